//! Marks in a scene file: dots on the wall, as on dice, which the page draws and the game ignores.

use super::field::{POSITION, Range};
use super::rules::Names;
use super::table::Table;
use glam::Vec2;

/// Maximum number of marks in a scene.
pub const MARKS_MAX: usize = 64;
const DOTS_MAX: u32 = 6;
const SIZE: Range = Range::from(1.0, 1.0e3);

/// Dots on the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Centre of the dots.
    pub position: Vec2,
    /// Number of dots.
    pub dots: u8,
    /// Width and height.
    pub size: f32,
    /// It is visible only in the light of this body.
    pub lamp: Option<usize>,
    /// Distance that the light reaches; only with `lamp`.
    pub reach: f32,
}

/// Reads one entry of `marks`.
pub(super) fn mark(table: &Table, names: &Names) -> Mark {
    let position = table.need("position", "[x, y] of the centre");
    let (lamp, reach) = (table.get("lamp"), table.get("reach"));
    if !lamp.is_given() {
        reach.refuse_if_given("nothing: only a mark with a lamp has it");
    }
    Mark {
        position: position.vector(Vec2::ZERO, POSITION),
        dots: table.need("dots", "1 to 6").whole(1, 1..=DOTS_MAX) as u8,
        size: table.get("size").number(8.0, SIZE),
        lamp: lamp.given(|lamp| names.body(lamp)).flatten(),
        reach: reach.number(40.0, SIZE),
    }
}
