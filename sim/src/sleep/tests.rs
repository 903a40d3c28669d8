//! Tests which bodies may sleep, what wakes them, and that sleep affects nothing else.

use super::*;
use crate::Conjugate;
use crate::math::max;
use crate::rng::Rng;
use crate::shape::Shape;
use crate::solver::Solver;
use crate::world::World;
use crate::world::{BodyDef, BodyId, WorldSettings};

fn settings(gravity: f32) -> WorldSettings {
    WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        solver: Some(Solver::Conjugate(Conjugate::default())),
        sleeping: true,
        ..WorldSettings::default()
    }
}

fn world() -> World {
    World::new(settings(50.0))
}

fn add(world: &mut World, def: BodyDef) -> BodyId {
    world.add(&def).expect("there is room")
}

fn floor_at(world: &mut World, motion: Motion, y: f32) -> BodyId {
    let position = Vec2::new(0.0, y - 10.0);
    let shape = Shape::rect(200.0, 20.0);
    add(world, BodyDef { shape, position, motion, restitution: 0.0, ..BodyDef::default() })
}

fn floor(world: &mut World) -> BodyId {
    floor_at(world, Motion::Static, 0.0)
}

fn crate_at(x: f32, y: f32) -> BodyDef {
    let position = Vec2::new(x, y);
    BodyDef { shape: Shape::rect(2.0, 2.0), position, restitution: 0.0, ..BodyDef::default() }
}

fn ball_at(x: f32, y: f32) -> BodyDef {
    BodyDef { shape: Shape::circle(1.0), ..crate_at(x, y) }
}

/// Adds a stack of boxes that stands on the floor.
fn stack(world: &mut World, x: f32, count: usize) -> Vec<BodyId> {
    (0..count).map(|index| add(world, crate_at(x, 1.0 + 2.0 * index as f32))).collect()
}

fn steps(world: &mut World, count: usize) {
    (0..count).for_each(|_| world.step());
}

fn asleep(world: &World, bodies: &[BodyId]) -> usize {
    bodies.iter().filter(|&&id| world.is_asleep(id)).count()
}

/// A floor with a sleeping stack on it.
fn sleeping_stack(count: usize) -> (World, BodyId, Vec<BodyId>) {
    let mut world = world();
    let floor = floor(&mut world);
    let bodies = stack(&mut world, 0.0, count);
    steps(&mut world, 60);
    assert_eq!(asleep(&world, &bodies), count);
    (world, floor, bodies)
}

// --- Falling asleep -----------------------------------------------------------------------------

#[test]
fn a_stack_of_a_thousand_sleeps_within_a_second_and_is_in_no_list() {
    let (world, _, bodies) = sleeping_stack(1000);
    assert!(bodies.iter().all(|&id| world.velocity(id) == Vec2::ZERO));
    assert!(world.bodies.moving.is_empty() && world.pairs.pairs.is_empty());
    assert_eq!(world.step_counts().solves, 0);
}

#[test]
fn an_island_sleeps_as_a_whole_or_not_at_all() {
    let mut world = world();
    floor(&mut world);
    let still = stack(&mut world, 0.0, 5);
    let apart = stack(&mut world, 50.0, 2);
    // A frictionless box on top slides back and forth forever.
    let on_top = BodyDef { friction: 0.0, ..crate_at(0.0, 11.0) };
    let restless = add(&mut world, on_top);
    for step in 0..240 {
        let side = if step / 10 % 2 == 0 { 1.0 } else { -1.0 };
        world.set_velocity(restless, Vec2::new(side, 0.0));
        world.step();
        assert_eq!(asleep(&world, &still), 0, "step {step}");
    }
    assert_eq!(asleep(&world, &apart), 2);
}

#[test]
fn a_flying_body_never_sleeps_however_weak_gravity_is() {
    for gravity in [1e-6, 1e-3, 0.1, 1.0, 50.0] {
        let mut world = World::new(settings(gravity));
        // The flyer rises for a second and then falls.
        let velocity = Vec2::new(0.0, gravity);
        let flyer = add(&mut world, BodyDef { velocity, ..ball_at(0.0, 0.0) });
        for step in 0..600 {
            world.step();
            assert!(!world.is_asleep(flyer), "gravity {gravity}, step {step}");
        }
    }
    // Nor does a body sleep that falls at the world's maximum speed, however low that is.
    let mut world = World::new(WorldSettings { speed_max: 0.02, ..settings(50.0) });
    let faller = add(&mut world, ball_at(0.0, 0.0));
    steps(&mut world, 120);
    assert!(!world.is_asleep(faller));
}

