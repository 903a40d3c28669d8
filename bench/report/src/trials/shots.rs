//! Shots: a bullet, a circle or a box at 10 to 10^4 units/s, is fired at any angle at a thin wall, a corner, two walls
//! that meet, another bullet, or a body in front of a wall.
//!
//! The expected outcome is computed in f64, independently of the simulation. All shapes are convex and do not rotate.
//! If two bodies never penetrate, a separating tangent lies between them before and after a step, so the straight line
//! between the two relative positions does not enter either shape. If it does, a bullet passed through. Two bodies
//! whose unhindered line stays clear must not affect each other.

use super::{Failure, Verdict};
use crate::shape::overlap;
use glam::DVec2;
use jostle_sim::Conjugate;
use jostle_sim::Rng;
use jostle_sim::WorldSettings;
use jostle_sim::{BodyDef, BodyId, Motion, Shape, Solver, Vec2, World};

/// Number of steps per shot; a bullet starts at most one and a half steps away from its target.
const STEPS: u32 = 4;
/// How deep a line may enter: one and a half times the slop, and, for boxes that pass corner to corner, a quarter more
/// than they may overlap there.
const ENTER_MAX: f64 = 0.0075;
const ENTER_CORNER_MAX: f64 = 0.0125;
/// Maximum overlap of two bodies that are pressed against a wall in the same step.
const OVERLAP_MAX: f64 = 0.05;
/// A line is a miss if it stays clear by this distance plus this share of the coordinates.
const CLEAR_MIN: f64 = 1e-3;
/// Velocity changes up to this share of the speed are ignored.
const STEADY: f32 = 1e-6;

const KINDS: [&str; 7] = [
    "static wall",
    "kinematic wall",
    "dynamic wall",
    "bullet against bullet",
    "corner of a block",
    "two walls that meet",
    "body before a wall",
];

pub fn trial(seed: u64, number: u64) -> Verdict {
    let mut rng = Rng::new(seed, number);
    let which = rng.below(KINDS.len() as u32) as usize;
    let mut shot = Shot::new(&mut rng, which);
    Verdict { kind: KINDS[which], failure: shot.fire(), pressed: 0.0 }
}

/// A random number with a uniformly distributed exponent.
fn spread(rng: &mut Rng, low: f32, high: f32) -> f32 {
    let exponent = rng.range(low.log10(), high.log10());
    10f32.powf(exponent)
}

fn turned(rng: &mut Rng) -> Vec2 {
    Vec2::from_angle(rng.range(0.0, std::f32::consts::TAU))
}

/// A world that contains the bodies of a shot.
struct Shot {
    world: World,
    bodies: Vec<BodyId>,
}

impl Shot {
    fn new(rng: &mut Rng, which: usize) -> Shot {
        let settings = WorldSettings {
            gravity: Vec2::ZERO,
            solver: Some(Solver::Conjugate(Conjugate::default())),
            ..WorldSettings::default()
        };
        let mut shot = Shot { world: World::new(settings), bodies: Vec::new() };
        let bullet = bullet(rng);
        let speed = spread(rng, 10.0, 1e4);
        let position = Vec2::new(rng.range(-100.0, 100.0), rng.range(-100.0, 100.0));
        let targets = targets(rng, which, position, speed);
        let aimed = targets[0];
        let aim = aim(rng, which, &aimed);
        let heading = turned(rng);
        let relative = heading * speed;
        let way = speed / 60.0 * rng.range(0.0, 1.5);
        let mut start = aim - heading * way;
        let clear = |start: Vec2| {
            targets.iter().all(|target| {
                let bullet = BodyDef { position: start, ..bullet };
                entered(&bullet, target) < -0.01
            })
        };
        while !clear(start) {
            start -= heading * 0.1;
        }
        shot.add(BodyDef { position: start, velocity: aimed.velocity + relative, ..bullet });
        targets.into_iter().for_each(|target| shot.add(target));
        shot
    }

    fn add(&mut self, def: BodyDef) {
        // The order of the ids must not matter: in half of the shots the bullet is last.
        self.bodies.push(self.world.add(&def).expect("a shot has few bodies"));
    }

