//! Ensembles: systems that are chaotic body by body but have known means and variances. The
//! pressure of a gas from many seeds follows the gas law, and its speeds follow Maxwell's law; the
//! particles of an emitter have the moments of their distributions.
//!
//! Pressure: with the kinetic energy E of discs whose centres can move in the area A, P A = E Z in two dimensions,
//! where Z = 1 + 2 pi r^2 n / A is the correction for discs of radius r (second virial coefficient; McQuarrie 1976,
//! "Statistical mechanics", chapter 12).

use crate::engine::{Engine, State};
use crate::methods::{Family, Method};
use crate::scene::{Body, Mulberry, Scene, Shape};
use crate::stability::{Case, Outcome, Subject, largest, outcome};
use jostle_sim::{EmitterDef, Particles, Recipe, Source, Vec2};

pub const ENSEMBLES: [Case; 2] = [
    Case { id: "E1", title: "Gas from 32 seeds, e = 1, against the law of ideal gases", run: gas },
    Case {
        id: "E2",
        title: "10,000 particles of 100 emitters, against closed forms",
        run: emitters,
    },
];

/// Accepted relative error of the pressure and of the energy.
const PRESSURE: f64 = 0.02;
const ENERGY: f64 = 0.001;
/// Accepted error of a moment, in standard errors.
const SIGMAS: f64 = 3.0;

const SEEDS: u32 = 32;
const SIDE: f64 = 120.0;
const RADIUS: f64 = 0.5;
const DISCS: u32 = 100;
/// Duration of a run: ten seconds.
const TICKS: usize = 600;
/// Interval between readings of the speeds, in ticks.
const LOOK: usize = 60;

fn gas(subject: &Subject) -> Outcome {
    outcome(|out| {
        let (mut pressures, mut energies, mut speeds) = (Vec::new(), Vec::new(), Vec::new());
        for seed in 0..SEEDS {
            let run = Gas::of(subject, seed)?;
            pressures.push(run.pressure);
            energies.push((run.energy - 1.0).abs());
            speeds.extend(run.energies);
        }
        let mean = pressures.iter().sum::<f64>() / pressures.len() as f64;
        let spread = pressures.iter().map(|p| (p - mean).powi(2)).sum::<f64>();
        let deviation = (spread / (pressures.len() as f64 - 1.0)).sqrt();
        let variant = "32 seeds, 10 s each";
        let error = (mean - 1.0).abs();
        out.check(variant, "pressure, relative error of the mean", PRESSURE, error);
        let standard = deviation / f64::from(SEEDS).sqrt();
        out.check(variant, "pressure, standard error of the mean", PRESSURE / 2.0, standard);
        let worst = largest(energies.into_iter());
        out.check(variant, "energy, largest relative error", ENERGY, worst);
        // Kolmogorov's bound at 0.1 %, with one independent energy per disc.
        let independent = f64::from(SEEDS * DISCS);
        let distance = from_exponential(speeds);
        out.check(variant, "distance from Maxwell's law", 1.95 / independent.sqrt(), distance);
        Ok(())
    })
}

/// Results of one run of a gas.
struct Gas {
    /// Mean pressure on the four walls, relative to the gas law at the initial energy.
    pressure: f64,
    /// Final energy, relative to the initial one.
    energy: f64,
    /// Energy of every disc at every reading in the second half, relative to the initial mean.
    energies: Vec<f64>,
}

impl Gas {
    fn of(subject: &Subject, seed: u32) -> Result<Gas, String> {
        let scene = scene(seed);
        let mut engine = subject.build(&scene)?;
        let read = |engine: &dyn Engine| -> Vec<State> {
            scene.dynamic().map(|body| engine.state(body)).collect()
        };
        let mass = Shape::Circle { radius: RADIUS }.area();
        let energy = |states: &[State]| -> f64 {
            states.iter().map(|state| 0.5 * mass * state.velocity.length_squared()).sum()
        };
        let mut before = read(engine.as_ref());
        let start = energy(&before);
        let (mut given, mut energies) = (0.0, Vec::new());
        for tick in 1..=TICKS {
            engine.tick();
            let states = read(engine.as_ref());
            let pairs = before.iter().zip(&states);
            given += pairs.map(|(old, new)| mass * from_walls(old, new, scene.tick_s)).sum::<f64>();
            if tick > TICKS / 2 && tick.is_multiple_of(LOOK) {
                let mean = start / f64::from(DISCS);
                energies.extend(states.iter().map(|state| energy(&[*state]) / mean));
            }
            before = states;
        }
        let free = (SIDE - 2.0 * RADIUS).powi(2);
        let crowding = 1.0 + 2.0 * std::f64::consts::PI * RADIUS.powi(2) * f64::from(DISCS) / free;
        let pressure = given / (4.0 * (SIDE - 2.0 * RADIUS) * TICKS as f64 * scene.tick_s);
        let law = start * crowding / free;
        Ok(Gas { pressure: pressure / law, energy: energy(&before) / start, energies })
    }
}

