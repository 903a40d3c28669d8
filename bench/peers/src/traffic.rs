//! rapier2d in the scenes of `traffic`, with its defaults and sleep enabled.

use crate::rapier::Rapier;
use glam::DVec2;
use jostle_report::engine::{Engine, State};
use jostle_report::traffic::{Crowd, Script};

/// Sub-steps per tick; rapier's default.
const SUB_STEPS: usize = 4;

/// The bodies of a script, simulated by rapier2d.
pub struct RapierCrowd(Rapier);

impl RapierCrowd {
    /// Creates the bodies with the script's damping; they may sleep.
    pub fn new(script: &Script) -> RapierCrowd {
        let mut scene = script.scene.clone();
        scene.sleeping = true;
        let mut engine =
            Rapier::new(&scene, SUB_STEPS, 1.0).expect("it has all that these scenes need");
        for (body, &damping) in script.damping.iter().enumerate() {
            engine.set_damping(body, damping);
        }
        RapierCrowd(engine)
    }
}

impl Crowd for RapierCrowd {
    fn kick(&mut self, body: usize, change: DVec2) {
        let velocity = self.0.state(body).velocity;
        self.0.set_velocity(body, velocity + change);
    }

    fn step(&mut self) {
        self.0.tick();
    }

    fn state(&self, body: usize) -> State {
        self.0.state(body)
    }
}
