//! Allocations of a room in which nobody comes or goes, counted on its thread. The bound only goes
//! down: the goal is none.

use allocation_counter::measure;
use jostle_protocol::Appearance;
use jostle_room::{Rate, Reader, Room};
use jostle_sim::{Buttons, Input, Scene, Seat, Vec2};
use std::sync::Arc;

const PLAYERS: u8 = 16;
/// Until every list has the length that it keeps.
const WARM_UP_TICKS: u32 = 900;
const TICKS: u32 = 300;
/// Allocations a tick, 11.7 when this was written: six of the game, and of the stream the message's
/// moves, the message, its shared handle, and the lists that are compared for it.
const TICK_MAX: u64 = 12;

/// Players who walk to and fro, and point somewhere.
fn input(seat: u8, tick: u32) -> Input {
    let left = (tick / 60 + u32::from(seat)).is_multiple_of(2);
    let buttons = if left { Buttons::LEFT } else { Buttons::RIGHT };
    Input { buttons, pointer: Some(Vec2::new((tick % 200) as f32, 40.0)) }
}

fn full_arena() -> Room {
    let mut scenes = Scene::built_in().into_iter();
    let arena = scenes.find(|scene| scene.name == "arena").expect("a built-in scene");
    let mut room = Room::new("arena", Arc::new(arena), 1);
    for seat in 0..PLAYERS {
        let look = Appearance::new(&format!("P{seat}"), seat % 8).expect("a name");
        room.join(look, None).expect("a seat");
    }
    room
}

#[test]
fn a_steady_tick_allocates_next_to_nothing() {
    let mut room = full_arena();
    let readers: Vec<Reader> = (0..PLAYERS).map(|_| room.begin(Rate::Full).0).collect();
    let mut tick = 0;
    let mut play = || {
        tick += 1;
        for seat in 0..PLAYERS {
            assert!(room.input(Seat(seat.into()), tick, input(seat, tick)));
        }
        room.tick();
        let sent: usize = readers.iter().filter_map(|r| room.message(r)).map(|m| m.len()).sum();
        assert!(sent > 0, "tick {tick}: something always moves");
    };
    (0..WARM_UP_TICKS).for_each(|_| play());
    let counted = measure(|| (0..TICKS).for_each(|_| play())).count_total;
    let allowed = TICK_MAX * u64::from(TICKS);
    assert!(counted <= allowed, "{counted} allocations in {TICKS} ticks; allowed: {allowed}");
}
