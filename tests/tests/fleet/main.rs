//! Real NATS servers, which are killed, and a network that is taken away.

mod nats;
mod wire;
