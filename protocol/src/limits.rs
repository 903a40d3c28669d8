//! The protocol's limits. A peer that exceeds one gets a specific refusal, and nothing grows without limit. The limits
//! on scenes are in `jostle_game`.

use jostle_game::{SEATS_MAX, scene};
use jostle_sim::particles;

/// Maximum length of a message from a client, bytes.
pub const CLIENT_MESSAGE_BYTES_MAX: usize = 192;
/// Maximum length of a post, which carries messages from a client over HTTP, bytes: a burst of 240 inputs.
pub const POST_BYTES_MAX: usize = 8 << 10;
/// Maximum length of a message from a server, bytes: a keyframe of a full room with all of its particles.
pub const SERVER_MESSAGE_BYTES_MAX: usize = 3 << 19;
/// Length of a token, bytes.
pub const TOKEN_BYTES: usize = 34;
/// Maximum length of a player's name in bytes of UTF-8.
pub const NAME_BYTES_MAX: usize = 64;
/// Maximum length of a player's name in characters.
pub const NAME_CHARS_MAX: usize = 20;
/// Maximum length of a room code, bytes.
pub const ROOM_CODE_BYTES_MAX: usize = 32;
/// Maximum length of a server's origin, bytes.
pub const ORIGIN_BYTES_MAX: usize = 200;
/// Maximum number of alternative servers that a client is given for its room.
pub const NODES_MAX: usize = 8;
/// Maximum length of a scene's name, bytes.
pub const SCENE_NAME_BYTES_MAX: usize = scene::SCENE_NAME_BYTES_MAX;
/// Maximum length of a scene file, bytes.
pub const SCENE_BYTES_MAX: usize = scene::SCENE_BYTES_MAX;
/// Maximum number of bodies in a snapshot; body indices are also below it.
pub const BODIES_MAX: usize = scene::BODIES_MAX as usize;
/// Maximum number of consecutive snapshots omitted while nothing changes; the next one is sent as a heartbeat.
pub const QUIET_MESSAGES_MAX: u32 = 12;
/// Maximum length of the encoded emitters and particles in a keyframe, bytes: as many as a scene may have at once.
pub const PARTICLES_BYTES_MAX: usize =
    particles::wire::encoded_bytes_max(scene::PARTICLES_MAX as usize);
/// Maximum number of events between two snapshots.
pub const EVENTS_MAX: usize = 4096;
/// Number of player colours in the page's palette.
pub const COLORS: u8 = 8;
/// Number of emotes that players can show.
pub const EMOTES: u8 = 8;
/// Maximum absolute coordinate on the wire, quanta.
pub const QUANTA_MAX: i32 = scene::QUANTA_MAX;
/// Maximum absolute coordinate of a pointer in an input, world units.
pub const POINTER_MAX: f32 = jostle_game::POINTER_MAX;
/// Maximum width and height of a client's view, world units; larger than any world.
pub const VIEW_MAX: f32 = POINTER_MAX;
/// Maximum length of a replay that can be read, bytes.
pub const REPLAY_BYTES_MAX: usize = 64 << 20;
/// Maximum length of a replay record, packed or unpacked, bytes: a keyframe of the largest scene.
pub const REPLAY_RECORD_BYTES_MAX: usize = 8 << 20;
/// Maximum number of ticks in one replay record.
pub const REPLAY_BLOCK_TICKS_MAX: usize = 600;
/// Last tick that a replay may contain, counted from the start of the room: more than a year.
pub const REPLAY_TICKS_MAX: u32 = 1 << 31;
/// Maximum length of a replay's name, bytes: two names of 32 bytes, a time, a kind and a number.
pub const REPLAY_NAME_BYTES_MAX: usize = 96;
/// Maximum length of a program version's name in a replay, bytes.
pub const PROGRAM_BYTES_MAX: usize = 64;

// A client message has room for a hello with the longest name and both tokens. A server message has room for the
// longest welcome, and for a keyframe or delta with the maximum numbers of bodies, events and players, of 30, 36 and
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
