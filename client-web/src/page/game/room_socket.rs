//! The socket to a room on the server: when it counts as lost, and how the next one is opened.

use crate::net::reconnect::{Backoff, LONGEST_MS, UNTRIED_MS};
use jostle_protocol::Servers;

/// Silence after which a socket is abandoned, milliseconds.
const SILENCE_MS: f64 = 6000.0;

/// The socket to a room on the server, and what is needed to open the next one.
#[derive(Debug)]
pub struct RoomSocket {
    /// The origins of servers that may run the room; an empty origin is the page's own server.
    pub servers: Servers,
    /// The number of the newest session.
    pub session: u32,
    /// Whether the newest session, and the next one, use HTTP instead of a WebSocket.
    pub over_http: bool,
    pub open: bool,
    /// Whether the newest session's socket has opened.
    pub has_opened: bool,
    /// Whether the server has answered a request since a WebSocket failed to open.
    pub is_answered: bool,
    pub opened_ms: f64,
    /// The time of the most recent message from the server.
    pub heard_ms: f64,
    /// Whether the previous check found that the server had been silent for too long.
    pub silent: bool,
    /// The time of the welcome, until the connection is known to be good.
    pub unproven_ms: Option<f64>,
    /// Determines when to try again.
    pub backoff: Backoff,
}

impl RoomSocket {
    /// A socket that is not open yet, to the page's own server.
    pub fn new(now_ms: f64, over_http: bool) -> RoomSocket {
        RoomSocket {
            servers: Servers::new(String::new()),
            session: 0,
            over_http,
            open: false,
            has_opened: false,
            is_answered: false,
            opened_ms: now_ms,
            heard_ms: now_ms,
            silent: false,
            unproven_ms: None,
            backoff: Backoff::default(),
        }
    }

    /// Silence after which the socket is abandoned, milliseconds. The limit is shorter for a socket that does not open
    /// while another server has not been tried.
    fn silence_ms_max(&self) -> f64 {
        if !self.has_opened && self.servers.has_untried() { UNTRIED_MS } else { SILENCE_MS }
    }

    /// Whether the server has been silent for too long since the socket was opened.
    pub fn is_silent(&self, now_ms: f64) -> bool {
        now_ms - self.heard_ms.max(self.opened_ms) > self.silence_ms_max()
    }

    /// Chooses between a WebSocket and HTTP for the next session, if the newest one, to the page's own server, did not
    /// open. HTTP is chosen only if a WebSocket fails after the server has answered a request: a server that restarts
    /// answers none until it accepts WebSockets, too.
    pub fn turn(&mut self) -> Turn {
        if self.has_opened || !self.servers.current().is_empty() {
            return Turn::None;
        }
        self.over_http = std::mem::take(&mut self.is_answered) && !self.over_http;
        if self.over_http { Turn::Http } else { Turn::Ask }
    }

    /// Records that the socket was lost or could not be opened, so that another attempt follows. `random` is uniform in
    /// [0, 1).
    pub fn lost(&mut self, now_ms: f64, random: f64) {
        let longest_ms = if self.servers.has_untried() { UNTRIED_MS } else { LONGEST_MS };
        self.backoff.lost(now_ms, random, longest_ms);
    }
}

/// The consequence of a socket that did not open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    None,
    /// Asks whether the server answers requests at all.
    Ask,
    /// Tries HTTP at once.
    Http,
}
