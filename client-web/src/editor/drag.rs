//! A pointer over the picture, and what it is holding.

use super::palette::Make;
use super::text::{PieceId, ScenePieces};
use jostle_sim::Vec2;

/// A pointer in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EditPointer {
    /// The browser's id for the pointer.
    pub id: i32,
    /// The pointer's position, world units.
    pub at: Vec2,
    /// Whether the pointer is over the picture.
    pub inside: bool,
    /// Distance within which something can be grabbed, world units.
    pub reach: f32,
    /// The width of a CSS pixel in world units, which is the pointer's smallest step.
    pub step: f32,
    /// Whether a press adds to the selection.
    pub adds: bool,
    /// Whether the pointer moves freely, without snapping.
    pub free: bool,
}

/// Everything that a pointer can hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DragTarget {
    Move,
    /// An edge or corner of the selected piece, given by its direction from the centre.
    Size(Vec2),
    /// A point of the selected piece's path.
    Point(usize),
    /// A corner of the selection box.
    Box,
    New(Make),
}

/// A gesture in progress.
#[derive(Clone, Debug)]
pub struct EditGesture {
    pub(super) id: i32,
    /// The held thing.
    pub(super) grip: DragTarget,
    pub(super) from: Vec2,
    pub at: Vec2,
    /// The text when the gesture began; `sheet` holds its pieces.
    pub(super) base: String,
    pub(super) sheet: ScenePieces,
    /// The selection when the gesture began.
    pub(super) selection: Vec<PieceId>,
    pub moving: bool,
    /// Whether snapping is off because a second finger is down.
    pub(super) free: bool,
}

impl EditGesture {
    /// The corners of the selection box.
    pub fn frame(&self) -> Option<[Vec2; 2]> {
        let selects = self.grip == DragTarget::Box && self.moving;
        selects.then(|| [self.from.min(self.at), self.from.max(self.at)])
    }
}
