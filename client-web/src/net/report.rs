//! Results that sockets and HTTP calls report to the page.

/// A change in the WebSocket's state.
#[derive(Debug, PartialEq)]
pub enum SocketEvent {
    /// The socket is open, so the hello can be sent.
    Opened,
    Message(Vec<u8>),
    /// The socket closed or never opened.
    Closed {
        code: u16,
    },
}

/// The result of fetching a file.
#[derive(Debug, PartialEq)]
pub enum Fetched {
    Bytes(Vec<u8>),
    /// The server refused, with this HTTP status.
    Refused(u16),
    Nothing,
}
