//! Drawing: the contents of a frame, the camera, vertices, and the GPU.

pub mod camera;
pub mod draw;
pub mod frame;
pub mod palette;
pub mod quality;
#[cfg(any(target_arch = "wasm32", feature = "native"))]
pub mod render;
pub mod style;
