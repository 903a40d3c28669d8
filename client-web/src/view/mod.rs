//! Drawing: what one frame shows, where the camera is, the vertices of a frame, and the GPU.

pub mod camera;
pub mod draw;
pub mod frame;
pub mod palette;
pub mod quality;
pub mod render;
