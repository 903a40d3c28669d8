//! Shapes without a position. Each body has one, a circle or an axis-aligned box, centred on the body. Shapes do
//! not rotate (A2.39).

use crate::check;
use crate::math::{max, min};
use glam::Vec2;

/// The shape of a body around its centre, in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A disc around the position.
    Circle {
        /// Radius, positive and finite.
        radius: f32,
    },
    /// An axis-aligned box around the position.
    Box {
        /// Half the width and half the height, both positive and finite.
        half: Vec2,
    },
}

impl Shape {
    /// Creates a circle. Panics unless the radius is positive and finite.
    pub fn circle(radius: f32) -> Shape {
        check::number(radius > 0.0 && radius.is_finite(), "circle radius", radius);
        Shape::Circle { radius }
    }

    /// Creates a box of this full width and height. Panics unless both are positive and finite.
    pub fn rect(width: f32, height: f32) -> Shape {
        check::number(width > 0.0 && width.is_finite(), "box width", width);
        check::number(height > 0.0 && height.is_finite(), "box height", height);
        Shape::Box { half: Vec2::new(width, height) * 0.5 }
    }

    /// Half the extent along x and y.
    #[inline]
    pub fn half_extent(&self) -> Vec2 {
        match *self {
            Shape::Circle { radius } => Vec2::splat(radius),
            Shape::Box { half } => half,
        }
    }

    /// The smaller half-size. A body that moves further than this in a step may tunnel.
    #[inline]
    pub fn thickness(&self) -> f32 {
        let half = self.half_extent();
        min(half.x, half.y)
    }

    /// Whether a point, relative to the centre, lies strictly inside (A1.16).
    #[inline]
    pub fn contains(&self, point: Vec2) -> bool {
        match *self {
            Shape::Circle { radius } => point.length_squared() < radius * radius,
            Shape::Box { half } => point.x.abs() < half.x && point.y.abs() < half.y,
        }
    }
}

/// An axis-aligned region of the world, `low` <= `high` on both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower left corner.
    pub low: Vec2,
    /// Upper right corner.
    pub high: Vec2,
}

impl Aabb {
    /// The smallest region that contains both.
    pub fn union(&self, other: &Aabb) -> Aabb {
        let (low, high) = (other.low, other.high);
        Aabb {
            low: Vec2::new(min(self.low.x, low.x), min(self.low.y, low.y)),
            high: Vec2::new(max(self.high.x, high.x), max(self.high.y, high.y)),
        }
    }

    /// The region around a centre.
    #[inline]
    pub fn around(center: Vec2, half: Vec2) -> Aabb {
        Aabb { low: center - half, high: center + half }
    }

    /// Whether the interiors overlap. Touching edges do not count.
    #[inline]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        self.low.x < other.high.x
            && other.low.x < self.high.x
            && self.low.y < other.high.y
            && other.low.y < self.high.y
    }

    /// Whether a point lies inside the region or on its edge.
    #[inline]
    pub fn contains(&self, point: Vec2) -> bool {
        point.x >= self.low.x
            && point.x <= self.high.x
            && point.y >= self.low.y
            && point.y <= self.high.y
    }
}

/// Kinds of shapes in a world. If there is only one kind, a body's shape is never looked up.
pub(crate) mod shapes {
    pub const BOTH: u8 = 0;
    pub const CIRCLES: u8 = 1;
    pub const BOXES: u8 = 2;
}
