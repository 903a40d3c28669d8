//! Tests that the structures in shipped scenes that use the conjugate solver stand, bear weight and sleep as intended.

use super::*;
use crate::scene::Location;
use jostle_sim::{Motion, World};

/// Plays ticks in which a single player holds down this button.
fn steer(game: &mut Game, ticks: u32, button: Buttons) {
    (0..ticks).for_each(|_| play(game, &[button], None));
}

fn positions(game: &Game, ids: &[BodyId]) -> Vec<Vec2> {
    ids.iter().map(|&id| game.world().position(id)).collect()
}

/// Distance of each body from its earlier position.
fn moved(game: &Game, ids: &[BodyId], before: &[Vec2]) -> Vec<f32> {
    let pairs = ids.iter().zip(before);
    pairs.map(|(&id, &place)| (game.world().position(id) - place).length()).collect()
}

fn asleep(game: &Game, ids: &[BodyId]) -> usize {
    ids.iter().filter(|&&id| game.world().is_asleep(id)).count()
}

#[test]
fn the_tower_stands_still_for_ten_minutes() {
    let mut game = built_in("tower", 1);
    game.join(FIRST);
    let pieces = all(&game, Kind::Block);
    assert_eq!(pieces.len(), 300);
    let before = positions(&game, &pieces);
    idle(&mut game, 60);
    assert_eq!(asleep(&game, &pieces), 300, "after a second");
    idle(&mut game, 10 * 60 * 60 - 60);
    let furthest = moved(&game, &pieces, &before).into_iter().fold(0.0, max);
    assert!(furthest <= 0.01, "moved by {furthest}");
    assert_eq!(asleep(&game, &pieces), 300, "at the end");
}

#[test]
fn the_tower_falls_when_a_ball_is_pulled_out_of_its_lowest_storey() {
    let mut game = built_in("tower", 1);
    game.join(FIRST);
    idle(&mut game, 60);
    let pieces = all(&game, Kind::Block);
    let before = positions(&game, &pieces);
    let (ball, outside) = (Vec2::new(160.0, 9.0), Vec2::new(20.0, 30.0));
    for tick in 0..60 {
        play(&mut game, &[Buttons::HOLD], Some(ball.lerp(outside, tick as f32 / 60.0)));
    }
    idle(&mut game, 300);
    let fallen = moved(&game, &pieces, &before).iter().filter(|&&way| way > 1.0).count();
    assert!(fallen >= 60, "{fallen} pieces fell");
}

#[test]
fn a_hero_that_flies_into_the_tower_knocks_pieces_off() {
    let mut game = built_in("tower", 1);
    game.join(FIRST);
    let pieces = all(&game, Kind::Block);
    let before = positions(&game, &pieces);
    for _ in 0..240 {
        play(&mut game, &[Buttons::RIGHT, Buttons::UP], None);
    }
    idle(&mut game, 300);
    let fallen = moved(&game, &pieces, &before).iter().filter(|&&way| way > 8.0).count();
    assert!(fallen >= 5, "{fallen} pieces fell");
}

/// Length of each spring of the scene, relative to its rest length.
fn stretches(game: &Game) -> Vec<f32> {
    let (world, placed) = (game.world(), &game.roster.placed);
    let position = |index: usize| world.position(placed[index].expect("a placed body"));
    let springs = game.scene().springs.iter().map(|spring| {
        let end = match spring.to {
            Location::Point(point) => point,
            Location::Body(index) => position(index),
        };
        (position(spring.body) - end).length() / spring.length
    });
    springs.collect()
}

fn weight(world: &World, ids: &[BodyId]) -> f32 {
    ids.iter().map(|&id| 50.0 / world.inverse_mass(id)).sum()
}

/// Depth to which a load sinks in the middle of a chain of 26 equal springs that spans a width of 208. The vertical
/// pull of both halves grows with the depth.
fn static_sag(load: f32, stiffness: f32) -> f32 {
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..50 {
        let sag: f32 = 0.5 * (low + high);
        let half = (104.0f32 * 104.0 + sag * sag).sqrt();
        let pull = 2.0 * stiffness * (half / 13.0 - 8.0) * sag / half;
        (low, high) = if pull < load { (sag, high) } else { (low, sag) };
    }
    low
}

