//! Compares forces with closed-form solutions, under both solvers and at any stiffness.

use super::*;
use crate::GROUPS_MAX;
use crate::shape::Shape;
use crate::solver::Solver;
use crate::state::bytes::{StateReader, StateWriter};
use crate::world::{BodyDef, World, WorldSettings};
use crate::{BodyId, Conjugate};
use glam::DVec2;

const DT: f64 = crate::DT as f64;

fn solvers() -> [Solver; 2] {
    [Solver::default(), Solver::Conjugate(Conjugate::default())]
}

fn settings(gravity: f32, wind: Vec2, solver: Solver) -> WorldSettings {
    WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        forces: Some(ForceSettings { wind, springs_max: 100, ..ForceSettings::default() }),
        solver: Some(solver),
        speed_max: 1e6,
        ..WorldSettings::default()
    }
}

fn ball(x: f32, y: f32) -> BodyDef {
    let shape = Shape::Circle { radius: 0.25 };
    BodyDef { shape, position: Vec2::new(x, y), restitution: 0.0, ..BodyDef::default() }
}

fn add(world: &mut World, def: BodyDef) -> BodyId {
    world.add(&def).expect("there is room")
}

/// A world with one body, advanced by this many steps.
fn one(def: BodyDef, gravity: f32, wind: Vec2, solver: Solver, steps: u32) -> (DVec2, DVec2) {
    let mut world = World::new(settings(gravity, wind, solver));
    let id = add(&mut world, def);
    (0..steps).for_each(|_| world.step());
    (world.position(id).as_dvec2(), world.velocity(id).as_dvec2())
}

#[test]
fn linear_drag_and_wind_are_exact_at_any_rate() {
    let (start, wind) = (DVec2::new(30.0, 40.0), Vec2::new(5.0, -3.0));
    for rate in [1e-6f32, 0.1, 2.0, 60.0, 6e4] {
        let drag = Drag { linear: rate, quadratic: 0.0 };
        let def = BodyDef { velocity: start.as_vec2(), drag, ..ball(0.0, 0.0) };
        let (k, t) = (f64::from(rate), 60.0 * DT);
        let terminal = DVec2::new(0.0, -50.0) / k + wind.as_dvec2();
        let left = crate::math::exp_m1(-k * t);
        let path = terminal * t - (start - terminal) * left / k;
        let speed = start + (start - terminal) * left;
        for solver in solvers() {
            let (x, v) = one(def, 50.0, wind, solver, 60);
            assert!((x - path).length() < 1e-4, "{rate} {solver:?}: {x} {path}");
            assert!((v - speed).length() < 1e-4, "{rate} {solver:?}: {v} {speed}");
        }
    }
}

#[test]
fn a_fall_with_quadratic_drag_is_exact_and_ends_in_its_terminal_speed() {
    let drag = Drag { linear: 0.0, quadratic: 0.05 };
    let terminal = (50.0f64 / 0.05).sqrt();
    for solver in solvers() {
        let (x, v) = one(BodyDef { drag, ..ball(0.0, 0.0) }, 50.0, Vec2::ZERO, solver, 120);
        // tanh and ln cosh, computed from exp and log in double precision.
        let e = crate::math::exp(2.0 * 50.0 * 120.0 * DT / terminal);
        let tanh = (e - 1.0) / (e + 1.0);
        let path = 20.0 * crate::math::ln_1p((e.sqrt() + 1.0 / e.sqrt()) / 2.0 - 1.0);
        assert!((v.y + terminal * tanh).abs() < 1e-4, "{v}");
        assert!((x.y + path).abs() < 1e-4, "{x} {path}");
    }
}

#[test]
fn quadratic_drag_of_any_strength_keeps_its_terminal_speed_and_stops_fast_bodies() {
    for rate in [1e-3f32, 1.0, 1e3, 1e6] {
        let drag = Drag { linear: 0.0, quadratic: rate };
        for solver in solvers() {
            let thrown = BodyDef { drag, velocity: Vec2::new(1e4, 0.0), ..ball(0.0, 0.0) };
            let (x, v) = one(thrown, 50.0, Vec2::ZERO, solver, 3000);
            let terminal = (50.0 / f64::from(rate)).sqrt();
            assert!((v.length() / terminal - 1.0).abs() < 1e-3, "{rate}: {v} {terminal}");
            // The path of free flight after this time is an upper bound.
            assert!(
                x.x <= crate::math::ln_1p(f64::from(rate) * 1e4 * 50.0) / f64::from(rate) * 1.01
            );
        }
    }
}

