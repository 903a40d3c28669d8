//! What a stream of snapshots costs: four scenes that anyone can make again, played by an engine and
//! sent through both ends of a [`jostle_protocol::Stream`].

pub mod measure;
pub mod scenes;

pub use measure::{Traffic, send};
pub use scenes::{Crowd, SCENES, Script};
