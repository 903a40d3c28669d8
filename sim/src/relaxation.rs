//! The relaxation solver: projection and impulse, all pairs together, N passes.

/// Settings of the relaxation; chapter rows A2.18 to A2.25.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// Passes over all pairs a step, 1..=240. Default 15.
    pub iterations: u32,
    /// Share of the overlap removed a pass, in (0, 1]. Default 0.8.
    pub correction: f32,
    /// Overlap left alone, world units, 0..=1. Default 0.005.
    pub slop: f32,
    /// Closing speed below which nothing bounces, units/s. Default 2.
    pub bounce_threshold: f32,
    /// Start each step from the last step's resting impulses. Default true.
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
