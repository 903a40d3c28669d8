//! The players' port. It accepts connections, serves the page and the HTTP API, and runs game sessions.

pub mod assets;
#[cfg(page_on_disk)]
mod dist;
pub mod game_socket;
pub mod http;
pub mod listen;
pub mod maybe_tls_stream;
pub mod posts;
pub mod pump;
pub mod session;
pub mod socket_threads;
pub mod tls;