#[test]
fn quadratic_drag_of_a_throw_is_of_third_order() {
    let error = |steps: u32| {
        let flown = |steps: u32| {
            let (mut x, mut v) = (DVec2::ZERO, DVec2::new(30.0, 40.0));
            let bodies_dt = 0.5 / f64::from(steps);
            for _ in 0..steps {
                let (after, path) = flight::fall(v, DVec2::new(0.0, -50.0), 0.05, bodies_dt);
                (x, v) = (x + path, after);
            }
            x
        };
        (flown(steps) - flown(1 << 14)).length()
    };
    let (coarse, fine) = (error(32), error(64));
    assert!(coarse < 2e-4 && fine < coarse / 6.0, "{coarse} {fine}");
}

#[test]
fn an_anchored_body_oscillates_exactly_for_a_hundred_periods() {
    let mut world = World::new(settings(50.0, Vec2::ZERO, solvers()[1]));
    let id = add(&mut world, ball(1.0, 0.0));
    let hook = SpringEnd::Point(Vec2::ZERO);
    let spring = Spring::tuned(id, hook, 1.0, 0.0, 1.0);
    assert!(world.add_spring(spring));
    let turn = f64::from(spring.stiffness).sqrt();
    let sag = 50.0 / f64::from(spring.stiffness);
    for step in 1..=6000 {
        world.step();
        let (sin, cos) = crate::math::sin_cos(turn * f64::from(step) * DT);
        let expected = DVec2::new(cos, sag * cos - sag);
        let error = (world.position(id).as_dvec2() - expected).length();
        assert!(error < 1e-4, "step {step}: {error}, {sin}");
    }
}

/// Worlds with all kinds of springs: to a point, with and without rest length, and between bodies.
fn stiff_worlds(turn: f32, ratio: f32, solver: Solver) -> Vec<World> {
    let mut worlds = Vec::new();
    for (length, two) in [(0.0, false), (2.0, false), (2.0, true), (0.0, true)] {
        let meets = [0; GROUPS_MAX];
        let mut world = World::new(WorldSettings { meets, ..settings(0.0, Vec2::ZERO, solver) });
        let id = add(&mut world, ball(length + 1.0, 0.0));
        let hook = match two {
            true => SpringEnd::Body(add(&mut world, ball(0.0, 0.0))),
            false => SpringEnd::Point(Vec2::ZERO),
        };
        let mass = if two { 0.5 } else { 1.0 };
        let spring = Spring::tuned(id, hook, turn / std::f32::consts::TAU, ratio, mass);
        world.add_spring(Spring { rest_length: length, ..spring });
        worlds.push(world);
    }
    worlds
}

/// Extension of a world's only spring beyond its rest length.
fn stretch(world: &World) -> f64 {
    let spring = world.springs()[0];
    let far = match spring.end {
        SpringEnd::Point(point) => point,
        SpringEnd::Body(other) => world.position(other),
    };
    let span = world.position(spring.body).as_dvec2() - far.as_dvec2();
    span.length() - f64::from(spring.rest_length)
}

#[test]
fn springs_of_any_stiffness_stay_bounded_and_come_to_rest_at_their_length() {
    for solver in solvers() {
        for stiff in [0.1f32, 1.0, 3.0, 30.0, 1000.0] {
            for ratio in [0.0, 0.1, 1.0, 5.0] {
                let turn = stiff * 60.0;
                for (index, mut world) in stiff_worlds(turn, ratio, solver).into_iter().enumerate()
                {
                    let mut last = stretch(&world);
                    let most = last;
                    let what = format!("{solver:?}, {index}, w h = {stiff}, ratio {ratio}");
                    for _ in 0..600 {
                        world.step();
                        let now = stretch(&world);
                        assert!(now.abs() <= most * 1.001 + 1e-5, "{what}: {now}");
                        let towards = now <= last + 1e-5 && now >= -1e-5;
                        assert!(ratio < 1.0 || towards, "{what}: {last} to {now}");
                        last = now;
                    }
                    // The spring is overdamped, and the slow part has decayed at its own rate.
                    let slow = f64::from(turn) * (5.0 - 24f64.sqrt()) * 10.0;
                    let decay = if ratio < 5.0 { f64::from(turn * ratio) * 10.0 } else { slow };
                    if decay > 15.0 {
                        assert!(last.abs() < 1e-4, "{what}: {last} from rest");
                    }
                }
            }
        }
    }
}

