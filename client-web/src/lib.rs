//! The web client: a thin client of a room, and the offline demo.

pub mod frame;
