//! A recorded run, with the overlap, energy and speeds after every tick.

use crate::engine::{Engine, State};
use crate::scene::Scene;
use crate::shape::overlaps;

/// The readings after one tick.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Seconds since the start.
    pub time_s: f64,
    /// Deepest overlap in units.
    pub overlap: f64,
    /// Kinetic and potential energy, in mass units * units^2 / s^2.
    pub energy: f64,
    /// Root mean square of the dynamic bodies' speeds, in units/s.
    pub rms: f64,
    /// Speed of the fastest body in units/s.
    pub fastest: f64,
    /// Largest upward speed; 0 if no body rises.
    pub rising: f64,
}

pub struct Run {
    /// One sample per tick, including the start.
    pub samples: Vec<Sample>,
    /// The states at the end.
    pub last: Vec<State>,
    /// The scene as it was at the start.
    pub scene: Scene,
}

impl Run {
    /// Runs and records an engine; `act` may interfere before each tick.
    pub fn record(
        engine: &mut dyn Engine,
        scene: &Scene,
        seconds: f64,
        mut act: impl FnMut(&mut dyn Engine, f64),
    ) -> Run {
        let ticks = (seconds / scene.tick_s).round() as usize;
        let mut samples = vec![Sample::read(engine, scene, 0.0).0];
        let mut last = Vec::new();
        for tick in 1..=ticks {
            act(engine, (tick - 1) as f64 * scene.tick_s);
            engine.tick();
            let sample;
            (sample, last) = Sample::read(engine, scene, tick as f64 * scene.tick_s);
            samples.push(sample);
        }
        Run { samples, last, scene: scene.clone() }
    }

    /// Deepest overlap after any tick; NaN if a body was lost.
    pub fn deepest(&self) -> f64 {
        largest(self.samples[1..].iter().map(|sample| sample.overlap))
    }

    /// Deepest overlap from `time_s` onwards.
    pub fn deepest_after(&self, time_s: f64) -> f64 {
        largest(self.samples.iter().filter(|s| s.time_s >= time_s).map(|sample| sample.overlap))
    }

    /// Root mean square of the speeds of all bodies over the last two seconds.
    pub fn jitter(&self) -> f64 {
        let end = self.samples.last().map_or(0.0, |sample| sample.time_s);
        let late = self.samples.iter().filter(|sample| sample.time_s > end - 2.0);
        let (sum, count) = late.fold((0.0, 0.0), |(sum, n), s| (sum + s.rms * s.rms, n + 1.0));
        f64::sqrt(sum / count)
    }

    /// The last time any body was faster than 0.01 units/s.
    pub fn settled_s(&self) -> f64 {
        let moves = |sample: &&Sample| sample.fastest > 0.01 || sample.fastest.is_nan();
        self.samples.iter().rev().find(moves).map_or(0.0, |sample| sample.time_s)
    }

    /// Largest energy gain since the start, as a share of `scale`.
    pub fn gain(&self, scale: f64) -> f64 {
        let start = self.samples[0].energy;
        largest(self.samples.iter().map(|sample| (sample.energy - start) / scale))
    }

    /// Displacement of a body since the start.
    pub fn shift(&self, body: usize) -> glam::DVec2 {
        self.last[body].position - self.scene.bodies[body].position
    }

    /// The largest distance between a dynamic body and its initial position.
    pub fn largest_shift(&self) -> f64 {
        largest(self.scene.dynamic().map(|body| self.shift(body).length()))
    }

    /// How far the scene's last body has sunk.
    pub fn loss(&self) -> f64 {
        -self.shift(self.last.len() - 1).y
    }
}

/// The largest value; NaN if any value is NaN, and 0 if there are none.
pub fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |worst, value| if value > worst || value.is_nan() { value } else { worst })
}

impl Sample {
    /// Reads the engine; returns the sample and the states of all bodies.
    pub fn read(engine: &dyn Engine, scene: &Scene, time_s: f64) -> (Sample, Vec<State>) {
        let states: Vec<State> = (0..scene.bodies.len()).map(|body| engine.state(body)).collect();
        let up = -scene.gravity.normalize_or_zero();
        let mut sample =
            Sample { time_s, overlap: 0.0, energy: 0.0, rms: 0.0, fastest: 0.0, rising: 0.0 };
        let (mut squares, mut count) = (0.0, 0.0);
        for body in scene.dynamic() {
            let State { position, velocity } = states[body];
            let square = velocity.length_squared();
            squares += square;
            count += 1.0;
            sample.energy += scene.bodies[body].mass * (square / 2.0 - scene.gravity.dot(position));
            sample.fastest = largest([sample.fastest, square.sqrt()].into_iter());
            sample.rising = largest([sample.rising, velocity.dot(up)].into_iter());
        }
        sample.rms = (squares / f64::max(count, 1.0)).sqrt();
        sample.overlap = if squares.is_finite() {
            largest(overlaps(&scene.bodies, &states).into_iter())
        } else {
            f64::NAN
        };
        (sample, states)
    }
}
