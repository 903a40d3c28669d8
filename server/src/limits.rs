//! The host's limits: those that an operator can set, and those that several files share. Other limits are defined next
//! to the code that uses them. A peer that exceeds a limit gets a specific refusal; other peers are unaffected. Limits
//! on what a message may contain are in [`jostle_protocol::limits`].

pub mod address_rate_limiter;
pub mod connection_limits;
pub mod networks;
pub mod rate_limited_stream;
pub mod token_bucket;
pub mod trial_queue;
pub mod uplink;

use jostle_game::SEATS_MAX;
use jostle_game::scene::{Budget, FOLLOWERS_MAX, SolverBudget};
use jostle_protocol::limits::{REPLAY_BYTES_MAX, REPLAY_RECORD_BYTES_MAX};
use jostle_sim::{StepBudget, TICKS_PER_SECOND};
use std::num::NonZero;
use std::thread::available_parallelism;
use std::time::Duration;

// Sockets.

/// TCP connections per processor, unless `--connections-max` is given: four times the number of players in full rooms
/// of 16, to leave some for spectators and browsers that load the page. Further connections are closed immediately.
pub const CONNECTIONS_PER_PROCESSOR: usize = 2048;
/// Minimum value of this limit, for a machine with one processor.
pub const CONNECTIONS_MIN: usize = 4096;
/// Maximum value of `--connections-max`: each connection may hold a 16 KiB buffer while its request is being read.
pub const CONNECTIONS_BOUND: usize = 65_536;
/// Descriptors needed in addition to those for connections: two files for each room, replays being read, the operators'
/// port, the log, the runtime's descriptors, and those of each socket thread.
pub const fn descriptors_spare(rooms: usize) -> usize {
    let files = 2 * rooms + REPLAY_READERS_MAX;
    files + OPS_CONNECTIONS_MAX + 48 + 3 * SOCKET_THREADS_MAX
}
/// Maximum number of threads that serve sockets. Each can handle about 800 players.
pub const SOCKET_THREADS_MAX: usize = 16;
/// Maximum number of concurrent TCP connections per address (for IPv6, per /64), as a fraction of all. A /56 may have
/// twice as many, a /48 four times as many, and an IPv4 /24 twice as many ([`networks::shares`]).
pub const ADDRESS_CONNECTIONS_SHARE: usize = 8;
/// Minimum value of this limit. A school behind one address loads the page over about six connections per browser, and
/// plays over one.
pub const ADDRESS_CONNECTIONS_MIN: usize = 512;
/// One in this many connections, game sockets or rooms is reserved for networks that hold few.
pub const RESERVE_SHARE: usize = 8;
/// Maximum number of concurrent game sockets per address, as a fraction of all connections, unless `--address-sockets`
/// is given. Further sockets are refused with `TooManySockets`.
pub const ADDRESS_SESSIONS_SHARE: usize = 32;
/// Minimum value of this limit, for a server with few connections.
pub const ADDRESS_SESSIONS_MIN: usize = 128;
/// TCP connections that an address may have in addition to its game sockets, if `--address-sockets` allows more of
/// those.
pub const ADDRESS_CONNECTIONS_SPARE: usize = ADDRESS_CONNECTIONS_MIN - ADDRESS_SESSIONS_MIN;
/// Maximum number of addresses whose rates are tracked at once. An address that connects once is dropped 20 ms later.
pub const TRACKED_ADDRESSES_MAX: usize = 4096;
/// Delay after the listener fails to accept a connection, so that it does not spin while descriptors are exhausted.
pub const ACCEPT_RETRY: Duration = Duration::from_millis(50);

/// Maximum size of a file that people write or name, bytes: settings, a scene, certificates, a key or a token. The
/// longest useful one, a scene, is 64 KiB.
pub const SETTINGS_FILE_BYTES_MAX: usize = 1 << 20;

