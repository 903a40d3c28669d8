//! Tests movement (A0.5), the relaxation solver (A0.10, A0.11, A0.13, A0.14, A2.18 to A2.23), bodies (A2.7 to
//! A2.11, A2.29), and that the defects of the chapter's solver and loop are avoided (C08 to C20, C22a to C22m,
//! C23a).

mod as_listed;
mod budget;
mod contacts;
mod gaps;
mod memory;
mod quarantine;
mod squeezed;

use super::*;
use crate::GROUPS_MAX;
use crate::body::Material;
use crate::{Conjugate, DT, ForceSettings, Relaxation, Solver};

const SLOP: f32 = 0.005;

fn world(relaxation: Relaxation, gravity: f32) -> World {
    World::new(WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        solver: Some(Solver::Relaxation(relaxation)),
        ..WorldSettings::default()
    })
}

fn floor(world: &mut World, friction: f32) -> BodyId {
    let def = BodyDef {
        shape: Shape::rect(2000.0, 10.0),
        position: Vec2::new(0.0, -5.0),
        motion: Motion::Static,
        friction,
        ..BodyDef::default()
    };
    world.add(&def).expect("there is room")
}

fn crate_at(x: f32, y: f32) -> BodyDef {
    BodyDef {
        shape: Shape::rect(2.0, 2.0),
        position: Vec2::new(x, y),
        restitution: 0.0,
        ..BodyDef::default()
    }
}

fn add(world: &mut World, def: BodyDef) -> BodyId {
    world.add(&def).expect("there is room")
}

fn steps(world: &mut World, count: usize) {
    for _ in 0..count {
        world.step();
    }
}

fn momentum(world: &World) -> Vec2 {
    let dynamic = world.ids().filter(|&id| world.motion(id) == Motion::Dynamic);
    dynamic.map(|id| world.velocity(id) / world.inverse_mass(id)).sum()
}

fn kinetic(world: &World) -> f64 {
    let dynamic = world.ids().filter(|&id| world.motion(id) == Motion::Dynamic);
    let energy = |id| f64::from(world.velocity(id).length_squared() / world.inverse_mass(id)) / 2.0;
    dynamic.map(energy).sum()
}

#[track_caller]
fn close(found: f32, expected: f32, tolerance: f32) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected} +- {tolerance}");
}

// --- Movement -----------------------------------------------------------------------------------

#[test]
fn free_fall_is_symplectic_euler() {
    let mut world = world(Relaxation::default(), 50.0);
    let id = add(&mut world, BodyDef { position: Vec2::new(3.0, 100.0), ..BodyDef::default() });
    for n in 1..=60 {
        world.step();
        let n = n as f32;
        close(world.position(id).y, 100.0 - 50.0 / 3600.0 * n * (n + 1.0) / 2.0, 1e-3);
        close(world.velocity(id).y, -50.0 * n / 60.0, 1e-3);
    }
    close(100.0 - world.position(id).y, 25.4167, 1e-3);
}

#[test]
fn all_masses_fall_alike_up_to_their_gravity_scale() {
    let mut world = world(Relaxation::default(), 50.0);
    let masses = [1e-3, 0.1, 0.7, 2.0, 10.0, 1e4];
    let mut x = 0.0;
    let ids = masses.map(|mass| {
        x += 10.0;
        let position = Vec2::new(x, 0.0);
        add(&mut world, BodyDef { mass, position, ..BodyDef::default() })
    });
    let half = add(&mut world, BodyDef { gravity_scale: 0.5, ..crate_at(-50.0, 0.0) });
    let floating = add(&mut world, BodyDef { gravity_scale: 0.0, ..crate_at(-90.0, 0.0) });
    steps(&mut world, 60);
    for id in ids {
        close(world.position(id).y, -25.4167, 1e-3);
    }
    close(world.position(half).y, -12.708, 1e-3);
    assert_eq!(world.position(floating), Vec2::new(-90.0, 0.0));
}