/// The ball starts level with the cliffs, sinks to twice its resting depth, and swings. A suddenly released load
/// stretches a spring up to about twice as far as the same load at rest: 1.05 becomes 1.11.
#[test]
fn the_bridge_carries_a_ball_of_a_thousand_planks() {
    let mut game = built_in("bridge", 1);
    let bodies = game.bodies().filter(|body| game.world().motion(body.id) == Motion::Dynamic);
    let chain: Vec<BodyId> = bodies.map(|body| body.id).take(25).collect();
    let (ball, planks) = chain.split_first().expect("a ball and planks");
    let ratio = game.world().inverse_mass(planks[0]) / game.world().inverse_mass(*ball);
    assert!((ratio - 1000.0).abs() < 0.1, "{ratio}");
    // The ball swings for more than a minute, since the springs lose no more energy than their damping removes.
    for tick in 0..6000 {
        idle(&mut game, 1);
        let most = stretches(&game).into_iter().fold(0.0, max);
        assert!(most < 1.13, "tick {tick}: a spring of {most} times its length");
    }
    // The springs at the ball support only the ball, while those at the cliffs also support all the planks.
    let load = weight(game.world(), &[*ball]) + 0.5 * weight(game.world(), planks);
    let sag = 112.0 - game.world().position(*ball).y;
    let expected = static_sag(load, game.scene().springs[0].stiffness);
    assert!((sag - expected).abs() < 0.1, "sags by {sag}, not by {expected}");
    let before = positions(&game, &chain);
    for _ in 0..600 {
        idle(&mut game, 1);
        let furthest = moved(&game, &chain, &before).into_iter().fold(0.0, max);
        assert!(furthest < 0.05, "moved by {furthest}");
    }
}

#[test]
fn the_bridge_carries_a_hero() {
    let mut game = built_in("bridge", 1);
    game.join(FIRST);
    idle(&mut game, 900);
    // The hero goes over the crates and down onto the planks.
    for (ticks, buttons) in
        [(30, &[Buttons::UP][..]), (40, &[Buttons::UP, Buttons::RIGHT]), (600, &[])]
    {
        (0..ticks).for_each(|_| play(&mut game, buttons, None));
    }
    let place = game.world().position(hero_of(&game, FIRST));
    assert!(place.x > 60.0 && place.x < 260.0 && place.y > 70.0, "on the planks: {place}");
    let most = stretches(&game).into_iter().fold(0.0, max);
    assert!(most < 1.13, "a spring of {most} times its length");
}

#[test]
fn the_hall_sleeps_but_for_the_pit_in_which_a_hero_wades() {
    let mut game = built_in("hall", 1);
    (0..64).for_each(|seat| game.join(Seat(seat)));
    game.tick(&[]);
    let heroes = game.players().filter(|player| player.hero.is_some()).count();
    assert_eq!(heroes, 64, "each finds a place");
    (1..64).for_each(|seat| game.leave(Seat(seat)));
    let blocks = all(&game, Kind::Block);
    assert_eq!(blocks.len(), 3000);
    idle(&mut game, 240);
    assert_eq!(asleep(&game, &blocks), 3000);
    let before = positions(&game, &blocks);
    let mut most_awake = 0;
    for second in 0..8 {
        let button = if second % 2 == 0 { Buttons::LEFT } else { Buttons::RIGHT };
        steer(&mut game, 60, button);
        most_awake = most_awake.max(3000 - asleep(&game, &blocks));
    }
    let touched = moved(&game, &blocks, &before).iter().filter(|&&way| way > 0.1).count();
    assert!((20..=150).contains(&touched), "{touched} bodies moved");
    assert!((20..=150).contains(&most_awake), "{most_awake} bodies awake at a time");
}

/// Heights that a body reaches between bounces, measured from its lowest position, not counting the first fall.
fn heights(game: &mut Game, body: usize, ticks: u32) -> Vec<f32> {
    let id = game.roster.placed[body].expect("a ball");
    let (mut heights, mut rose, mut before) = (Vec::new(), false, game.world().position(id).y);
    for _ in 0..ticks {
        idle(game, 1);
        let y = game.world().position(id).y;
        if rose && y < before {
            heights.push(before - 8.5);
        }
        // At the very top, it may neither rise nor fall for a tick.
        rose = y > before || rose && y == before;
        before = y;
    }
    heights
}

