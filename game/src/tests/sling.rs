//! Tests the sling and breakable bodies, as the chapter's slingshot project suggests (D3).

use super::*;
use crate::rules::{RoundPhase, sling_path};
use crate::side::Side;

/// Ticks of the countdown, plus one.
const START: u32 = 181;

/// Plays a single-player game until the round has begun.
fn begun(game: &mut Game) {
    game.join(Seat(0));
    (0..START).for_each(|_| game.tick(&[]));
    assert_eq!(phase(game), RoundPhase::Running);
}

fn phase(game: &Game) -> RoundPhase {
    game.round().expect("a round").phase
}

fn start(game: &Game) -> Vec2 {
    let sling = game.scene.sling.expect("a sling");
    game.scene.bodies[sling.ball].def.position
}

fn ball(game: &Game) -> Option<BodyId> {
    game.roster.placed[game.scene.sling.expect("a sling").ball]
}

fn input(fires: bool, pointer: Vec2) -> [(Seat, Input); 1] {
    let buttons = if fires { Buttons::FIRE } else { Buttons::default() };
    [(Seat(0), Input::new(buttons, Some(pointer)))]
}

/// Grabs the ball, pulls it this far over three ticks, and releases it.
fn shoot(game: &mut Game, pull: Vec2) {
    let at = start(game);
    game.tick(&input(false, at));
    for part in [0.0, 0.5, 1.0] {
        game.tick(&input(true, at + pull * part));
    }
    game.tick(&input(false, at + pull));
}

/// Plays until the ball is back in the sling, or the round is over.
fn finish_shot(game: &mut Game) {
    for _ in 0..700 {
        let sling = game.round().expect("a round").sling.expect("a sling");
        if !sling.is_flying || phase(game) == RoundPhase::Over {
            return;
        }
        game.tick(&input(false, Vec2::ONE));
    }
    panic!("the shot has no end");
}

fn shots(game: &Game) -> u8 {
    game.round().expect("a round").sling.expect("a sling").shots
}

/// A sling in front of a single pot.
fn range(gravity: f32, pot: &str) -> Game {
    let text = format!(
        r#"
        title = "Range"
        size = [240, 135]
        gravity = [0, {gravity}]
        speed_max = 200
        tools = ["sling"]
        groups = ["ball", "pot"]
        pairs = [["ball", "pot"]]
        [round]
        task = "Break it"
        [[teams]]
        name = "crew"
        [sling]
        ball = "ball"
        [[bodies]]
        kind = "block"
        name = "ball"
        group = "ball"
        position = [60, 60]
        radius = 3
        [[bodies]]
        kind = "block"
        group = "pot"
        gravity_scale = 0
        radius = 4
        {pot}
        [[zones]]
        name = "pots"
        who = ["pot"]
        [[rules]]
        on = ["sling.spent", "pots"]
        end = "lose"
        [[rules]]
        breaks = "pot"
        score = 7
        to = "by"
        "#
    );
    let mut game = game_of(&text);
    begun(&mut game);
    game
}

fn score(game: &Game) -> i32 {
    game.round().expect("a round").teams[0].score
}

#[test]
fn the_preview_is_the_path_that_is_flown() {
    for pull in [Vec2::new(-12.0, -9.0), Vec2::new(-4.0, 0.0), Vec2::new(3.0, -19.0)] {
        let mut game = range(-50.0, "position = [20, 120]\nmass = 1");
        shoot(&mut game, pull);
        let preview = sling_path(&game.scene, pull, 90);
        for (tick, expected) in preview.iter().enumerate() {
            let at = game.world().position(ball(&game).expect("a ball in flight"));
            assert!(at.distance(*expected) < 0.01, "tick {tick}: {at} instead of {expected}");
            game.tick(&input(false, Vec2::ONE));
        }
        assert!(preview.len() > 60, "{} points", preview.len());
    }
}

