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
use jostle_protocol::limits::{
    CLIENT_MESSAGE_BYTES_MAX, REPLAY_BYTES_MAX, REPLAY_RECORD_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX,
};
use jostle_sim::{StepBudget, TICKS_PER_SECOND};
use std::num::NonZero;
use std::thread::available_parallelism;
use std::time::Duration;

// Sockets.

/// TCP connections for each processor, unless `--connections-max` says otherwise: four times the players of full rooms of 16,
/// for spectators and for browsers that load the page. One more is closed at once.
pub const CONNECTIONS_PER_PROCESSOR: usize = 2048;
/// The least of these on a machine with one processor.
pub const CONNECTIONS_MIN: usize = 4096;
/// The most that `--connections-max` may say: each may hold a buffer of 16 KiB while its request is read.
pub const CONNECTIONS_BOUND: usize = 65_536;
/// Descriptors beside those of connections: two files for each room, replays that are being read, the operators'
/// port, the log, what the runtime has, and each thread of sockets.
pub const fn descriptors_spare(rooms: usize) -> usize {
    let files = 2 * rooms + REPLAY_READERS_MAX;
    files + OPS_CONNECTIONS_MAX + 48 + 3 * SOCKET_THREADS_MAX
}
/// Threads that serve sockets. Each can carry some 800 players.
pub const SOCKET_THREADS_MAX: usize = 16;
/// TCP connections of one address at a time (IPv6: of one /64), as a fraction of all of them; a /56 may hold twice as many, a
/// /48 four times, and a /24 of IPv4 twice ([`networks::shares`]).
pub const ADDRESS_CONNECTIONS_SHARE: usize = 8;
/// The least of these: a school behind one address loads the page over some six connections a browser, and plays over one.
pub const ADDRESS_CONNECTIONS_MIN: usize = 512;
/// A part of all connections, of game sockets, of rooms, one in so many, that is left to networks which hold few.
pub const RESERVE_SHARE: usize = 8;
/// Game sockets of one address at a time, as a fraction of all connections, unless `--address-sockets` says otherwise; one
/// more is refused with `TooManySockets`.
pub const ADDRESS_SESSIONS_SHARE: usize = 32;
/// The least of these on a server with few connections.
pub const ADDRESS_SESSIONS_MIN: usize = 128;
/// TCP connections of one address beyond its game sockets, where `--address-sockets` allows more of those.
pub const ADDRESS_CONNECTIONS_SPARE: usize = ADDRESS_CONNECTIONS_MIN - ADDRESS_SESSIONS_MIN;
/// Addresses whose rates are tracked at a time. One that connected once is dropped 20 ms later.
pub const TRACKED_ADDRESSES_MAX: usize = 4096;
/// Wait after the listener failed to accept, so that a lack of descriptors does not spin.
pub const ACCEPT_RETRY: Duration = Duration::from_millis(50);

/// Maximum size of files written or named by people, bytes: settings, a scene, certificates, a key, a token. The longest
/// that makes sense, a scene, has 64 KiB.
pub const SETTINGS_FILE_BYTES_MAX: usize = 1 << 20;

/// Connections to the operators' port at a time.
pub const OPS_CONNECTIONS_MAX: usize = 16;

// HTTP.

/// Requests of one address a second in the long run, also where a proxy passes them on.
pub const REQUESTS_PER_SECOND_MAX: u32 = 100;
/// Burst of requests of one address: a class of fifty loads the page.
pub const REQUESTS_BURST_MAX: usize = 1024;
/// Bytes buffered of a request's head.
pub const HTTP_BUFFER_BYTES_MAX: usize = 16 << 10;
/// Bytes of a request's body.
pub const HTTP_BODY_BYTES_MAX: usize = 1 << 10;
/// Longer bodies, of scenes and runs, that are being received: a megabyte each at most.
pub const LONG_BODIES_MAX: usize = 64;
/// Of these, of one address.
pub const ADDRESS_LONG_BODIES_MAX: usize = 4;
/// Time that such a body has before it gives way to one of a network that sends fewer, once there are too many: as long as
/// 230 kB take at 2 Mbit/s.
pub const LONG_BODY_GRACE: Duration = Duration::from_secs(1);

