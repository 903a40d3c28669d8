//! Narrow phase: how two shapes touch, overlap or are apart.

pub(crate) mod manifold;
pub(crate) mod overlap;
pub(crate) mod separation;