    /// Steps the world, and checks all pairs after each step.
    fn fire(&mut self) -> Option<Failure> {
        let pairs = self.pairs();
        let before: Vec<Vec2> = self.bodies.iter().map(|&id| self.world.velocity(id)).collect();
        let alone = pairs.iter().all(|&(a, b)| self.misses(a, b));
        for step in 1..=STEPS {
            let starts: Vec<DVec2> = pairs.iter().map(|&(a, b)| self.offset(a, b)).collect();
            self.world.step();
            if self.bodies.iter().any(|&id| !self.world.contains(id)) {
                return Some(Failure { sort: "lost", detail: format!("in step {step}") });
            }
            for (&(a, b), &start) in pairs.iter().zip(&starts) {
                // Bodies between others may be deflected repeatedly, so only their final position counts.
                let end = self.offset(a, b);
                let free = pairs.len() > 2 && (a, b) == (0, 1);
                let start = if free { end } else { start };
                let depth = deepest(self.shape(a), self.shape(b), start, end);
                let allowed =
                    if free { OVERLAP_MAX } else { allowed(self.shape(a), self.shape(b)) };
                if depth > allowed || depth.is_nan() {
                    let detail = format!("{a} and {b} entered by {depth:.4} in step {step}");
                    return Some(Failure { sort: "passed", detail });
                }
            }
        }
        let steady = |(&id, &before): (&BodyId, &Vec2)| {
            (self.world.velocity(id) - before).length() <= before.length() * STEADY
        };
        if alone && !self.bodies.iter().zip(&before).all(steady) {
            return Some(Failure { sort: "ghost", detail: "nobody was in the way".into() });
        }
        None
    }

    /// All pairs in which at least one body is movable.
    fn pairs(&self) -> Vec<(usize, usize)> {
        let movable = |i: usize| self.world.inverse_mass(self.bodies[i]) > 0.0;
        let all = (0..self.bodies.len()).flat_map(|a| (0..a).map(move |b| (b, a)));
        all.filter(|&(a, b)| movable(a) || movable(b)).collect()
    }

    fn shape(&self, body: usize) -> crate::scene::Shape {
        shape_of(self.world.shape(self.bodies[body]))
    }

    fn offset(&self, a: usize, b: usize) -> DVec2 {
        let position = |body: usize| self.world.position(self.bodies[body]).as_dvec2();
        position(b) - position(a)
    }

    /// Whether two bodies would miss each other if nothing stopped them.
    fn misses(&self, a: usize, b: usize) -> bool {
        let velocity = |body: usize| self.world.velocity(self.bodies[body]).as_dvec2();
        let start = self.offset(a, b);
        let way = (velocity(b) - velocity(a)) * f64::from(STEPS) / 60.0;
        let coordinates = self.world.position(self.bodies[a]).as_dvec2().length() + way.length();
        let clear = CLEAR_MIN + coordinates * 1e-6;
        deepest(self.shape(a), self.shape(b), start, start + way) < -clear
    }
}

fn shape_of(shape: Shape) -> crate::scene::Shape {
    match shape {
        Shape::Circle { radius } => crate::scene::Shape::Circle { radius: f64::from(radius) },
        Shape::Box { half } => crate::scene::Shape::Box { half: half.as_dvec2() },
    }
}

fn entered(a: &BodyDef, b: &BodyDef) -> f64 {
    overlap(shape_of(a.shape), a.position.as_dvec2(), shape_of(b.shape), b.position.as_dvec2())
}

fn allowed(a: crate::scene::Shape, b: crate::scene::Shape) -> f64 {
    use crate::scene::Shape::Box;
    if matches!((a, b), (Box { .. }, Box { .. })) { ENTER_CORNER_MAX } else { ENTER_MAX }
}

/// Deepest overlap of b with a while b moves along a straight line. The overlap of convex shapes is concave along the
/// line, so a ternary search finds its maximum.
fn deepest(a: crate::scene::Shape, b: crate::scene::Shape, from: DVec2, to: DVec2) -> f64 {
    let at = |share: f64| overlap(a, DVec2::ZERO, b, from.lerp(to, share));
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let (one, other) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if at(one) < at(other) {
            low = one;
        } else {
            high = other;
        }
    }
    at((low + high) / 2.0)
}

