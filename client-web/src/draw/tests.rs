//! Unit tests of the draw list.
