//! The length of a step.

/// Ticks per second of the server's counter; one tick is one step of the World.
pub const TICKS_PER_SECOND: u32 = 60;
/// Seconds in one step.
pub const DT: f32 = 1.0 / TICKS_PER_SECOND as f32;
/// Longest step of a world, seconds.
pub const STEP_MAX: f32 = 0.1;
