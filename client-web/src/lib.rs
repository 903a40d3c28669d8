//! The web client: a thin client of a room, and the offline demo.

pub mod draw;
pub mod frame;
pub mod palette;
pub mod render;
