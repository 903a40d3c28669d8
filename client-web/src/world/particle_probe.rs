//! The particles of a page's replica for a recorded stream: their digest at every tick. Tests compare these with the
//! digests of the streamed game, natively and in a browser.

use crate::world::replica::{Eye, Replica};
use jostle_game::{Scene, Seat};
use std::sync::Arc;

/// Appends an encoded snapshot to a recording, as its length in four little-endian bytes followed by its own bytes.
pub fn record(message: &[u8], recording: &mut Vec<u8>) {
    let length = u32::try_from(message.len()).expect("messages are limited far below 4 GiB");
    recording.extend(length.to_le_bytes());
    recording.extend(message);
}

/// Plays a recording of a room with this scene source. Returns each tick with the digest of its particles, or an error
/// message.
pub fn particle_digests(scene: &str, mut recording: &[u8]) -> Result<Vec<(u32, u64)>, String> {
    let scene = Scene::parse("witness.toml", scene).map_err(|error| error.to_string())?;
    let mut replica = Replica::new(Arc::new(scene), Seat(0));
    let mut digests = Vec::new();
    while let Some((length, rest)) = recording.split_first_chunk() {
        let length = u32::from_le_bytes(*length) as usize;
        let (message, rest) = rest.split_at_checked(length).ok_or("a message is cut short")?;
        recording = rest;
        let (arrival, _) = replica.hear(message).map_err(|error| error.to_string())?;
        let first = digests.last().map_or(arrival.tick, |&(tick, _)| tick + 1);
        for tick in first..=arrival.tick {
            replica.advance(f64::from(tick), Eye::default());
            digests.push((tick, replica.particles().digest()));
        }
    }
    Ok(digests)
}
