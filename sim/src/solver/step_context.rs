//! The constants for a step.

use crate::broad_phase::pairs::Filter;
use crate::features::Features;
use crate::math::max;
use crate::solver::settings::Conjugate;
use crate::solver::tolerances::{GRAVITY_GAIN_MIN, NO_SWEEP_SHARE};
use crate::world::settings::WorldSettings;
use glam::Vec2;

/// Constants for a step that do not depend on the bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepContext<'a> {
    pub settings: &'a Conjugate,
    pub gravity: Vec2,
    pub dt: f32,
    pub speed_max: f32,
    pub features: Features,
    pub filter: Filter<'a>,
}

impl<'a> StepContext<'a> {
    /// Creates the constants for a world's next step.
    pub fn new(settings: &'a Conjugate, world: &'a WorldSettings) -> StepContext<'a> {
        let WorldSettings { gravity, dt, speed_max, features, .. } = *world;
        StepContext { settings, gravity, dt, speed_max, features, filter: world.filter() }
    }

    /// Change in a relative velocity at which sweeps end, units/s, before the adjustment for the size of the island.
    pub fn tolerance(&self) -> f32 {
        max(self.gravity.length() * self.dt, GRAVITY_GAIN_MIN) * self.settings.tolerance
    }

    /// Change in a relative velocity that counts as rounding in an island at rest, units/s.
    pub fn rounding(&self) -> f32 {
        self.tolerance() * NO_SWEEP_SHARE
    }

    /// Distance that a body at rest falls in a step.
    pub fn fall_distance(&self) -> f32 {
        self.gravity.length() * self.dt * self.dt
    }
}
