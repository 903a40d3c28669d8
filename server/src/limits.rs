//! Limits of the host: what an operator can set, and the bounds that several files share. The others stand beside their user.
//! A peer that exceeds one gets a specific refusal; other peers are unaffected.
//! Limits on what a message may hold are in [`jostle_protocol::limits`].

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

/// TCP connections per processor, unless `--connections-max` is given: four times the players of full rooms of 16, to
/// leave some for spectators and browsers that load the page. Further connections are closed at once.
pub const CONNECTIONS_PER_PROCESSOR: usize = 2048;
/// Lower bound of these connections, for a machine with one processor.
pub const CONNECTIONS_MIN: usize = 4096;
/// Largest value of `--connections-max`: each connection may hold a buffer of 16 KiB while its request is read.
pub const CONNECTIONS_BOUND: usize = 65_536;
/// Descriptors besides those of connections: two files for each room, replays being read, the operators' port, the log,
/// the runtime's descriptors, and each socket thread.
pub const fn descriptors_spare(rooms: usize) -> usize {
    let files = 2 * rooms + REPLAY_READERS_MAX;
    files + OPS_CONNECTIONS_MAX + 48 + 3 * SOCKET_THREADS_MAX
}
/// Maximum number of threads that serve sockets. Each can handle about 800 players.
pub const SOCKET_THREADS_MAX: usize = 16;
/// TCP connections of one address at a time (IPv6: of one /64), as a fraction of all. A /56 may have twice as many, a
/// /48 four times, and an IPv4 /24 twice ([`networks::shares`]).
pub const ADDRESS_CONNECTIONS_SHARE: usize = 8;
/// Lower bound of these: a school behind one address loads the page over about six connections per browser, and plays
/// over one.
pub const ADDRESS_CONNECTIONS_MIN: usize = 512;
/// One part in this many of all connections, game sockets or rooms is reserved for networks that hold few.
pub const RESERVE_SHARE: usize = 8;
/// Game sockets of one address at a time, as a fraction of all connections, unless `--address-sockets` is given.
/// Further sockets are refused with `TooManySockets`.
pub const ADDRESS_SESSIONS_SHARE: usize = 32;
/// Lower bound of these, for a server with few connections.
pub const ADDRESS_SESSIONS_MIN: usize = 128;
/// TCP connections of one address beyond its game sockets, if `--address-sockets` allows more of those.
pub const ADDRESS_CONNECTIONS_SPARE: usize = ADDRESS_CONNECTIONS_MIN - ADDRESS_SESSIONS_MIN;
/// Addresses whose rates are tracked at a time. An address that connected once is dropped 20 ms later.
pub const TRACKED_ADDRESSES_MAX: usize = 4096;
/// Wait after the listener failed to accept, so that it does not spin while descriptors are exhausted.
pub const ACCEPT_RETRY: Duration = Duration::from_millis(50);

/// Largest file written or named by people, bytes: settings, a scene, certificates, a key, a token. The longest useful
/// one, a scene, has 64 KiB.
pub const SETTINGS_FILE_BYTES_MAX: usize = 1 << 20;

/// Maximum number of connections to the operators' port at a time.
pub const OPS_CONNECTIONS_MAX: usize = 16;

// HTTP.

/// Requests of one address per second in the long run, including those passed on by a proxy.
pub const REQUESTS_PER_SECOND_MAX: u32 = 100;
/// Largest burst of requests from one address: a class of fifty that loads the page.
pub const REQUESTS_BURST_MAX: usize = 1024;
/// Largest buffer for a request's head, bytes.
pub const HTTP_BUFFER_BYTES_MAX: usize = 16 << 10;
/// Longest usual request body, bytes.
pub const HTTP_BODY_BYTES_MAX: usize = 1 << 10;
/// Longer bodies, of scenes and runs, that may be received at a time, with up to a megabyte each.
pub const LONG_BODIES_MAX: usize = 64;
/// Longer bodies that one address may send at a time.
pub const ADDRESS_LONG_BODIES_MAX: usize = 4;
/// Time after which a long body may be displaced by one from a network that sends fewer, once there are too many:
/// enough for 230 kB at 2 Mbit/s.
pub const LONG_BODY_GRACE: Duration = Duration::from_secs(1);

// Sessions.

/// Messages per second in the long run; a page sends 60 inputs and a few pings.
pub const MESSAGES_PER_SECOND_MAX: u32 = 120;
/// Largest burst of messages: the number that an honest client sends after a network stall of four seconds.
pub const MESSAGES_BURST_MAX: u32 = 240;
/// Decoded messages that may wait for the room: twice the burst, so that only a room that is blocked for seconds lets
/// it fill up.
pub const INBOX_MAX: usize = 512;
/// Time for the last message, the close frame, and the peer's close.
pub const CLOSE_WAIT: Duration = Duration::from_secs(2);
/// Bytes read from a session's socket at a time, into a cleared buffer: about ten inputs.
pub const READ_BUFFER_BYTES: usize = 512;

