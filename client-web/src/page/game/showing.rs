//! Highlights on display, in place of the room.

use crate::world::highlight_player::HighlightPlayer;

pub struct Showing {
    pub player: HighlightPlayer,
    /// Number of a highlight, and of the copy that draws it.
    pub copy: (usize, u32),
}