#[test]
fn a_default_body_has_the_values_of_the_textbook() {
    let mut world = World::new(WorldSettings::default());
    assert_eq!(world.settings().gravity, Vec2::new(0.0, -50.0));
    let id = add(&mut world, BodyDef::default());
    assert_eq!(world.inverse_mass(id), 1.0);
    let Material { restitution, friction } = world.bodies.material[id.index as usize];
    assert_eq!((restitution, friction), (0.8, 0.3));
    assert_eq!(world.velocity(id), Vec2::ZERO);
    let settings = Relaxation::default();
    assert_eq!((settings.iterations, settings.correction, settings.slop), (15, 0.8, SLOP));
}

#[test]
fn static_bodies_never_move_and_never_pair_with_each_other() {
    let mut world = world(Relaxation::default(), 50.0);
    let wall = BodyDef { motion: Motion::Static, ..crate_at(0.0, 0.0) };
    let (a, b) = (add(&mut world, wall), add(&mut world, wall));
    assert_eq!(world.inverse_mass(a), 0.0);
    steps(&mut world, 60);
    assert_eq!((world.position(a), world.position(b)), (Vec2::ZERO, Vec2::ZERO));
    assert!(world.touches().is_empty(), "C15");
}

#[test]
fn ids_are_never_reused() {
    let mut world = world(Relaxation::default(), 0.0);
    let first = add(&mut world, crate_at(0.0, 0.0));
    let second = add(&mut world, crate_at(9.0, 0.0));
    assert!(world.remove(first));
    assert!(!world.remove(first));
    let third = add(&mut world, crate_at(18.0, 0.0));
    assert_eq!(third.index, first.index);
    assert_ne!(third, first);
    assert!(!world.contains(first) && world.contains(second) && world.contains(third));
    assert_eq!(world.ids().collect::<Vec<_>>(), vec![third, second]);
}

#[test]
fn the_body_limit_is_an_answer_and_not_a_panic() {
    let settings = WorldSettings { bodies_max: 2, ..WorldSettings::default() };
    let mut world = World::new(settings);
    assert!(world.add(&crate_at(0.0, 0.0)).is_some());
    let last = add(&mut world, crate_at(9.0, 0.0));
    assert_eq!(world.add(&crate_at(18.0, 0.0)), None);
    world.remove(last);
    assert!(world.add(&crate_at(18.0, 0.0)).is_some());
}

// --- Reports, limits, state ---------------------------------------------------------------------

#[test]
fn a_contact_begins_once() {
    let mut world = world(Relaxation::default(), 50.0);
    let ground = floor(&mut world, 0.3);
    let id = add(&mut world, crate_at(0.0, 3.0));
    let mut began = 0;
    for _ in 0..120 {
        world.step();
        for touch in world.touches() {
            assert_eq!((touch.a, touch.b), (ground, id));
            assert_eq!(touch.normal, Vec2::Y);
            began += u32::from(touch.began);
            assert!(!touch.began || touch.closing > 10.0, "closing at {}", touch.closing);
        }
    }
    assert_eq!(began, 1);
}

#[test]
fn groups_that_do_not_collide_pass_through_each_other() {
    let mut meets = [0; GROUPS_MAX];
    meets[0] = 0b01;
    let mut world = World::new(WorldSettings { meets, ..WorldSettings::default() });
    add(&mut world, BodyDef { group: 1, motion: Motion::Static, ..crate_at(0.0, 0.0) });
    let id = add(&mut world, BodyDef { group: 0, ..crate_at(0.0, 0.5) });
    steps(&mut world, 10);
    assert!(world.touches().is_empty());
    assert!(world.position(id).y < 0.0);
}

