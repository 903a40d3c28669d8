//! Tests the solver on the cases for which it is built, with the accepted limits.

mod bounces;
mod gaps;
mod islands;
mod masses;
mod rooms;
mod shaken;
mod stacks;

use super::solve_island::SWEEPS_MIN;
use super::*;
use crate::Conjugate;
use crate::rng::Rng;
use crate::shape::Shape;
use crate::solver::Solver;
use crate::world::{BodyDef, BodyId, Motion, World, WorldSettings};

const SLOP: f32 = 0.005;

fn world_with(settings: Conjugate, gravity: f32) -> World {
    World::new(WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        solver: Some(Solver::Conjugate(settings)),
        ..WorldSettings::default()
    })
}

fn world() -> World {
    world_with(Conjugate::default(), 50.0)
}

/// A world in which everything bounces, no matter how slowly it moves.
fn bouncy_world(gravity: f32) -> World {
    world_with(Conjugate { bounce_threshold: 0.0, ..Conjugate::default() }, gravity)
}

fn add(world: &mut World, def: BodyDef) -> BodyId {
    world.add(&def).expect("there is room")
}

fn fixed(world: &mut World, center: (f32, f32), half: (f32, f32), friction: f32) -> BodyId {
    let shape = Shape::rect(2.0 * half.0, 2.0 * half.1);
    let position = Vec2::new(center.0, center.1);
    let def = BodyDef { shape, position, motion: Motion::Static, friction, ..BodyDef::default() };
    add(world, BodyDef { restitution: 1.0, ..def })
}

fn floor(world: &mut World) -> BodyId {
    fixed(world, (0.0, -10.0), (1000.0, 10.0), 0.3)
}

fn crate_at(x: f32, y: f32) -> BodyDef {
    let shape = Shape::rect(2.0, 2.0);
    BodyDef { shape, position: Vec2::new(x, y), restitution: 0.0, ..BodyDef::default() }
}

fn ball_at(x: f32, y: f32) -> BodyDef {
    BodyDef { shape: Shape::circle(1.0), friction: 0.0, ..crate_at(x, y) }
}

fn steps(world: &mut World, count: usize) {
    for _ in 0..count {
        world.step();
    }
}

fn dynamic(world: &World) -> impl Iterator<Item = BodyId> + '_ {
    world.ids().filter(|&id| world.motion(id) == Motion::Dynamic)
}

fn deepest(world: &World) -> f32 {
    world.touches().iter().fold(0.0, |deepest, touch| max(deepest, touch.depth))
}

/// Root mean square of the speeds of all bodies.
fn rms_speed(world: &World) -> f64 {
    let squares = dynamic(world).map(|id| f64::from(world.velocity(id).length_squared()));
    (squares.sum::<f64>() / dynamic(world).count() as f64).sqrt()
}

fn kinetic(world: &World) -> f64 {
    let energy = |id| f64::from(world.velocity(id).length_squared() / world.inverse_mass(id)) / 2.0;
    dynamic(world).map(energy).sum()
}

fn momentum(world: &World) -> [f64; 2] {
    let mut sum = [0.0, 0.0];
    for id in dynamic(world) {
        let (velocity, mass) = (world.velocity(id), 1.0 / f64::from(world.inverse_mass(id)));
        sum = [sum[0] + mass * f64::from(velocity.x), sum[1] + mass * f64::from(velocity.y)];
    }
    sum
}

#[track_caller]
fn close(found: f32, expected: f32, tolerance: f32) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected} +- {tolerance}");
}

// --- Impacts and energy -------------------------------------------------------------------------

#[test]
fn newtons_cradle_passes_the_impact_exactly() {
    for (gap, reverse) in [(0.0, false), (0.0, true), (0.01, false), (0.01, true)] {
        let mut world = bouncy_world(0.0);
        let mut balls: Vec<(usize, BodyId)> = Vec::new();
        for index in 0..5 {
            let index = if reverse { 4 - index } else { index };
            let x = if index == 0 { -3.0 } else { (2.0 + gap) * index as f32 };
            let velocity = Vec2::new(if index == 0 { 20.0 } else { 0.0 }, 0.0);
            let def = BodyDef { restitution: 1.0, velocity, ..ball_at(x, 0.0) };
            balls.push((index, add(&mut world, def)));
        }
        balls.sort();
        steps(&mut world, 60);
        for (index, ball) in balls {
            close(world.velocity(ball).x, if index == 4 { 20.0 } else { 0.0 }, 0.02);
        }
    }
}

