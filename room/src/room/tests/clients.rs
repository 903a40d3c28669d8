//! Tests of the messages to clients: at every rate, from the start or later, in every built-in scene, and reproducible.

use super::*;
use jostle_protocol::limits::POINTER_MAX;
use jostle_sim::Rng;

const ROOM_TICKS: u32 = 400;

/// A built-in scene with some players who press keys and point at random.
struct Play {
    room: Room,
    seats: Vec<Seat>,
    rng: Rng,
    seq: u32,
    input: Vec<Input>,
}

impl Play {
    fn new(scene: &Scene, players: u16) -> Play {
        let mut room = Room::new("oak", Arc::new(scene.clone()), 3);
        let players = players.min(scene.players_max);
        let seats: Vec<_> = (0..players).map(|_| join(&mut room, "Ann")).collect();
        let input = vec![Input::default(); seats.len()];
        Play { room, seats, rng: Rng::new(11, 0), seq: 0, input }
    }

    fn tick(&mut self) {
        self.seq += 1;
        let size = self.room.scene().size;
        for (seat, input) in self.seats.iter().zip(&mut self.input) {
            if self.rng.below(12) == 0 {
                // Clearing must be rare, or nothing would pile up.
                let left_out = if self.rng.below(8) > 0 { Buttons::CLEAR.0 } else { 0 };
                let buttons = Buttons(self.rng.next_u32() as u16 & Buttons::ALL.0 & !left_out);
                *input = input.with_buttons(buttons);
            }
            if self.rng.below(5) == 0 {
                let point = Vec2::new(self.rng.range(0.0, size.x), self.rng.range(0.0, size.y));
                let pointer = match self.rng.below(12) {
                    0 => None,
                    1 => Some(Vec2::new(POINTER_MAX, -POINTER_MAX)),
                    _ => Some(point),
                };
                *input = Input::new(input.buttons(), pointer);
            }
            self.room.input(*seat, self.seq, *input);
        }
        self.room.tick();
    }
}

#[test]
fn every_client_of_every_scene_sees_the_game_and_each_event_once() {
    for scene in Scene::built_in() {
        let mut play = Play::new(&scene, 4);
        let mut clients = Rate::ALL.map(Client::at);
        let mut late = Client::default();
        clients.iter_mut().for_each(|client| client.receive(&mut play.room));
        for tick in 1..=ROOM_TICKS {
            play.tick();
            clients.iter_mut().for_each(|client| client.receive(&mut play.room));
            if tick > ROOM_TICKS / 2 {
                late.receive(&mut play.room);
            }
        }
        let [full, third, twelfth] = &clients;
        assert!(full.events.len() >= play.seats.len(), "{}: nothing happened", scene.name);
        assert!(full.events.is_sorted_by_key(|event| event.tick));
        for client in [third, twelfth] {
            assert!(client.bytes < full.bytes, "{}", scene.name);
            assert!(full.events.starts_with(&client.events), "{}", scene.name);
            let behind = &full.events[client.events.len()..];
            let told = client.held().tick;
            assert!(behind.iter().all(|event| event.tick > told), "{}", scene.name);
        }
        assert!(full.events.ends_with(&late.events), "{}", scene.name);
    }
}

#[test]
fn clients_receive_the_events_that_the_game_reports() {
    let scene = Scene::parse("yard.toml", YARD).unwrap();
    let mut play = Play::new(&scene, 3);
    let mut client = Client::default();
    client.receive(&mut play.room);
    let mut reported = Vec::new();
    for _ in 0..ROOM_TICKS {
        play.tick();
        let tick = play.room.game().tick_count();
        reported.extend(play.room.game().events().iter().map(|&event| TimedEvent { tick, event }));
        client.receive(&mut play.room);
    }
    assert_eq!(client.events, reported);
}

#[test]
fn the_same_calls_give_the_same_hashes_and_bytes() {
    let arena = &Scene::built_in()[0];
    let record = || {
        let mut play = Play::new(arena, 6);
        let (mut record, mut subscriber) = (Vec::new(), None);
        for tick in 0..ROOM_TICKS {
            play.tick();
            match tick {
                100 => play.room.disconnect(play.seats[1]),
                150 => play.room.leave(play.seats[2]),
                200 => drop(play.room.join(look("Eve"), None)),
                _ => {}
            }
            let bytes = Rate::ALL.map(|rate| play.room.subscribe(rate).1);
            let subscriber = *subscriber.get_or_insert_with(|| play.room.subscribe(Rate::Full).0);
            record.push((play.room.game().hash(), bytes, play.room.message(&subscriber).cloned()));
        }
        record
    };
    assert!(record() == record());
}