#[test]
fn a_stiff_pendulum_keeps_its_length_and_energy() {
    for solver in solvers() {
        let mut world = World::new(settings(50.0, Vec2::ZERO, solver));
        let id = add(&mut world, ball(10.0, 0.0));
        let hook = SpringEnd::Point(Vec2::ZERO);
        let spring = Spring::tuned(id, hook, 600.0, 0.0, 1.0);
        world.add_spring(Spring { rest_length: 10.0, ..spring });
        let mut lowest = 0.0f32;
        for _ in 0..1200 {
            world.step();
            let (x, v) = (world.position(id), world.velocity(id));
            assert!((x.length() - 10.0).abs() < 0.02, "{}", x.length());
            let energy = v.length_squared() / 2.0 + 50.0 * x.y;
            assert!(energy.abs() < 0.01 * 500.0, "{energy}");
            lowest = crate::math::min(lowest, x.y);
        }
        assert!(lowest < -9.9);
    }
}

#[test]
fn a_spring_conserves_momentum_and_is_removed_with_its_body() {
    for solver in solvers() {
        let mut world = World::new(settings(0.0, Vec2::ZERO, solver));
        let a = add(&mut world, BodyDef { mass: 3.0, ..ball(0.0, 0.0) });
        let b = add(&mut world, BodyDef { velocity: Vec2::new(1.0, 5.0), ..ball(4.0, 0.0) });
        let (end, mass) = (SpringEnd::Body(b), 0.75);
        let spring = Spring { rest_length: 2.0, ..Spring::tuned(a, end, 3.0, 0.2, mass) };
        world.add_spring(spring);
        for _ in 0..300 {
            world.step();
            let sum = world.velocity(a) * 3.0 + world.velocity(b);
            assert!((sum - Vec2::new(1.0, 5.0)).length() < 1e-4, "{sum}");
        }
        assert!((world.position(b) - world.position(a)).length() > 1.9);
        world.remove(b);
        assert!(world.springs().is_empty());
        let before = world.velocity(a);
        world.step();
        assert_eq!(world.velocity(a), before);
    }
}

#[test]
fn a_spring_presses_a_body_onto_the_floor_and_no_further() {
    for solver in solvers() {
        let mut world = World::new(settings(10.0, Vec2::ZERO, solver));
        let floor =
            BodyDef { motion: Motion::Static, shape: Shape::rect(20.0, 2.0), ..ball(0.0, -1.0) };
        add(&mut world, floor);
        let id = add(&mut world, ball(0.0, 3.0));
        world.add_spring(Spring::tuned(id, SpringEnd::Point(Vec2::new(0.0, -2.0)), 3.0, 0.5, 1.0));
        (0..300).for_each(|_| world.step());
        let (x, v) = (world.position(id), world.velocity(id));
        assert!((x.y - 0.25).abs() < 0.02 && v.length() < 0.01, "{solver:?}: {x} {v}");
    }
}

/// Two bodies with drag, tied to each other; one also hangs from a hook.
fn tied(solver: Solver) -> World {
    let mut world = World::new(settings(50.0, Vec2::new(3.0, 0.0), solver));
    let drag = Drag { linear: 0.5, quadratic: 0.01 };
    let a = add(&mut world, BodyDef { drag, ..ball(0.0, 20.0) });
    let b = add(&mut world, BodyDef { drag, ..ball(3.0, 20.0) });
    let spring = Spring::tuned(b, SpringEnd::Body(a), 4.0, 0.1, 0.5);
    world.add_spring(Spring { rest_length: 3.0, ..spring });
    world.add_spring(Spring::tuned(a, SpringEnd::Point(Vec2::new(0.0, 20.0)), 2.0, 0.0, 1.0));
    add(&mut world, BodyDef { drag, ..ball(-9.0, 20.0) });
    world
}

#[test]
fn a_restored_world_continues_as_if_it_had_never_stopped() {
    for solver in solvers() {
        let mut world = tied(solver);
        for _ in 0..50 {
            let mut out = StateWriter::default();
            world.save(&mut out);
            let mut bytes = StateReader::new(&out.0);
            let mut copy = World::restore(world.settings().clone(), &mut bytes).expect("own bytes");
            bytes.end().expect("all is read");
            assert_eq!(copy.first_difference(&world).map(|d| d.to_string()), None);
            copy.step();
            world.step();
            assert_eq!(copy.hash(), world.hash());
        }
    }
}

