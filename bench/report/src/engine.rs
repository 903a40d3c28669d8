//! What every engine can do here: take bodies, step, be read. Peers implement it in their own
//! workspace.

use crate::scene::{Body, Scene};
use glam::DVec2;

/// A body as it is read back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Centre.
    pub position: DVec2,
    /// Units/s.
    pub velocity: DVec2,
}

/// A simulation under test. Bodies are named by the order in which they were added.
pub trait Engine {
    /// Adds a body.
    fn add(&mut self, body: &Body) -> usize;

    /// Advances by one tick of the scene, in as many steps as the method takes.
    fn tick(&mut self);

    /// Where a body is and how fast.
    fn state(&self, body: usize) -> State;

    /// Sets the velocity of a kinematic or dynamic body.
    fn set_velocity(&mut self, body: usize, velocity: DVec2);

    /// Takes a body away; it is not to be read any more.
    fn remove(&mut self, body: usize);

    /// Changes the gravity of the scene.
    fn set_gravity(&mut self, _: DVec2) {}

    /// Whether a body sleeps, in a scene that lets it.
    fn is_asleep(&self, _: usize) -> bool {
        false
    }

    /// Pairs solved so far, once a pass: work that no machine changes. `None` if it does not tell.
    fn pair_solves(&self) -> Option<u64>;

    /// Steps of bodies so far: what is left of the work where nothing touches.
    fn body_steps(&self) -> u64;
}

/// Makes an engine with the bodies of a scene in it, or says why it cannot.
pub type Build = fn(&Scene, f64) -> Result<Box<dyn Engine>, String>;

/// All readings of a run: `states[tick][body]`, from tick 0, the start.
pub struct Trace {
    /// Seconds between two readings.
    pub tick_s: f64,
    /// Bodies by index, ticks by time.
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

    /// The last reading.
    pub fn last(&self) -> &[State] {
        self.states.last().expect("the start is always there")
    }

    /// Readings of one body with their times, the start included.
    pub fn of(&self, body: usize) -> impl Iterator<Item = (f64, State)> + '_ {
        let times = (0..self.states.len()).map(|tick| tick as f64 * self.tick_s);
        times.zip(self.states.iter().map(move |bodies| bodies[body]))
    }

    /// Whether all numbers are numbers.
    pub fn is_finite(&self) -> bool {
        self.last().iter().all(|s| s.position.is_finite() && s.velocity.is_finite())
    }
}