/// Maximum number of concurrent connections to the operators' port.
pub const OPS_CONNECTIONS_MAX: usize = 16;

// HTTP.

/// Sustained rate of requests per address, including those passed on by a proxy.
pub const REQUESTS_PER_SECOND_MAX: u32 = 100;
/// Largest burst of requests from one address: a class of fifty loading the page.
pub const REQUESTS_BURST_MAX: usize = 1024;
/// Maximum size of the buffer for a request's head, bytes.
pub const HTTP_BUFFER_BYTES_MAX: usize = 16 << 10;
/// Maximum length of an ordinary request body, bytes.
pub const HTTP_BODY_BYTES_MAX: usize = 1 << 10;
/// Maximum number of longer bodies (scenes and runs, of up to a megabyte each) that may be received at once.
pub const LONG_BODIES_MAX: usize = 64;
/// Maximum number of longer bodies that one address may send at once.
pub const ADDRESS_LONG_BODIES_MAX: usize = 4;
/// Time after which, if there are too many long bodies, one may be displaced by another from a network that sends
/// fewer: enough for 230 kB at 2 Mbit/s.
pub const LONG_BODY_GRACE: Duration = Duration::from_secs(1);

// Sessions.

/// Sustained rate of messages; a page sends 60 inputs and a few pings per second.
pub const MESSAGES_PER_SECOND_MAX: u32 = 120;
/// Largest burst of messages: as many as an honest client sends after a network stall of four seconds.
pub const MESSAGES_BURST_MAX: u32 = 240;
/// Maximum number of decoded messages waiting for the room: twice the burst, so that the queue fills up only if the
/// room is blocked for seconds.
pub const INBOX_MAX: usize = 512;
/// Time allowed for the last message, the close frame, and the peer's close.
pub const CLOSE_WAIT: Duration = Duration::from_secs(2);
/// Number of bytes read from a session's socket in one go, into a cleared buffer: about ten inputs.
pub const READ_BUFFER_BYTES: usize = 512;

// Bytes.

/// Default for the number of megabits per second that the server may send: the slowest uplink that rented machines
/// usually have.
pub const UPLINK_MEGABITS: u32 = 100;
/// Maximum value of `--uplink`, beyond what any machine can send.
pub const UPLINK_MEGABITS_MAX: u32 = 30_000;
/// Each address (for IPv6, each /64) may be sent at most the uplink divided by this number. A quarter of 100 Mbit/s is
/// 24 kB/s for each of [`ADDRESS_SESSIONS_MIN`] sessions; a player in a pile of 900 boxes receives 7 kB/s on the wire.
pub const ADDRESS_UPLINK_SHARE: u32 = 4;
/// All rooms with guests' scenes together may send at most the uplink divided by this number. Such a scene may send 178
/// kB/s to each client.
pub const GUESTS_UPLINK_SHARE: u32 = 4;
/// How many seconds of a budget may be sent at once: enough for the welcomes and keyframes of a class that arrives
/// together.
pub const UPLINK_BURST_SECONDS: u32 = 2;

// Rooms.

/// Maximum number of scenes on offer, unless `--scenes-max` is given.
pub const SCENES_MAX: usize = 64;
/// Maximum value of `--scenes-max`: each scene has a standing room and a card in the lobby.
pub const SCENES_BOUND: usize = 1024;
/// Number of rooms that a processor is assumed to handle; most rooms use less than 3 % of one.
pub const ROOMS_PER_PROCESSOR: usize = 32;
/// Maximum value of `--rooms-max`: each room has a thread that wakes sixty times a second.
pub const ROOMS_BOUND: usize = 4096;
/// Maximum number of open rooms created from one address, as a fraction of all.
pub const ADDRESS_ROOMS_SHARE: usize = 8;
/// Minimum value of this limit, for a server with few rooms.
pub const ADDRESS_ROOMS_MIN: usize = 8;
/// Maximum number of spectators in a room. Even with all 512 seats taken, they still fit on one socket thread. A
/// spectator costs only the bytes sent, with no encoding.
pub const SPECTATORS_MAX: usize = 256;
/// Length of a private room's code, at 5 bits per character: too long to be guessed.
pub const PRIVATE_CODE_CHARS: usize = 20;
/// Minimum length of an operators' token.
pub const OPS_TOKEN_CHARS_MIN: usize = 16;
/// Maximum number of joins waiting for a room's next tick: as many as a room has seats.
pub const JOINS_WAITING_MAX: usize = SEATS_MAX;
/// Maximum number of ticks played in a row to catch up; any further due ticks are skipped and counted as missed.
pub const CATCH_UP_TICKS_MAX: u32 = 5;

