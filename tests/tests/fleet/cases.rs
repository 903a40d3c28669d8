//! Tests of servers as nodes of a fleet with real NATS servers, any of which may be killed or cut off.

mod games;
mod joints;
mod nats;
mod node;
mod player;
mod rooms;
mod store;
mod wire;
