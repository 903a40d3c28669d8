//! Results that sockets and HTTP calls report to the page.

/// A change of the WebSocket.
#[derive(Debug, PartialEq)]
pub enum SocketEvent {
    /// It is open: the hello may be sent.
    Opened,
    Message(Vec<u8>),
    /// It is closed, or never opened.
    Closed {
        code: u16,
    },
}

/// Result of fetching a file.
#[derive(Debug, PartialEq)]
pub enum Fetched {
    Bytes(Vec<u8>),
    /// The server refused, with this HTTP status.
    Refused(u16),
    Nothing,
}
