//! The connection to the server: sockets over WebSockets or HTTP, HTTP calls, reconnecting, and the clock derived from snapshots.

pub mod api;
pub mod clock;
#[cfg(target_arch = "wasm32")]
pub mod http;
#[cfg(target_arch = "wasm32")]
mod http_socket;
pub mod http_stream;
#[cfg(target_arch = "wasm32")]
mod json;
pub mod meter;
pub mod reconnect;
pub mod report;
pub mod scene_link;
pub mod simulated_link;
#[cfg(target_arch = "wasm32")]
pub mod socket;
pub mod timeline;
