//! Tests that springs never add energy, by checking the sum of the kinetic energy and the potential energies of
//! gravity and springs in free flight, against a floor and among moving bodies, with both solvers.

use super::*;
use crate::rng::Rng;
use crate::shape::Shape;
use crate::solver::Solver;
use crate::world::{BodyDef, World, WorldSettings};
use crate::{BodyId, Conjugate};

/// Share of the initial energy by which rounding may raise it.
const ROUNDING_SHARE: f64 = 2e-3;

fn solvers() -> [Solver; 2] {
    [Solver::default(), Solver::Conjugate(Conjugate::default())]
}

fn world(gravity: f32, solver: Solver) -> World {
    World::new(WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        forces: Some(ForceSettings { springs_max: 1024, ..ForceSettings::default() }),
        solver: Some(solver),
        speed_max: 1e6,
        ..WorldSettings::default()
    })
}

fn add(world: &mut World, def: BodyDef) -> BodyId {
    world.add(&def).expect("there is room")
}

fn ball(radius: f32, mass: f32, position: Vec2) -> BodyDef {
    let shape = Shape::circle(radius);
    BodyDef { shape, mass, position, friction: 0.0, restitution: 0.0, ..BodyDef::default() }
}

/// A floor whose top is at height 10.
fn floor(restitution: f32) -> BodyDef {
    let (shape, position) = (Shape::rect(200.0, 20.0), Vec2::new(100.0, 0.0));
    let motion = Motion::Static;
    BodyDef { shape, position, motion, friction: 0.3, restitution, ..BodyDef::default() }
}

/// Total energy of all bodies and springs. Gravity's part is 0 at this height.
fn energy(world: &World, height: f64) -> f64 {
    let gravity = -f64::from(world.settings().gravity.y);
    let bodies = &world.bodies;
    let of_bodies = bodies.moving.iter().map(|&slot| {
        let slot = slot as usize;
        let squared = bodies.velocity[slot].as_dvec2().length_squared();
        let height = f64::from(bodies.center[slot].y) - height;
        (squared / 2.0 + gravity * height) / f64::from(bodies.inverse_mass[slot])
    });
    let of_springs = world
        .springs()
        .iter()
        .map(|spring| spring.energy(|slot| bodies.center[slot as usize].as_dvec2()));
    of_bodies.sum::<f64>() + of_springs.sum::<f64>()
}

/// The least and the greatest energy over this many steps, as shares of the initial energy.
fn extremes(world: &mut World, height: f64, steps: u32) -> (f64, f64) {
    let start = energy(world, height);
    let (mut least, mut most) = (1.0f64, 1.0f64);
    for _ in 0..steps {
        world.step();
        let share = energy(world, height) / start;
        assert!(share.is_finite());
        (least, most) = (least.min(share), most.max(share));
    }
    (least, most)
}

/// A ball attached to a point or to a second ball by a spring of this length, stretched by `amplitude`.
fn stretched(
    solver: Solver,
    frequency: f32,
    mass: f32,
    (length, amplitude): (f32, f32),
    is_pair: bool,
) -> World {
    let mut world = world(0.0, solver);
    let id = add(&mut world, ball(1.0, mass, Vec2::new(100.0 + length + amplitude, 50.0)));
    let far = Vec2::new(100.0, 50.0);
    let (end, mass) = match is_pair {
        true => (SpringEnd::Body(add(&mut world, ball(1.0, mass, far))), mass / 2.0),
        false => (SpringEnd::Point(far), mass),
    };
    let spring = Spring::tuned(id, end, frequency, 0.0, mass);
    world.add_spring(Spring { rest_length: length, ..spring });
    world
}

const FREQUENCIES: [f32; 12] =
    [0.5, 1.6, 2.8, 4.7, 10.5, 15.9, 20.0, 34.0, 60.0, 159.0, 300.0, 600.0];
const MASSES: [f32; 3] = [0.01, 1.0, 1000.0];

#[test]
fn a_free_spring_keeps_its_energy() {
    for solver in solvers() {
        for (index, frequency) in FREQUENCIES.into_iter().enumerate() {
            for (length, amplitude, is_pair) in
                [(0.0, 5.0, false), (10.0, 5.0, false), (10.0, 1.0, false), (10.0, 5.0, true)]
            {
                let (mass, stretch) = (MASSES[index % 3], (length, amplitude));
                let mut world = stretched(solver, frequency, mass, stretch, is_pair);
                let (least, most) = extremes(&mut world, 0.0, 3600);
                let what = format!("{solver:?} {frequency} Hz {mass} {stretch:?} {is_pair}");
                assert!(most < 1.0 + ROUNDING_SHARE, "{what}: {most}");
                assert!(least > 1.0 - ROUNDING_SHARE, "{what}: {least}");
            }
        }
    }
}

