//! Measures the cost of a snapshot stream: four reproducible scenes, played by an engine and passed through both ends
//! of a [`jostle_protocol::SnapshotStream`]. A few seconds of each are kept as recordings, and their sizes as a golden
//! table.

pub mod interest;
pub mod measure;
pub mod program;
pub mod recording;
pub mod scenes;
pub mod sizes;

pub use measure::Traffic;
pub use scenes::{Crowd, SCENES, Script};
