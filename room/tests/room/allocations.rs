//! The allocations that a room without joins and leaves makes, counted on its thread. There must be none, whether its
//! players see the whole world or only part of it.

use allocation_counter::measure;
use jostle_game::{Buttons, Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_room::{Rate, Room, Subscriber};
use jostle_sim::Vec2;
use std::sync::Arc;

const PLAYERS: u8 = 16;
/// Number of ticks until every list has reached its final capacity.
const WARM_UP_TICKS: u32 = 2000;
const TICKS: u32 = 300;

/// Players who walk back and forth and point.
fn input(seat: u8, tick: u32) -> Input {
    let left = (tick / 60 + u32::from(seat)).is_multiple_of(2);
    let buttons = if left { Buttons::LEFT } else { Buttons::RIGHT };
    Input::new(buttons, Some(Vec2::new((tick % 200) as f32, 40.0)))
}

/// The arena, with its players and their subscribers.
struct Full {
    room: Room,
    subscribers: Vec<Subscriber>,
    tick: u32,
}

impl Full {
    /// Creates the arena; `more` is prepended to the scene file.
    fn new(more: &str) -> Full {
        let mut scenes = Scene::built_in().into_iter();
        let arena = scenes.find(|scene| scene.name == "arena").expect("a built-in scene");
        let text = format!("{more}{}", arena.source);
        let arena = Scene::parse("arena.toml", &text).unwrap_or_else(|error| panic!("{error}"));
        let mut room = Room::new("arena", Arc::new(arena), 1);
        for seat in 0..PLAYERS {
            let look = Appearance::new(&format!("P{seat}"), seat % 8).expect("a name");
            room.join(look, None).expect("a seat");
        }
        let begin = |seat: u8| room.subscribe_view(Seat(seat.into()), Rate::Full).0;
        let subscribers = (0..PLAYERS).map(begin).collect();
        Full { room, subscribers, tick: 0 }
    }

    fn play(&mut self) {
        self.tick += 1;
        for seat in 0..PLAYERS {
            assert!(self.room.input(Seat(seat.into()), self.tick, input(seat, self.tick)));
        }
        self.room.tick();
        let messages =
            self.subscribers.iter().filter_map(|subscriber| self.room.message(subscriber));
        let sent: usize = messages.map(|message| message.len()).sum();
        assert!(sent > 0, "tick {}: something always moves", self.tick);
    }

    /// Number of allocations in [`TICKS`] after the warm-up.
    fn counted(mut self) -> u64 {
        (0..WARM_UP_TICKS).for_each(|_| self.play());
        measure(|| (0..TICKS).for_each(|_| self.play())).count_total
    }
}

#[test]
fn a_steady_tick_allocates_nothing() {
    assert_eq!(Full::new("").counted(), 0, "allocations in {TICKS} ticks");
}

#[test]
fn a_steady_tick_allocates_nothing_for_cameras_that_follow_their_players() {
    let full = Full::new("camera = { follow = 40 }\n");
    assert_eq!(full.counted(), 0, "allocations in {TICKS} ticks");
}
