//! The player's hero ahead of the newest snapshot: the small world, advanced through the inputs that the server has not
//! played yet.

use super::authoritative::{AuthoritativeSim, Carrier};
use super::schedule::InputSchedule;
use jostle_game::Scene;
use jostle_sim::{BodyId, Vec2};

/// The hero ahead of the newest snapshot.
pub(super) struct PredictedSim {
    /// The small world at the end of the last predicted tick.
    pub world: AuthoritativeSim,
    /// The hero's position one tick before the world's.
    before: Vec2,
    carrier: Option<Carrier>,
}

impl PredictedSim {
    /// Starts at the newest snapshot.
    pub fn new(from: &AuthoritativeSim) -> PredictedSim {
        PredictedSim { before: from.center(), world: from.clone(), carrier: None }
    }

    /// Steps to the end of tick `last`.
    pub fn go_on(&mut self, scene: &Scene, schedule: &InputSchedule, last: u32) {
        while self.world.tick < last {
            self.before = self.world.center();
            self.world.step(scene, schedule);
            self.carrier = self.world.carrier();
        }
    }

    /// The fraction of the last tick that has passed at this moment.
    fn share(&self, moment: f64) -> f32 {
        (moment - f64::from(self.world.tick) + 1.0).clamp(0.0, 1.0) as f32
    }

    /// The hero's centre at this moment within the last tick, world units.
    pub fn center(&self, moment: f64) -> Vec2 {
        self.before + (self.world.center() - self.before) * self.share(moment)
    }

    /// The offset from the predicted position of the body that carries the hero to its displayed position. The carrier
    /// is displayed with a delay, and the hero should appear to stand on it.
    pub fn aside(&self, moment: f64, shown: impl Fn(BodyId) -> Option<Vec2>) -> Vec2 {
        let place = |carrier: &Carrier| {
            let to_come = carrier.step * (1.0 - self.share(moment));
            Some(shown(carrier.id)? - (carrier.center - to_come))
        };
        self.carrier.as_ref().and_then(place).unwrap_or(Vec2::ZERO)
    }
}