// Scenes of guests.

/// Maximum size of a guest's scene, bytes; the largest built-in scene, `hall`, is 19 kB.
pub const GUEST_SCENE_BYTES_MAX: usize = 32 << 10;
/// The budget for a guest's scene. Every built-in scene except `hall` stays within it.
pub const GUEST_BUDGET: Budget = Budget {
    // Sending to more players would cost more than most scenes do.
    players: FOLLOWERS_MAX as u16,
    // A keyframe with this many takes about 10 kB, and each player who joins or lags gets one.
    bodies: 1000,
    // Twice the default. Each player's page simulates the particles too.
    particles: 8192,
    // The width of twelve screens of the usual height in a row, with a kill zone around them.
    size: 4096.0,
    // Half a tick, so that a room is not late even if its worst ticks come in a row.
    tick_ms: 8.0,
    solver: SolverBudget {
        // Twice the default.
        iterations: 30,
        // The defaults.
        sweeps: 400,
        work: 2_000_000,
        // Twice the default.
        position_passes: 8,
    },
    // Enough for a chain as long as the widest built-in scene.
    springs: 256,
    // 32 zones that contain all allowed bodies, which takes a few tenths of a millisecond.
    zone_looks: 32_000,
    // Each rule is compared with every contact.
    rules: 64,
    // Ten per tick; each one is an event sent to all players.
    starts_per_s: 600,
    // The rate at which all particles are in use if each one lives for two seconds.
    emitted_per_s: 4096,
    // One per tick.
    launched_per_s: 60,
};
/// Limits on a step of a guest's scene; a room that exceeds them is closed. The scene's budget limits the number of
/// bodies, but not how players, forces and launchers pile them up.
pub const GUEST_STEP: StepBudget = StepBudget {
    // Three times as many pairs as a heap of all bodies has; 30 iterations over them take about 14 ms, and the pairs
    // take about 3 MB.
    pairs: 10_000,
    // About 50 ms; the largest built-in tower needs a fiftieth of this.
    work: 1_000_000,
    // Sixteen obstacles that cover everything, which take half a megabyte.
    obstacle_cells: 65_536,
};
/// In the long run, a room with a guest's scene may use a processor's time divided by this number: two milliseconds of
/// each tick, while most scenes use far less.
pub const GUEST_SHARE: u32 = 8;
/// All such rooms together may use the processors' time divided by this number, so that at least as much is left for
/// other rooms.
pub const GUESTS_SHARE: usize = 2;
/// Number of ticks in each part of a trial before a room opens. By the end, the scene's bodies have fallen, and each
/// key has been pressed many times.
pub const GUEST_TRIAL_TICKS: u32 = 2 * TICKS_PER_SECOND;
/// Maximum number of parts in a trial ([`Timeouts::guest_trial_later`]). By the end, launchers have filled the scene,
/// and falling bodies have come to rest.
pub const GUEST_TRIAL_PARTS: u32 = 10;
/// Number of players in a trial, all of whom press keys at random.
pub const GUEST_TRIAL_PLAYERS: u16 = 8;
/// Maximum number of guests' scenes that are being tried or waiting for their trial.
pub const GUEST_TRIALS_MAX: usize = 16;
/// Maximum number of trials per address. A /48 may have eight, so that no organisation takes them all.
pub const ADDRESS_GUEST_TRIALS_MAX: usize = 2;
/// Maximum number of rooms with guests' scenes per address, as a fraction of all, and at least one. It takes four
/// addresses to use them all.
pub const ADDRESS_GUEST_ROOMS_SHARE: usize = 4;
/// How many of the last rooms with guests' scenes are reserved for networks without one.
pub const GUEST_ROOMS_RESERVE: usize = 1;
/// Niceness of the threads that play and try guests' scenes, so that all other threads take precedence.
pub const GUEST_NICENESS: i32 = 10;

