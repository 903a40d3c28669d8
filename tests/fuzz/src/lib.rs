//! What must hold for any bytes that somebody sends or leaves in a file, one function a kind of input.
//! Each panics where it does not hold. `tests` tries the committed corpus and thousands of its
//! mutations in every run, the fuzzer in `targets` millions: `cargo xtask fuzz`.

mod files;
mod messages;
pub mod mutations;
mod play;
#[cfg(feature = "server")]
mod server;
pub mod snapshots;

pub use files::{replay, scene};
pub use messages::{client_message, delta, events, keyframe, particles, server_message};
pub use play::room;
#[cfg(feature = "server")]
pub use server::{SIGNING_KEY, handshake, link, token};

/// A property of bytes; panics where it does not hold.
pub type Property = fn(&[u8]);

/// All of them; the fuzzer's targets and the directories of the corpus have these names.
#[cfg(feature = "server")]
pub const PROPERTIES: [(&str, Property); 12] = [
    ("client_message", client_message),
    ("server_message", server_message),
    ("keyframe", keyframe),
    ("delta", delta),
    ("events", events),
    ("particles", particles),
    ("replay", replay),
    ("scene", scene),
    ("room", room),
    ("link", link),
    ("handshake", handshake),
    ("token", token),
];

/// Takes a part with its length before it off an input that is made of several; the rest at most.
fn part<'a>(bytes: &mut &'a [u8]) -> Option<(u8, &'a [u8])> {
    let (&[kind, low, high], rest) = bytes.split_first_chunk()?;
    let length = usize::from(u16::from_le_bytes([low, high])).min(rest.len());
    let (part, rest) = rest.split_at(length);
    *bytes = rest;
    Some((kind, part))
}

/// The opposite: appends a part.
pub fn push_part(kind: u8, part: &[u8], bytes: &mut Vec<u8>) {
    let length = u16::try_from(part.len()).expect("parts of an input are short");
    bytes.push(kind);
    bytes.extend(length.to_le_bytes());
    bytes.extend(part);
}
