//! Limits of the protocol. Past a limit the peer gets a named answer; nothing grows without one.

/// Longest message from a client, bytes.
pub const CLIENT_MESSAGE_BYTES_MAX: usize = 192;
/// Longest message from a server, bytes: a keyframe of a full room, or a welcome with its scene.
pub const SERVER_MESSAGE_BYTES_MAX: usize = 1 << 20;
/// Longest player name in bytes of UTF-8.
pub const NAME_BYTES_MAX: usize = 64;
/// Longest player name in characters.
pub const NAME_CHARS_MAX: usize = 20;
/// Longest room code, bytes.
pub const ROOM_CODE_BYTES_MAX: usize = 32;
/// Longest scene file, bytes.
pub const SCENE_BYTES_MAX: usize = 64 << 10;
/// Bodies in a snapshot.
pub const BODIES_MAX: usize = 20_000;
/// Events between two snapshots.
pub const EVENTS_MAX: usize = 4096;
/// Player colours, see the palette of the page.
pub const COLORS: u8 = 8;
/// Coordinates on the wire, quanta, either sign.
pub const QUANTA_MAX: i32 = 1 << 24;
