//! Turns keys, pointers, gamepads and touches into inputs, and sends these to the server.

pub mod action;
pub mod bindings;
pub mod keys;
pub mod pad;
pub mod sender;
pub mod stick;
pub mod touch;