// Bytes.

/// Default for the megabits per second that the server may send: the slowest uplink with which machines are usually
/// rented.
pub const UPLINK_MEGABITS: u32 = 100;
/// Largest value of `--uplink`, beyond the reach of any machine.
pub const UPLINK_MEGABITS_MAX: u32 = 30_000;
/// The fraction of these that may be sent to one address (IPv6: one /64). A quarter of 100 Mbit/s is 24 kB/s for each
/// of [`ADDRESS_SESSIONS_MIN`] sessions; a player in a pile of 900 boxes receives 7 kB/s on the wire.
pub const ADDRESS_UPLINK_SHARE: u32 = 4;
/// The part of these that all rooms with guests' scenes may send together. Such a scene may send 178 kB/s to each
/// client.
pub const GUESTS_UPLINK_SHARE: u32 = 4;
/// Seconds of a budget that may be sent at once: the welcomes and keyframes of a class that arrives together.
pub const UPLINK_BURST_SECONDS: u32 = 2;

// Rooms.

/// Maximum number of scenes on offer, unless `--scenes-max` is given.
pub const SCENES_MAX: usize = 64;
/// Largest value of `--scenes-max`: each scene has a standing room, and a card in the lobby.
pub const SCENES_BOUND: usize = 1024;
/// Rooms that a processor is assumed to handle; most take less than 3 % of one.
pub const ROOMS_PER_PROCESSOR: usize = 32;
/// Largest value of `--rooms-max`: each room has a thread that wakes sixty times a second.
pub const ROOMS_BOUND: usize = 4096;
/// Rooms created from one address at a time, as a fraction of all.
pub const ADDRESS_ROOMS_SHARE: usize = 8;
/// Lower bound of these, for a server with few rooms.
pub const ADDRESS_ROOMS_MIN: usize = 8;
/// Maximum number of spectators of a room: with all 512 seats taken they still fit on one socket thread. A spectator
/// costs the bytes sent, but no encoding.
pub const SPECTATORS_MAX: usize = 256;
/// Length of a private room's code, 5 bits per character: too long to be guessed.
pub const PRIVATE_CODE_CHARS: usize = 20;
/// Minimum length of an operators' token.
pub const OPS_TOKEN_CHARS_MIN: usize = 16;
/// Joins that may wait for a room's next tick: as many as a room has seats.
pub const JOINS_WAITING_MAX: usize = SEATS_MAX;
/// Maximum number of ticks played in a row to catch up; further due ticks are skipped and counted as missed.
pub const CATCH_UP_TICKS_MAX: u32 = 5;

// Scenes of guests.

/// Longest scene of a guest, bytes; the largest built-in scene, `hall`, has 19 kB.
pub const GUEST_SCENE_BYTES_MAX: usize = 32 << 10;
/// The budget of a guest's scene. Every built-in scene except `hall` stays within it.
pub const GUEST_BUDGET: Budget = Budget {
    // Sending to more players would cost more than most scenes do.
    players: FOLLOWERS_MAX as u16,
    // Their keyframe has about 10 kB, and each player who joins or lags gets one.
    bodies: 1000,
    // Twice the default. Each player's page simulates them too.
    particles: 8192,
    // Twelve screens of the usual height in a row, with a kill zone around them.
    size: 4096.0,
    // Half a tick, so that a room is not late if it has its worst ticks in a row.
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
    // 32 zones with all allowed bodies, a few tenths of a millisecond.
    zone_looks: 32_000,
    // Each rule is compared with every contact.
    rules: 64,
    // Ten in each tick; each is an event that is sent to all players.
    starts_per_s: 600,
    // The rate at which all particles are in use if each lives for two seconds.
    emitted_per_s: 4096,
    // One in each tick.
    launched_per_s: 60,
};
/// Limits of a step of a guest's scene; a room that exceeds them is closed. The scene's budget limits the number of its
/// bodies, not the piles that players, forces and launchers make of them.
pub const GUEST_STEP: StepBudget = StepBudget {
    // Three times the pairs of a heap of all bodies; 30 iterations over them take about 14 ms, and the pairs about 3
    // MB.
    pairs: 10_000,
    // About 50 ms; the largest built-in tower needs a fiftieth of it.
    work: 1_000_000,
    // Sixteen obstacles that cover everything, which takes half a megabyte.
    obstacle_cells: 65_536,
};
/// A room with a guest's scene may use one part in this many of a processor in the long run: two milliseconds of each
/// tick, while most scenes take far less.
pub const GUEST_SHARE: u32 = 8;
/// All such rooms together may use one part in this many of the processors, so that at least as much is left to other
/// rooms.
pub const GUESTS_SHARE: usize = 2;
/// Ticks tried at a time before a room opens. By then its bodies have fallen, and each key was pressed many times.
pub const GUEST_TRIAL_TICKS: u32 = 2 * TICKS_PER_SECOND;
/// Maximum number of parts of a trial ([`Timeouts::guest_trial_later`]). By then launchers have filled the scene, and
/// falling bodies have come to rest.
pub const GUEST_TRIAL_PARTS: u32 = 10;
/// Number of players in a trial, who press all keys at random.
pub const GUEST_TRIAL_PLAYERS: u16 = 8;
/// Maximum number of guests' scenes that are being tried or wait for their trial.
pub const GUEST_TRIALS_MAX: usize = 16;
/// Maximum number of trials of one address. A /48 may have eight, so that no organisation has them all.
pub const ADDRESS_GUEST_TRIALS_MAX: usize = 2;
/// Rooms with guests' scenes per address, as a fraction of all, and at least one: it takes four addresses to use them
/// all.
pub const ADDRESS_GUEST_ROOMS_SHARE: usize = 4;
/// The number of last rooms with guests' scenes reserved for networks without one.
pub const GUEST_ROOMS_RESERVE: usize = 1;
/// Niceness of the threads that play and try guests' scenes, so that all other threads come first.
pub const GUEST_NICENESS: i32 = 10;