/// Number of processors that this process may use.
pub fn processors() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

/// Default for the maximum number of rooms that people may have open at once. The scenes' standing rooms do not count.
pub fn rooms_max() -> usize {
    (processors() * ROOMS_PER_PROCESSOR).min(ROOMS_BOUND)
}

/// Default for the maximum number of concurrent connections. A system with fewer descriptors has a lower limit.
pub fn connections_max() -> usize {
    (processors() * CONNECTIONS_PER_PROCESSOR).clamp(CONNECTIONS_MIN, CONNECTIONS_BOUND)
}

/// Maximum number of connections per address on a server with this many connections, if one address may have `sessions`
/// game sockets.
pub fn address_connections_max(connections: usize, sessions: usize) -> usize {
    let share = (connections / ADDRESS_CONNECTIONS_SHARE).max(ADDRESS_CONNECTIONS_MIN);
    share.max(ADDRESS_CONNECTIONS_SPARE + sessions)
}

/// Default for the maximum number of game sockets per address on a server with this many connections.
pub fn address_sessions_max(connections: usize) -> usize {
    (connections / ADDRESS_SESSIONS_SHARE).max(ADDRESS_SESSIONS_MIN)
}

/// Maximum number of open rooms with guests' scenes on a machine with this many processors.
pub const fn guest_rooms_max(processors: usize) -> usize {
    processors * GUEST_SHARE as usize / GUESTS_SHARE
}

// Replays.

/// Size of a file after which a new one begins, in bytes. Records still waiting for the writer fit below
/// [`REPLAY_BYTES_MAX`].
pub const REPLAY_FILE_BYTES_MAX: u64 = 32 << 20;
/// Default for the total size of all files in the directory, in megabytes.
pub const REPLAYS_MB: u32 = 1024;
/// Maximum number of files in the directory; beyond this the oldest finished ones are deleted.
pub const REPLAY_FILES_MAX: usize = 10_000;
/// Minimum number of bytes counted for a file: the disk block that it occupies.
pub const REPLAY_FILE_CHARGE_MIN: u64 = 4 << 10;
/// Clips may take up the directory's limits on files and bytes divided by this number. Beyond that, they are deleted
/// before recordings of games.
pub const CLIPS_SHARE: usize = 8;
/// Maximum number of clips, across all rooms, that may be in progress or waiting for the writer. The writer also writes
/// all recordings.
pub const CLIPS_WAITING_MAX: usize = 4;
/// Default for the number of days that a file is kept.
pub const REPLAYS_DAYS: u32 = 30;
/// Time after which a room whose recording failed starts a new file.
pub const REPLAY_RETRY: Duration = Duration::from_secs(60);
/// Maximum number of replays in a list; older ones are still available by name.
pub const REPLAYS_LISTED_MAX: usize = 100;
/// Maximum number of concurrent replay downloads.
pub const REPLAY_READERS_MAX: usize = 64;
/// Maximum number of concurrent replay downloads per address.
pub const ADDRESS_REPLAY_READERS_MAX: usize = 4;

// Records.

