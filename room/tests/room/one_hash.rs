//! Checks that a game's hashes depend only on its scene, its seed and its inputs, and not on other rooms, threads,
//! memory addresses or the order in which bodies were removed.

use jostle_game::{Buttons, Game, Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_room::Room;
use jostle_sim::Rng;
use jostle_sim::WorldSettings;
use jostle_sim::{BodyDef, Vec2, World};
use std::sync::Arc;
use std::thread;

const TICKS: u32 = 200;

fn scenes() -> Vec<Arc<Scene>> {
    Scene::built_in().into_iter().map(Arc::new).collect()
}

/// A room with one player and the player's inputs.
struct Busy {
    room: Room,
    rng: Rng,
    hashes: Vec<u64>,
}

impl Busy {
    fn new(scene: &Arc<Scene>, seed: u64) -> Busy {
        let mut room = Room::new("busy", Arc::clone(scene), seed);
        room.join(Appearance::new("Ann", 0).expect("a name"), None).expect("a free seat");
        Busy { room, rng: Rng::new(seed, 5), hashes: Vec::new() }
    }

    fn tick(&mut self) {
        let size = self.room.scene().size;
        let buttons = Buttons((self.rng.next_u32() & self.rng.next_u32()) as u16);
        let pointer = Vec2::new(self.rng.range(0.0, size.x), self.rng.range(0.0, size.y));
        let input = Input::new(buttons, Some(pointer));
        self.room.input(Seat(0), self.hashes.len() as u32 + 1, input);
        self.room.tick();
        self.hashes.push(self.room.game().hash());
    }

    fn played(mut self) -> Vec<u64> {
        (0..TICKS).for_each(|_| self.tick());
        self.hashes
    }
}

/// Plays each scene alone, one after the other.
fn alone() -> Vec<Vec<u64>> {
    scenes().iter().map(|scene| Busy::new(scene, 8).played()).collect()
}

#[test]
fn the_order_in_which_rooms_run_does_not_matter() {
    let mut rooms: Vec<Busy> = scenes().iter().map(|scene| Busy::new(scene, 8)).collect();
    let mut rng = Rng::new(1, 1);
    while rooms.iter().any(|busy| busy.hashes.len() < TICKS as usize) {
        let one = rng.below(rooms.len() as u32) as usize;
        if rooms[one].hashes.len() < TICKS as usize {
            rooms[one].tick();
        }
    }
    let hashes: Vec<_> = rooms.into_iter().map(|busy| busy.hashes).collect();
    assert_eq!(hashes, alone());
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the test is about threads")]
fn the_number_of_threads_does_not_matter() {
    let threads: Vec<_> = scenes()
        .into_iter()
        .map(|scene| thread::spawn(move || Busy::new(&scene, 8).played()))
        .collect();
    let hashes: Vec<_> = threads.into_iter().map(|thread| thread.join().expect("a game")).collect();
    assert_eq!(hashes, alone());
}

#[test]
fn memory_addresses_do_not_matter() {
    let mut rng = Rng::new(2, 1);
    let mut litter: Vec<Vec<u8>> = Vec::new();
    let scattered: Vec<_> = scenes()
        .iter()
        .map(|scene| {
            let mut busy = Busy::new(scene, 8);
            for _ in 0..TICKS {
                litter.push(vec![1; 1 + rng.below(5000) as usize]);
                if litter.len() > 50 {
                    litter.swap_remove(rng.below(50) as usize);
                }
                // A copy has a different address, and the old memory is reused.
                let game: Game = busy.room.game().clone();
                assert_eq!(game.hash(), busy.room.game().hash());
                busy.tick();
            }
            busy.hashes
        })
        .collect();
    assert_eq!(scattered, alone());
}

/// Bodies may be removed in any order; their slots are reused in the same order.
#[test]
fn the_order_of_removals_does_not_matter() {
    let hashes = [[1, 4, 7, 8], [8, 7, 4, 1], [4, 8, 1, 7]].map(|removals| {
        let mut world = World::new(WorldSettings::default());
        let at = |place: u32| BodyDef {
            position: Vec2::new((place % 4) as f32 * 1.9, (place / 4) as f32 * 1.9),
            ..BodyDef::default()
        };
        let ids: Vec<_> = (0..10).map(|place| world.add(&at(place)).expect("room")).collect();
        (0..20).for_each(|_| world.step());
        removals.into_iter().for_each(|place| assert!(world.remove(ids[place])));
        for place in [20, 21, 22, 23] {
            world.add(&at(place)).expect("room");
        }
        (0..60).for_each(|_| world.step());
        world.hash()
    });
    assert_eq!(hashes, [hashes[0]; 3]);
}
