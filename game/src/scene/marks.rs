//! Marks on the wall in a scene file: dots that are drawn, and mean nothing to the game.

use super::rules::Names;
use super::spec::Mark;
use super::table::{POSITION, Range, Table};
use glam::Vec2;

/// Marks of a scene.
pub const MARKS_MAX: usize = 64;
const DOTS_MAX: u32 = 6;
const SIZE: Range = Range::from(1.0, 1.0e3);

/// Reads one entry of `marks`.
pub(super) fn mark(table: &Table, names: &Names) -> Mark {
    let position = table.need("position", "[x, y] of the centre");
    let (lamp, reach) = (table.get("lamp"), table.get("reach"));
    if reach.is_given() && !lamp.is_given() {
        reach.refuse("nothing: only a mark with a lamp has it");
    }
    Mark {
        position: position.vector(Vec2::ZERO, POSITION),
        dots: table.need("dots", "1 to 6").whole(1, 1..=DOTS_MAX) as u8,
        size: table.get("size").number(8.0, SIZE),
        lamp: if lamp.is_given() { names.body(&lamp) } else { None },
        reach: reach.number(40.0, SIZE),
    }
}
