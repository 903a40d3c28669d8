//! A pointer over the picture, and what it holds.

use super::palette::Make;
use super::text::{PieceId, Sheet};
use jostle_sim::Vec2;

/// A pointer in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// The browser's number of the pointer.
    pub id: i32,
    /// Its place, world units.
    pub at: Vec2,
    /// It is over the picture.
    pub inside: bool,
    /// A thing that is no further than this is meant, world units.
    pub reach: f32,
    /// A step of the pointer, which is a CSS pixel, world units.
    pub step: f32,
    /// It adds to the selection.
    pub adds: bool,
    /// It goes where it goes, without snapping.
    pub free: bool,
}

/// The thing that a hand holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grip {
    Move,
    /// An edge or a corner of the selected piece: which way it lies from the centre.
    Size(Vec2),
    /// A point of the selected piece's path.
    Point(usize),
    /// A corner of a box that selects.
    Box,
    New(Make),
}

/// A gesture that is on.
#[derive(Clone, Debug)]
pub struct EditGesture {
    pub(super) id: i32,
    /// The thing that is held.
    pub(super) grip: Grip,
    pub(super) from: Vec2,
    pub at: Vec2,
    /// The text at its beginning, and its pieces.
    pub(super) base: String,
    pub(super) sheet: Sheet,
    /// The selection at that time.
    pub(super) selection: Vec<PieceId>,
    pub moving: bool,
    /// Another finger switches snapping off.
    pub(super) free: bool,
}

impl EditGesture {
    /// The corners of the box that selects.
    pub fn frame(&self) -> Option<[Vec2; 2]> {
        let selects = self.grip == Grip::Box && self.moving;
        selects.then(|| [self.from.min(self.at), self.from.max(self.at)])
    }
}
