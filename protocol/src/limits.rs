//! Limits of the protocol. A peer that exceeds one gets a specific refusal, and nothing grows without a limit. The
//! limits of scenes are in `jostle_game`.

use jostle_game::{SEATS_MAX, scene};
use jostle_sim::particles;

/// Longest message from a client, bytes.
pub const CLIENT_MESSAGE_BYTES_MAX: usize = 192;
/// Longest message from a server, bytes: a keyframe of a full room with all of its particles.
pub const SERVER_MESSAGE_BYTES_MAX: usize = 3 << 19;
/// Length of a token, bytes.
pub const TOKEN_BYTES: usize = 34;
/// Longest player name in bytes of UTF-8.
pub const NAME_BYTES_MAX: usize = 64;
/// Longest player name in characters.
pub const NAME_CHARS_MAX: usize = 20;
/// Longest room code, bytes.
pub const ROOM_CODE_BYTES_MAX: usize = 32;
/// Longest origin of a server, bytes.
pub const ORIGIN_BYTES_MAX: usize = 200;
/// Maximum number of alternative servers that a client is given for its room.
pub const NODES_MAX: usize = 8;
/// Longest name of a scene, bytes.
pub const SCENE_NAME_BYTES_MAX: usize = scene::SCENE_NAME_BYTES_MAX;
/// Longest scene file, bytes.
pub const SCENE_BYTES_MAX: usize = scene::SCENE_BYTES_MAX;
/// Most bodies in a snapshot; the indices of bodies are below it too.
pub const BODIES_MAX: usize = scene::BODIES_MAX as usize;
/// Most consecutive snapshots omitted while nothing changes; the next is sent as a heartbeat.
pub const QUIET_MESSAGES_MAX: u32 = 12;
/// Longest encoding of the emitters and particles in a keyframe, bytes: the most that a scene may have at a time.
pub const PARTICLES_BYTES_MAX: usize =
    particles::wire::encoded_bytes_max(scene::PARTICLES_MAX as usize);
/// Most events between two snapshots.
pub const EVENTS_MAX: usize = 4096;
/// Number of player colours, as in the palette of the page.
pub const COLORS: u8 = 8;
/// Number of emotes that players can show.
pub const EMOTES: u8 = 8;
/// Largest absolute coordinate on the wire, quanta.
pub const QUANTA_MAX: i32 = scene::QUANTA_MAX;
/// Largest absolute coordinate of a pointer in an input, world units.
pub const POINTER_MAX: f32 = jostle_game::POINTER_MAX;
/// Largest width and height of a client's view, world units; larger than any world.
pub const VIEW_MAX: f32 = POINTER_MAX;
/// Longest replay that is read, bytes.
pub const REPLAY_BYTES_MAX: usize = 64 << 20;
/// Longest record of a replay, packed or unpacked, bytes: a keyframe of the largest scene.
pub const REPLAY_RECORD_BYTES_MAX: usize = 8 << 20;
/// Most ticks in one record of a replay.
pub const REPLAY_BLOCK_TICKS_MAX: usize = 600;
/// Last tick that a replay may have, counted from the start of the room: more than a year.
pub const REPLAY_TICKS_MAX: u32 = 1 << 31;
/// Longest name of a replay, bytes: two names of 32 bytes, a time, a kind and a number.
pub const REPLAY_NAME_BYTES_MAX: usize = 96;
/// Longest name of a program version in a replay, bytes.
pub const PROGRAM_BYTES_MAX: usize = 64;

// A client message can hold a hello with the longest name and both tokens. A server message can hold the
// longest welcome, and a keyframe or delta with the most bodies and events, 30 and 36 bytes each, the most players,
// 113 bytes each, and all live particles.
const _: () =
    assert!(CLIENT_MESSAGE_BYTES_MAX >= 2 + 2 + 1 + NAME_BYTES_MAX + 1 + 2 * (1 + TOKEN_BYTES));
const _: () = assert!(
    SERVER_MESSAGE_BYTES_MAX
        >= 64 + TOKEN_BYTES + SCENE_BYTES_MAX + SCENE_NAME_BYTES_MAX + ROOM_CODE_BYTES_MAX
);
const _: () = assert!(
    SERVER_MESSAGE_BYTES_MAX
        >= 64 + 30 * BODIES_MAX + 36 * EVENTS_MAX + 113 * SEATS_MAX + PARTICLES_BYTES_MAX
);