#[test]
fn the_path_is_the_sum_of_its_steps() {
    let game = range(-50.0, "position = [20, 120]\nmass = 1");
    let (pull, dt) = (Vec2::new(-10.0, -10.0), 1.0 / 60.0);
    let parabola = |time: f32| {
        let from = start(&game) + pull;
        from - pull * 5.0 * time - Vec2::new(0.0, 25.0 * time * (time + dt))
    };
    for (n, at) in (1u8..).zip(sling_path(&game.scene, pull, 60)) {
        let expected = parabola(f32::from(n) * dt);
        assert!(at.distance(expected) < 0.01, "update {n}: {at} instead of {expected}");
    }
}

#[test]
fn the_same_pull_gives_the_same_result() {
    let shot = || {
        let mut game = built_in("slingshot", 3);
        begun(&mut game);
        shoot(&mut game, Vec2::new(-16.0, -9.0));
        finish_shot(&mut game);
        game.hash()
    };
    assert_eq!(shot(), shot());
}

#[test]
fn a_pull_of_nothing_shoots_nothing() {
    let mut game = range(-50.0, "position = [100, 60]\nmass = 1");
    for pull in [Vec2::ZERO, Vec2::new(-0.9, 0.0)] {
        shoot(&mut game, pull);
        game.tick(&[]);
        assert_eq!(shots(&game), 5, "{pull}");
        assert_eq!(game.world().position(ball(&game).expect("a ball")), start(&game));
    }
}

#[test]
fn only_a_press_near_the_ball_pulls_it() {
    let mut game = range(0.0, "position = [100, 60]\nmass = 1");
    let far = start(&game) + Vec2::new(-30.0, 0.0);
    game.tick(&input(false, far));
    game.tick(&input(true, far));
    game.tick(&input(true, start(&game) + Vec2::new(-10.0, 0.0)));
    assert_eq!(game.world().position(ball(&game).expect("a ball")), start(&game));
}

#[test]
fn a_pull_has_an_end() {
    let mut game = range(0.0, "position = [100, 60]\nmass = 1");
    let at = start(&game);
    game.tick(&input(true, at));
    game.tick(&input(true, at + Vec2::new(-50.0, 0.0)));
    let pulled = game.world().position(ball(&game).expect("a ball"));
    assert!((at.distance(pulled) - 20.0).abs() < 1e-4, "{pulled}");
}

#[test]
fn a_pot_breaks_above_its_strength_and_cracks_above_half_of_it() {
    // For two bodies of mass 1, the blow is half the speed, so a ball at 100 units/s gives 50.
    let cases = [(2.0, 15.0, false, false), (100.0, 15.0, true, false)];
    let near =
        [(100.0, 49.0, true, false), (100.0, 51.0, false, true), (100.0, 101.0, false, false)];
    for (speed, strength, breaks, cracks) in cases.into_iter().chain(near) {
        let pot = format!("position = [100, 60]\nmass = 1\nstrength = {strength}\npoints = 500");
        let mut game = range(0.0, &pot);
        let pot = game.roster.placed[1].expect("a pot");
        shoot(&mut game, Vec2::new(-speed / 5.0, 0.0));
        if speed > 10.0 {
            // Long enough for the two to meet, but not for the pot to leave the world.
            (0..60).for_each(|_| game.tick(&[]));
        } else {
            // Such a short pull would not launch the ball, so it is given this low speed directly.
            let ball = ball(&game).expect("a ball");
            game.world.set_position(ball, Vec2::new(92.0, 60.0));
            game.world.set_velocity(ball, Vec2::new(speed, 0.0));
            game.world.step();
        }
        let case = format!("{speed} against {strength}");
        assert_eq!(!game.world().contains(pot), breaks, "{case}");
        let cracked = game.round().expect("a round").cracked;
        assert_eq!(cracked.contains(&pot.index), cracks, "{case}");
        // Points for the pot plus those from the rule.
        assert_eq!(score(&game), if breaks { 507 } else { 0 }, "{case}");
    }
}