#[test]
fn bodies_outside_the_kill_zone_are_removed_and_reported() {
    let kill_zone = Aabb { low: Vec2::splat(-10.0), high: Vec2::splat(10.0) };
    let mut world = World::new(WorldSettings { kill_zone, ..WorldSettings::default() });
    let id = add(&mut world, crate_at(0.0, 0.0));
    let mut reports = 0;
    for _ in 0..60 {
        world.step();
        for &(gone, position) in &world.departed().bodies {
            assert_eq!(gone, id);
            assert!(position.y < -10.0);
            reports += 1;
        }
    }
    assert_eq!((reports, world.body_count()), (1, 0));
}

#[test]
fn without_a_solver_contacts_are_found_and_nothing_moves() {
    let settings = WorldSettings { solver: None, gravity: Vec2::ZERO, ..WorldSettings::default() };
    let mut world = World::new(settings);
    let fixed = BodyDef { motion: Motion::Static, ..crate_at(0.0, 0.0) };
    let a = add(&mut world, fixed);
    let b = add(&mut world, fixed);
    let c = add(&mut world, BodyDef { position: Vec2::new(50.0, 0.0), ..fixed });
    world.step();
    assert_eq!(world.touches().len(), 1);
    assert_eq!((world.touches()[0].a, world.touches()[0].b), (a, b));
    world.set_position(c, Vec2::new(1.0, 1.0));
    world.step();
    assert_eq!(world.touches().len(), 3);
    assert_eq!(world.position(a), Vec2::ZERO);
}

#[test]
fn a_shorter_step_halves_the_error_of_a_flight() {
    let error = |share: f32| {
        let settings = WorldSettings { dt: DT * share, ..WorldSettings::default() };
        let mut world = World::new(settings);
        let id = add(&mut world, crate_at(0.0, 0.0));
        steps(&mut world, (60.0 / share) as usize);
        world.position(id).y + 25.0
    };
    // The error of symplectic Euler is g * h * t / 2, here for t = 1 s and t = 0.25 s.
    close(error(1.0), -50.0 / 120.0, 1e-3);
    close(error(0.25), -50.0 / 480.0, 1e-3);
}

#[test]
fn bodies_removed_together_leave_what_they_leave_one_by_one() {
    for sleeping in [false, true] {
        let mut together = World::new(WorldSettings {
            gravity: Vec2::new(0.0, -50.0),
            solver: Some(Solver::Conjugate(Conjugate::default())),
            sleeping,
            forces: Some(ForceSettings { springs_max: 30, ..ForceSettings::default() }),
            ..WorldSettings::default()
        });
        let floor = floor(&mut together, 0.3);
        let stacked = |index: i32| crate_at((index % 6) as f32 * 2.1, (1 + index / 6 * 2) as f32);
        let mut heap: Vec<BodyId> =
            (0..30).map(|index| add(&mut together, stacked(index))).collect();
        steps(&mut together, 200);
        assert_eq!(together.sleep.count() > 0, sleeping);
        for pair in heap.chunks(2) {
            let end = SpringEnd::Body(pair[1]);
            together.add_spring(Spring::tuned(pair[0], end, 2.0, 0.1, 0.5));
        }
        steps(&mut together, 2);
        let mut one_by_one = together.clone();
        heap.push(floor);
        let mut gone: Vec<BodyId> = heap.iter().copied().step_by(3).collect();
        gone.push(gone[0]);
        together.remove_all(&gone);
        assert_eq!(gone.iter().rev().filter(|&&id| one_by_one.remove(id)).count(), 11);
        assert_eq!(together.body_count(), heap.len() - 11);
        let is_gone = |touch: &Touch| gone.contains(&touch.a) || gone.contains(&touch.b);
        assert!(!together.touches().is_empty() && !together.touches().iter().any(is_gone));
        for _ in 0..100 {
            together.step();
            one_by_one.step();
            assert_eq!(together.hash(), one_by_one.hash());
        }
    }
}