#[test]
fn weightless_bodies_sleep_only_at_rest() {
    let mut world = world();
    let float = BodyDef { gravity_scale: 0.0, ..ball_at(0.0, 5.0) };
    let still = add(&mut world, float);
    let velocity = Vec2::new(0.01, 0.0);
    let adrift = add(
        &mut world,
        BodyDef { velocity, ..BodyDef { gravity_scale: 0.0, ..ball_at(9.0, 5.0) } },
    );
    steps(&mut world, 60);
    assert!(world.is_asleep(still) && !world.is_asleep(adrift));
}

#[test]
fn a_slow_body_without_support_does_not_sleep() {
    // Two bodies are pressed together without ground, as one falls up and the other down.
    let mut world = World::new(WorldSettings { speed_max: 1.0, ..settings(50.0) });
    let up = add(&mut world, BodyDef { gravity_scale: -1.0, ..crate_at(0.0, 0.0) });
    let down = add(&mut world, crate_at(0.0, 2.0));
    steps(&mut world, 120);
    assert_eq!(asleep(&world, &[up, down]), 0);
}

#[test]
fn a_pile_moves_to_the_bit_as_without_sleep_until_a_body_sleeps() {
    let mut one = world();
    let mut other = World::new(WorldSettings { sleeping: false, ..settings(50.0) });
    let mut rng = Rng::new(11, 0);
    floor(&mut one);
    floor(&mut other);
    let mut bodies = Vec::new();
    for index in 0..60 {
        let def = crate_at(rng.range(-9.0, 9.0), 3.0 + 2.2 * index as f32);
        let shape = if index % 2 == 0 { Shape::circle(rng.range(0.5, 1.5)) } else { def.shape };
        bodies.push((
            add(&mut one, BodyDef { shape, ..def }),
            add(&mut other, BodyDef { shape, ..def }),
        ));
    }
    let mut step = 0;
    while one.sleep.count() == 0 {
        one.step();
        other.step();
        step += 1;
        assert!(step < 3000, "no body ever slept");
        for &(id, twin) in &bodies {
            let same = one.position(id) == other.position(twin);
            assert!(same && (one.sleep.count() > 0 || one.velocity(id) == other.velocity(twin)));
        }
    }
}

#[test]
fn sleeping_bodies_change_nothing_for_bodies_elsewhere() {
    let run = |with_sleepers: bool| {
        let mut world = world();
        floor(&mut world);
        let bodies: Vec<_> = (0..12)
            .map(|k| add(&mut world, ball_at(40.0 + k as f32 % 3.0, 3.0 + 2.5 * k as f32)))
            .collect();
        if with_sleepers {
            stack(&mut world, -40.0, 20);
            steps(&mut world, 60);
            assert!(world.sleep.count() >= 20);
        } else {
            steps(&mut world, 60);
        }
        add(&mut world, ball_at(41.0, 60.0));
        let mut trace = Vec::new();
        for _ in 0..200 {
            world.step();
            trace.extend(bodies.iter().map(|&id| (world.position(id), world.velocity(id))));
        }
        trace
    };
    assert!(run(true) == run(false));
}

// --- Waking -------------------------------------------------------------------------------------

#[test]
fn a_touch_wakes_the_whole_island_and_no_other() {
    let (mut world, _, bodies) = sleeping_stack(10);
    let other = stack(&mut world, 20.0, 3);
    steps(&mut world, 60);
    assert_eq!(asleep(&world, &other), 3);
    let ball = add(&mut world, ball_at(0.0, 40.0));
    while asleep(&world, &bodies) == 10 {
        assert!(world.position(ball).y > 20.5, "it went in");
        world.step();
    }
    assert_eq!(asleep(&world, &bodies), 0);
    assert_eq!(asleep(&world, &other), 3);
    steps(&mut world, 300);
    assert_eq!(world.sleep.count(), 14, "all sleep again");
}