/// Number of best runs kept per scene, with at most one by the same players.
pub const RECORDS_MAX: usize = 10;
/// Maximum size of a run's replay, bytes. For half an hour, the hashes take about 230 kB, and a busy pointer takes as
/// much again.
pub const RUN_BYTES_MAX: usize = 1 << 20;
/// Number of displaced runs kept per scene, in case an operator removes better ones: two tables' worth.
pub const DISPLACED_MAX: usize = 2 * RECORDS_MAX;
/// Maximum number of files that hold a scene's runs. All scenes' files are played again when the server starts.
pub const RECORD_FILES_MAX: usize = RECORDS_MAX + DISPLACED_MAX;
/// Maximum number of replays, of up to a megabyte each, that are being verified or waiting for it.
pub const RUN_TRIALS_MAX: usize = 16;

// The state directory.

/// Number of ticks after which a new file replaces a room's file. A restart may have to replay this many, which takes a
/// third of a second of processor time for a busy room.
pub const STATE_FILE_TICKS: u32 = 20 * TICKS_PER_SECOND;
/// Minimum number of ticks between notes in a room's file. A note for the largest scene takes about 90 kB, and players
/// may come and go in every tick; this limit keeps the file far below [`REPLAY_BYTES_MAX`].
pub const STATE_NOTES_EVERY_TICKS: u32 = 6;
/// Interval at which files are synced to the disk.
pub const STATE_SYNC_EVERY: Duration = Duration::from_millis(400);
/// Time after which a room whose file was given up starts a new one.
pub const STATE_RETRY: Duration = Duration::from_secs(5);

// The fleet.

/// Timeout for reading from or writing to the directory.
pub const FLEET_ANSWER: Duration = Duration::from_millis(1500);
/// Interval at which to check the inboxes of a room that is being handed over.
pub const FLEET_HAND_OVER_LOOK: Duration = Duration::from_millis(20);
/// Time that a drain reserves for files and for notices to other nodes, whatever the server's players do.
pub const DRAIN_FILES: Duration = Duration::from_secs(1);
/// Time allowed for a draining node to hand over its rooms.
pub const FLEET_DRAIN: Duration = Duration::from_millis(2500);
/// Time allowed for a node to read a room's records and open the room.
pub const FLEET_OPEN: Duration = Duration::from_secs(10);

// The end.

/// Maximum time from a signal to the end of the process, whatever its sockets, rooms, disks and log do.
pub const DRAIN_MAX: Duration = Duration::from_secs(8);
/// The part of this time that is reserved for closing a log that nothing is reading.
pub const LOG_END_MAX: Duration = Duration::from_millis(1200);

/// Timeouts for peers, rooms and the server itself; tests shorten and lengthen them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeouts {
    /// Time allowed to send a request's head, to stay idle between requests, and to complete the TLS handshake.
    pub http_head: Duration,
    /// Time allowed to send a request's body.
    pub http_body: Duration,
    /// Time for which a peer may accept none of a response. A single byte within that time keeps the connection open.
    pub http_stall: Duration,
    /// Time allowed from the upgrade to a valid hello.
    pub hello: Duration,
    /// Interval between WebSocket pings.
    pub keepalive: Duration,
    /// Silence (not even a pong) after which a session is closed.
    pub silence: Duration,
    /// Time within which a peer must accept a message.
    pub stall: Duration,
    /// Time for which a client may be sent snapshots without acknowledging any of them.
    pub hearing: Duration,
    /// Time for which a room without players stays open.
    pub room_empty: Duration,
    /// Time for which a room with a guest's scene stays open while no seat is taken: long enough for someone to open
    /// the link by hand. The number of such rooms is small.
    pub guest_room_empty: Duration,
    /// How long an empty room is still recorded; a player who reconnects sooner continues the same replay.
    pub record_empty: Duration,
    /// Time within which a room must answer an operator, or all rooms together if all of them are asked.
    pub command: Duration,
    /// Time between warning players that the server will end and closing their sockets.
    pub drain_notice: Duration,
    /// Time allowed after that for sockets to close and rooms to end.
    pub drain: Duration,
    /// Time allowed for the whole shutdown under all circumstances; the files get what is left.
    pub drain_max: Duration,
    /// Processor time allowed for reading a guest's scene, and for each part of its trial: twice a room's share, since
    /// a trial is livelier than real players.
    pub guest_trial: Duration,
    /// Processor time allowed for a trial after its first part.
    pub guest_trial_later: Duration,
    /// Processor time allowed for verifying a run's replay; half an hour of a scene takes a few seconds.
    pub run_trial: Duration,
    /// Processor time in excess of its share after which a room with a guest's scene is closed.
    pub guest_excess: Duration,
    /// Processor time for a single tick beyond which such a room is closed: six ticks' worth, twice the time of a step
    /// within [`GUEST_STEP`].
    pub guest_tick: Duration,
    /// Interval at which the certificate files are checked. A change is applied once it has persisted for one interval.
    pub certificate_look: Duration,
}

