//! Limits and units of rules, and what rules may name.

use super::names::Names;
use crate::scene::groups::Groups;
use crate::scene::table::Range;
use jostle_sim::TICKS_PER_SECOND;

/// Teams of a scene.
pub const TEAMS_MAX: usize = 8;
/// Zones of a scene, one bit of a word each.
pub const ZONES_MAX: usize = 64;
/// Signals of a scene, one bit of a word each.
pub const SIGNALS_MAX: usize = 64;
/// Rules of a scene.
pub const RULES_MAX: usize = 128;
/// Points of a side, either sign.
pub const POINTS_MAX: i32 = 1_000_000;
/// Longest sentence that a scene shows, characters.
pub(super) const SENTENCE_CHARS_MAX: usize = 80;
/// Times in seconds.
pub(in crate::scene) const SECONDS: Range = Range::from(0.0, 3600.0);

/// What rules may name.
pub(in crate::scene) struct Known<'a> {
    pub names: &'a Names,
    pub groups: &'a Groups,
}

/// Whole ticks of a time in seconds.
pub(in crate::scene) fn ticks(seconds: f32) -> u32 {
    (seconds * TICKS_PER_SECOND as f32 + 0.5) as u32
}
