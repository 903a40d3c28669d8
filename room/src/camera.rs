//! How the page's camera goes after a hero, as far as a room has to know it: what comes into sight
//! is sent before it is seen. The page takes its own figures from these.

/// The camera looks so far ahead of its hero, ticks of the hero's motion.
pub const AHEAD_TICKS: i32 = 11;
/// It closes in on that by one part in so many of the way, each tick.
pub const CATCH_UP_TICKS: i32 = 9;