#[test]
fn bodies_go_only_by_a_blow_above_their_strength() {
    let mut game = built_in("slingshot", 1);
    begun(&mut game);
    let mut broken = 0;
    for pull in [Vec2::new(-19.0, -6.0), Vec2::new(-17.0, -10.0), Vec2::new(-14.0, -14.0)] {
        shoot(&mut game, pull);
        for _ in 0..600 {
            let before = game.clone();
            game.tick(&input(false, Vec2::ONE));
            let breakable = |id: BodyId| {
                let index = before.roster.placed.iter().position(|&placed| placed == Some(id))?;
                before.scene.bodies[index].breaks
            };
            for id in before.world().ids().filter(|&id| !game.world().contains(id)) {
                let Some(breaks) = breakable(id) else { continue };
                broken += 1;
                // Only after the step alone are the removed body's contacts still visible.
                let mut stepped = before.clone();
                stepped.world.step();
                let blow = |other: BodyId, closing: f32| {
                    let world = stepped.world();
                    closing / (world.inverse_mass(id) + world.inverse_mass(other))
                };
                let touches = stepped.world().touches().iter();
                let blows = touches.filter_map(|touch| match (touch.a == id, touch.b == id) {
                    (true, _) => Some(blow(touch.b, touch.closing)),
                    (_, true) => Some(blow(touch.a, touch.closing)),
                    _ => None,
                });
                assert!(blows.fold(0.0, max) > breaks.strength, "{id:?} broke for nothing");
            }
        }
    }
    assert!(broken > 2, "only {broken} broke");
}

/// Tries pulls in increasingly fine steps, each in a copy of the game, and returns the best one.
fn best_shot(game: &Game) -> Vec2 {
    let worth = |pull: Vec2| {
        let mut game = game.clone();
        shoot(&mut game, pull);
        finish_shot(&mut game);
        let won = !game.round().expect("a round").winners.is_empty();
        score(&game) + if won { 10_000 } else { 0 }
    };
    let slopes = (0..11u8).map(|step| 0.1 + 0.12 * f32::from(step));
    let pulls = slopes.flat_map(|slope| {
        [20.0, 18.5, 17.0].map(|length| Vec2::new(-1.0, -slope).normalize() * length)
    });
    pulls.max_by_key(|&pull| worth(pull)).expect("pulls")
}

#[test]
fn a_player_who_aims_wins_the_slingshot() {
    let mut game = built_in("slingshot", 1);
    begun(&mut game);
    while phase(&game) == RoundPhase::Running {
        let pull = best_shot(&game);
        shoot(&mut game, pull);
        finish_shot(&mut game);
    }
    let round = game.round().expect("a round");
    assert_eq!(round.winners, [Side::Team(0)], "{:?}", round.teams);
    let stars = game.scene.rules.round.as_ref().and_then(|round| round.stars).expect("stars");
    let score = round.teams[0].score;
    assert!(score >= stars[2], "{score} points, {} shots left", shots(&game));
}

#[test]
fn five_shots_into_the_sky_lose_the_slingshot() {
    let mut game = built_in("slingshot", 1);
    begun(&mut game);
    for left in (0..5).rev() {
        shoot(&mut game, Vec2::new(0.0, -18.0));
        assert_eq!(shots(&game), left);
        finish_shot(&mut game);
    }
    game.tick(&[]);
    assert_eq!(phase(&game), RoundPhase::Over);
    assert!(game.round().expect("a round").winners.is_empty());
}

#[test]
fn who_does_nothing_loses_the_slingshot_at_its_time() {
    let mut game = built_in("slingshot", 1);
    begun(&mut game);
    let time = game.scene.rules.round.as_ref().and_then(|round| round.time).expect("a time");
    (1..time - 1).for_each(|_| game.tick(&[]));
    assert_eq!(phase(&game), RoundPhase::Running);
    game.tick(&[]);
    assert_eq!(phase(&game), RoundPhase::Over);
    assert!(game.round().expect("a round").winners.is_empty());
    let blocks = game.scene.bodies.len();
    assert_eq!(game.roster.placed.iter().flatten().count(), blocks, "nothing broke by itself");
}