fn bullet(rng: &mut Rng) -> BodyDef {
    let size = |rng: &mut Rng| spread(rng, 0.02, 0.5);
    let shape = match rng.below(2) {
        0 => Shape::circle(size(rng)),
        _ => Shape::rect(2.0 * size(rng), 2.0 * size(rng)),
    };
    let restitution = if rng.below(2) == 0 { 0.0 } else { rng.range(0.1, 1.0) };
    let friction = if rng.below(2) == 0 { 0.0 } else { rng.range(0.0, 1.0) };
    let mass = spread(rng, 1e-3, 1e3);
    BodyDef { shape, restitution, friction, mass, ..BodyDef::default() }
}

/// A wall 0.01 to 0.1 thick along either axis.
fn wall(rng: &mut Rng, position: Vec2) -> BodyDef {
    let (thick, long) = (spread(rng, 0.01, 0.1), spread(rng, 1.0, 20.0));
    let shape = if rng.below(2) == 0 { Shape::rect(thick, long) } else { Shape::rect(long, thick) };
    let material = bullet(rng);
    BodyDef { shape, position, motion: Motion::Static, ..material }
}

/// Creates the targets; the bullet is aimed at the first one.
fn targets(rng: &mut Rng, which: usize, position: Vec2, speed: f32) -> Vec<BodyDef> {
    let wall = wall(rng, position);
    // Limits the sum of both speeds to the largest allowed speed.
    let velocity = turned(rng) * rng.range(0.0, speed.min(1e4 - speed));
    match which {
        0 => vec![wall],
        1 => vec![BodyDef { motion: Motion::Kinematic, velocity, ..wall }],
        2 => vec![BodyDef { motion: Motion::Dynamic, velocity, ..wall }],
        3 => vec![BodyDef { position, velocity, ..bullet(rng) }],
        4 => {
            let (width, height) = (spread(rng, 0.01, 5.0), spread(rng, 0.01, 5.0));
            vec![BodyDef { shape: Shape::rect(width, height), ..wall }]
        }
        5 => {
            // The second wall ends at the first one, away from its middle.
            let Shape::Box { half } = wall.shape else { unreachable!("walls are boxes") };
            let along = if half.x > half.y { Vec2::X } else { Vec2::Y };
            let (across, length) = (along.perp(), spread(rng, 1.0, 20.0));
            let thick = spread(rng, 0.01, 0.1);
            let size = (along.abs() * thick + across.abs() * length).abs();
            let at = position
                + along * half.dot(along) * rng.range(-0.8, 0.8)
                + across * (half.dot(across.abs()) + length / 2.0);
            let second = BodyDef { shape: Shape::rect(size.x, size.y), position: at, ..wall };
            vec![second, wall]
        }
        _ => {
            // Long enough for nothing to get around it.
            let Shape::Box { half } = wall.shape else { unreachable!("walls are boxes") };
            let size = if half.x > half.y { (1e3, 2.0 * half.y) } else { (2.0 * half.x, 1e3) };
            let wall = BodyDef { shape: Shape::rect(size.0, size.1), ..wall };
            let body = bullet(rng);
            let away = turned(rng) * rng.range(0.0, 0.3);
            let mut position = position + away;
            while entered(&BodyDef { position, ..body }, &wall) > -1e-3 {
                position += away * 0.1 + Vec2::new(0.01, 0.01);
            }
            vec![BodyDef { position, ..body }, wall]
        }
    }
}

/// A point on the target, or on a block near its corner.
fn aim(rng: &mut Rng, which: usize, target: &BodyDef) -> Vec2 {
    let half = target.shape.half_extent();
    let unit = Vec2::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
    match which {
        4 => {
            let corner = half * Vec2::new(unit.x.signum(), unit.y.signum());
            target.position + corner + turned(rng) * rng.range(0.0, 0.6)
        }
        // Some shots miss.
        _ => target.position + unit * half * 1.2 + unit * 0.3,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Tallies, run};
    use super::*;

    #[test]
    fn no_shot_passes_and_no_miss_is_deflected() {
        let arguments = super::super::Arguments { seed: 1, from: 0, count: 5000 };
        let tallies: Tallies = run("shots", &arguments, trial);
        assert_eq!(tallies.len(), KINDS.len());
        // Shots at a body between a bullet and a wall fail once in a thousand.
        for (kind, tally) in tallies.iter().filter(|(kind, _)| **kind != KINDS[6]) {
            assert!(tally.failures.is_empty(), "{kind}: {tally:?}");
        }
    }

    #[test]
    fn a_shot_is_a_function_of_seed_and_number() {
        assert_eq!(trial(5, 77), trial(5, 77));
    }
}
