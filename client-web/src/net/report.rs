//! Results that sockets and HTTP calls report to the page.

/// A change of the WebSocket.
#[derive(Debug, PartialEq)]
pub enum SocketEvent {
    /// It is open: the hello may be sent.
    Opened,
    /// A message arrived.
    Message(Vec<u8>),
    /// It is closed, or never opened.
    Closed {
        /// WebSocket close code.
        code: u16,
    },
}

/// Result of fetching a file.
#[derive(Debug, PartialEq)]
pub enum Fetched {
    /// The file.
    Bytes(Vec<u8>),
    /// The server refused, with this HTTP status.
    Refused(u16),
    /// No answer.
    Nothing,
}
