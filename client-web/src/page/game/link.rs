//! The two kinds of rooms that a game is played in: one on the server, or one in the page.

use crate::net::reconnect::{Backoff, LONGEST_MS, UNTRIED_MS};
use crate::world::room_in_page::RoomInPage;
use jostle_protocol::Servers;

/// Silence after which a socket is given up, milliseconds.
const SILENCE_MS: f64 = 6000.0;

pub enum Link {
    Server(RoomConnection),
    InPage(Box<RoomInPage>),
}

/// The connection to a room on the server.
#[derive(Debug)]
pub struct RoomConnection {
    /// Origins of the servers that may play the room; an empty one is the page's own.
    pub servers: Servers,
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

impl RoomConnection {
    /// A connection that is not open yet, to the page's own server.
    pub fn new(now_ms: f64) -> RoomConnection {
        RoomConnection {
            servers: Servers::new(String::new()),
            session: 0,
            open: false,
            opened_ms: now_ms,
            heard_ms: now_ms,
            silent: false,
            unproven_ms: None,
            backoff: Backoff::default(),
        }
    }

    /// Silence after which the socket is given up, milliseconds: less for one that does not open, while another
    /// server was not asked yet.
    fn silence_ms_max(&self) -> f64 {
        let opens = self.opened_ms > self.heard_ms;
        if opens && self.servers.has_untried() { UNTRIED_MS } else { SILENCE_MS }
    }

    /// Whether the other end was not heard for too long since the socket was opened.
    pub fn is_silent(&self, now_ms: f64) -> bool {
        now_ms - self.heard_ms.max(self.opened_ms) > self.silence_ms_max()
    }

    /// The socket was lost, or none came about: another attempt follows. `random` is uniform in [0, 1).
    pub fn lost(&mut self, now_ms: f64, random: f64) {
        let longest_ms = if self.servers.has_untried() { UNTRIED_MS } else { LONGEST_MS };
        self.backoff.lost(now_ms, random, longest_ms);
    }
}