#[test]
fn bodies_fall_when_their_support_is_removed() {
    let (mut world, floor, bodies) = sleeping_stack(5);
    world.remove(bodies[1]);
    assert_eq!(world.sleep.count(), 0);
    steps(&mut world, 120);
    assert!((world.position(bodies[4]).y - 7.0).abs() < 0.01);
    assert_eq!(world.sleep.count(), 4);
    world.remove(floor);
    assert_eq!(world.sleep.count(), 0);
    steps(&mut world, 60);
    assert!(world.position(bodies[0]).y < -20.0);
}

#[test]
fn any_change_to_a_body_wakes_its_island() {
    type Deed = fn(&mut World, BodyId);
    let deeds: [(&str, Deed); 4] = [
        ("velocity", |world, id| world.set_velocity(id, Vec2::new(0.001, 0.0))),
        ("position", |world, id| world.set_position(id, world.position(id) + Vec2::X)),
        ("gravity scale", |world, id| world.set_gravity_scale(id, 2.0)),
        ("gravity", |world, _| world.set_gravity(Vec2::new(50.0, 0.0))),
    ];
    for (name, deed) in deeds {
        let (mut world, _, bodies) = sleeping_stack(5);
        deed(&mut world, bodies[2]);
        assert_eq!(world.sleep.count(), 0, "{name}");
    }
    let (mut world, _, bodies) = sleeping_stack(5);
    world.set_velocity(bodies[2], Vec2::ZERO);
    world.set_position(bodies[2], world.position(bodies[2]));
    assert_eq!(world.sleep.count(), 5, "nothing was done");
}

#[test]
fn moving_a_wall_wakes_the_bodies_at_both_positions() {
    let mut world = world();
    floor(&mut world);
    let shelf = BodyDef { motion: Motion::Static, ..crate_at(0.0, 10.0) };
    let shelf = add(&mut world, shelf);
    let above = add(&mut world, crate_at(0.0, 12.0));
    let aside = add(&mut world, crate_at(30.0, 1.0));
    let away = add(&mut world, crate_at(60.0, 1.0));
    steps(&mut world, 60);
    assert_eq!(world.sleep.count(), 3);
    world.set_position(shelf, Vec2::new(31.0, 1.5));
    assert_eq!(asleep(&world, &[above, aside]), 0);
    assert!(world.is_asleep(away));
    steps(&mut world, 120);
    assert!((world.position(above).y - 1.0).abs() < 0.01);
}

#[test]
fn a_body_added_on_sleeping_ones_wakes_them() {
    for motion in [Motion::Dynamic, Motion::Kinematic, Motion::Static] {
        let (mut world, _, bodies) = sleeping_stack(3);
        add(&mut world, BodyDef { motion, ..crate_at(0.5, 5.5) });
        world.step();
        assert_eq!(asleep(&world, &bodies), 0, "{motion:?}");
    }
}

#[test]
fn a_lift_that_starts_takes_its_riders_along() {
    let mut world = world();
    let lift = floor_at(&mut world, Motion::Kinematic, 0.0);
    let bodies = stack(&mut world, 0.0, 4);
    steps(&mut world, 60);
    assert_eq!(asleep(&world, &bodies), 4);
    for speed in [5.0, -5.0] {
        world.set_velocity(lift, Vec2::new(0.0, speed));
        for step in 0..60 {
            world.step();
            let gap = world.position(bodies[3]).y - world.position(lift).y - 17.0;
            assert_eq!(asleep(&world, &bodies), 0);
            // A lift that starts moving down leaves them behind at first.
            assert!(gap > -0.01 && gap < 0.3, "{gap} at step {step}");
        }
        world.set_velocity(lift, Vec2::ZERO);
        steps(&mut world, 90);
        assert_eq!(asleep(&world, &bodies), 4);
    }
    world.remove(lift);
    assert_eq!(world.sleep.count(), 0);
}

