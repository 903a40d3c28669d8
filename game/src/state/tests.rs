//! Tests that a restored game continues like the original, in every scene and at every tick, that invalid bytes are
//! refused, and that the first difference is found.

use super::*;
use crate::{Input, Phase};
use glam::Vec2;
use jostle_sim::Conjugate;
use jostle_sim::{Motion, Solver};

/// Inputs of two busy players for a tick.
fn inputs(rng: &mut Rng, game: &Game) -> Vec<(Seat, Input)> {
    let size = game.scene().size;
    let seats = game.players().map(|player| player.seat);
    let mut input = || {
        // About a third of the buttons are down. V, which clears the marbles, is down less often.
        let mut buttons = (rng.next_u32() & rng.next_u32() | rng.next_u32() & 16) as u16;
        if rng.below(60) > 0 {
            buttons &= !Buttons::CLEAR.0;
        }
        let pointer = Vec2::new(rng.range(0.0, size.x), rng.range(0.0, size.y));
        Input::new(Buttons(buttons & Buttons::ALL.0), Some(pointer))
    };
    seats.map(|seat| (seat, input())).collect()
}

/// Two-player games of each shipped scene, with its own solver and with the conjugate one.
fn games() -> Vec<Game> {
    let solved = Scene::built_in().into_iter().filter(|scene| scene.world.solver.is_some());
    let conjugate = Some(Solver::Conjugate(Conjugate::default()));
    let again = solved.map(|mut scene| {
        scene.world.solver = conjugate;
        scene
    });
    let scenes = Scene::built_in().into_iter().chain(again);
    scenes
        .map(Arc::new)
        .map(|scene| {
            let mut game = Game::new(scene, 3);
            game.join(Seat(0));
            game.join(Seat(1));
            game
        })
        .collect()
}

/// Returns whether the game's scene has hundreds or thousands of bodies. Ticks and states of such a scene take many
/// times as long but run the same code, so the tests run fewer of them.
fn is_large(game: &Game) -> bool {
    game.world().body_count() > 200
}

fn again(game: &Game) -> Game {
    Game::restore(Arc::clone(game.scene()), &game.save()).expect("what was saved")
}

#[test]
fn a_game_saved_and_restored_every_tick_plays_like_the_original() {
    for mut plain in games() {
        let mut rng = Rng::new(1, 9);
        let mut kept = again(&plain);
        let ticks = if is_large(&plain) { 60 } else { 240 };
        for tick in 0..ticks {
            if tick == ticks / 2 {
                [&mut plain, &mut kept].into_iter().for_each(|game| game.leave(Seat(1)));
            }
            let inputs = inputs(&mut rng, &plain);
            plain.tick(&inputs);
            kept.tick(&inputs);
            assert_eq!(plain.first_difference(&kept), None, "{} {tick}", plain.scene().name);
            assert_eq!(plain.events(), kept.events(), "{} {tick}", plain.scene().name);
            assert_eq!(plain.hash(), kept.hash());
            kept = again(&kept);
        }
    }
}

#[test]
fn a_saved_game_is_small() {
    for mut game in games() {
        let mut rng = Rng::new(2, 9);
        for _ in 0..300 {
            let inputs = inputs(&mut rng, &game);
            game.tick(&inputs);
            let particles = game.world().particles();
            let aside = 25 * particles.len()
                + 41 * particles.emitter_count()
                + 300
                + 64 * game.players().count();
            let bodies = game.world().body_count() + game.scene().bodies.len();
            let allowed = 64 * bodies + 8 * game.world().touches().len() + aside;
            let bytes = game.save().len();
            assert!(bytes <= allowed, "{}: {bytes} of {allowed}", game.scene().name);
        }
    }
}

#[test]
fn wrong_bytes_are_refused_and_never_panic() {
    let mut rng = Rng::new(5, 9);
    for mut game in games() {
        for _ in 0..60 {
            let inputs = inputs(&mut rng, &game);
            game.tick(&inputs);
        }
        let whole = game.save();
        let every = if is_large(&game) { 7 } else { 1 };
        for length in (0..whole.len().min(2000)).step_by(every) {
            assert!(Game::restore(Arc::clone(game.scene()), &whole[..length]).is_err());
        }
        let flipped = if is_large(&game) { 200 } else { 1000 };
        for _ in 0..flipped {
            let mut bytes = whole.clone();
            let place = rng.below(bytes.len() as u32) as usize;
            bytes[place] ^= 1 << rng.below(8);
            // If a state is accepted, it can be played.
            if let Ok(mut other) = Game::restore(Arc::clone(game.scene()), &bytes) {
                let inputs = inputs(&mut rng, &other);
                other.tick(&inputs);
            }
        }
        let mut longer = whole;
        longer.push(0);
        assert!(Game::restore(Arc::clone(game.scene()), &longer).is_err());
    }
}

#[test]
fn the_first_difference_names_phase_body_and_field() {
    let mut game = games().remove(0);
    game.tick(&[]);
    let body = game.world().ids().find(|&id| game.world().motion(id) == Motion::Dynamic);
    let body = body.expect("the arena has loose bodies");
    for planted in [Phase::Inputs, Phase::Integrate, Phase::Relax, Phase::Events] {
        let (mut one, mut other) = (game.clone(), game.clone());
        let mut trail = Vec::new();
        one.tick_watched(&[], &mut |phase, world| trail.push((phase, world.clone())));
        let mut found = None;
        let mut trail = trail.into_iter();
        other.tick_watched(&[], &mut |phase, world| {
            if phase == planted {
                let velocity = world.velocity(body);
                let nudged = f32::from_bits(velocity.x.to_bits() ^ 1);
                world.set_velocity(body, Vec2::new(nudged, velocity.y));
            }
            let (_, twin) = trail.next().expect("as many phases");
            let difference = twin.first_difference(world).map(|difference| (phase, difference));
            found = found.or(difference);
        });
        let (phase, difference) = found.expect("a difference");
        assert_eq!(phase, planted);
        assert_eq!((difference.subject, difference.field), (Subject::Body(body), "velocity.x"));
    }
}

#[test]
fn a_subject_missing_from_one_game_is_named() {
    let lives = |list: &mut StateDump, index| {
        list.subject(Subject::Body(BodyId { index, generation: 0 }));
        list.bits("life", 1);
    };
    let (mut list, mut longer) = (StateDump::default(), StateDump::default());
    lives(&mut list, 1);
    (1..=2).for_each(|index| lives(&mut longer, index));
    assert_eq!(list.first_difference(&list), None);
    let found = list.first_difference(&longer).expect("a difference");
    assert_eq!(found.to_string(), "body 2.0 life: only the second has it");
    let found = longer.first_difference(&list).expect("a difference");
    assert_eq!(found.to_string(), "body 2.0 life: only the first has it");
    let mut other = StateDump::default();
    other.subject(Subject::Body(BodyId { index: 1, generation: 0 }));
    other.number("velocity.x", 1.0, f32::is_finite);
    assert!(list.first_difference(&other).is_some());
}
