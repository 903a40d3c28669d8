//! Limits of the protocol. Past a limit the peer gets a named answer; nothing grows without one.
//! Those of a scene are the simulation's own.

use jostle_sim::{SEATS_MAX, particle, scene};

/// Longest message from a client, bytes.
pub const CLIENT_MESSAGE_BYTES_MAX: usize = 192;
/// Longest message from a server, bytes: a keyframe of a full room with all of its particles.
pub const SERVER_MESSAGE_BYTES_MAX: usize = 3 << 19;
/// A token, bytes.
pub const TOKEN_BYTES: usize = 34;
/// Longest player name in bytes of UTF-8.
pub const NAME_BYTES_MAX: usize = 64;
/// Longest player name in characters.
pub const NAME_CHARS_MAX: usize = 20;
/// Longest room code, bytes.
pub const ROOM_CODE_BYTES_MAX: usize = 32;
/// Longest name of a scene, bytes.
pub const SCENE_NAME_BYTES_MAX: usize = scene::SCENE_NAME_BYTES_MAX;
/// Longest scene file, bytes.
pub const SCENE_BYTES_MAX: usize = scene::SCENE_BYTES_MAX;
/// Bodies in a snapshot; indices of bodies are below it too.
pub const BODIES_MAX: usize = scene::BODIES_MAX as usize;
/// Messages that a room may leave out in a row because nothing moves: the next is sent all the same,
/// so that clients know that it lives.
pub const QUIET_MESSAGES_MAX: u32 = 12;
/// What a keyframe tells of emitters and particles, bytes: all that a scene may have at a time.
pub const PARTICLES_BYTES_MAX: usize = particle::told_bytes_max(scene::PARTICLES_MAX as usize);
/// Events between two snapshots.
pub const EVENTS_MAX: usize = 4096;
/// Player colours, see the palette of the page.
pub const COLORS: u8 = 8;
/// Coordinates on the wire, quanta, either sign.
pub const QUANTA_MAX: i32 = scene::QUANTA_MAX;
/// Coordinates of a pointer in an input, world units, either sign.
pub const POINTER_MAX: f32 = jostle_sim::game::POINTER_MAX;
/// Width and height of what a client shows, world units: more than any world has.
pub const VIEW_MAX: f32 = POINTER_MAX;
/// Longest replay that is read, bytes.
pub const REPLAY_BYTES_MAX: usize = 64 << 20;
/// Longest record of a replay, packed and unpacked, bytes: a keyframe of the largest scene.
pub const REPLAY_RECORD_BYTES_MAX: usize = 8 << 20;
/// Ticks in one record of a replay.
pub const REPLAY_BLOCK_TICKS_MAX: usize = 600;
/// Ticks in one replay: some more than a day.
pub const REPLAY_TICKS_MAX: u32 = 1 << 23;
/// Longest name of a program version in a replay, bytes.
pub const PROGRAM_BYTES_MAX: usize = 64;

// A client message fits a hello with the longest name and both tokens; a server message the longest
// welcome, and a keyframe or delta with the largest bodies and events: 30 and 36 bytes each, 113 a player,
// and all that flies.
const _: () =
    assert!(CLIENT_MESSAGE_BYTES_MAX >= 1 + 2 + 1 + NAME_BYTES_MAX + 1 + 2 * (1 + TOKEN_BYTES));
const _: () = assert!(
    SERVER_MESSAGE_BYTES_MAX
        >= 64 + TOKEN_BYTES + SCENE_BYTES_MAX + SCENE_NAME_BYTES_MAX + ROOM_CODE_BYTES_MAX
);
const _: () = assert!(
    SERVER_MESSAGE_BYTES_MAX
        >= 64 + 30 * BODIES_MAX + 36 * EVENTS_MAX + 113 * SEATS_MAX + PARTICLES_BYTES_MAX
);
