//! The page's copy of a room, the prediction of the own hero, and rooms that run inside the page.

pub mod ghost;
pub mod highlight_player;
pub mod overlap;
pub mod predict;
pub mod replica;
pub mod room_in_page;
pub mod witness;
