//! Drawing without a window.
