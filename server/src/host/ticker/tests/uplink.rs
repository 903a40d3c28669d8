//! The bytes sent to sessions, measured on a simulated clock.

use super::*;
use crate::limits::{ADDRESS_UPLINK_SHARE, GUESTS_UPLINK_SHARE, UPLINK_BURST_SECONDS};
use jostle_protocol::{ServerMessage, SnapshotStream};
use jostle_sim::TICKS_PER_SECOND;

/// Bodies between two walls that never come to rest.
const RESTLESS: &str = r#"title = "Restless"
size = [400, 200]
gravity = [0, -40]
groups = ["block", "platform"]
pairs = [["block", "platform"], ["block", "block"]]
limits = { players = 8, bodies = 320 }

[[bodies]]
kind = "wall"
position = [200, -5]
size = [420, 10]

[[layouts]]
kind = "block"
count = 300
area = [[10, 10], [390, 190]]
radius = 2
velocity = [0, 40]
restitution = 1
friction = 0
"#;
const SECONDS: u32 = 10;
/// Number of sessions that decode their messages; for the other sessions, only the bytes are counted.
const READERS: usize = 6;

/// A session and the messages that it has received.
struct Session {
    _inbox: InboxSender<Option<ClientMessage>>,
    outbox: Arc<Outbox>,
    stream: SnapshotStream,
    bytes: usize,
    snapshots: u32,
}

impl Session {
    fn join(open: &mut OpenRoom, role: Role, own: [u8; 4], now: Instant) -> Session {
        let (join, inbox, outbox) = join();
        open.seat(Join { role, address: own.into(), ..join }, &mut None, now);
        let stream = SnapshotStream::default();
        Session { _inbox: inbox, outbox, stream, bytes: 0, snapshots: 0 }
    }

    /// Receives the waiting messages, and checks that they can be decoded.
    fn receive(&mut self, reads: bool) {
        while let NextToSend::Message(bytes) = self.outbox.take() {
            self.bytes += bytes.len();
            self.snapshots += 1;
            if !reads {
                continue;
            }
            if let Ok(ServerMessage::Snapshot(coded)) = ServerMessage::decode(&bytes) {
                self.stream.decode(&coded).expect("a snapshot");
            }
        }
        assert_eq!(self.outbox.end_reason(), None);
    }
}

/// Plays a guest's room with this uplink, 120 spectators from two addresses, and a player from a third. Returns the
/// total bytes per second, the number of messages to the player, and the smallest number of messages to any spectator.
fn crowd(megabits: u32) -> (usize, u32, u32) {
    let (mut ends, _outside) = room("crowd", Duration::MAX);
    let began = Instant::now();
    let scene = Arc::new(Scene::parse("restless.toml", RESTLESS).expect("a scene"));
    let info = RoomInfo::new("crowd", 1, false, None, &scene);
    ends.info = Arc::new(RoomInfo { guest: true, ..info });
    Arc::get_mut(&mut ends.host).expect("one room").uplink = Uplink::new(megabits, began);
    let mut open = open(&ends).open;
    let player = Session::join(&mut open, Role::Player, [10, 0, 0, 9], began);
    let mut sessions = vec![player];
    for number in 0..120 {
        let own = [10, 0, 0, 1 + number % 2];
        sessions.push(Session::join(&mut open, Role::Spectator, own, began));
    }
    for tick in 0..SECONDS * TICKS_PER_SECOND {
        open.room.tick();
        open.feed(began + Duration::from_secs(tick.into()) / TICKS_PER_SECOND);
        for (index, session) in sessions.iter_mut().enumerate() {
            session.receive(index < READERS);
        }
    }
    let least = sessions.iter().map(|session| session.snapshots).min().unwrap_or_default();
    let newest = |session: &Session| session.stream.newest().map_or(0, |newest| newest.tick);
    let oldest = sessions[..READERS].iter().map(newest).min().unwrap_or_default();
    let age = open.room.game().tick_count() - oldest;
    assert!(age < 5 * TICKS_PER_SECOND, "{age} ticks");
    let bytes: usize = sessions.iter().map(|session| session.bytes).sum();
    (bytes / SECONDS as usize, sessions[0].snapshots, least)
}

#[test]
fn a_crowd_in_a_guests_room_is_sent_what_the_uplink_allows_and_a_player_everything() {
    let ticks = SECONDS * TICKS_PER_SECOND;
    let (unlimited, of_player, least) = crowd(100_000);
    // The additional message is the welcome.
    assert_eq!((of_player, least), (ticks + 1, ticks + 1));
    let megabits = 20;
    let (sent, of_player, least) = crowd(megabits);
    println!(
        "{unlimited} B/s without a limit, {sent} with {megabits} Mbit/s; {least} snapshots at least"
    );
    let allowed =
        (megabits * 1_000_000 / 8 / GUESTS_UPLINK_SHARE.min(ADDRESS_UPLINK_SHARE)) as usize;
    let burst = allowed * UPLINK_BURST_SECONDS as usize / SECONDS as usize;
    assert!(unlimited > 2 * allowed, "{unlimited} B/s");
    assert!(sent < allowed + burst, "{sent} B/s");
    assert_eq!(of_player, ticks + 1);
    assert!(least > SECONDS, "{least} snapshots");
}