/// Processors that this process may use.
pub fn processors() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

/// Default for the rooms that people may have open at a time. The scenes' standing rooms do not count.
pub fn rooms_max() -> usize {
    (processors() * ROOMS_PER_PROCESSOR).min(ROOMS_BOUND)
}

/// Default for the connections at a time. A system with fewer descriptors has a lower limit.
pub fn connections_max() -> usize {
    (processors() * CONNECTIONS_PER_PROCESSOR).clamp(CONNECTIONS_MIN, CONNECTIONS_BOUND)
}

/// Connections per address on a server with this many connections, if one address may have `sessions` game sockets.
pub fn address_connections_max(connections: usize, sessions: usize) -> usize {
    let share = (connections / ADDRESS_CONNECTIONS_SHARE).max(ADDRESS_CONNECTIONS_MIN);
    share.max(ADDRESS_CONNECTIONS_SPARE + sessions)
}

/// Default for the game sockets per address on a server with this many connections.
pub fn address_sessions_max(connections: usize) -> usize {
    (connections / ADDRESS_SESSIONS_SHARE).max(ADDRESS_SESSIONS_MIN)
}

/// Maximum number of open rooms with guests' scenes on a machine with this many processors.
pub const fn guest_rooms_max(processors: usize) -> usize {
    processors * GUEST_SHARE as usize / GUESTS_SHARE
}

// Replays.

/// Bytes of one file, after which a new one begins; the records that wait for the writer still fit below
/// [`REPLAY_BYTES_MAX`].
pub const REPLAY_FILE_BYTES_MAX: u64 = 32 << 20;
/// Default for the megabytes of all files in the directory.
pub const REPLAYS_MB: u32 = 1024;
/// Maximum number of files in the directory; beyond this the oldest finished ones are deleted.
pub const REPLAY_FILES_MAX: usize = 10_000;
/// Minimum bytes counted for a file: the disk block that it takes.
pub const REPLAY_FILE_CHARGE_MIN: u64 = 4 << 10;
/// Clips may take one part in this many of the directory, in files and in bytes. Beyond it they are deleted before
/// recordings of games.
pub const CLIPS_SHARE: usize = 8;
/// Clips of all rooms that may wait for the writer or be in progress. The writer also writes all recordings.
pub const CLIPS_WAITING_MAX: usize = 4;
/// Default for the days that a file is kept.
pub const REPLAYS_DAYS: u32 = 30;
/// Time after which a room whose recording failed starts a new file.
pub const REPLAY_RETRY: Duration = Duration::from_secs(60);
/// Maximum number of replays in a list; older ones are still available by name.
pub const REPLAYS_LISTED_MAX: usize = 100;
/// Maximum number of replays being downloaded at a time.
pub const REPLAY_READERS_MAX: usize = 64;
/// Maximum number of replays being downloaded at a time from one address.
pub const ADDRESS_REPLAY_READERS_MAX: usize = 4;

// Records.