/// A stiff spring notices a fast body from further away than a slow one, even in a restored world.
#[test]
fn a_restored_spring_meets_what_flies_past() {
    for solver in solvers() {
        let mut world = World::new(settings(0.0, Vec2::ZERO, solver));
        let held = add(&mut world, ball(0.0, 0.0));
        world.add_spring(Spring::tuned(held, SpringEnd::Point(Vec2::new(0.0, 0.5)), 8.0, 0.0, 1.0));
        for index in 0..8 {
            let velocity = Vec2::new(-40.0 - 5.0 * index as f32, 3.0 * index as f32 - 9.0);
            add(&mut world, BodyDef { velocity, ..ball(6.0 + 4.0 * index as f32, 2.2) });
        }
        for _ in 0..60 {
            let mut out = StateWriter::default();
            world.save(&mut out);
            let mut bytes = StateReader::new(&out.0);
            let mut copy = World::restore(world.settings().clone(), &mut bytes).expect("own bytes");
            copy.step();
            world.step();
            assert_eq!(copy.hash(), world.hash(), "{solver:?}");
        }
    }
}

#[test]
fn the_hash_covers_drag_and_springs_only_where_there_are_some() {
    let solver = Solver::default();
    let plain = |forces: Option<ForceSettings>| {
        let mut world = World::new(WorldSettings { forces, ..settings(50.0, Vec2::ZERO, solver) });
        add(&mut world, ball(0.0, 0.0));
        world
    };
    let some = Some(ForceSettings { springs_max: 1, ..ForceSettings::default() });
    assert_ne!(plain(None).hash(), plain(some).hash());
    let mut sprung = plain(some);
    let id = sprung.ids().next().expect("one body");
    sprung.add_spring(Spring::tuned(id, SpringEnd::Point(Vec2::ZERO), 1.0, 0.0, 1.0));
    let difference = sprung.first_difference(&plain(some)).expect("a spring more");
    assert_eq!(difference.to_string(), "world springs: 1 against 0");
    assert!(!sprung.add_spring(Spring::tuned(id, SpringEnd::Point(Vec2::ONE), 1.0, 0.0, 1.0)));
}

#[test]
fn any_bytes_are_read_without_a_panic() {
    let mut out = StateWriter::default();
    let world = tied(Solver::default());
    world.save(&mut out);
    let mut rng = crate::rng::Rng::new(7, 7);
    for _ in 0..3000 {
        let mut bytes = out.0.clone();
        for _ in 0..3 {
            let at = rng.below(bytes.len() as u32) as usize;
            bytes[at] = rng.next_u32() as u8;
        }
        if let Ok(mut world) =
            World::restore(world.settings().clone(), &mut StateReader::new(&bytes))
        {
            (0..3).for_each(|_| world.step());
        }
    }
}

/// A force whose displacement the contacts do not undo would lift resting bodies a little in every step.
#[test]
fn a_stack_rests_under_drag_wind_and_springs() {
    for (drag, wind, pull) in [
        (Drag { linear: 1e-3, quadratic: 0.0 }, Vec2::ZERO, 0.0),
        (Drag { linear: 0.0, quadratic: 1e-3 }, Vec2::ZERO, 0.0),
        (Drag { linear: 2.0, quadratic: 0.0 }, Vec2::new(4.0, 0.0), 0.0),
        (Drag::NONE, Vec2::ZERO, 3.0),
    ] {
        for solver in solvers() {
            let mut world = World::new(settings(50.0, wind, solver));
            let floor = BodyDef {
                shape: Shape::rect(100.0, 10.0),
                motion: Motion::Static,
                ..ball(0.0, -5.0)
            };
            add(&mut world, floor);
            let stack: Vec<BodyId> = (0..6)
                .map(|index| {
                    let shape = Shape::rect(2.0, 2.0);
                    add(&mut world, BodyDef { shape, drag, ..ball(0.0, 1.0 + 2.0 * index as f32) })
                })
                .collect();
            if pull > 0.0 {
                let end = SpringEnd::Point(Vec2::new(0.0, 15.0));
                let (rest_length, stiffness, damping) = (0.0, pull, 0.0);
                world.add_spring(Spring { body: stack[5], end, rest_length, stiffness, damping });
            }
            (0..300).for_each(|_| world.step());
            let before: Vec<Vec2> = stack.iter().map(|&id| world.position(id)).collect();
            for _ in 0..120 {
                world.step();
                for (&id, &place) in stack.iter().zip(&before) {
                    let off = (world.position(id) - place).length();
                    assert!(off < 2e-3, "{drag:?} {wind} {solver:?}: body {} by {off}", id.index);
                    let speed = world.velocity(id).length();
                    assert!(speed < 0.02, "{drag:?} {wind} {solver:?}: at {speed}");
                }
            }
        }
    }
}

