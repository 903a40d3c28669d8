//! Settings of the solvers.

/// Settings of the relaxation (A2.18).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// Passes over all pairs per step, 1..=240. Default 15.
    pub iterations: u32,
    /// Share of the overlap removed per pass, in (0, 1]. Default 0.8.
    pub correction: f32,
    /// Tolerated overlap, world units, 0..=1. Default 0.005.
    pub slop: f32,
    /// Closing speed below which nothing bounces, units/s, not negative. Default 2.
    pub bounce_threshold: f32,
    /// Whether a step starts from the last step's resting impulses. Default true.
    pub warm_start: bool,
}

impl Default for Relaxation {
    fn default() -> Relaxation {
        Relaxation {
            iterations: 15,
            correction: 0.8,
            slop: 0.005,
            bounce_threshold: 2.0,
            warm_start: true,
        }
    }
}

impl Relaxation {
    /// Panics unless every setting is in its documented range (C22c).
    pub(crate) fn check(&self) {
        assert!((1..=240).contains(&self.iterations), "iterations {}", self.iterations);
        assert!(self.correction > 0.0 && self.correction <= 1.0, "correction {}", self.correction);
        assert!((0.0..=1.0).contains(&self.slop), "slop {}", self.slop);
        let threshold = self.bounce_threshold;
        assert!(threshold >= 0.0 && threshold.is_finite(), "bounce threshold {threshold}");
    }
}

/// Default of [`Conjugate::tolerance`].
pub(crate) const TOLERANCE: f32 = 0.005;

/// Settings of the conjugate solver. It is meant for mass ratios up to 10^6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conjugate {
    /// Sweeps end when none changes a relative velocity by more than this share of the velocity
    /// that gravity adds in a step, in (0, 1]. Default 0.005. Islands that take a limited number of
    /// sweeps (see `sweeps_max`) take more in proportion where it is less.
    pub tolerance: f32,
    /// Most sweeps over an island per step, 1..=1000. Within it and `work_max`, islands of more than 16
    /// contacts that are in motion take at most 16 to 128 sweeps, slower ones 8800 visits in all
    /// (or 16 sweeps, if they have 64 contacts or more and that is more), and half of these where they
    /// are solved again; not in worlds of more than 6000 moving bodies. With mass ratios beyond 10^4
    /// slower ones take 32,000 visits, and 64 sweeps before an elimination. Default 400.
    pub sweeps_max: u32,
    /// Visits of contact constraints by the sweeps over an island, 1000..=1e9: bounds the time of
    /// each. Every island gets four sweeps in any case.
    /// Default 2e6: with less a pile of 20,000 comes to
    /// rest late or never, and then takes more time than one that does.
    pub work_max: u32,
    /// Closing speed below which nothing bounces, units/s, 0..=100. Default 2.
    pub bounce_threshold: f32,
    /// Tolerated overlap, world units, 0..=1. Default 0.005.
    pub slop: f32,
    /// Share of the overlap beyond the slop that a pass removes, in (0, 1]. Default 0.4.
    pub correction: f32,
    /// Largest displacement of a pair or a body in a pass, world units, above 0 and at most 100.
    /// Default 0.3.
    pub correction_max: f32,
    /// Passes over the positions per step, 0..=60. Default 4.
    pub position_passes: u32,
}

impl Default for Conjugate {
    fn default() -> Conjugate {
        Conjugate {
            tolerance: TOLERANCE,
            sweeps_max: 400,
            work_max: 2_000_000,
            bounce_threshold: 2.0,
            slop: 0.005,
            correction: 0.4,
            correction_max: 0.3,
            position_passes: 4,
        }
    }
}

impl Conjugate {
    /// Panics unless every setting is in its documented range.
    pub(crate) fn check(&self) {
        assert!(self.tolerance > 0.0 && self.tolerance <= 1.0, "tolerance {}", self.tolerance);
        assert!((1..=1000).contains(&self.sweeps_max), "sweeps_max {}", self.sweeps_max);
        assert!((1000..=1_000_000_000).contains(&self.work_max), "work_max {}", self.work_max);
        let threshold = self.bounce_threshold;
        assert!((0.0..=100.0).contains(&threshold), "bounce threshold {threshold}");
        assert!((0.0..=1.0).contains(&self.slop), "slop {}", self.slop);
        assert!(self.correction > 0.0 && self.correction <= 1.0, "correction {}", self.correction);
        let limit = self.correction_max;
        assert!(limit > 0.0 && limit <= 100.0, "correction_max {limit}");
        assert!(self.position_passes <= 60, "position_passes {}", self.position_passes);
    }
}
