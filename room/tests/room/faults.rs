//! A seeded simulation of a room with two honest players and every kind of disturbance, without sockets and in virtual
//! time. The hashes must always equal those of the undisturbed game with the same inputs, and a subscriber that keeps
//! up must see every tick. If the test fails, it names the seed.

use jostle_game::{Buttons, Input, Scene, Seat};
use jostle_protocol::limits::CLIENT_MESSAGE_BYTES_MAX;
use jostle_protocol::{Appearance, ClientMessage, Refusal, ServerMessage, SnapshotStream};
use jostle_room::{Claim, Rate, Room, SEQ_AHEAD_MAX, Subscriber};
use jostle_sim::{Rng, Vec2};
use std::sync::Arc;

/// A scene with two seats, both of them taken, so that no stranger gets one.
const SCENE: &str = r#"title = "Pair"
size = [100, 60]
tools = ["steer"]
groups = ["hero", "platform", "block"]
pairs = [["hero", "platform"], ["hero", "block"], ["block", "block"], ["block", "platform"]]

[limits]
players = 2

[hero]
spawns = [[30, 20], [70, 20]]

[[bodies]]
kind = "wall"
position = [50, 0]
size = [100, 4]

[[layouts]]
kind = "block"
count = 40
area = [[5, 5], [95, 55]]
radius = 1
"#;

const TICKS: u32 = 240;
const SEEDS: u64 = 16;
/// Maximum number of concurrent subscribers. When one more would subscribe, all of them leave in the same tick.
const READERS_MAX: usize = 40;

/// A game with two players whose inputs depend only on its seed.
struct Play {
    room: Room,
    rng: Rng,
    seq: u32,
}

fn look(name: &str) -> Appearance {
    Appearance::new(name, 0).expect("a name")
}

impl Play {
    fn new(seed: u64) -> Play {
        let scene = Scene::parse("pair.toml", SCENE).unwrap_or_else(|error| panic!("{error}"));
        let mut room = Room::new("pair", Arc::new(scene), seed);
        for name in ["Ann", "Bob"] {
            room.join(look(name), None).expect("a free seat");
        }
        Play { room, rng: Rng::new(seed, 1), seq: 0 }
    }

    fn inputs(&mut self) {
        self.seq += 1;
        for seat in [Seat(0), Seat(1)] {
            let buttons = Buttons(self.rng.next_u32() as u16 & Buttons::ALL.0);
            let x = self.rng.range(0.0, 100.0);
            let input = Input::new(buttons, Some(Vec2::new(x, 30.0)));
            assert!(self.room.input(seat, self.seq, input), "an honest input is taken");
        }
    }
}

fn quiet(seed: u64) -> Vec<u64> {
    let mut play = Play::new(seed);
    let tick = |_| {
        play.inputs();
        play.room.tick();
        play.room.game().hash()
    };
    (0..TICKS).map(tick).collect()
}

/// The disturbances that surround the two players.
struct Trouble {
    rng: Rng,
    subscribers: Vec<Subscriber>,
}

impl Trouble {
    /// Causes one random disturbance.
    fn strike(&mut self, room: &mut Room, seq: u32) {
        let input = Input::new(Buttons::LEFT, None);
        let seat = Seat(self.rng.below(2) as u16);
        match self.rng.below(9) {
            0 => {
                assert_eq!(room.join(look("Eve"), None), Err(Refusal::RoomFull));
                let claim = Claim { seat, serial: u64::from(self.rng.next_u32()) << 8 };
                assert_eq!(room.join(look("Eve"), Some(claim)), Err(Refusal::BadToken));
            }
            1 => assert!(!room.input(seat, self.rng.below(seq + 1), input), "an old input"),
            2 => {
                let ahead = SEQ_AHEAD_MAX + 1 + self.rng.below(1 << 20);
                assert!(!room.input(seat, seq + ahead, input), "an input of the far future");
            }
            3 => {
                let free = Seat(2 + self.rng.below(998) as u16);
                assert!(!room.input(free, seq, input), "an input for a free seat");
                room.disconnect(free);
                room.leave(free);
            }
            4 => self.garbage(),
            5 => room.record("a disk that was empty", 0),
            6 => drop(room.take_records()),
            7 => drop(room.stop_recording()),
            _ => self.read(room),
        }
    }

    /// Sends random bytes, or an input for an empty seat.
    fn garbage(&mut self) {
        let count = self.rng.below(CLIENT_MESSAGE_BYTES_MAX as u32 + 9) as usize;
        let bytes: Vec<u8> = (0..count).map(|_| self.rng.next_u32() as u8).collect();
        if let Ok(message) = ClientMessage::decode(&bytes) {
            assert!(message.encode().len() <= CLIENT_MESSAGE_BYTES_MAX);
        }
    }

    /// Subscribes a client, or removes all of them at once.
    fn read(&mut self, room: &mut Room) {
        if self.subscribers.len() == READERS_MAX {
            self.subscribers.clear();
        }
        let rate = Rate::ALL[self.rng.below(Rate::ALL.len() as u32) as usize];
        self.subscribers.push(room.subscribe(rate).0);
    }
}

/// A subscriber that keeps up and compares every snapshot.
struct Watcher {
    subscriber: Subscriber,
    stream: SnapshotStream,
}

impl Watcher {
    fn new(room: &mut Room) -> Watcher {
        let (subscriber, keyframe) = room.subscribe(Rate::Full);
        let mut watcher = Watcher { subscriber, stream: SnapshotStream::default() };
        watcher.take(&keyframe);
        watcher
    }

    fn take(&mut self, bytes: &[u8]) {
        let Ok(ServerMessage::Snapshot(coded)) = ServerMessage::decode(bytes) else {
            panic!("no snapshot")
        };
        self.stream.decode(&coded).expect("a readable snapshot");
    }

    fn look(&mut self, room: &Room, seed: u64) {
        if let Some(bytes) = room.message(&self.subscriber).cloned() {
            self.take(&bytes);
            let newest = self.stream.newest().expect("a snapshot was read");
            assert_eq!(&**newest, room.snapshot(), "seed {seed}");
        }
    }
}

fn troubled(seed: u64) -> Vec<u64> {
    let mut play = Play::new(seed);
    let mut trouble = Trouble { rng: Rng::new(seed, 2), subscribers: Vec::new() };
    let mut watcher = Watcher::new(&mut play.room);
    let tick = |_| {
        for _ in 0..trouble.rng.below(12) {
            trouble.strike(&mut play.room, play.seq);
        }
        play.inputs();
        for _ in 0..trouble.rng.below(4) {
            trouble.strike(&mut play.room, play.seq);
        }
        play.room.tick();
        watcher.look(&play.room, seed);
        play.room.game().hash()
    };
    (0..TICKS).map(tick).collect()
}

#[test]
fn two_players_have_the_same_game_whatever_happens_around_them() {
    for seed in 0..SEEDS {
        let (quiet, troubled) = (quiet(seed), troubled(seed));
        let parted = quiet.iter().zip(&troubled).position(|(a, b)| a != b);
        assert_eq!(parted, None, "seed {seed}: tick after which the games part");
    }
}