/// Number of best runs kept for a scene, at most one by the same players.
pub const RECORDS_MAX: usize = 10;
/// Longest replay of a run, bytes: half an hour takes about 230 kB for its hashes, and as much again for a busy
/// pointer.
pub const RUN_BYTES_MAX: usize = 1 << 20;
/// Number of displaced runs kept for a scene, in case an operator removes better ones: two tables of them.
pub const DISPLACED_MAX: usize = 2 * RECORDS_MAX;
/// Maximum number of files with a scene's runs. The files of all scenes are played again when the server starts.
pub const RECORD_FILES_MAX: usize = RECORDS_MAX + DISPLACED_MAX;
/// Maximum number of replays that are being verified or wait for it, a megabyte each.
pub const RUN_TRIALS_MAX: usize = 16;

// The state directory.

/// Ticks after which a room's file is replaced by a new one: as many as a restart may have to replay, a third of a
/// second of processor time for a busy room.
pub const STATE_FILE_TICKS: u32 = 20 * TICKS_PER_SECOND;
/// Minimum number of ticks between two notes in a room's file. Those of the largest scene take about 90 kB, and players
/// may come and go in every tick; this keeps the file far below [`REPLAY_BYTES_MAX`].
pub const STATE_NOTES_EVERY_TICKS: u32 = 6;
/// Time between two syncs of the files to the disk.
pub const STATE_SYNC_EVERY: Duration = Duration::from_millis(400);
/// Time after which a room whose file was given up starts a new one.
pub const STATE_RETRY: Duration = Duration::from_secs(5);

// The fleet.

/// Timeout of a read or write of the directory.
pub const FLEET_ANSWER: Duration = Duration::from_millis(1500);
/// Time between two checks of the inboxes of a room that is handed over.
pub const FLEET_HAND_OVER_LOOK: Duration = Duration::from_millis(20);
/// Time that a drain reserves for files and for notices to other nodes, whatever its players do.
pub const DRAIN_FILES: Duration = Duration::from_secs(1);
/// Time for a draining node to hand over its rooms.
pub const FLEET_DRAIN: Duration = Duration::from_millis(2500);
/// Time for a node to read a room's records and open the room.
pub const FLEET_OPEN: Duration = Duration::from_secs(10);

// The end.

/// Time from a signal to the end of the process, whatever its sockets, rooms, disks and log do.
pub const DRAIN_MAX: Duration = Duration::from_secs(8);
/// The part of it for closing a log that is not read by anything.
pub const LOG_END_MAX: Duration = Duration::from_millis(1200);

/// The timeouts of peers, rooms and the server itself; tests shorten and lengthen them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeouts {
    /// Time to send the head of a request, to idle between two requests, and to complete the TLS handshake.
    pub http_head: Duration,
    /// Time to send a request's body.
    pub http_body: Duration,
    /// Time for which a peer may take nothing of a response. A single byte in time keeps the connection.
    pub http_stall: Duration,
    /// Time from the upgrade to a valid hello.
    pub hello: Duration,
    /// Time between two WebSocket pings.
    pub keepalive: Duration,
    /// Silence (not even a pong) after which a session is closed.
    pub silence: Duration,
    /// Time within which a peer must take one message.
    pub stall: Duration,
    /// Time for which a client may be sent snapshots without acknowledging any.
    pub hearing: Duration,
    /// Time for which a room without players stays open.
    pub room_empty: Duration,
    /// Time for which a room with a guest's scene stays open while no seat is taken: long enough to open its link by
    /// hand. The number of such rooms is small.
    pub guest_room_empty: Duration,
    /// Time for which an empty room is still recorded; a player who reconnects sooner continues the same
    /// replay.
    pub record_empty: Duration,
    /// Time within which a room must answer an operator, or all rooms together if all are asked.
    pub command: Duration,
    /// Time between warning the players of the server's end and closing their sockets.
    pub drain_notice: Duration,
    /// Time after that for sockets to close and rooms to end.
    pub drain: Duration,
    /// Time for the whole shutdown in every case; the files get the remainder.
    pub drain_max: Duration,
    /// Processor time for reading a guest's scene, and for each part of its trial: twice a room's share, as a trial is
    /// livelier than real players.
    pub guest_trial: Duration,
    /// Processor time of a trial after its first part.
    pub guest_trial_later: Duration,
    /// Processor time for verifying the replay of a run; half an hour of a scene takes a few seconds.
    pub run_trial: Duration,
    /// Processor time beyond its share after which a room with a guest's scene is closed.
    pub guest_excess: Duration,
    /// Processor time of a single tick after which such a room is closed: six ticks, twice the time of a step within
    /// [`GUEST_STEP`].
    pub guest_tick: Duration,
    /// Time between two checks of the certificate files. A change is applied once it has persisted for one interval.
    pub certificate_look: Duration,
}

impl Timeouts {
    /// The timeouts of a server that is not under test.
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

    /// Time for which a room without connected players stays open. Players who lost their sockets keep their `seats`
    /// for a while, and can return to the room.
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
