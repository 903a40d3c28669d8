//! The panels of the page: pure functions from the state of the app to a [`View`](crate::page::view::View) each.

pub mod players;
pub mod round;
pub mod sound;