#[test]
fn a_spring_presses_a_ball_on_to_the_floor_and_it_stays_there() {
    for solver in solvers() {
        for index in 0..120u8 {
            let frequency = 1.0 + 5.0 * f32::from(index);
            for end in [14.0, 5.0, -40.0] {
                let mass = MASSES[usize::from(index) % 3];
                let mut world = world(50.0, solver);
                add(&mut world, floor(0.0));
                let def = BodyDef { friction: 0.3, ..ball(5.0, mass, Vec2::new(100.0, 15.0)) };
                let id = add(&mut world, def);
                let point = SpringEnd::Point(Vec2::new(100.0, end));
                world.add_spring(Spring::tuned(id, point, frequency, 0.0, mass));
                let (mut off, mut fast) = (0.0f32, 0.0f32);
                for _ in 0..120 {
                    world.step();
                    off = max(off, (world.position(id) - Vec2::new(100.0, 15.0)).length());
                    fast = max(fast, world.velocity(id).length());
                }
                let what = format!("{solver:?} {frequency} Hz {mass} to {end}: {off} {fast}");
                assert!(off < 0.02 && fast < 0.02, "{what}");
            }
        }
    }
}

/// Runs a scene with each solver, restitution and frequency. `check` gets the world at the end, the least energy, and
/// a description of the case.
fn assert_no_gain(
    solvers: &[Solver],
    restitutions: &[f32],
    frequencies: &[f32],
    steps: u32,
    scene: impl Fn(&mut World, f32, f32),
    check: impl Fn(&World, f64, &str),
) {
    for &solver in solvers {
        for &restitution in restitutions {
            for &frequency in frequencies {
                let mut world = world(50.0, solver);
                scene(&mut world, restitution, frequency);
                let (least, most) = extremes(&mut world, 13.0, steps);
                let what = format!("{solver:?}, restitution {restitution}, {frequency} Hz");
                assert!(most < 1.0 + ROUNDING_SHARE, "{what}: {most}");
                check(&world, least, &what);
            }
        }
    }
}

/// A ball above a floor, attached by a spring to a point at this height.
fn bouncing(world: &mut World, restitution: f32, frequency: f32, (mass, end): (f32, f32)) {
    add(world, floor(restitution));
    let def = ball(5.0, mass, Vec2::new(100.0, 40.0));
    let id = add(world, BodyDef { restitution, ..def });
    let end = SpringEnd::Point(Vec2::new(100.0, end));
    world.add_spring(Spring::tuned(id, end, frequency, 0.0, mass));
}

#[test]
fn a_bouncing_ball_on_a_spring_gains_no_energy() {
    for (mass, end) in [(0.01, 20.0), (1.0, 20.0), (1000.0, 20.0), (0.01, 5.0), (1000.0, 5.0)] {
        let scene = |world: &mut World, restitution: f32, frequency: f32| {
            bouncing(world, restitution, frequency, (mass, end));
        };
        assert_no_gain(
            &solvers(),
            &[0.0, 0.8, 1.0],
            &FREQUENCIES,
            3600,
            scene,
            |world, _, what| {
                let id = world.ids().nth(1).expect("the ball");
                let height = world.position(id).y;
                assert!(height > 14.9, "{what}: at {height}");
                let speed = world.velocity(id).length();
                let rests = what.contains("restitution 0,") && end < 15.0;
                assert!(!rests || speed < 0.1, "{what}: {speed} at last");
            },
        );
    }
}

#[test]
fn an_elastic_ball_on_a_soft_spring_keeps_its_energy() {
    for end in [20.0, 5.0] {
        for (frequency, kept) in
            [(0.5, 0.999), (1.6, 0.999), (2.8, 0.999), (4.7, 0.999), (10.5, 0.99)]
        {
            let mut world = world(50.0, solvers()[1]);
            bouncing(&mut world, 1.0, frequency, (1.0, end));
            let (least, most) = extremes(&mut world, 13.0, 3600);
            assert!(least > kept && most < 1.001, "{frequency} Hz to {end}: {least} to {most}");
        }
    }
}