impl Timeouts {
    /// The timeouts for a server that is not under test.
    pub const USUAL: Timeouts = Timeouts {
        http_head: Duration::from_secs(10),
        http_body: Duration::from_secs(5),
        http_stall: Duration::from_secs(20),
        hello: Duration::from_secs(5),
        keepalive: Duration::from_secs(10),
        silence: Duration::from_secs(30),
        stall: Duration::from_secs(20),
        hearing: Duration::from_secs(20),
        room_empty: Duration::from_secs(120),
        guest_room_empty: Duration::from_secs(15),
        record_empty: Duration::from_secs(10),
        command: Duration::from_secs(1),
        drain_notice: Duration::from_secs(2),
        drain: Duration::from_secs(3),
        drain_max: Duration::from_millis(6500),
        guest_trial: Duration::from_millis(500),
        guest_trial_later: Duration::from_millis(250),
        run_trial: Duration::from_secs(10),
        guest_excess: Duration::from_secs(5),
        guest_tick: Duration::from_millis(100),
        certificate_look: Duration::from_secs(5),
    };

    /// How long a room without connected players stays open. Players who lost their sockets keep their `seats` for a
    /// while, and can return to the room.
    pub fn empty(&self, has_guests_scene: bool, seats: usize) -> Duration {
        if has_guests_scene && seats == 0 { self.guest_room_empty } else { self.room_empty }
    }
}

impl Default for Timeouts {
    fn default() -> Timeouts {
        Timeouts::USUAL
    }
}

const _: () = assert!(
    Timeouts::USUAL.guest_trial.as_micros()
        == 2 * GUEST_TRIAL_TICKS as u128 * 1_000_000 / (TICKS_PER_SECOND * GUEST_SHARE) as u128,
    "a trial has twice a room's share"
);
const _: () = assert!(INBOX_MAX > MESSAGES_BURST_MAX as usize, "an honest burst fits the inbox");
const _: () =
    assert!(Timeouts::USUAL.drain.as_secs() > CLOSE_WAIT.as_secs(), "a close fits the drain");
const _: () = assert!(
    Timeouts::USUAL.drain_max.as_millis() + LOG_END_MAX.as_millis() <= DRAIN_MAX.as_millis(),
    "the log is left time"
);
const _: () = assert!(
    FLEET_DRAIN.as_millis() + Timeouts::USUAL.drain_notice.as_millis() + DRAIN_FILES.as_millis()
        < Timeouts::USUAL.drain_max.as_millis(),
    "some of the time is left for closing sockets"
);
const _: () = assert!(
    Timeouts::USUAL.silence.as_secs() > 2 * Timeouts::USUAL.keepalive.as_secs(),
    "a pong may get lost"
);
const _: () = assert!(
    REPLAY_FILE_BYTES_MAX as usize + 2 * REPLAY_RECORD_BYTES_MAX < REPLAY_BYTES_MAX,
    "a file that has come to its end can be read"
);