// Sessions.

/// Messages a second in the long run; a page sends 60 inputs and a few pings.
pub const MESSAGES_PER_SECOND_MAX: u32 = 120;
/// Burst of messages: those that an honest client has sent after a network stall of four seconds.
pub const MESSAGES_BURST_MAX: u32 = 240;
/// Decoded messages that wait for the room. Twice the burst, so only a room that stands still for
/// seconds can fill it.
pub const INBOX_MAX: usize = 512;
/// Time for the last message, the close frame, and the peer's own closing.
pub const CLOSE_WAIT: Duration = Duration::from_secs(2);
/// Bytes read from a session's socket at a time, which are cleared before: some ten inputs.
pub const READ_BUFFER_BYTES: usize = 512;

// Bytes.

/// Megabits a second that the server may send, unless `--uplink` says otherwise: the least that machines are rented with.
pub const UPLINK_MEGABITS: u32 = 100;
/// The most that `--uplink` may say, which no machine reaches.
pub const UPLINK_MEGABITS_MAX: u32 = 30_000;
/// Of these, the part that may be sent to one address (IPv6: one /64). A quarter of 100 Mbit/s is 24 kB/s for each of
/// [`ADDRESS_SESSIONS_MIN`], where a player in a pile of 900 boxes is sent 7 on the wire.
pub const ADDRESS_UPLINK_SHARE: u32 = 4;
/// The part that all rooms with guests' scenes may send together. Such a scene can be one that sends 178 kB/s to each client.
pub const GUESTS_UPLINK_SHARE: u32 = 4;
/// Seconds of a budget that may be sent at once: the welcomes and keyframes of a class that comes in together.
pub const UPLINK_BURST_SECONDS: u32 = 2;

// Rooms.

/// Scenes that a server offers, unless `--scenes-max` says otherwise.
pub const SCENES_MAX: usize = 64;
/// The most that it may say: each has a standing room, and a card in the lobby.
pub const SCENES_BOUND: usize = 1024;
/// Rooms that a processor is taken to play: most take less than 3 % of one.
pub const ROOMS_PER_PROCESSOR: usize = 32;
/// The most that `--rooms-max` may say: each room has a thread, which wakes sixty times a second.
pub const ROOMS_BOUND: usize = 4096;
/// Rooms created from one address, at a time, as a fraction of all of them.
pub const ADDRESS_ROOMS_SHARE: usize = 8;
/// The least of these on a server with few rooms.
pub const ADDRESS_ROOMS_MIN: usize = 8;
/// Spectators of a room at a time: with all 512 seats taken they fit the sockets of one thread. Each costs what it is sent, and no
/// encoding.
pub const SPECTATORS_MAX: usize = 256;
/// Characters of the code of a private room, 5 bits each: none can be found by trying.
pub const PRIVATE_CODE_CHARS: usize = 20;
/// Characters of an operators' token, at least.
pub const OPS_TOKEN_CHARS_MIN: usize = 16;
/// Joins that wait for a room's next tick: all that a room can take.
pub const JOINS_WAITING_MAX: usize = SEATS_MAX;
/// Ticks played in a row to catch up; what is due beyond them is skipped and counted as missed.
pub const CATCH_UP_TICKS_MAX: u32 = 5;

// Scenes of guests.

