//! Settings of a world, and their valid ranges.

use crate::body::GROUPS_MAX;
use crate::broad_phase::pairs::Filter;
use crate::check;
use crate::features::Features;
use crate::forces::{ForceSettings, Surroundings};
use crate::particles::Recipe;
use crate::shape::Aabb;
use crate::solver::Solver;
use crate::time::{DT, STEP_MAX};
use glam::Vec2;

/// Settings of a world.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSettings {
    /// Length of one step of the bodies in seconds, above 0 and at most [`STEP_MAX`]. Rules, scenes and
    /// particles count in steps of [`DT`], the default; other values are for measurements.
    pub dt: f32,
    /// Gravity, units/s^2.
    pub gravity: Vec2,
    /// Drag, wind and springs; `None` if there are only gravity and contacts.
    pub forces: Option<ForceSettings>,
    /// Solver for contacts; with `None`, they are only detected (A1.4).
    pub solver: Option<Solver>,
    /// Whether islands at rest fall asleep, so that they cost nothing until something happens to them. This is
    /// available only with the conjugate solver.
    pub sleeping: bool,
    /// For each group, the set of groups with which it collides, one bit each; symmetric.
    pub meets: [u32; GROUPS_MAX],
    /// Groups that push particles out, one bit each.
    pub meets_particles: u32,
    /// Bodies whose centre leaves this region are removed and reported.
    pub kill_zone: Aabb,
    /// Positions seen by clients are rounded to multiples of this, a power of two.
    pub quantum: f32,
    /// Maximum speed of any body, units/s.
    pub speed_max: f32,
    /// Maximum number of bodies at any time.
    pub bodies_max: usize,
    /// Maximum number of particles at any time.
    pub particles_max: usize,
    /// Recipes available to emitters.
    pub recipes: Vec<Recipe>,
    /// Features that steps handle. Adding bodies with other features extends them; they never shrink, and are not
    /// state.
    pub features: Features,
    /// Upper limits on the cost of a step.
    pub budget: StepBudget,
}

/// Upper limits on the cost of a step, for worlds made by strangers. A step that needs more is aborted before it
/// allocates or solves more, and the world makes no more steps ([`World::is_over_budget`]).
///
/// [`World::is_over_budget`]: crate::World::is_over_budget
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepBudget {
    /// Maximum number of pairs of bodies that may come into contact, which are those within reach of each other
    /// plus a margin. They determine a step's memory for contacts, and the visits in a pass of the relaxation
    /// solver.
    pub pairs: usize,
    /// Maximum work in a step of the conjugate solver, consisting of contact visits by its sweeps, impact
    /// predictions, and each visit to a pair. The last island may exceed it by a sweep, by the few sweeps that every
    /// island in motion gets, or by an elimination. Position corrections may exceed it too, since they are counted
    /// afterwards.
    pub work: u64,
    /// Maximum number of entries in the grid in which particles find obstacles, one for each cell that an obstacle
    /// touches. Per tick, particles may be compared with 16 times as many obstacles in total.
    pub obstacle_cells: usize,
}

impl StepBudget {
    /// A budget that no step exceeds.
    pub const UNLIMITED: StepBudget =
        StepBudget { pairs: usize::MAX, work: u64::MAX, obstacle_cells: usize::MAX };
}

impl Default for WorldSettings {
    /// The chapter's gravity (A2.8) and solver (A0.13), collisions between all groups, no particles, and room for
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
            budget: StepBudget::UNLIMITED,
        }
    }
}

impl WorldSettings {
    /// Whether the world uses the conjugate solver.
    pub fn is_conjugate(&self) -> bool {
        matches!(self.solver, Some(Solver::Conjugate(_)))
    }

    /// Returns the filter that decides which bodies may pair.
    pub(crate) fn filter(&self) -> Filter<'_> {
        let (immovable, pairs_max) = (self.solver.is_none(), self.budget.pairs);
        Filter { meets: &self.meets, immovable, pairs_max }
    }

    /// Constants for a step with forces.
    pub(super) fn surroundings(&self) -> Surroundings {
        let WorldSettings { gravity, dt, speed_max, meets, .. } = *self;
        Surroundings { gravity, dt, speed_max, meets }
    }

    /// Panics unless every setting is in its documented range.
    pub(super) fn check(&self) {
        assert!(self.dt > 0.0 && self.dt <= STEP_MAX, "dt {} must be a step", self.dt);
        check::vector(self.gravity.is_finite(), "gravity", self.gravity);
        check::number(self.quantum > 0.0, "quantum", self.quantum);
        let is_limit = self.speed_max > 0.0 && self.speed_max.is_finite();
        check::number(is_limit, "speed_max", self.speed_max);
        if let Some(solver) = &self.solver {
            solver.check();
        }
        assert!(self.is_conjugate() || !self.sleeping, "only worlds of the conjugate solver sleep");
        for (group, &meets) in self.meets.iter().enumerate() {
            for other in 0..GROUPS_MAX {
                let mirrored = self.meets[other] >> group & 1;
                assert!(meets >> other & 1 == mirrored, "groups {group} and {other} must agree");
            }
        }
    }
}