#[test]
fn a_removed_body_stops_a_debug_build_and_is_nothing_in_others() {
    let mut world = world(Relaxation::default(), 50.0);
    let wall = floor(&mut world, 0.3);
    let gone = add(&mut world, crate_at(3.0, 4.0));
    assert!(world.remove(gone) && !world.remove(gone));
    let other = add(&mut world, crate_at(5.0, 6.0));
    assert_eq!(other.index, gone.index, "another body has its slot");
    let faults: [fn(&mut World, BodyId); 6] = [
        |world, id| assert_eq!(world.position(id), Vec2::ZERO),
        |world, id| assert_eq!((world.velocity(id), world.inverse_mass(id)), (Vec2::ZERO, 0.0)),
        |world, id| assert_eq!((world.motion(id), world.is_asleep(id)), (Motion::Static, false)),
        |world, id| world.set_position(id, Vec2::ONE),
        |world, id| world.set_velocity(id, Vec2::ONE),
        |world, id| world.set_gravity_scale(id, 2.0),
    ];
    for fault in faults {
        let before = world.hash();
        let done =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| fault(&mut world, gone)));
        assert_eq!(done.is_err(), cfg!(debug_assertions));
        assert_eq!(world.hash(), before);
    }
    let pushed = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        world.set_velocity(wall, Vec2::ONE);
    }));
    assert_eq!(pushed.is_err(), cfg!(debug_assertions));
    assert_eq!(world.velocity(wall), Vec2::ZERO);
}

#[test]
#[should_panic(expected = "must be a step")]
fn a_step_of_zero_length_is_refused() {
    World::new(WorldSettings { dt: 0.0, ..WorldSettings::default() });
}

#[test]
fn a_pair_at_rest_is_solved_at_least_once_a_step() {
    let mut world = world(Relaxation::default(), 50.0);
    floor(&mut world, 0.3);
    add(&mut world, crate_at(0.0, 1.0));
    steps(&mut world, 60);
    assert_eq!(world.step_counts().solves, u64::from(world.solvers.passes()));
}

#[test]
fn speed_is_capped() {
    let settings = WorldSettings { speed_max: 20.0, ..WorldSettings::default() };
    let mut world = World::new(settings);
    let id = add(&mut world, BodyDef { velocity: Vec2::new(300.0, 400.0), ..crate_at(0.0, 0.0) });
    world.step();
    close(world.velocity(id).length(), 20.0, 1e-4);
}

#[test]
fn warm_starting_does_not_apply_an_impact_twice() {
    for mass in [0.1, 1.0, 100.0] {
        let mut world = world(Relaxation::default(), 50.0);
        floor(&mut world, 0.3);
        let id = add(&mut world, BodyDef { mass, ..crate_at(0.0, 40.0) });
        for _ in 0..240 {
            world.step();
            assert!(world.velocity(id).y <= 1e-3, "thrown up at {}", world.velocity(id).y);
        }
    }
}

#[test]
fn the_load_falls_when_its_support_is_removed() {
    let mut world = world(Relaxation::default(), 50.0);
    floor(&mut world, 0.3);
    let lower = add(&mut world, crate_at(0.0, 1.0));
    let upper = add(&mut world, crate_at(0.0, 3.0));
    steps(&mut world, 60);
    world.remove(lower);
    steps(&mut world, 30);
    close(world.position(upper).y, 1.0 - SLOP, 0.02);
}

#[test]
fn the_same_steps_give_the_same_hash_and_a_changed_bit_another() {
    let build = || {
        let mut world = world(Relaxation::default(), 50.0);
        floor(&mut world, 0.3);
        for i in 0..30 {
            add(&mut world, crate_at((i % 5) as f32 * 1.9, 3.0 + i as f32));
        }
        world
    };
    let (mut one, mut two, mut changed) = (build(), build(), build());
    let victim = changed.ids().last().expect("thirty crates");
    let position = changed.position(victim);
    changed.set_position(victim, Vec2::new(f32::from_bits(position.x.to_bits() + 1), position.y));
    for _ in 0..200 {
        one.step();
        two.step();
        assert_eq!(one.hash(), two.hash());
    }
    changed.step();
    assert_ne!(changed.hash(), build().hash());
}