/// Bytes of a guest's scene: the largest that Jostle ships, `hall`, has 19 kB.
pub const GUEST_SCENE_BYTES_MAX: usize = 32 << 10;
/// A guest's scene stays within this. Each shipped scene does, but for `hall`.
pub const GUEST_BUDGET: Budget = Budget {
    // Sending to more costs more than most scenes do.
    players: FOLLOWERS_MAX as u16,
    // A keyframe of them has some 10 kB, and each player that joins or lags gets one.
    bodies: 1000,
    // Twice the default. They are simulated by the page of each player too.
    particles: 8192,
    // Twelve screens of the usual height in a row, and a kill zone around them.
    size: 4096.0,
    // Half a tick, so that a room that has its worst ticks in a row is not late.
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
    // A chain as long as the widest shipped scene.
    springs: 256,
    // 32 zones with all bodies that are allowed, some tenths of a millisecond.
    zone_looks: 32_000,
    // They are compared with each contact.
    rules: 64,
    // Ten in each tick; each is an event that all players are sent.
    starts_per_s: 600,
    // As many as live for two seconds when all particles are in the air.
    emitted_per_s: 4096,
    // One in each tick.
    launched_per_s: 60,
};
/// What a step of a guest's scene takes at most; a room that needs more is closed. The budget of a scene counts its bodies,
/// not where players, forces and launchers pile them up.
pub const GUEST_STEP: StepBudget = StepBudget {
    // Three times what a heap of all bodies has; 30 iterations over them take some 14 ms, and the pairs some 3 MB.
    pairs: 10_000,
    // Some 50 ms; the largest tower that is shipped needs a fiftieth.
    work: 1_000_000,
    // Sixteen obstacles that cover everything, half a megabyte.
    obstacle_cells: 65_536,
};
/// A room with a guest's scene has one processor divided by this in the long run: two milliseconds of each tick, as most
/// scenes take far less.
pub const GUEST_SHARE: u32 = 8;
/// All of them together have the processors divided by this, so that at least as much is left to other rooms.
pub const GUESTS_SHARE: usize = 2;
/// Ticks that are tried at a time before a room opens: its bodies have fallen, and each key was pressed many times.
pub const GUEST_TRIAL_TICKS: u32 = 2 * TICKS_PER_SECOND;
/// Times that as much is tried at most, one after the other ([`Waits::guest_trial_later`]): launchers
/// have filled a scene by then, and what falls together has fallen.
pub const GUEST_TRIAL_PARTS: u32 = 10;
/// Players in such a trial, who press all keys at random.
pub const GUEST_TRIAL_PLAYERS: u16 = 8;
/// Scenes of guests that are tried or wait for that.
pub const GUEST_TRIALS_MAX: usize = 16;
/// Of these, of one address. A /48 has eight, so that no organisation has all.
pub const ADDRESS_GUEST_TRIALS_MAX: usize = 2;
/// Rooms with scenes of guests of one address, as a fraction of all of them, and at least one: four addresses are needed
/// to take them all.
pub const ADDRESS_GUEST_ROOMS_SHARE: usize = 4;
/// The last of these rooms, which are for networks that have none.
pub const GUEST_ROOMS_RESERVE: usize = 1;
/// Niceness of the threads that play and try scenes of guests, so that all others go first.
pub const GUEST_NICENESS: i32 = 10;

/// Processors that this process may use.
pub fn processors() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

/// Rooms that people create, at a time, unless `--rooms-max` says otherwise; the scenes' standing rooms do not count.
pub fn rooms_max() -> usize {
    (processors() * ROOMS_PER_PROCESSOR).min(ROOMS_BOUND)
}

/// Connections at a time, unless `--connections-max` says otherwise or the system has fewer descriptors.
pub fn connections_max() -> usize {
    (processors() * CONNECTIONS_PER_PROCESSOR).clamp(CONNECTIONS_MIN, CONNECTIONS_BOUND)
}

/// Connections of one address on a server with this many, of which it may have as many game sockets.
pub fn address_connections_max(connections: usize, sessions: usize) -> usize {
    let share = (connections / ADDRESS_CONNECTIONS_SHARE).max(ADDRESS_CONNECTIONS_MIN);
    share.max(ADDRESS_CONNECTIONS_SPARE + sessions)
}

/// Game sockets of one address on a server with this many connections, unless `--address-sockets` says otherwise.
pub fn address_sessions_max(connections: usize) -> usize {
    (connections / ADDRESS_SESSIONS_SHARE).max(ADDRESS_SESSIONS_MIN)
}