/// Lets a ball oscillate about a point once a second with this method. Returns its energy at the end of each second,
/// relative to the start.
fn orbit(euler: EulerGroups, solver: Solver) -> Vec<f64> {
    let mut settings = settings(0.0, Vec2::ZERO, solver);
    settings.forces = Some(ForceSettings { springs_max: 1, euler, ..ForceSettings::default() });
    let mut world = World::new(settings);
    let def = ball(10.0, 0.0);
    let id = add(&mut world, BodyDef { group: 3, velocity: Vec2::new(0.0, 40.0), ..def });
    world.add_spring(Spring::tuned(id, SpringEnd::Point(Vec2::ZERO), 1.0, 0.0, def.mass));
    let turn = std::f64::consts::TAU;
    let energy = |world: &World| {
        let (x, v) = (world.position(id).as_dvec2(), world.velocity(id).as_dvec2());
        v.length_squared() + turn * turn * x.length_squared()
    };
    let start = energy(&world);
    let mut second = || {
        (0..60).for_each(|_| world.step());
        energy(&world) / start
    };
    (0..10).map(|_| second()).collect()
}

#[test]
fn the_explicit_method_gains_energy_the_symplectic_one_keeps_it() {
    let turn = std::f64::consts::TAU * DT;
    for solver in solvers() {
        let explicit = orbit(EulerGroups { explicit: 1 << 3, symplectic: 0 }, solver);
        for (second, energy) in (1..).zip(explicit) {
            // Each step multiplies the energy by 1 + (w h)^2.
            let expected: f64 = std::iter::repeat_n(1.0 + turn * turn, 60 * second).product();
            assert!((energy / expected - 1.0).abs() < 1e-3, "{second} s: {energy} {expected}");
        }
        let symplectic = orbit(EulerGroups { explicit: 0, symplectic: 1 << 3 }, solver);
        assert!(symplectic.iter().all(|energy| (energy - 1.0).abs() < turn), "{symplectic:?}");
        assert!(symplectic.iter().any(|energy| (energy - 1.0).abs() > 1e-4), "{symplectic:?}");
        let other_group = orbit(EulerGroups { explicit: 1 << 4, symplectic: 1 << 2 }, solver);
        assert!(other_group.iter().all(|energy| (energy - 1.0).abs() < 1e-4), "{other_group:?}");
    }
}

#[test]
fn euler_bodies_feel_gravity_drag_wind_and_springs() {
    let euler = EulerGroups { explicit: 1 << 1, symplectic: 1 << 2 };
    let forces = ForceSettings { wind: Vec2::new(6.0, 0.0), springs_max: 2, euler };
    for solver in solvers() {
        let mut settings = settings(50.0, Vec2::ZERO, solver);
        settings.forces = Some(forces);
        let mut world = World::new(settings);
        let drag = Drag { linear: 0.5, quadratic: 0.25 };
        let velocity = Vec2::new(2.0, 3.0);
        let def = |group, x| BodyDef { group, drag, velocity, mass: 2.0, ..ball(x, 0.0) };
        let [a, b] = [def(1, 0.0), def(2, 20.0)].map(|def| add(&mut world, def));
        let end = SpringEnd::Body(b);
        let spring = Spring { body: a, end, rest_length: 15.0, stiffness: 8.0, damping: 1.0 };
        assert!(world.add_spring(spring));
        world.step();
        let through_air = DVec2::new(-4.0, 3.0);
        let slowed = -through_air * (0.5 + 0.25 * 5.0);
        let acceleration = |pull: f64| DVec2::new(pull / 2.0, -50.0) + slowed;
        let gain = [acceleration(40.0), acceleration(-40.0)].map(|gained| gained * DT);
        for ((id, gain), weight) in [a, b].into_iter().zip(gain).zip([0.0, 1.0]) {
            let start = if id == a { DVec2::ZERO } else { DVec2::new(20.0, 0.0) };
            let before = velocity.as_dvec2();
            let (x, v) = (world.position(id).as_dvec2(), world.velocity(id).as_dvec2());
            assert!((v - before - gain).length() < 1e-5, "{v}");
            let path = (before + gain * weight) * DT;
            assert!((x - start - path).length() < 1e-5, "{x}");
        }
    }
}
