//! Argument checks, with one function for each kind of value. They are never inlined, since a message at every call
//! site would add kilobytes to the page's program.

use glam::Vec2;

/// Panics unless a number is in its documented range.
#[inline(never)]
#[track_caller]
pub(crate) fn number(is_allowed: bool, name: &str, value: f32) {
    assert!(is_allowed, "{name}: {value} is out of range");
}

/// Panics unless a vector is in its documented range.
#[inline(never)]
#[track_caller]
pub(crate) fn vector(is_allowed: bool, name: &str, value: Vec2) {
    assert!(is_allowed, "{name}: {value} is out of range");
}
