//! What must hold for any bytes, tried with the corpus and thousands of mutations.

mod editor;
mod mutations;
mod properties;