/// A gas scene: random velocities, positions on a grid.
fn scene(seed: u32) -> Scene {
    let mut scene = Scene { bounce_threshold: 0.0, ..Scene::new(0.0) };
    scene.contain(SIDE, SIDE, 0.0, 1.0);
    let mut draws = Mulberry(0x6A50_0000 + seed);
    for i in 0..DISCS {
        let (x, y) = (12.0 * (f64::from(i % 10) + 0.5), 12.0 * (f64::from(i / 10) + 0.5));
        let (vx, vy) = (normal(&mut draws) * 25.0, normal(&mut draws) * 25.0);
        let disc = Body::new(Shape::Circle { radius: RADIUS }, x, y).moving(vx, vy);
        scene.add(disc.of_stuff(0.0, 1.0));
    }
    scene
}

/// A random number with mean 0 and variance 1. A sum of twelve uniform numbers is close enough to a normal
/// distribution, since the gas reaches its equilibrium distribution anyway.
fn normal(draws: &mut Mulberry) -> f64 {
    (0..12).map(|_| draws.unit()).sum::<f64>() - 6.0
}

/// The change in a disc's speed caused by walls during a tick. A velocity component counts if it was reversed within
/// reach of the wall ahead.
fn from_walls(old: &State, new: &State, tick_s: f64) -> f64 {
    let along = |axis: usize| {
        let (speed, then) = (old.velocity[axis], new.velocity[axis]);
        let reach = RADIUS + speed.abs().max(then.abs()) * tick_s + 0.01;
        let ahead = if speed > 0.0 { SIDE - new.position[axis] } else { new.position[axis] };
        if speed * then < 0.0 && ahead < reach { (then - speed).abs() } else { 0.0 }
    };
    along(0) + along(1)
}

/// Kolmogorov-Smirnov distance between values and the exponential distribution with mean 1, which energies follow in
/// two dimensions.
fn from_exponential(mut found: Vec<f64>) -> f64 {
    found.sort_by(f64::total_cmp);
    let count = found.len() as f64;
    let distance = |(rank, energy): (usize, &f64)| {
        let share = 1.0 - (-energy).exp();
        (share - rank as f64 / count).abs().max((share - (rank + 1) as f64 / count).abs())
    };
    found.iter().enumerate().map(distance).fold(0.0, f64::max)
}

const EMITTERS: u32 = 100;
const COUNT: u16 = 100;
const LIFE: [u16; 2] = [600, 1199];
const SIZE: [f32; 2] = [1.0, 3.0];
const CORNERS: [Vec2; 2] = [Vec2::new(-20.0, 10.0), Vec2::new(40.0, 50.0)];

/// A distribution, described by its mean, variance and fourth moment, the last relative to the square of the variance.
#[derive(Clone, Copy)]
struct Law {
    mean: f64,
    variance: f64,
    kurtosis: f64,
}

fn emitters(subject: &Subject) -> Outcome {
    outcome(|out| {
        if !has_particles(&subject.method) {
            return Err("it has no particles".into());
        }
        for (variant, round) in [("box of velocities", false), ("ellipse of velocities", true)] {
            let particles = emitted(round);
            let made = f64::from(EMITTERS) * f64::from(COUNT);
            let off = (particles.len() as f64 - made).abs();
            out.check(variant, "particles too many or too few", 0.0, off);
            for (axis, name) in ["x", "y"].into_iter().enumerate() {
                let (low, high) = (f64::from(CORNERS[0][axis]), f64::from(CORNERS[1][axis]));
                let law = if round { law_of_ellipse(low, high) } else { uniform(low, high) };
                let speeds = particles.velocities().iter().map(|v| f64::from(v[axis])).collect();
                let metrics = match name {
                    "x" => ["mean of v.x, sigmas off", "variance of v.x, sigmas off"],
                    _ => ["mean of v.y, sigmas off", "variance of v.y, sigmas off"],
                };
                check_moments(out, variant, metrics, speeds, law);
            }
            let lives = (0..particles.len()).map(|i| f64::from(particles.age(i).1)).collect();
            let whole = f64::from(LIFE[1] - LIFE[0] + 1);
            let law = Law {
                mean: f64::midpoint(f64::from(LIFE[0]), f64::from(LIFE[1])),
                variance: (whole * whole - 1.0) / 12.0,
                kurtosis: 1.8,
            };
            let metrics = ["mean of the life, sigmas off", "variance of the life, sigmas off"];
            check_moments(out, variant, metrics, lives, law);
        }
        let gone = alive_after(u32::from(LIFE[1]) + 200);
        out.check("after the longest life", "particles left", 0.0, gone as f64);
        Ok(())
    })
}

