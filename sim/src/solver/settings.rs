//! Settings of the solvers.

use crate::check;

/// Settings of the relaxation solver (A2.18).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// Maximum number of passes over all pairs per step, 1..=240. Default 15.
    pub iterations: u32,
    /// Share of the overlap removed per pass, in (0, 1]. Default 0.8.
    pub correction: f32,
    /// Tolerated overlap, world units, 0..=1. Default 0.005.
    pub slop: f32,
    /// Closing speed below which nothing bounces, units/s, not negative. Default 2.
    pub bounce_threshold: f32,
    /// Whether a step starts from the previous step's resting impulses. Default true.
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
        let Relaxation { iterations, correction, slop, bounce_threshold: threshold, .. } = *self;
        check::number((1..=240).contains(&iterations), "iterations", iterations as f32);
        check::number(correction > 0.0 && correction <= 1.0, "correction", correction);
        check::number((0.0..=1.0).contains(&slop), "slop", slop);
        let is_allowed = threshold >= 0.0 && threshold.is_finite();
        check::number(is_allowed, "bounce threshold", threshold);
    }
}

/// Default of [`Conjugate::tolerance`].
pub(crate) const TOLERANCE: f32 = 0.005;

/// Settings of the conjugate solver. It is meant for mass ratios up to 10^6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conjugate {
    /// Sweeps end when no relative velocity changes by more than this share of the velocity that gravity adds in a
    /// step, in (0, 1]. Default 0.005. With a smaller value, islands whose number of sweeps is limited (see
    /// `sweeps_max`) take proportionally more.
    pub tolerance: f32,
    /// Maximum number of sweeps over an island per step, 1..=1000. Default 400. Besides this and `work_max`, more
    /// limits apply to islands with more than 16 contacts, except in worlds with more than 6000 moving bodies.
    /// Islands in motion take at most 16 to 128 sweeps. Slower ones take at most 8800 visits in total or, if they
    /// have at least 64 contacts, 16 sweeps if that is more. Islands that are solved again take half as many. With
    /// mass ratios beyond 10^4, slower islands take 32,000 visits, and up to 64 sweeps before an elimination.
    pub sweeps_max: u32,
    /// Maximum number of visits to contact constraints by the sweeps over an island, 1000..=1e9, which limits the
    /// time spent on each island. Every island gets at least four sweeps. Default 2e6. With less, a pile of 20,000
    /// bodies comes to rest late or never, and takes more time overall.
    pub work_max: u32,
    /// Closing speed below which nothing bounces, units/s, 0..=100. Default 2.
    pub bounce_threshold: f32,
    /// Tolerated overlap, world units, 0..=1. Default 0.005.
    pub slop: f32,
    /// Share of the overlap beyond the slop that a pass removes, in (0, 1]. Default 0.4.
    pub correction: f32,
    /// Largest displacement of a pair or a body in a pass, world units, in (0, 100]. Default 0.3.
    pub correction_max: f32,
    /// Maximum number of correction passes over the positions per step, 0..=60. Default 4.
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
        let Conjugate { tolerance, slop, correction, bounce_threshold: threshold, .. } = *self;
        let Conjugate { sweeps_max, work_max, position_passes, correction_max, .. } = *self;
        check::number(tolerance > 0.0 && tolerance <= 1.0, "tolerance", tolerance);
        check::number((1..=1000).contains(&sweeps_max), "sweeps_max", sweeps_max as f32);
        let is_allowed = (1000..=1_000_000_000).contains(&work_max);
        check::number(is_allowed, "work_max", work_max as f32);
        check::number((0.0..=100.0).contains(&threshold), "bounce threshold", threshold);
        check::number((0.0..=1.0).contains(&slop), "slop", slop);
        check::number(correction > 0.0 && correction <= 1.0, "correction", correction);
        let is_allowed = correction_max > 0.0 && correction_max <= 100.0;
        check::number(is_allowed, "correction_max", correction_max);
        check::number(position_passes <= 60, "position_passes", position_passes as f32);
    }
}
