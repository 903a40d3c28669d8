//! Materials of bodies.

/// Restitution and friction of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Material {
    pub restitution: f32,
    pub friction: f32,
}
