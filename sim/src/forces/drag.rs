//! Drag against the air.

/// Largest rate of drag, 1/s and 1/unit, and largest stiffness and damping of a spring.
pub const FORCE_MAX: f32 = 1e18;

/// Drag on a body: its velocity u against the wind changes by -(linear + quadratic |u|) u.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drag {
    /// 1/s, 0..=[`FORCE_MAX`].
    pub linear: f32,
    /// 1/unit, 0..=[`FORCE_MAX`].
    pub quadratic: f32,
}

impl Drag {
    /// No drag: velocities keep their length.
    pub const NONE: Drag = Drag { linear: 0.0, quadratic: 0.0 };

    pub(super) fn is_valid(self) -> bool {
        let range = 0.0..=FORCE_MAX;
        range.contains(&self.linear) && range.contains(&self.quadratic)
    }
}
