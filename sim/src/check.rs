//! Checks of what callers give. Out of line and for one kind of number each: a message of its own in every place would take
//! kilobytes of the page's program.

use glam::Vec2;

/// Panics unless a number is as its documentation allows.
#[inline(never)]
#[track_caller]
pub(crate) fn number(is_allowed: bool, name: &str, value: f32) {
    assert!(is_allowed, "{name}: {value} is out of range");
}

/// Panics unless a vector is as its documentation allows.
#[inline(never)]
#[track_caller]
pub(crate) fn vector(is_allowed: bool, name: &str, value: Vec2) {
    assert!(is_allowed, "{name}: {value} is out of range");
}
