//! The WebSocket of a game session: its limits, its first message and its close.

use crate::limits;
use crate::limits::rate_limited_stream::{RateLimitedStream, SPENT};
use crate::net::maybe_tls_stream::MaybeTlsStream;
use futures_util::{SinkExt, StreamExt};
use jostle_protocol::limits::{CLIENT_MESSAGE_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX};
use jostle_protocol::{Appearance, ClientMessage, Refusal, ServerMessage, Token, VERSION};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};

/// A game socket, with a limit on the bytes that the peer may send.
pub type Socket = WebSocketStream<RateLimitedStream<MaybeTlsStream>>;

/// How a session ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The server ends it, and sends the reason.
    Refused(Refusal),
    /// The peer closed the socket, on purpose or not.
    Gone,
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
            Some(Ok(_)) => return Err(End::Refused(Refusal::BadMessage)),
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

/// Translates an error of the socket: too many bytes, a lost connection, or else a bad message.
pub fn end_of(error: &tokio_tungstenite::tungstenite::Error) -> End {
    use tokio_tungstenite::tungstenite::error::{Error, ProtocolError};
    match error {
        Error::Io(error) if error.kind() == SPENT => End::Refused(Refusal::Flood),
        Error::Io(_)
        | Error::ConnectionClosed
        | Error::AlreadyClosed
        | Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => End::Gone,
        _ => End::Refused(Refusal::BadMessage),
    }
}

/// Sends the reason, closes, and reads on until the peer has closed too: closing a socket with unread bytes
/// would reset it, and the peer would never see our last message.
pub async fn close(mut socket: Socket, end: End) {
    match end {
        End::Refused(refusal) => {
            let bytes = ServerMessage::Refused { refusal }.encode();
            let reason = CloseFrame {
                code: CloseCode::from(refusal.close_code()),
                reason: refusal.message().into(),
            };
            let said = match socket.send(Message::Binary(bytes.into())).await {
                Ok(()) => socket.send(Message::Close(Some(reason))).await,
                lost => lost,
            };
            if said.is_err() {
                return;
            }
        }
        // Answers the peer's close frame, if that is what ended it.
        End::Gone => {
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
