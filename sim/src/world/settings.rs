//! What a world is made with, and the ranges of it.

use crate::DT;
use crate::body::GROUPS_MAX;
use crate::features::Features;
use crate::forces::ForceSettings;
use crate::particle::Recipe;
use crate::shape::Aabb;
use crate::solver::Solver;
use glam::Vec2;

/// Longest step that a world takes, seconds.
pub const STEP_MAX: f32 = 0.1;

/// A fixed description of a world.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSettings {
    /// Seconds in one step of the bodies, above 0 and at most [`STEP_MAX`]. The rules, the scenes and
    /// the particles count in steps of [`DT`], the default; measurements take others.
    pub dt: f32,
    /// Gravity, units/s^2.
    pub gravity: Vec2,
    /// Drag, wind and springs; `None` where nothing acts but gravity and contacts.
    pub forces: Option<ForceSettings>,
    /// What solves the contacts; `None` detects them and solves nothing (chapter project 9.1).
    pub solver: Option<Solver>,
    /// Whether islands at rest fall asleep: they cost nothing until something happens to them. Only
    /// with the conjugate solver.
    pub sleeping: bool,
    /// For each group, the set of groups that it meets, one bit each; symmetric.
    pub meets: [u32; GROUPS_MAX],
    /// Groups that push particles out, one bit each.
    pub meets_particles: u32,
    /// Bodies whose centre leaves this region are removed and reported.
    pub kill_zone: Aabb,
    /// Positions seen by clients are rounded to multiples of this, a power of two.
    pub quantum: f32,
    /// Speed cap of every body, units/s.
    pub speed_max: f32,
    /// Bodies at a time.
    pub bodies_max: usize,
    /// Particles at a time.
    pub particles_max: usize,
    /// Recipes that emitters may name.
    pub recipes: Vec<Recipe>,
    /// What a step is prepared for from the start; what comes later is added as it comes.
    pub features: Features,
}

impl Default for WorldSettings {
    /// The chapter's gravity and solver, every group meets every other, no particles, room for
    /// 4096 bodies in a wide kill zone.
    fn default() -> WorldSettings {
        WorldSettings {
            dt: DT,
            gravity: Vec2::new(0.0, -50.0),
            forces: None,
            solver: Some(Solver::default()),
            sleeping: false,
            meets: [u32::MAX; GROUPS_MAX],
            meets_particles: u32::MAX,
            kill_zone: Aabb { low: Vec2::splat(-1e5), high: Vec2::splat(1e5) },
            quantum: 1.0 / 256.0,
            speed_max: 1e4,
            bodies_max: 4096,
            particles_max: 0,
            recipes: Vec::new(),
            features: Features::NONE,
        }
    }
}

impl WorldSettings {
    /// Panics unless every setting is in its documented range.
    pub(super) fn check(&self) {
        assert!(self.dt > 0.0 && self.dt <= STEP_MAX, "dt {} must be a step", self.dt);
        assert!(self.gravity.is_finite(), "gravity {} must be finite", self.gravity);
        assert!(self.quantum > 0.0, "quantum {} must be positive", self.quantum);
        assert!(self.speed_max > 0.0, "speed_max {} must be positive", self.speed_max);
        assert!(self.speed_max.is_finite(), "speed_max must be finite");
        if let Some(solver) = &self.solver {
            solver.check();
        }
        let conjugate = matches!(self.solver, Some(Solver::Conjugate(_)));
        assert!(conjugate || !self.sleeping, "only worlds of the conjugate solver sleep");
        for (group, &meets) in self.meets.iter().enumerate() {
            for other in 0..GROUPS_MAX {
                let mirrored = self.meets[other] >> group & 1;
                assert!(meets >> other & 1 == mirrored, "groups {group} and {other} must agree");
            }
        }
    }
}
