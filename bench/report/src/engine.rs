//! The interface of all engines: adding bodies, stepping and reading states. Peers implement it in a separate
//! workspace.

use crate::scene::{Body, Scene};
use glam::DVec2;

/// The state of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    pub position: DVec2,
    /// Velocity in units/s.
    pub velocity: DVec2,
}

/// A simulation under test. Bodies are numbered in the order they were added.
pub trait Engine {
    fn add(&mut self, body: &Body) -> usize;

    /// Advances by one tick of the scene, in as many steps as the method uses.
    fn tick(&mut self);

    /// Returns the position and velocity of a body.
    fn state(&self, body: usize) -> State;

    /// Sets the velocity of a kinematic or dynamic body.
    fn set_velocity(&mut self, body: usize, velocity: DVec2);

    /// Removes a body, which must not be read afterwards.
    fn remove(&mut self, body: usize);

    /// Changes the scene's gravity.
    fn set_gravity(&mut self, _: DVec2) {}

    /// Whether a body is asleep, in a scene that allows sleep.
    fn is_asleep(&self, _: usize) -> bool {
        false
    }

    /// Number of pair solves so far, counted once per pass: a machine-independent measure of work. `None` if the engine
    /// does not count them.
    fn pair_solves(&self) -> Option<u64>;

    /// Number of body steps so far, the only work if no bodies touch.
    fn body_steps(&self) -> u64;
}

/// Creates an engine with the bodies of a scene, or returns the reason for failure.
pub type Build = fn(&Scene, f64) -> Result<Box<dyn Engine>, String>;

/// All states read during a run, as `states[tick][body]`; tick 0 is the start.
pub struct Trace {
    /// Seconds between consecutive readings.
    pub tick_s: f64,
    /// The states, by tick and then by body.
    pub states: Vec<Vec<State>>,
}

impl Trace {
    /// Runs an engine and reads every body after every tick.
    pub fn record(engine: &mut dyn Engine, scene: &Scene, ticks: u32) -> Trace {
        let read = |engine: &dyn Engine| (0..scene.bodies.len()).map(|i| engine.state(i)).collect();
        let mut states: Vec<Vec<State>> = vec![read(engine)];
        for _ in 0..ticks {
            engine.tick();
            states.push(read(engine));
        }
        Trace { tick_s: scene.tick_s, states }
    }

    pub fn last(&self) -> &[State] {
        self.states.last().expect("the start is always there")
    }

    /// The states of one body with their times, including the start.
    pub fn of(&self, body: usize) -> impl Iterator<Item = (f64, State)> + '_ {
        let times = (0..self.states.len()).map(|tick| tick as f64 * self.tick_s);
        times.zip(self.states.iter().map(move |bodies| bodies[body]))
    }

    /// Whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.last().iter().all(|s| s.position.is_finite() && s.velocity.is_finite())
    }
}
