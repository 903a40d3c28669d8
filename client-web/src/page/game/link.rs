//! The two kinds of rooms that a game is played in: one on the server, or one in the page.

use crate::net::reconnect::Backoff;
use crate::world::room_in_page::RoomInPage;

/// The other end.
pub enum Link {
    Server(Connection),
    InPage(Box<RoomInPage>),
}

/// The connection to a room on the server.
#[derive(Debug, Default)]
pub struct Connection {
    /// Number of the newest session.
    pub session: u32,
    pub open: bool,
    pub opened_ms: f64,
    /// When the server was last heard.
    pub heard_ms: f64,
    /// Whether it was silent for too long when that was last checked.
    pub silent: bool,
    /// When the welcome came, while the connection is not known to be good.
    pub unproven_ms: Option<f64>,
    /// When to try again.
    pub backoff: Backoff,
}