/// Whether a method supports particles, which do not depend on the contact solver.
fn has_particles(method: &Method) -> bool {
    method.family == Family::Jostle
}

/// Compares the mean and variance with their expected values, in standard errors for this number of draws.
fn check_moments(
    out: &mut Outcome,
    variant: &str,
    metrics: [&'static str; 2],
    found: Vec<f64>,
    law: Law,
) {
    let count = found.len() as f64;
    let mean = found.iter().sum::<f64>() / count;
    let variance = found.iter().map(|x| (x - law.mean).powi(2)).sum::<f64>() / count;
    let mean_off = (mean - law.mean).abs() / (law.variance / count).sqrt();
    let share_off = (variance / law.variance - 1.0).abs();
    out.check(variant, metrics[0], SIGMAS, mean_off);
    out.check(variant, metrics[1], SIGMAS, share_off / ((law.kurtosis - 1.0) / count).sqrt());
}

fn uniform(low: f64, high: f64) -> Law {
    Law { mean: f64::midpoint(low, high), variance: (high - low).powi(2) / 12.0, kurtosis: 1.8 }
}

/// For a square (x, y) in [-1, 1]^2 mapped to a disc by x sqrt(1 - y^2 / 2), the second moment is 1/3 (1 - 1/6) and the
/// fourth 1/5 (1 - 1/3 + 1/20).
fn law_of_ellipse(low: f64, high: f64) -> Law {
    let half = (high - low) / 2.0;
    let (second, fourth) = (5.0 / 18.0, 43.0 / 300.0);
    let kurtosis = fourth / (second * second);
    Law { mean: f64::midpoint(low, high), variance: half * half * second, kurtosis }
}

/// Returns all particles after every emitter has finished. No forces act on them.
fn emitted(round: bool) -> Particles {
    let recipe = Recipe {
        life_ticks: LIFE,
        velocity: CORNERS,
        size: SIZE,
        round,
        acceleration: Vec2::ZERO,
        drag: 1.0,
        ..Recipe::default()
    };
    let mut particles = Particles::new(vec![recipe], usize::MAX);
    for seed in 0..EMITTERS {
        let source = Source::Point(Vec2::ZERO);
        particles.start(EmitterDef { recipe: 0, count: COUNT, seed, source });
    }
    while particles.emitter_count() > 0 {
        particles.step(&[], |_| None);
    }
    particles
}

fn alive_after(ticks: u32) -> usize {
    let mut particles = emitted(false);
    (0..ticks).for_each(|_| particles.step(&[], |_| None));
    particles.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn a_disc_gets_its_speed_from_a_wall_only_near_one() {
        let state = |x: f64, vx: f64| State {
            position: DVec2::new(x, 60.0),
            velocity: DVec2::new(vx, 3.0),
        };
        assert_eq!(from_walls(&state(0.7, -30.0), &state(0.8, 30.0), 1.0 / 60.0), 60.0);
        assert_eq!(from_walls(&state(60.0, -30.0), &state(60.0, 30.0), 1.0 / 60.0), 0.0);
        assert_eq!(from_walls(&state(0.7, 30.0), &state(1.2, 30.0), 1.0 / 60.0), 0.0);
    }

    #[test]
    fn the_distance_from_an_exponential_law_tells_it_from_another() {
        let law: Vec<f64> =
            (0..1000).map(|i| -(1.0 - (f64::from(i) + 0.5) / 1000.0).ln()).collect();
        assert!(from_exponential(law.clone()) < 1e-3);
        assert!(from_exponential(law.iter().map(|x| 0.8 * x).collect()) > 0.05);
    }

    #[test]
    fn emitters_follow_their_distributions() {
        let method = crate::methods::METHODS[0];
        let out = emitters(&Subject { method, quick: true });
        assert_eq!(out.checks.len(), 15);
        for check in out.checks {
            assert!(check.passes(), "{} {}: {}", check.variant, check.metric, check.measured);
        }
    }
}