#[test]
fn a_lift_that_woke_beside_another_lets_its_riders_fall_when_removed() {
    let mut world = world();
    let lift_at = |world: &mut World, x: f32| {
        let def = BodyDef { motion: Motion::Kinematic, ..crate_at(x, -1.0) };
        add(world, def)
    };
    let (first, second) = (lift_at(&mut world, 0.0), lift_at(&mut world, 2.0));
    let bodies = stack(&mut world, 2.8, 1);
    steps(&mut world, 60);
    assert_eq!(asleep(&world, &bodies), 1);
    assert!(world.remove(first) && world.remove(second));
    steps(&mut world, 30);
    assert!(world.position(bodies[0]).y < 0.0, "{}", world.position(bodies[0]));
}

#[test]
fn sleepers_stop_bullets() {
    for speed in [200.0, 3000.0, 10_000.0] {
        let (mut world, _, bodies) = sleeping_stack(5);
        let velocity = Vec2::new(speed, 0.0);
        let bullet =
            BodyDef { shape: Shape::circle(0.1), mass: 1e-5, velocity, ..ball_at(-90.0, 5.0) };
        let bullet = add(&mut world, bullet);
        let mut woken = 0;
        for _ in 0..60 {
            world.step();
            woken = woken.max(5 - asleep(&world, &bodies));
        }
        assert!(world.position(bullet).x < -1.0, "speed {speed}: {}", world.position(bullet));
        assert_eq!(woken, 5);
    }
}

#[test]
fn a_chain_of_impacts_wakes_all_its_bodies_in_the_same_step() {
    let run = |sleeping: bool| {
        let mut world = World::new(WorldSettings { sleeping, ..settings(50.0) });
        floor(&mut world);
        let hit: Vec<_> = [0.0, 2.6, 5.2].map(|x| add(&mut world, crate_at(x, 1.0))).into();
        steps(&mut world, 60);
        let velocity = Vec2::new(300.0, 0.0);
        add(&mut world, BodyDef { velocity, mass: 1000.0, ..crate_at(-8.0, 1.01) });
        steps(&mut world, 2);
        assert_eq!(asleep(&world, &hit), 0);
        hit.into_iter().map(|id| world.position(id)).collect::<Vec<_>>()
    };
    for (with, without) in run(true).into_iter().zip(run(false)) {
        assert!(with.distance(without) < 1e-3, "{with} {without}");
    }
}

#[test]
fn a_new_body_in_the_slot_of_a_sleeping_one_is_awake() {
    let (mut world, _, bodies) = sleeping_stack(2);
    world.remove(bodies[1]);
    let new = add(&mut world, ball_at(30.0, 80.0));
    assert_eq!(new.index, bodies[1].index);
    world.step();
    assert!(!world.is_asleep(new) && world.velocity(new).y < 0.0);
}

// --- Random games -------------------------------------------------------------------------------

fn poke(world: &mut World, rng: &mut Rng, lift: BodyId) {
    let dynamic: Vec<BodyId> =
        world.ids().filter(|&id| world.motion(id) == Motion::Dynamic).collect();
    let position = Vec2::new(rng.range(-12.0, 12.0), rng.range(1.0, 25.0));
    let kick = Vec2::new(rng.range(-20.0, 20.0), rng.range(-20.0, 20.0));
    let any = dynamic.get(rng.below(dynamic.len().max(1) as u32) as usize).copied();
    match (rng.below(8), any) {
        (0, Some(id)) => drop(world.remove(id)),
        (1, Some(id)) => world.set_velocity(id, kick),
        (2, Some(id)) => world.set_position(id, position),
        (3, Some(id)) => world.set_gravity_scale(id, rng.range(0.1, 2.0)),
        (4, _) => world.set_velocity(lift, Vec2::new(0.0, rng.range(-3.0, 3.0))),
        (5, _) => world.set_velocity(lift, Vec2::ZERO),
        (6, _) => {
            let statics: Vec<BodyId> = world
                .ids()
                .filter(|&id| world.motion(id) == Motion::Static && id.index > 2)
                .collect();
            if let Some(&shelf) = statics.first() {
                world.set_position(shelf, position);
            }
        }
        _ if dynamic.len() < 14 => {
            let half = Vec2::new(rng.range(0.5, 1.5), rng.range(0.5, 1.5));
            let round = rng.below(2) == 0;
            let shape = if round { Shape::circle(half.x) } else { Shape::Box { half } };
            world.add(&BodyDef { shape, ..crate_at(position.x, position.y) });
        }
        _ => {}
    }
}