#[test]
fn a_ball_bounces_as_high_as_its_restitution_allows() {
    for restitution in [0.9, 1.0] {
        let mut world = bouncy_world(50.0);
        floor(&mut world);
        let ball = add(&mut world, BodyDef { restitution, ..ball_at(0.0, 21.0) });
        let (mut expected, mut rising, mut bounces) = (20.0, false, 0);
        while bounces < 10 {
            let (y, speed) = (world.position(ball).y, world.velocity(ball).y);
            if rising && speed <= 0.0 {
                bounces += 1;
                expected *= restitution * restitution;
                let height = y - 1.0 + speed * speed / 100.0;
                close(height / expected, 1.0, 1e-3);
            }
            rising = speed > 0.0;
            world.step();
        }
    }
}

#[test]
fn colliding_bodies_never_gain_energy() {
    let mut world = world_with(Conjugate::default(), 0.0);
    let mut rng = Rng::new(3, 0);
    for index in 0..200 {
        let at = Vec2::new((index % 20) as f32 * 6.0 - 57.0, (index / 20) as f32 * 6.0 - 27.0);
        let shape = match index % 2 {
            0 => Shape::circle(rng.range(1.0, 2.5)),
            _ => Shape::rect(rng.range(2.0, 5.0), rng.range(2.0, 5.0)),
        };
        let mass = rng.range(1.0, 20.0);
        add(&mut world, BodyDef { shape, mass, velocity: -at, ..crate_at(at.x, at.y) });
    }
    let mut before = kinetic(&world);
    for _ in 0..180 {
        world.step();
        let after = kinetic(&world);
        assert!(after <= before * (1.0 + 1e-6), "energy {before} became {after}");
        before = after;
    }
}

// --- Friction and riding ------------------------------------------------------------------------

#[test]
fn a_slide_stops_exactly_at_the_coulomb_distance() {
    for (friction, gravity) in [(0.3, 50.0), (0.6, 50.0), (0.3, 500.0), (1.0, 20.0)] {
        let mut world = world_with(Conjugate::default(), gravity);
        fixed(&mut world, (0.0, -10.0), (1000.0, 10.0), friction);
        let id = add(&mut world, BodyDef { friction, ..crate_at(0.0, 1.0) });
        steps(&mut world, 5);
        world.set_velocity(id, Vec2::new(40.0, 0.0));
        while world.velocity(id).x > 0.0 {
            world.step();
            assert!(world.velocity(id).x > -1e-5, "friction reversed a slide");
        }
        let exact = 1600.0 / (2.0 * friction * gravity);
        close(world.position(id).x / exact, 1.0, 1e-5);
    }
}

#[test]
fn a_rider_is_carried_by_a_moving_platform() {
    let mut world = world();
    let shape = Shape::rect(30.0, 3.0);
    let slab = BodyDef { shape, motion: Motion::Kinematic, friction: 0.6, ..BodyDef::default() };
    let slab = add(&mut world, slab);
    let rider = add(&mut world, BodyDef { friction: 0.6, ..crate_at(0.0, 2.5) });
    steps(&mut world, 30);
    for up in [10.0, -10.0, 0.0] {
        world.set_velocity(slab, Vec2::new(0.0, up));
        steps(&mut world, 60);
        close(world.velocity(rider).y, up, 1e-4);
        close(world.position(rider).y - world.position(slab).y, 2.5, SLOP);
    }
    // The floor swings sideways at up to 10 units/s. A friction of 0.6 is enough to hold the body, so no
    // slip may accumulate.
    let mut worst = 0.0;
    for step in 0..240 {
        let phase = step as f32 / 240.0;
        let speed = 10.0 * 4.0 * (0.25 - (0.5 - (phase + 0.25) % 1.0).abs());
        world.set_velocity(slab, Vec2::new(speed, 0.0));
        world.step();
        worst = max(worst, (world.position(rider).x - world.position(slab).x).abs());
    }
    assert!(worst < 0.01, "slipped by {worst}");
}

#[test]
fn flush_tiles_are_a_floor() {
    for shape in [Shape::rect(2.0, 2.0), Shape::circle(1.0)] {
        for speed in [0.1, 0.5, 1.0, 5.0, 20.0, 50.0] {
            let mut world = world();
            for tile in 0..60 {
                fixed(&mut world, (tile as f32 * 2.0, -1.0), (1.0, 1.0), 0.0);
            }
            let velocity = Vec2::new(speed, 0.0);
            let def = BodyDef { shape, velocity, friction: 0.0, ..crate_at(3.3, 1.0) };
            let id = add(&mut world, def);
            for _ in 0..400 {
                world.step();
                if world.position(id).x > 110.0 {
                    break;
                }
                assert!(world.velocity(id).y.abs() < 1e-4, "{shape:?} hops at {speed}");
            }
            close(world.velocity(id).x / speed, 1.0, 1e-5);
        }
    }
}