#[test]
fn a_ball_that_bounces_less_each_time_comes_to_rest_on_a_pressing_spring() {
    for solver in solvers() {
        for frequency in FREQUENCIES {
            for restitution in [0.5, 0.8] {
                let mut world = world(50.0, solver);
                bouncing(&mut world, restitution, frequency, (1.0, 5.0));
                extremes(&mut world, 13.0, 3600);
                let id = world.ids().nth(1).expect("the ball");
                let (speed, height) = (world.velocity(id).length(), world.position(id).y);
                let what = format!("{solver:?} {frequency} Hz {restitution}: {speed} at {height}");
                assert!(speed < 0.01 && (height - 15.0).abs() < 0.02, "{what}");
            }
        }
    }
}

#[test]
fn a_pair_on_a_spring_that_falls_to_the_floor_gains_no_energy() {
    for (mass, offset) in [
        (1.0, Vec2::new(10.0, 0.0)),
        (0.01, Vec2::new(0.0, 10.0)),
        (100.0, Vec2::new(0.0, 10.0)),
        (0.01, Vec2::new(6.0, 8.0)),
        (100.0, Vec2::new(6.0, 8.0)),
    ] {
        let scene = |world: &mut World, restitution: f32, frequency: f32| {
            add(world, floor(restitution));
            let def = BodyDef { restitution, ..ball(3.0, 1.0, Vec2::new(90.0, 30.0)) };
            let id = add(world, def);
            let other = add(world, BodyDef { position: def.position + offset, mass, ..def });
            let reduced = mass / (1.0 + mass);
            let spring = Spring::tuned(id, SpringEnd::Body(other), frequency, 0.0, reduced);
            world.add_spring(Spring { rest_length: 10.0, ..spring });
        };
        assert_no_gain(&solvers(), &[0.0, 0.8, 1.0], &FREQUENCIES, 600, scene, |_, _, _| {});
    }
}

#[test]
fn a_ball_that_falls_on_a_sprung_plate_gains_no_energy() {
    for (mass, length) in [(0.01, 0.0), (1.0, 10.0), (100.0, 0.0), (100.0, 10.0)] {
        let scene = |world: &mut World, restitution: f32, frequency: f32| {
            let at = Vec2::new(90.0, 30.0);
            let def = BodyDef { restitution, ..ball(3.0, 1.0, at) };
            let id = add(world, BodyDef { shape: Shape::rect(40.0, 4.0), ..def });
            add(world, BodyDef { position: at + Vec2::new(0.0, 12.0), mass, ..def });
            let point = SpringEnd::Point(at - Vec2::new(0.0, length));
            let spring = Spring::tuned(id, point, frequency, 0.0, 1.0);
            world.add_spring(Spring { rest_length: length, ..spring });
        };
        assert_no_gain(&solvers(), &[0.0, 0.8, 1.0], &FREQUENCIES, 600, scene, |_, _, _| {});
    }
}

/// A row of planks, joined together and held at both ends, under a ball of this mass.
fn chain(world: &mut World, restitution: f32, frequency: f32, (mass, count): (f32, u8)) {
    let def = BodyDef { restitution, ..ball(3.0, 1.0, Vec2::ZERO) };
    let join = |world: &mut World, body, end| {
        let spring = Spring::tuned(body, end, frequency, 0.0, 1.0);
        world.add_spring(Spring { rest_length: 10.0, ..spring });
    };
    let at = |index: u8| Vec2::new(100.0 + 10.0 * f32::from(index), 60.0);
    let mut last = SpringEnd::Point(Vec2::new(90.0, 60.0));
    for index in 0..count {
        let (shape, position) = (Shape::rect(9.0, 2.0), at(index));
        let id = add(world, BodyDef { shape, position, ..def });
        join(world, id, last);
        last = SpringEnd::Body(id);
    }
    if let SpringEnd::Body(id) = last {
        join(world, id, SpringEnd::Point(at(count)));
    }
    add(world, BodyDef { mass, position: at(count / 2) + Vec2::new(0.0, 15.0), ..def });
}

#[test]
fn a_heavy_ball_that_falls_on_a_chain_of_planks_gains_no_energy_and_is_held() {
    for (mass, count) in [(1.0, 5), (100.0, 5), (100.0, 9)] {
        let scene = |world: &mut World, restitution: f32, frequency: f32| {
            chain(world, restitution, frequency, (mass, count));
        };
        let held = |world: &World, _: f64, what: &str| {
            let id = world.ids().last().expect("the ball");
            let height = world.position(id).y;
            let is_stiff = [20.0, 34.0, 60.0, 159.0, 300.0, 600.0]
                .iter()
                .any(|hertz| what.ends_with(&format!(" {hertz} Hz")));
            // The relaxation solver lets bodies of very different masses pass through each other.
            let holds = is_stiff && what.starts_with("Conjugate");
            assert!(!holds || height > 20.0, "{what}: at {height}");
        };
        assert_no_gain(&solvers(), &[0.0, 0.8, 1.0], &FREQUENCIES, 600, scene, held);
    }
}