#[test]
fn a_sling_is_restored_in_mid_pull_and_in_flight() {
    let mut game = built_in("slingshot", 2);
    begun(&mut game);
    let at = start(&game);
    let pull = Vec2::new(-16.0, -9.0);
    let mut copy: Option<Game> = None;
    for tick in 0..400u32 {
        let input = input((5..20).contains(&tick), if tick < 6 { at } else { at + pull });
        game.tick(&input);
        if let Some(copy) = &mut copy {
            copy.tick(&input);
            assert_eq!(copy.hash(), game.hash(), "tick {tick}");
        }
        if tick == 10 || tick == 60 || tick == 200 {
            copy = Some(Game::restore(Arc::clone(&game.scene), &game.save()).expect("a state"));
        }
    }
    assert!(shots(&game) == 4);
}

#[test]
fn silence_of_the_connection_shoots_nothing() {
    let mut game = range(0.0, "position = [20, 120]\nmass = 1");
    let (at, pull) = (start(&game), Vec2::new(-12.0, -4.0));
    let sling = |game: &Game| game.round().expect("a round").sling.expect("a sling");
    game.tick(&input(false, at));
    (0..3).for_each(|_| game.tick(&input(true, at + pull)));
    let pulled = game.world().position(ball(&game).expect("a ball"));
    let before = shots(&game);
    idle(&mut game, 40);
    assert_eq!(game.world().position(ball(&game).expect("a ball")), pulled);
    assert_eq!((sling(&game).is_flying, shots(&game)), (false, before));
    game.tick(&input(true, at + pull));
    game.tick(&input(false, at + pull));
    assert_eq!((sling(&game).is_flying, shots(&game)), (true, before - 1), "let go on purpose");
}

#[test]
fn another_player_may_take_the_ball_from_one_who_is_away() {
    let mut game = range(0.0, "position = [20, 120]\nmass = 1");
    game.join(Seat(1));
    let at = start(&game);
    let of_bob = |fires: bool, pointer: Vec2| [(Seat(1), input(fires, pointer)[0].1)];
    game.tick(&input(false, at));
    game.tick(&input(true, at));
    let both = [input(true, at - Vec2::X)[0], of_bob(true, at + Vec2::Y)[0]];
    game.tick(&both);
    game.tick(&both);
    let place = |game: &Game| game.world().position(ball(game).expect("a ball"));
    assert_eq!(place(&game), at - Vec2::X, "the first one pulls");
    game.tick(&of_bob(false, at));
    game.tick(&of_bob(true, at + Vec2::Y));
    assert_eq!(place(&game), at + Vec2::Y, "the first one is away");
}

#[test]
fn a_sling_whose_shooter_leaves_is_free_again() {
    let mut game = range(0.0, "position = [100, 60]\nmass = 1");
    game.join(Seat(1));
    let at = start(&game);
    game.tick(&input(true, at));
    game.tick(&input(true, at + Vec2::new(-10.0, 0.0)));
    game.leave(Seat(0));
    game.tick(&[]);
    assert_eq!(game.world().position(ball(&game).expect("a ball")), at);
    let buttons = Buttons::FIRE;
    game.tick(&[(Seat(1), Input::new(buttons, Some(at)))]);
    let pointer = Some(at + Vec2::new(-10.0, 0.0));
    game.tick(&[(Seat(1), Input::new(buttons, pointer))]);
    game.tick(&[(Seat(1), Input::new(Buttons::default(), pointer))]);
    assert_eq!(shots(&game), 4);
}

#[test]
fn a_ball_that_is_taken_from_the_sling_comes_back() {
    let mut game = range(0.0, "position = [100, 60]\nmass = 1");
    let taken = ball(&game).expect("a ball");
    game.roster.remove(&mut game.world, taken);
    game.tick(&[]);
    let there = ball(&game).expect("another ball");
    assert_eq!(game.world().position(there), start(&game));
    assert_eq!(shots(&game), 5);
}