/// Rooms with scenes of guests that may be open at a time on a machine with this many processors.
pub const fn guest_rooms_max(processors: usize) -> usize {
    processors * GUEST_SHARE as usize / GUESTS_SHARE
}

// Replays.

/// Bytes of one file, after which a new one begins; the records that wait for the writer still fit below
/// [`REPLAY_BYTES_MAX`].
pub const REPLAY_FILE_BYTES_MAX: u64 = 32 << 20;
/// Megabytes of all files in the directory, unless `--replays-mb` says otherwise.
pub const REPLAYS_MB: u32 = 1024;
/// Files in the directory; past them the oldest finished ones are deleted.
pub const REPLAY_FILES_MAX: usize = 10_000;
/// Bytes that a file counts for at least: the block that it takes of a disk.
pub const REPLAY_FILE_CHARGE_MIN: u64 = 4 << 10;
/// Clips have the directory divided by this, in files and in bytes. Past it they are deleted before recordings of games.
pub const CLIPS_SHARE: usize = 8;
/// Clips of all rooms that wait for the writer, or are being cut. It writes all recordings, too.
pub const CLIPS_WAITING_MAX: usize = 4;
/// Days for which a file is kept, unless `--replays-days` says otherwise.
pub const REPLAYS_DAYS: u32 = 30;
/// Time after which a room whose recording failed begins a fresh file.
pub const REPLAY_RETRY: Duration = Duration::from_secs(60);
/// Replays that are listed; older ones are still there by name.
pub const REPLAYS_LISTED_MAX: usize = 100;
/// Replays that are being downloaded at a time.
pub const REPLAY_READERS_MAX: usize = 64;
/// Of these, of one address.
pub const ADDRESS_REPLAY_READERS_MAX: usize = 4;

// Records.

/// Best runs of a scene that are kept, one of the same players.
pub const RECORDS_MAX: usize = 10;
/// Bytes of a run's replay: half an hour takes some 230 kB for its hashes, and a busy pointer as much again.
pub const RUN_BYTES_MAX: usize = 1 << 20;
/// Displaced runs of a scene that are kept, in case an operator removes better ones: two tables of them.
pub const DISPLACED_MAX: usize = 2 * RECORDS_MAX;
/// Files of the records of a scene, of which those of all scenes are played again when the server starts.
pub const RECORD_FILES_MAX: usize = RECORDS_MAX + DISPLACED_MAX;
/// Replays that are checked or wait for that, a megabyte each.
pub const RUN_TRIALS_MAX: usize = 16;

// The state directory.

/// Ticks after which a room's file gives way to a new one: as many as a restart has to play again, a third of a
/// second of a busy room.
pub const STATE_FILE_TICKS: u32 = 20 * TICKS_PER_SECOND;
/// Ticks between two notes in a room's file: those of the largest scene take some 90 kB, and players may come and
/// go in every tick, so that a file stays far below [`REPLAY_BYTES_MAX`].
pub const STATE_NOTES_EVERY_TICKS: u32 = 6;
/// Time between two syncs of the files with the disk.
pub const STATE_SYNC_EVERY: Duration = Duration::from_millis(400);
/// Time after which a room whose file was given up begins a new one.
pub const STATE_RETRY: Duration = Duration::from_secs(5);

// The fleet.

/// Time for which a write to the directory, or a read, may be on its way.
pub const FLEET_ANSWER: Duration = Duration::from_millis(1500);
/// Time between two looks at the inboxes of a room that is handed over.
pub const FLEET_HAND_OVER_LOOK: Duration = Duration::from_millis(20);
/// Time that a drain leaves for files and for what other nodes are to be told, whatever its players do.
pub const DRAIN_FILES: Duration = Duration::from_secs(1);
/// Time in which a node that drains hands its rooms over.
pub const FLEET_DRAIN: Duration = Duration::from_millis(2500);
/// Time in which a node reads a room's records, and opens it.
pub const FLEET_OPEN: Duration = Duration::from_secs(10);

// The end.

