//! Turns keys, pointers, gamepads and touches into inputs and sends them to the server.

pub mod action;
pub mod bindings;
pub mod keys;
pub mod pad;
pub mod sender;
pub mod stick;
pub mod touch;
