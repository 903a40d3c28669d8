//! The page's replica of a room, prediction of the player's hero, and rooms that run inside the page.

pub mod daily;
pub mod ghost;
pub mod highlight_player;
pub mod overlap;
pub mod particle_probe;
pub mod predict;
pub mod replica;
pub mod room_in_page;
