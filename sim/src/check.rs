//! Checks of what callers give, one function for each kind of value and out of line: with a message written out in every
//! place they would take kilobytes of the page's program.

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
