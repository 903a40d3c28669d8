//! Properties that hold for any bytes from a peer or a file, one function per kind of input. Each panics if it is
//! violated. The tests in `tests` try a corpus and thousands of mutations in every run; the fuzzer in `targets` tries
//! millions (`cargo xtask fuzz`).

#[cfg(feature = "server")]
mod corpus;
mod files;
mod messages;
pub mod mutations;
mod play;
#[cfg(feature = "server")]
mod server;
pub mod snapshots;
#[cfg(feature = "server")]
mod tiled;

#[cfg(feature = "server")]
pub use corpus::corpus;
pub use files::{replay, scene};
pub use messages::{client_message, delta, events, keyframe, particles, server_message};
pub use play::room;
#[cfg(feature = "server")]
pub use server::{RUN_SCENE, SIGNING_KEY, guest_scene, handshake, link, run, token};
#[cfg(feature = "server")]
pub use tiled::tiled_map;

/// A property of bytes, which panics if it is violated.
pub type Property = fn(&[u8]);

/// Properties that need no server, so that their fuzzing program is small and fast.
pub const OF_ROOMS: [(&str, Property); 9] = [
    ("client_message", client_message),
    ("server_message", server_message),
    ("keyframe", keyframe),
    ("delta", delta),
    ("events", events),
    ("particles", particles),
    ("replay", replay),
    ("scene", scene),
    ("room", room),
];

/// Properties of input that only the server or the command line reads.
#[cfg(feature = "server")]
pub const OF_SERVERS: [(&str, Property); 6] = [
    ("link", link),
    ("handshake", handshake),
    ("token", token),
    ("guest_scene", guest_scene),
    ("run", run),
    ("tiled_map", tiled_map),
];

/// Finds a property by name. Without the feature `server`, only those in [`OF_ROOMS`] exist.
pub fn property(name: &str) -> Option<Property> {
    #[cfg(feature = "server")]
    let servers = OF_SERVERS.as_slice();
    #[cfg(not(feature = "server"))]
    let servers = [].as_slice();
    let mut all = OF_ROOMS.iter().chain(servers);
    all.find(|(known, _)| *known == name).map(|(_, property)| *property)
}

/// Splits the next part off an input. Each part is preceded by its kind and length; if the length is too large, the
/// part takes the rest.
fn part<'a>(bytes: &mut &'a [u8]) -> Option<(u8, &'a [u8])> {
    let (&[kind, low, high], rest) = bytes.split_first_chunk()?;
    let length = usize::from(u16::from_le_bytes([low, high])).min(rest.len());
    let (part, rest) = rest.split_at(length);
    *bytes = rest;
    Some((kind, part))
}

/// Appends a part; the inverse of `part`.
pub fn push_part(kind: u8, part: &[u8], bytes: &mut Vec<u8>) {
    let length = u16::try_from(part.len()).expect("parts of an input are short");
    bytes.push(kind);
    bytes.extend(length.to_le_bytes());
    bytes.extend(part);
}
