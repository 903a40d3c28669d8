//! Drawing: what one frame shows, where the camera is, the vertices of a frame, and the GPU.

pub mod camera;
pub mod draw;
pub mod frame;
pub mod palette;
pub mod quality;
#[cfg(any(target_arch = "wasm32", feature = "native"))]
pub mod render;
