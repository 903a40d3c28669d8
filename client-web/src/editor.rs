//! The scene editor, which shows the pieces of a scene in the picture next to the scene's text. The text is
//! authoritative.
//!
//! All of it is plain Rust that needs no browser. [`text`] finds the pieces in the text of a [`document`], [`edit`]
//! edits the text, [`palette`] adds pieces to it, [`history`] undoes edits, [`snap`] aligns pieces, and [`update`] handles
//! the pointer, the keys and the page's buttons.

pub mod document;
pub mod drag;
pub mod edit;
pub mod field;
pub mod field_words;
pub mod form;
mod gesture;
mod groups;
pub mod history;
pub mod number;
pub mod palette;
mod references;
mod rule_pieces;
pub mod sketch;
pub mod snap;
pub mod state;
pub mod strings;
pub mod tables;
pub mod templates;
pub mod text;
pub mod update;

#[cfg(test)]
mod tests;