#[test]
fn a_raft_of_stiff_springs_sinks_under_the_weight_that_it_carries() {
    for (solver, off) in solvers().into_iter().zip([0.3, 0.05]) {
        for frequency in [10.0, 34.0, 159.0] {
            let mut world = world(50.0, solver);
            let mut planks: Vec<BodyId> = Vec::new();
            for x in [90.0, 100.0, 110.0] {
                let def = ball(1.0, 1.0, Vec2::new(x, 60.0));
                let id = add(&mut world, BodyDef { shape: Shape::rect(9.0, 2.0), ..def });
                let end = SpringEnd::Point(def.position);
                let (rest_length, stiffness, damping) = (0.0, 20.0, 10.0);
                world.add_spring(Spring { body: id, end, rest_length, stiffness, damping });
                if let Some(&last) = planks.last() {
                    let spring = Spring::tuned(id, SpringEnd::Body(last), frequency, 0.0, 0.5);
                    world.add_spring(Spring { rest_length: 10.0, ..spring });
                }
                planks.push(id);
            }
            add(&mut world, ball(3.0, 5.0, Vec2::new(100.0, 66.0)));
            (0..1800).for_each(|_| world.step());
            let sum: f32 = planks.iter().map(|&id| world.position(id).y).sum();
            // The three springs together support a mass of 8.
            let (mean, expected) = (sum / 3.0, 60.0 - 8.0 * 50.0 / 60.0);
            assert!((mean - expected).abs() < off, "{solver:?} {frequency} Hz: {mean} {expected}");
        }
    }
}

#[test]
fn two_bodies_that_a_spring_pulls_together_stay_side_by_side() {
    for mass in [0.01, 1.0, 100.0] {
        for frequency in FREQUENCIES {
            let mut world = world(0.0, solvers()[1]);
            let def = BodyDef { mass, ..ball(3.0, mass, Vec2::new(90.0, 50.0)) };
            let id = add(&mut world, def);
            let (shape, position) = (Shape::rect(6.0, 6.0), Vec2::new(110.0, 51.0));
            let other = add(&mut world, BodyDef { shape, position, mass: 1.0, ..def });
            let reduced = mass / (1.0 + mass);
            world.add_spring(Spring::tuned(id, SpringEnd::Body(other), frequency, 0.0, reduced));
            (0..600).for_each(|_| world.step());
            let gap = (world.position(other) - world.position(id)).abs();
            let gap = max(gap.x, gap.y) - 6.0;
            assert!(gap > -0.1, "{mass} {frequency} Hz: {gap}");
        }
    }
}

/// Bodies of many sizes and masses in a box, joined at random.
fn mixed(world: &mut World, restitution: f32, seed: u64) {
    let mut rng = Rng::new(seed, 3);
    let mut unit = move || rng.unit();
    for side in [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y] {
        let (shape, position) = (Shape::rect(200.0, 200.0), Vec2::splat(100.0) + side * 190.0);
        add(world, BodyDef { shape, position, ..floor(restitution) });
    }
    let mut all = Vec::new();
    for index in 0..9u8 {
        let cell = Vec2::new(f32::from(index % 3), f32::from(index / 3)) * 60.0;
        let position = cell + Vec2::new(30.0 + 20.0 * unit(), 35.0 + 20.0 * unit());
        let mass = [0.01, 1.0, 1.0, 100.0][(unit() * 4.0) as usize % 4];
        let size = 2.0 + unit() * 12.0;
        let shape = match unit() < 0.5 {
            true => Shape::circle(size),
            false => Shape::rect(size * 2.0, size),
        };
        let velocity = (Vec2::new(unit(), unit()) - 0.5) * 200.0;
        let friction = unit();
        let def = BodyDef { shape, velocity, friction, restitution, ..ball(1.0, mass, position) };
        all.push((add(world, def), position, mass));
    }
    for _ in 0..6 {
        let mut one = || all[(unit() * 9.0) as usize % 9];
        let ((a, at, mass), (b, far, other)) = (one(), one());
        let (end, mass) = match a == b {
            true => (SpringEnd::Point(Vec2::new(unit(), unit()) * 200.0), mass),
            false => (SpringEnd::Body(b), mass * other / (mass + other)),
        };
        let frequency = FREQUENCIES[(unit() * 12.0) as usize % 12];
        let ratio = if unit() < 0.3 { unit() } else { 0.0 };
        let rest_length = if unit() < 0.3 { 0.0 } else { at.distance(far) * (0.7 + 0.6 * unit()) };
        let spring = Spring::tuned(a, end, frequency, ratio, mass);
        world.add_spring(Spring { rest_length, ..spring });
    }
}

