//! Keys, pointer, gamepads and thumbs become inputs, and inputs leave for the server.

pub mod action;
pub mod bindings;
pub mod keys;
pub mod pad;
pub mod sender;
pub mod stick;
pub mod touch;