#[test]
fn each_ball_of_bounce_comes_back_to_its_share_of_the_height() {
    for ball in 1..=10u8 {
        let mut game = built_in("bounce", 3);
        let restitution = f32::from(ball) / 10.0;
        let first = heights(&mut game, 4 + usize::from(ball), 400).first().copied().unwrap_or(0.0);
        let expected = restitution * restitution * 81.5;
        assert!((first - expected).abs() < 3.0, "{restitution}: {first}, not {expected}");
    }
}

#[test]
fn the_same_throw_goes_higher_where_gravity_is_less() {
    // A body thrown at 24 units/s rises by v^2 / 2g, unless the ceiling is in the way.
    for (ball, gravity) in [(1, 0.165f32), (2, 0.379), (3, 1.0), (4, 2.53)] {
        let mut game = built_in("planets", 3);
        let first = heights(&mut game, 4 + ball, 400)[0] - 1.5;
        let expected = 24.0 * 24.0 / (2.0 * 50.0 * gravity);
        assert!((first - expected).abs() < 0.6, "{gravity}: {first}, not {expected}");
    }
}

#[test]
fn of_three_orbits_only_the_explicit_one_grows() {
    let mut game = built_in("euler", 1);
    let middles = [34.0, 100.0, 166.0].map(|x| Vec2::new(x, 56.0));
    idle(&mut game, 480);
    let radius = |index: usize| {
        let world = game.world();
        let id = game.roster.placed[6 + index].expect("a ball");
        let turn = std::f32::consts::TAU * 0.4;
        let (offset, speed) = (world.position(id) - middles[index], world.velocity(id) / turn);
        // Radius of the circle that an exact orbit would follow from here.
        ((offset.length_squared() + speed.length_squared()) / 2.0).sqrt()
    };
    let [explicit, symplectic, exact] = [0, 1, 2].map(radius);
    assert!(explicit > 20.0, "after eight seconds: {explicit}");
    assert!((symplectic - 14.0).abs() < 0.5, "{symplectic}");
    assert!((exact - 14.0).abs() < 0.05, "{exact}");
}

#[test]
fn the_puck_corrects_what_the_chapter_lists() {
    let mut game = built_in("listing", 1);
    game.join(FIRST);
    let body = |game: &Game, name: &str| {
        let named = game.scene().bodies.iter().position(|body| body.name.as_deref() == Some(name));
        game.roster.placed[named.expect("a named body")].expect("it is there")
    };
    let state = |game: &Game, name| {
        let id = body(game, name);
        (game.world().position(id), game.world().velocity(id))
    };
    idle(&mut game, 40);
    assert!(state(&game, "ball-1").0.y < 72.0, "light: {}", state(&game, "ball-1").0);
    assert!(state(&game, "ball-5").0.y > 98.0, "heavy: {}", state(&game, "ball-5").0);
    assert!(state(&game, "box").1.x > 24.0, "it speeds up: {}", state(&game, "box").1);
    let rider = state(&game, "rider").1.x;
    assert!(rider.abs() < 0.1, "it stays where the platform leaves it: {rider}");

    for pointer in [at(30.0, 7.6), at(30.0, 18.0), at(74.0, 18.0), at(74.0, 8.0)] {
        (0..30).for_each(|_| play(&mut game, &[Buttons::HOLD], pointer));
    }
    while !game.tick_count().is_multiple_of(360) {
        idle(&mut game, 1);
    }
    idle(&mut game, 40);
    let [light, heavy] = ["ball-1", "ball-5"].map(|name| state(&game, name).0.y);
    assert!((light - heavy).abs() < 0.01, "all fall alike: {light} {heavy}");
    assert!(state(&game, "box").1.x < 8.0, "friction brakes: {}", state(&game, "box").1);
    assert!((state(&game, "rider").1.x - 18.7).abs() < 0.5, "{}", state(&game, "rider").1);
}