#[test]
fn no_mixture_of_sprung_bodies_gains_energy() {
    for solver in solvers() {
        for seed in 0..60u8 {
            let mut world = world(50.0, solver);
            mixed(&mut world, [0.0, 0.8, 1.0][usize::from(seed % 3)], u64::from(seed));
            let (_, most) = extremes(&mut world, 0.0, 300);
            assert!(most < 1.0 + ROUNDING_SHARE, "{solver:?} {seed}: {most}");
            let is_inside = |at: Vec2| {
                let off = (at - 100.0).abs();
                max(off.x, off.y) < 92.0
            };
            let all_inside = world.ids().skip(4).all(|id| is_inside(world.position(id)));
            // The relaxation solver lets bodies of very different masses pass through each other.
            assert!(all_inside || solver == solvers()[0], "{seed}: one is outside");
        }
    }
}

#[test]
fn the_stiffest_springs_stay_finite_on_a_floor() {
    for solver in solvers() {
        for stiffness in [1e6, 1e9, 1e18] {
            for (damping, length) in [(0.0, 0.0), (0.0, 10.0), (1e9, 0.0), (1e9, 10.0)] {
                let mut world = world(50.0, solver);
                bouncing(&mut world, 0.8, 1.0, (0.01, 5.0));
                let id = world.ids().nth(1).expect("the ball");
                let other = add(&mut world, ball(5.0, 0.01, Vec2::new(120.0, 40.0)));
                for end in [SpringEnd::Point(Vec2::new(100.0, 5.0)), SpringEnd::Body(other)] {
                    let rest_length = length;
                    world.add_spring(Spring { body: id, end, rest_length, stiffness, damping });
                }
                (0..120).for_each(|_| world.step());
                assert_eq!(world.ids().count(), 3, "{solver:?} {stiffness} {damping} {length}");
            }
        }
    }
}

/// Bodies of very different masses at random positions above a floor, with this many random springs between them.
fn tangle(world: &mut World, rng: &mut Rng, (bodies, springs): (u32, u32), stiffness: [f32; 3]) {
    add(world, floor(0.0));
    let one_of = |rng: &mut Rng, of: [f32; 3]| of[rng.below(3) as usize];
    let body = |rng: &mut Rng| {
        let mass = one_of(rng, [0.1, 1.0, 1e4]);
        ball(1.0, mass, Vec2::new(rng.range(20.0, 180.0), rng.range(15.0, 120.0)))
    };
    let ids: Vec<BodyId> = (0..bodies).map(|_| add(world, body(rng))).collect();
    for _ in 0..springs {
        let [body, other] = [0; 2].map(|_| ids[rng.below(bodies) as usize]);
        let (rest_length, stiffness) = (rng.range(0.0, 40.0), one_of(rng, stiffness));
        if body != other {
            let end = SpringEnd::Body(other);
            world.add_spring(Spring { body, end, rest_length, stiffness, damping: 0.0 });
        }
    }
}

#[test]
fn a_tangle_of_springs_gains_no_energy_and_its_work_is_bounded() {
    let (soft, stiff) = ([1.0, 30.0, 100.0], [1e4, 1e7, 1e9]);
    // Moves are computed twice if something bounces. In the densest networks, a factorisation uses up nearly all
    // visits, and four are needed: to probe the step, to find the moves without and with obstacles, and for the
    // response.
    let most = 2 * 4 * VISITS_MAX + VISITS_MAX;
    for solver in solvers() {
        for (seed, (size, stiffness, steps)) in (0..).zip([
            ((10, 12), soft, 600),
            ((10, 12), stiff, 600),
            ((60, 90), soft, 120),
            ((60, 90), stiff, 120),
            ((45, 1000), stiff, 30),
            ((500, 1020), soft, 10),
            ((500, 1020), stiff, 10),
            ((1000, 1000), stiff, 10),
        ]) {
            let mut world = world(50.0, solver);
            tangle(&mut world, &mut Rng::new(seed, 1), size, stiffness);
            let start = energy(&world, 0.0);
            for step in 0..steps {
                world.step();
                let (share, springs) = (energy(&world, 0.0) / start, world.step_counts().springs);
                let what = format!("{solver:?} {size:?} {stiffness:?}, step {step}");
                assert!(share < 1.0 + ROUNDING_SHARE, "{what}: {share}");
                assert!(springs > 0 && springs < most, "{what}: {springs} visits");
            }
        }
    }
}