// --- Fast bodies --------------------------------------------------------------------------------

/// Target of a shot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    Static,
    Moving,
    Bullet,
}

/// Fires one shot in each of a hundred lanes, at speeds of 10 to 10^4, at walls 0.01 to 0.1 thick or at each other.
/// Returns how many pass.
fn shoot(target: Target, seed: u64) -> usize {
    let mut world = world_with(Conjugate::default(), 0.0);
    let mut rng = Rng::new(seed, 0);
    let mut shots = Vec::new();
    for lane in 0..100 {
        let y = lane as f32 * 4.0;
        let speed = [10.0, 100.0, 1000.0, 10_000.0][rng.below(4) as usize] * rng.range(0.3, 1.0);
        let (thick, radius) = (rng.range(0.01, 0.1), rng.range(0.05, 0.5));
        let away = radius + thick + speed / 60.0 * rng.range(0.0, 1.5);
        let bullet = BodyDef { shape: Shape::circle(radius), ..ball_at(0.0, y) };
        let wall = BodyDef { shape: Shape::rect(thick, 4.0), friction: 0.0, ..crate_at(0.0, y) };
        let def = match target {
            Target::Static => BodyDef { motion: Motion::Static, ..wall },
            Target::Moving => {
                let velocity = Vec2::new(rng.range(-speed, 0.0), 0.0);
                BodyDef { motion: Motion::Kinematic, velocity, ..wall }
            }
            Target::Bullet => {
                let (position, velocity) = (Vec2::new(away, y), Vec2::new(-speed, 0.0));
                BodyDef { position, velocity, ..bullet }
            }
        };
        let (position, velocity) = (Vec2::new(-away, y), Vec2::new(speed, 0.0));
        let other = add(&mut world, def);
        shots.push((other, add(&mut world, BodyDef { position, velocity, ..bullet })));
    }
    let mut passed = vec![false; shots.len()];
    for _ in 0..4 {
        world.step();
        for (&(other, bullet), passed) in shots.iter().zip(&mut passed) {
            *passed |= world.position(bullet).x > world.position(other).x;
        }
    }
    passed.into_iter().filter(|&passed| passed).count()
}

#[test]
fn no_bullet_tunnels_through_a_wall_or_another_bullet() {
    for target in [Target::Static, Target::Moving, Target::Bullet] {
        for seed in 0..5 {
            assert_eq!(shoot(target, seed), 0, "{target:?}, seed {seed}");
        }
    }
}

#[test]
fn a_resting_body_hit_by_a_bullet_does_not_tunnel_through_a_wall_out_of_its_reach() {
    let mut world = world_with(Conjugate::default(), 0.0);
    let velocity = Vec2::new(5000.0, 0.0);
    let hit = add(&mut world, BodyDef { shape: Shape::circle(0.2), ..ball_at(0.0, 0.0) });
    let bullet = add(
        &mut world,
        BodyDef { shape: Shape::circle(0.2), mass: 1e3, velocity, ..ball_at(-9.0, 0.0) },
    );
    fixed(&mut world, (5.0, 0.0), (0.05, 2.0), 0.0);
    steps(&mut world, 10);
    let positions = [hit, bullet].map(|id| world.position(id));
    assert!(positions.iter().all(|position| position.x < 4.75 + SLOP), "{positions:?}");
    // The wall stopped both at the same point, and they may separate in any direction.
    assert!(positions[0].distance(positions[1]) > 0.4 - SLOP, "{positions:?}");
}

// --- Overlaps -----------------------------------------------------------------------------------

#[test]
fn bodies_at_one_point_separate_and_come_to_rest() {
    for shape in [Shape::circle(1.0), Shape::rect(2.0, 2.0)] {
        let mut world = world_with(Conjugate::default(), 0.0);
        for _ in 0..60 {
            add(&mut world, BodyDef { shape, ..crate_at(0.0, 0.0) });
        }
        steps(&mut world, 120);
        assert!(world.is_finite());
        assert!(deepest(&world) <= 1.1 * SLOP, "{shape:?} overlap by {}", deepest(&world));
        assert!(rms_speed(&world) < 1e-3, "{shape:?} move at {}", rms_speed(&world));
    }
}

// --- Reports and state --------------------------------------------------------------------------

