//! The WebSocket of a game session: its limits, its first message and its close.

use crate::limits;
use crate::limits::rate_limited_stream::{RateLimitedStream, SPENT};
use crate::net::maybe_tls_stream::MaybeTlsStream;
use futures_util::{SinkExt, StreamExt};
use jostle_protocol::limits::{CLIENT_MESSAGE_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX};
use jostle_protocol::{Appearance, ClientMessage, Refusal, ServerMessage, Token, VERSION};
use std::sync::Arc;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};

/// A game socket, with a limit on the bytes that the peer may send.
pub type Socket = WebSocketStream<RateLimitedStream<MaybeTlsStream>>;

/// How a session ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// The server ends it, and sends the reason.
    Refused(Refusal),
    /// The room is at the server with this origin, and the peer is told so.
    Moved(Arc<str>),
    /// The same for a message that is against the protocol.
    Violated(Violation),
    /// The peer closed the socket, on purpose or not.
    Gone,
}

impl End {
    /// The reason and the close code that the peer is sent, unless it closed the socket itself.
    pub fn refusal(&self) -> Option<(Refusal, u16)> {
        match self {
            End::Refused(refusal) => Some((*refusal, refusal.close_code())),
            End::Moved(_) => Some((Refusal::Moved, Refusal::Moved.close_code())),
            End::Violated(violation) => Some((Refusal::BadMessage, *violation as u16)),
            End::Gone => None,
        }
    }
}

/// How a message is against the protocol, as the close code of RFC 6455 says it. To players all of these are
/// [`Refusal::BadMessage`]; to those who write a client they are not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Violation {
    /// The frames are no WebSocket frames of a client, or come in no order that they may have.
    Framing = 1002,
    /// Text, where all messages are binary.
    Text = 1003,
    /// The bytes of the message are none of the protocol, or its text is no UTF-8.
    Content = 1007,
    /// The message may not come at this point.
    Order = 1008,
    /// The message is longer than any may be.
    TooLong = 1009,
}

/// Wraps an upgraded connection; `read` holds bytes that came with the upgrade.
pub async fn accept(stream: MaybeTlsStream, read: Vec<u8>) -> Socket {
    let config = Some(socket_config());
    let stream = RateLimitedStream::new(stream);
    WebSocketStream::from_partially_read(stream, read, Role::Server, config).await
}

fn socket_config() -> WebSocketConfig {
    // The write buffer takes one message, because each is flushed before the next, and a pong.
    WebSocketConfig::default()
        .max_message_size(Some(CLIENT_MESSAGE_BYTES_MAX))
        .max_frame_size(Some(CLIENT_MESSAGE_BYTES_MAX))
        .read_buffer_size(limits::READ_BUFFER_BYTES)
        .write_buffer_size(0)
        .max_write_buffer_size(SERVER_MESSAGE_BYTES_MAX + limits::READ_BUFFER_BYTES)
}

/// The first message of a client.
pub struct Hello {
    /// Name and colour.
    pub appearance: Appearance,
    /// Token of a seat held before.
    pub token: Option<Token>,
    /// Key of a room's host.
    pub host_key: Option<Token>,
}

/// Receives the first message of a socket.
pub async fn receive_hello(socket: &mut Socket) -> Result<Hello, End> {
    loop {
        let bytes = match socket.next().await {
            Some(Ok(Message::Binary(bytes))) => bytes,
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
            Some(Ok(Message::Close(_))) | None => return Err(End::Gone),
            Some(Err(error)) => return Err(end_of(&error)),
            Some(Ok(_)) => return Err(End::Violated(Violation::Text)),
        };
        return match ClientMessage::decode(&bytes) {
            Ok(ClientMessage::Hello { version, .. }) if version != VERSION => {
                Err(End::Refused(Refusal::Version))
            }
            Ok(ClientMessage::Hello { appearance, token, host_key, .. }) => {
                Ok(Hello { appearance, token, host_key })
            }
            _ => Err(End::Refused(Refusal::BadHello)),
        };
    }
}

/// Translates an error of the socket: too many bytes, a lost connection, or else a violation.
pub fn end_of(error: &tokio_tungstenite::tungstenite::Error) -> End {
    use tokio_tungstenite::tungstenite::error::{Error, ProtocolError};
    match error {
        Error::Io(error) if error.kind() == SPENT => End::Refused(Refusal::Flood),
        Error::Io(_)
        | Error::ConnectionClosed
        | Error::AlreadyClosed
        | Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => End::Gone,
        Error::Capacity(_) => End::Violated(Violation::TooLong),
        Error::Utf8(_) => End::Violated(Violation::Content),
        _ => End::Violated(Violation::Framing),
    }
}

/// Sends the reason, closes, and reads on until the peer has closed too: closing a socket with unread bytes
/// would reset it, and the peer would never see our last message.
pub async fn close(mut socket: Socket, end: End) {
    match end.refusal() {
        Some((refusal, code)) => {
            let last = match &end {
                End::Moved(url) => ServerMessage::Moved { url: url.to_string() },
                _ => ServerMessage::Refused { refusal },
            };
            let bytes = last.encode();
            let reason =
                CloseFrame { code: CloseCode::from(code), reason: refusal.message().into() };
            let said = match socket.send(Message::Binary(bytes.into())).await {
                Ok(()) => socket.send(Message::Close(Some(reason))).await,
                lost => lost,
            };
            if said.is_err() {
                return;
            }
        }
        // Answers the peer's close frame, if that is what ended it.
        None => {
            let _ = socket.flush().await;
        }
    }
    let mut stream = socket.into_inner().into_inner();
    if stream.shutdown().await.is_err() {
        return;
    }
    let mut scratch = [0; limits::READ_BUFFER_BYTES];
    let mut discarded = 0;
    while discarded < limits::CLOSE_DISCARD_BYTES_MAX {
        match stream.read(&mut scratch).await {
            Ok(0) | Err(_) => return,
            Ok(count) => discarded += count,
        }
    }
}