/// Time from a signal to the end of the process, whatever its sockets, rooms, disks and log do.
pub const DRAIN_MAX: Duration = Duration::from_secs(8);
/// Of this, the time that a log which nothing reads takes to end.
pub const LOG_END_MAX: Duration = Duration::from_millis(1200);

/// The times after which a peer, a room or the server itself is given up; tests shorten and lengthen them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Waits {
    /// Time to send the head of a request, to idle between two requests, and for the handshake of TLS.
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
    /// Time in which a peer must take one message.
    pub stall: Duration,
    /// Time for which a client may be sent snapshots without acknowledging one.
    pub hearing: Duration,
    /// Time for which a room stays open without players.
    pub room_empty: Duration,
    /// Time for which a room with a guest's scene stays open in which no seat is taken: as long as it takes to open its
    /// link by hand. There are few such rooms.
    pub guest_room_empty: Duration,
    /// Time for which an empty room is still recorded; a player who reconnects sooner continues the same
    /// replay.
    pub record_empty: Duration,
    /// Time in which a room answers an operator, or all of them together where all are asked.
    pub command: Duration,
    /// Time between warning the players of the server's end and closing their sockets.
    pub drain_notice: Duration,
    /// Time that sockets have to close after that, and rooms to end.
    pub drain: Duration,
    /// Time from the beginning of the end to the end, in every case: the files have what is left of it.
    pub drain_max: Duration,
    /// Processor time in which a guest's scene is read and plays each part of its trial: twice a room's share, as the trial is livelier
    /// than players are.
    pub guest_trial: Duration,
    /// Processor time for which a trial goes on after its first part.
    pub guest_trial_later: Duration,
    /// Processor time in which a replay of a run is played again: half an hour of a scene takes a few seconds.
    pub run_trial: Duration,
    /// Processor time that a room with a guest's scene may take beyond its share before it is closed.
    pub guest_excess: Duration,
    /// Processor time that a single tick of such a room may take before it is closed: six ticks, twice what a step
    /// within [`GUEST_STEP`] takes.
    pub guest_tick: Duration,
    /// Time between two looks at the files of the certificate. A change is taken up once it has lasted for one.
    pub certificate_look: Duration,
}

impl Waits {
    /// Those of a server that is not under test.
    pub const USUAL: Waits = Waits {
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

    /// Time for which a room stays open while nobody is connected. Players who lost their sockets keep their `seats` for a
    /// while, and find the room again.
    pub fn empty(&self, has_guests_scene: bool, seats: usize) -> Duration {
        if has_guests_scene && seats == 0 { self.guest_room_empty } else { self.room_empty }
    }
}

impl Default for Waits {
    fn default() -> Waits {
        Waits::USUAL
    }
}

const _: () = assert!(
    Waits::USUAL.guest_trial.as_micros()
        == 2 * GUEST_TRIAL_TICKS as u128 * 1_000_000 / (TICKS_PER_SECOND * GUEST_SHARE) as u128,
    "a trial has twice a room's share"
);
const _: () = assert!(INBOX_MAX > MESSAGES_BURST_MAX as usize, "an honest burst fits the inbox");
const _: () =
    assert!(Waits::USUAL.drain.as_secs() > CLOSE_WAIT.as_secs(), "a close fits the drain");
const _: () = assert!(
    Waits::USUAL.drain_max.as_millis() + LOG_END_MAX.as_millis() <= DRAIN_MAX.as_millis(),
    "the log is left time"
);
const _: () = assert!(
    FLEET_DRAIN.as_millis() + Waits::USUAL.drain_notice.as_millis() + DRAIN_FILES.as_millis()
        < Waits::USUAL.drain_max.as_millis(),
    "some of the time is left for closing sockets"
);
const _: () = assert!(
    Waits::USUAL.silence.as_secs() > 2 * Waits::USUAL.keepalive.as_secs(),
    "a pong may get lost"
);
const _: () = assert!(
    REPLAY_FILE_BYTES_MAX as usize + 2 * REPLAY_RECORD_BYTES_MAX < REPLAY_BYTES_MAX,
    "a file that has come to its end can be read"
);