#[test]
fn a_contact_begins_once_whether_it_rests_or_bounces() {
    for (restitution, expected) in [(0.0, 1), (0.9, 2)] {
        let mut world = world();
        let ground = floor(&mut world);
        let id = add(&mut world, BodyDef { restitution, ..ball_at(0.0, 3.0) });
        let mut began = 0;
        for _ in 0..if restitution > 0.0 { 60 } else { 120 } {
            world.step();
            for touch in world.touches() {
                assert_eq!((touch.a, touch.b), (ground, id));
                assert_eq!(touch.normal, Vec2::Y);
                assert!(!touch.began || touch.closing > 10.0, "closing at {}", touch.closing);
                began += u32::from(touch.began);
            }
        }
        assert_eq!(began, expected, "restitution {restitution}");
    }
}

#[test]
fn a_budget_bounds_the_work_of_a_step() {
    let settings = Conjugate { work_max: 1000, ..Conjugate::default() };
    let mut world = world_with(settings, 50.0);
    floor(&mut world);
    let mut rng = Rng::new(2, 0);
    for index in 0..200 {
        add(&mut world, ball_at((index % 20) as f32 * 2.1, 3.0 + (index / 20) as f32 * 2.2));
        let _ = rng.next_u32();
    }
    for _ in 0..200 {
        world.step();
        let constraints = world.solvers.conjugate.contacts.constraints.len() as u64;
        assert!(world.step_counts().solves <= 1000 + u64::from(SWEEPS_MIN) * constraints);
    }
}

#[test]
fn the_same_steps_give_the_same_hash() {
    let build = || {
        let mut world = world();
        floor(&mut world);
        let mut rng = Rng::new(8, 0);
        for index in 0..60 {
            let at = ((index % 6) as f32 * 2.3, 3.0 + (index / 6) as f32 * 2.4);
            let def = if rng.below(2) == 0 { ball_at(at.0, at.1) } else { crate_at(at.0, at.1) };
            add(&mut world, BodyDef { restitution: rng.unit(), friction: rng.unit(), ..def });
        }
        world
    };
    let (mut one, mut other) = (build(), build());
    for step in 0..200 {
        other.pairs.invalidate();
        one.step();
        other.step();
        assert_eq!(one.hash(), other.hash(), "step {step}");
    }
}

// --- Rain ---------------------------------------------------------------------------------------

/// The mulberry32 generator, which defines the shared scenes.
struct Mulberry(u32);

impl Mulberry {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x6D2B_79F5);
        let mut t = self.0;
        t = (t ^ (t >> 15)).wrapping_mul(t | 1);
        t ^= t.wrapping_add((t ^ (t >> 7)).wrapping_mul(t | 61));
        f64::from(t ^ (t >> 14)) / 4_294_967_296.0
    }

    fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// A rain of `count` bodies, half of them circles and half boxes, above the floor of a container, with four times as
/// many columns as rows. `examples/rain.rs` runs larger ones.
fn rain(count: u32) -> World {
    let mut world = world();
    let columns = f64::from(4 * count).sqrt().ceil() as u32;
    let (w, h) = (8.0 * columns as f32, 8.0 * count.div_ceil(columns) as f32 + 40.0);
    for (center, half) in [
        ((w / 2.0, -10.0), (w / 2.0 + 20.0, 10.0)),
        ((w / 2.0, h + 10.0), (w / 2.0 + 20.0, 10.0)),
        ((-10.0, h / 2.0), (10.0, h / 2.0 + 20.0)),
        ((w + 10.0, h / 2.0), (10.0, h / 2.0 + 20.0)),
    ] {
        fixed(&mut world, center, half, 0.3);
    }
    let mut draws = Mulberry(0x5EED_0000 + count);
    for index in 0..count {
        let kind = draws.unit();
        let (a, b) = (1.0 + 2.5 * draws.unit(), 1.0 + 2.5 * draws.unit());
        let (jitter_x, jitter_y) = (draws.range(-0.45, 0.45), draws.range(-0.45, 0.45));
        let (shape, mass) = if kind < 0.5 {
            (Shape::circle(a as f32), std::f64::consts::PI * a * a)
        } else {
            (Shape::rect(2.0 * a as f32, 2.0 * b as f32), 4.0 * a * b)
        };
        let x = 8.0 * (f64::from(index % columns) + 0.5) + jitter_x;
        let y = 8.0 * (f64::from(index / columns) + 0.5) + jitter_y;
        let def = BodyDef { shape, mass: mass as f32, ..crate_at(x as f32, y as f32) };
        add(&mut world, def);
    }
    world
}

#[test]
fn rain_lands_without_overlap_and_lies_still() {
    let mut world = rain(1000);
    for _ in 0..240 {
        world.step();
        assert!(deepest(&world) <= 0.02, "overlap {}", deepest(&world));
    }
    assert!(rms_speed(&world) < 0.01, "rms speed {}", rms_speed(&world));
}
