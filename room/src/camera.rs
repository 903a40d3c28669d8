//! How the page's camera follows a hero. A room has to know this, because a body must be sent before the
//! camera can see it; the page takes its own constants from these.

/// How far the camera looks ahead of its hero, in ticks of the hero's motion.
pub const AHEAD_TICKS: i32 = 11;
/// Each tick the camera covers one part in this many of the distance to its goal.
pub const CATCH_UP_TICKS: i32 = 9;
