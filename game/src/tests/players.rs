//! Tests how players join and leave, invalid input, and that games are reproducible.

use super::*;
use jostle_sim::Rng;

#[test]
fn joins_and_leaves_are_reported_by_the_next_tick() {
    let mut game = floor_with("");
    game.join(Seat(5));
    game.join(Seat(2));
    assert!(game.events().is_empty());
    game.tick(&[]);
    assert_eq!(game.events(), [Event::Joined(Seat(5)), Event::Joined(Seat(2))]);
    let seats: Vec<Seat> = game.players().map(|player| player.seat).collect();
    assert_eq!(seats, [Seat(2), Seat(5)]);
    game.leave(Seat(5));
    game.tick(&[]);
    assert_eq!(game.events(), [Event::Left(Seat(5))]);
    assert_eq!(all(&game, Kind::Hero).len(), 1);
}

#[test]
fn leaving_removes_hero_and_packs_and_allows_a_return() {
    let mut game = floor_with("");
    game.join(FIRST);
    game.join(Seat(1));
    game.tick(&[
        (FIRST, input(&[Buttons::FIRE], at(300.0, 150.0))),
        (Seat(1), input(&[Buttons::FIRE], at(320.0, 150.0))),
    ]);
    assert_eq!(all(&game, Kind::Pack).len(), 2);
    game.leave(FIRST);
    let owners: Vec<_> = game.bodies().filter_map(|body| body.owner).collect();
    assert_eq!(owners, [Seat(1), Seat(1)]);
    game.join(FIRST);
    game.tick(&[]);
    assert_eq!(all(&game, Kind::Hero).len(), 2);
}

#[test]
#[should_panic(expected = "seat 3 is taken")]
fn a_seat_is_taken_once() {
    let mut game = floor_with("");
    game.join(Seat(3));
    game.join(Seat(3));
}

#[test]
fn foul_pointers_and_unknown_seats_are_ignored() {
    let mut game = floor_with("");
    game.join(FIRST);
    let used = [Buttons::FIRE, Buttons::MAKE, Buttons::HOLD];
    let foul = [f32::NAN, f32::INFINITY, -1.0, 1e30];
    for value in foul {
        play(&mut game, &used, at(value, 50.0));
        play(&mut game, &[], at(50.0, value));
        play(&mut game, &used, at(50.0, value));
        play(&mut game, &[], None);
    }
    game.tick(&[(Seat(9), input(&used, at(50.0, 50.0))), (Seat(200), Input::default())]);
    assert_eq!(game.bodies().count(), 2, "floor and hero");
    assert_eq!(game.players().next().expect("a player").pointer, None);
    play(&mut game, &[], at(50.0, 60.0));
    play(&mut game, &[], None);
    let pointer = game.players().next().expect("a player").pointer;
    assert_eq!(pointer, Some([50 * 64, 60 * 64]), "the last one is kept");
}

#[test]
fn a_full_world_still_has_room_for_heroes() {
    let text = FLOOR.replace("limits = { dumb = 250 }", "limits = { bodies = 20, players = 4 }");
    let mut game = game_of(&text);
    game.join(FIRST);
    for tick in 0..60 {
        play(&mut game, &[Buttons::MAKE], at(20.0 + 5.0 * tick as f32, 150.0));
    }
    assert_eq!(game.world().body_count(), 17, "three heroes may yet come");
    for seat in 1..4 {
        game.join(Seat(seat));
    }
    idle(&mut game, 60);
    assert_eq!(all(&game, Kind::Hero).len(), 4);
}

/// Inputs of several players who press buttons and point at random.
pub(super) fn busy_inputs(game: &Game, rng: &mut Rng) -> Vec<(Seat, Input)> {
    let size = game.scene().size;
    let mut inputs = Vec::new();
    for player in game.players() {
        let buttons = Buttons((rng.next_u32() & rng.next_u32()) as u16 & Buttons::ALL.0);
        let pointer = Vec2::new(rng.unit() * size.x, rng.unit() * size.y);
        inputs.push((player.seat, Input::new(buttons, Some(pointer))));
    }
    inputs
}

/// Plays a tick with [`busy_inputs`].
pub(super) fn busy_tick(game: &mut Game, rng: &mut Rng) {
    let inputs = busy_inputs(game, rng);
    game.tick(&inputs);
}

fn hashes(seed: u64) -> Vec<u64> {
    let mut game = built_in("arena", seed);
    let mut rng = Rng::new(11, 1);
    let mut hashes = vec![game.hash()];
    for tick in 0..240 {
        if tick % 40 == 0 {
            game.join(Seat(tick as u16 / 4));
        }
        if tick == 150 {
            game.leave(Seat(10));
        }
        busy_tick(&mut game, &mut rng);
        hashes.push(game.hash());
    }
    hashes
}

#[test]
fn the_same_scene_seed_and_inputs_give_the_same_hashes() {
    let (one, two) = (hashes(4), hashes(4));
    assert_eq!(one, two);
    let mut distinct = one.clone();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), one.len(), "every tick changes the state");
    assert_ne!(one[0], hashes(5)[0], "another seed is another game");
}

#[test]
fn a_copy_plays_on_like_the_original() {
    let mut game = built_in("arena", 9);
    game.join(FIRST);
    let mut rng = Rng::new(3, 3);
    for _ in 0..100 {
        busy_tick(&mut game, &mut rng);
    }
    let (mut copy, mut copied_rng) = (game.clone(), rng.clone());
    for _ in 0..100 {
        busy_tick(&mut game, &mut rng);
        busy_tick(&mut copy, &mut copied_rng);
        assert_eq!(game.hash(), copy.hash());
    }
}

#[test]
fn the_state_of_the_rules_is_part_of_the_hash() {
    let mut game = floor_with("");
    game.join(FIRST);
    let mut other = game.clone();
    play(&mut game, &[], at(10.0, 10.0));
    play(&mut other, &[], at(10.0, 11.0));
    assert_eq!(game.world().hash(), other.world().hash());
    assert_ne!(game.hash(), other.hash(), "the pointer decides where a held body goes");
}