/// A box with a lift, a shelf and a few bodies.
fn playground(rng: &mut Rng) -> (World, BodyId) {
    let mut world = world();
    floor(&mut world);
    for x in [-16.0, 16.0] {
        let wall =
            BodyDef { shape: Shape::rect(4.0, 100.0), motion: Motion::Static, ..crate_at(x, 40.0) };
        add(&mut world, wall);
    }
    let shelf =
        BodyDef { shape: Shape::rect(6.0, 1.0), motion: Motion::Static, ..crate_at(4.0, 8.0) };
    add(&mut world, shelf);
    let lift =
        BodyDef { shape: Shape::rect(6.0, 1.0), motion: Motion::Kinematic, ..crate_at(-6.0, 5.0) };
    let lift = add(&mut world, lift);
    (0..20).for_each(|_| poke(&mut world, rng, lift));
    (world, lift)
}

/// Checks that each sleeping body would also stay in place if it were awake.
fn check_that_no_body_sleeps_in_the_air(world: &World, game: u64) {
    let (mut awake, mut as_it_is) = (world.clone(), world.clone());
    awake.wake(&world.ids().collect::<Vec<_>>());
    steps(&mut awake, 20);
    steps(&mut as_it_is, 20);
    // Bodies that another one wakes in the meantime prove nothing.
    for id in as_it_is.ids().filter(|&id| as_it_is.is_asleep(id) && world.is_asleep(id)) {
        let moved = awake.position(id).distance(world.position(id));
        assert!(moved < 0.05, "game {game}: body {} went {moved} after waking", id.index);
    }
}

fn play(game: u64) {
    let mut rng = Rng::new(game, 5);
    let (mut world, lift) = playground(&mut rng);
    for _ in 0..4 {
        let count = 20 + rng.below(100) as usize;
        steps(&mut world, count);
        if world.sleep.count() > 1 {
            check_that_no_body_sleeps_in_the_air(&world, game);
        }
        poke(&mut world, &mut rng, lift);
        let count = rng.below(4) as usize;
        steps(&mut world, count);
    }
}

#[test]
fn random_games_leave_no_body_asleep_in_the_air() {
    (0..10_000).for_each(play);
}

// --- State --------------------------------------------------------------------------------------

#[test]
fn a_world_restored_at_any_tick_continues_alike() {
    use crate::state::bytes::{StateReader, StateWriter};
    let (mut slept, mut woke) = (0, 0);
    for game in 0..7 {
        let mut rng = Rng::new(game, 6);
        let (mut world, lift) = playground(&mut rng);
        for tick in 0..400 {
            let before = world.sleep.count();
            if tick % 90 == 80 {
                poke(&mut world, &mut rng, lift);
            }
            let mut out = StateWriter::default();
            world.save(&mut out);
            let mut twin = World::restore(world.settings().clone(), &mut StateReader::new(&out.0))
                .expect("what was saved is a state");
            assert_eq!(twin.hash(), world.hash(), "game {game}, tick {tick}");
            world.step();
            twin.step();
            assert_eq!(twin.hash(), world.hash(), "game {game}, after tick {tick}");
            assert_eq!(twin.touches().len(), world.touches().len());
            slept += usize::from(world.sleep.count() > before);
            woke += usize::from(world.sleep.count() < before);
        }
    }
    assert!(slept > 20 && woke >= 10, "{slept} {woke}");
}

#[test]
fn the_time_of_a_rebuild_changes_no_bit() {
    for game in 0..4 {
        let mut rng = [Rng::new(game, 7), Rng::new(game, 7)];
        let [one, other] = &mut rng;
        let ((mut lazy, lift), (mut eager, _)) = (playground(one), playground(other));
        for tick in 0..400 {
            if tick % 70 == 60 {
                poke(&mut lazy, one, lift);
                poke(&mut eager, other, lift);
            }
            eager.pairs.invalidate();
            lazy.step();
            eager.step();
            assert_eq!(lazy.hash(), eager.hash(), "game {game}, tick {tick}");
        }
    }
}

