//! Servers as nodes of a fleet, with real NATS servers: all of them are killed, and their network is taken away.

mod games;
mod joints;
mod nats;
mod node;
mod player;
mod rooms;
mod store;
mod wire;
