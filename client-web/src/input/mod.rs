//! Keys, pointer and thumbs become inputs, and inputs leave for the server.

pub mod keys;
pub mod sender;
pub mod stick;
pub mod touch;