#[test]
fn invalid_bytes_of_sleep_are_refused_and_never_panic() {
    use crate::state::bytes::{StateReader, StateWriter};
    let (world, ..) = sleeping_stack(4);
    let mut out = StateWriter::default();
    world.save(&mut out);
    for index in 0..out.0.len() {
        for bit in 0..8 {
            let mut bytes = out.0.clone();
            bytes[index] ^= 1 << bit;
            if let Ok(mut world) = World::restore(settings(50.0), &mut StateReader::new(&bytes)) {
                let ids: Vec<BodyId> = world.ids().collect();
                world.wake(&ids);
                world.step();
            }
        }
    }
}

#[test]
fn the_deepest_overlap_stays_small_when_islands_wake_again_and_again() {
    let (mut world, _, bodies) = sleeping_stack(30);
    let mut deepest = 0.0;
    for _ in 0..10 {
        world.set_gravity(Vec2::new(0.0, -50.0));
        world.step();
        deepest = world.touches().iter().fold(deepest, |most, touch| max(most, touch.depth));
        steps(&mut world, 40);
        assert_eq!(asleep(&world, &bodies), 30);
    }
    assert!(deepest <= 0.005, "{deepest}");
    assert!((world.position(bodies[29]).y - 59.0).abs() < 0.005);
}

#[test]
fn bodies_woken_at_once_move_as_if_one_after_another() {
    let (mut at_once, _, stack) = sleeping_stack(6);
    let lone: Vec<BodyId> =
        [12.0, 20.0, 30.0].map(|x| add(&mut at_once, ball_at(x, 1.0))).into_iter().collect();
    steps(&mut at_once, 120);
    assert_eq!(at_once.sleep.count(), 9);
    let mut in_turn = at_once.clone();
    let some: Vec<BodyId> = lone.into_iter().chain(stack.into_iter().skip(4)).collect();
    at_once.wake(&some);
    assert_eq!(at_once.sleep.count(), 0);
    for world in [&mut at_once, &mut in_turn] {
        for &id in &some {
            world.set_velocity(id, Vec2::new(3.0, 9.0));
        }
    }
    for step in 0..60 {
        assert_eq!(at_once.hash(), in_turn.hash(), "step {step}");
        at_once.step();
        in_turn.step();
    }
}

#[test]
fn a_step_that_begins_again_counts_all_attempts() {
    let (mut world, _, stack) = sleeping_stack(6);
    let ball = add(&mut world, ball_at(0.0, 30.0));
    while world.sleep.count() > 0 {
        assert!(world.step_counts().moving <= 1, "only the ball moves");
        world.step();
    }
    assert!(world.contains(ball));
    let (alone, all) = (1, 1 + stack.len() as u64);
    assert_eq!(world.step_counts().moving, alone + all);
}

#[test]
fn a_platform_that_moved_wakes_as_many_as_its_restored_twin() {
    use crate::state::bytes::{StateReader, StateWriter};
    let mut world = world();
    floor(&mut world);
    let sleeper = add(&mut world, crate_at(0.0, 1.0));
    let platform = BodyDef { motion: Motion::Kinematic, ..crate_at(-60.0, 1.0) };
    let platform = add(&mut world, platform);
    steps(&mut world, 200);
    assert!(world.is_asleep(sleeper));
    // The platform arrives 0.5 from the sleeper, outside its reach at rest, and stops.
    world.set_velocity(platform, Vec2::new(60.0, 0.0));
    while world.position(platform).x < -3.0 {
        world.step();
    }
    world.set_position(platform, Vec2::new(-2.5, 1.0));
    world.set_velocity(platform, Vec2::ZERO);
    assert!(world.is_asleep(sleeper));
    let mut out = StateWriter::default();
    world.save(&mut out);
    let mut twin = World::restore(world.settings().clone(), &mut StateReader::new(&out.0))
        .expect("what was saved is a state");
    for world in [&mut world, &mut twin] {
        world.set_velocity(platform, Vec2::new(-1.0, 0.0));
        world.step();
    }
    assert_eq!(world.sleep.count(), twin.sleep.count());
    assert_eq!(world.hash(), twin.hash());
}
