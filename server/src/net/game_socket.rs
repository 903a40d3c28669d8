//! A game session's WebSocket, or the same frames over HTTP: its limits, its first message and how it closes.

use crate::host::socket_writer::SocketWriter;
use crate::limits;
use crate::limits::rate_limited_stream::{RateLimitedStream, SPENT};
use crate::net::maybe_tls_stream::{FromPeer, MaybeTlsStream, ToPeer, into_directions};
use crate::net::posts::{PostReader, Posts};
use jostle_protocol::limits::CLIENT_MESSAGE_BYTES_MAX;
use jostle_protocol::{Appearance, ClientMessage, Refusal, Role, ServerMessage, Token, VERSION};
use std::future::poll_fn;
use std::io::{self, ErrorKind, Read, Write};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWriteExt, ReadBuf};
use tokio_util::either::Either;
use tungstenite::error::{Error, ProtocolError};
use tungstenite::protocol::frame::Frame;
use tungstenite::protocol::frame::coding::{CloseCode, Data, OpCode};
use tungstenite::protocol::{self, CloseFrame, Message, WebSocket, WebSocketConfig};

/// Maximum number of bytes read and discarded while a socket closes, so that a reset does not destroy the last message.
const CLOSE_DISCARD_BYTES_MAX: usize = 1 << 20;

/// A game socket, with a limit on the bytes that the peer may send.
pub struct GameSocket {
    frames: WebSocket<PeerStream>,
    /// The socket's sending side.
    pub writer: Arc<SocketWriter>,
}

impl GameSocket {
    /// The next message from the peer. This must not be called again after an error.
    pub fn poll_next(&mut self, cx: &mut Context<'_>) -> Poll<tungstenite::Result<Message>> {
        self.frames.get_mut().waker.clone_from(cx.waker());
        match self.frames.read() {
            Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => Poll::Pending,
            read => Poll::Ready(read),
        }
    }

    /// Sends the answer to a ping.
    async fn answer(&mut self) -> io::Result<()> {
        // This fails if too many answers are waiting, in which case those are sent.
        let _ = self.frames.flush();
        poll_fn(|cx| self.writer.poll_send(cx, || None)).await
    }
}

/// A peer as the frame codec sees it. Bytes come from the socket or from posts. The codec's automatic answers to pings
/// and closes are queued for the writer.
struct PeerStream {
    stream: RateLimitedStream<Either<FromPeer, Box<PostReader>>>,
    /// Woken when there is more to read.
    waker: Waker,
    writer: Arc<SocketWriter>,
}

impl Read for PeerStream {
    fn read(&mut self, memory: &mut [u8]) -> io::Result<usize> {
        let mut buffer = ReadBuf::new(memory);
        let mut cx = Context::from_waker(&self.waker);
        match Pin::new(&mut self.stream).poll_read(&mut cx, &mut buffer) {
            Poll::Ready(read) => read.map(|()| buffer.filled().len()),
            Poll::Pending => Err(ErrorKind::WouldBlock.into()),
        }
    }
}

impl Write for PeerStream {
    fn write(&mut self, frames: &[u8]) -> io::Result<usize> {
        match self.writer.queue_bytes(frames) {
            true => Ok(frames.len()),
            // The codec tries again the next time it reads.
            false => Err(ErrorKind::WouldBlock.into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// How a session ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SocketEnd {
    /// The server ended the session and sends the peer this reason.
    Refused(Refusal),
    /// The room is on the server with this origin, which the peer is told.
    Moved(Arc<str>),
    /// The peer sent a message that violates the protocol.
    Violated(Violation),
    /// The peer closed the socket, deliberately or not.
    Gone,
}

impl SocketEnd {
    /// The reason and close code to send to the peer, unless the peer closed the socket itself.
    pub fn refusal(&self) -> Option<(Refusal, u16)> {
        match self {
            SocketEnd::Refused(refusal) => Some((*refusal, refusal.close_code())),
            SocketEnd::Moved(_) => Some((Refusal::Moved, Refusal::Moved.close_code())),
            SocketEnd::Violated(violation) => Some((Refusal::BadMessage, *violation as u16)),
            SocketEnd::Gone => None,
        }
    }
}

/// The kind of protocol violation, as a close code from RFC 6455. Players see all of these as [`Refusal::BadMessage`];
/// client developers can tell them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Violation {
    /// The frames are not valid WebSocket frames from a client, or are out of order.
    Framing = 1002,
    /// A text message was sent, but all messages are binary.
    Text = 1003,
    /// The bytes are not a protocol message, or its text is not UTF-8.
    Content = 1007,
    /// The message is not allowed at this point.
    Order = 1008,
    /// The message exceeds the maximum length.
    TooLong = 1009,
}

/// Wraps an upgraded connection. `read` contains bytes that arrived with the upgrade.
pub fn accept(stream: MaybeTlsStream, read: Vec<u8>) -> GameSocket {
    // From here on, the session itself limits how long a message may take.
    let (from_peer, to_peer) = into_directions(stream);
    framed(Either::Left(from_peer), to_peer, read)
}

/// Begins a streamed response on a connection. The peer's frames come in posts.
pub async fn accept_posts(
    mut stream: MaybeTlsStream,
    head: &[u8],
    posts: Posts,
) -> io::Result<GameSocket> {
    stream.write_all(head).await?;
    stream.flush().await?;
    let (connection, to_peer) = into_directions(stream);
    let reader = Box::new(PostReader::new(posts, connection));
    Ok(framed(Either::Right(reader), to_peer, Vec::new()))
}

fn framed(
    from_peer: Either<FromPeer, Box<PostReader>>,
    to_peer: ToPeer,
    read: Vec<u8>,
) -> GameSocket {
    let writer = Arc::new(SocketWriter::new(to_peer));
    let stream = RateLimitedStream::new(from_peer);
    let peer = PeerStream { stream, waker: Waker::noop().clone(), writer: Arc::clone(&writer) };
    let config = Some(socket_config());
    let frames = WebSocket::from_partially_read(peer, read, protocol::Role::Server, config);
    GameSocket { frames, writer }
}

fn socket_config() -> WebSocketConfig {
    // The write buffer holds the codec's automatic answers.
    WebSocketConfig::default()
        .max_message_size(Some(CLIENT_MESSAGE_BYTES_MAX))
        .max_frame_size(Some(CLIENT_MESSAGE_BYTES_MAX))
        .read_buffer_size(limits::READ_BUFFER_BYTES)
        .write_buffer_size(0)
        .max_write_buffer_size(limits::READ_BUFFER_BYTES)
}

/// A client's first message.
pub struct Hello {
    pub appearance: Appearance,
    /// Token for a seat that the client held earlier.
    pub token: Option<Token>,
    /// Host key for a room.
    pub host_key: Option<Token>,
    /// Whether the client plays or watches.
    pub role: Role,
}

/// Receives a socket's first message.
pub async fn receive_hello(socket: &mut GameSocket) -> Result<Hello, SocketEnd> {
    loop {
        let bytes = match poll_fn(|cx| socket.poll_next(cx)).await {
            Ok(Message::Binary(bytes)) => bytes,
            Ok(Message::Ping(_) | Message::Pong(_)) => {
                socket.answer().await.map_err(|_lost| SocketEnd::Gone)?;
                continue;
            }
            Ok(Message::Close(_)) => return Err(SocketEnd::Gone),
            Err(error) => return Err(end_of(&error)),
            Ok(_) => return Err(SocketEnd::Violated(Violation::Text)),
        };
        return match ClientMessage::decode(&bytes) {
            Ok(ClientMessage::Hello { version, .. }) if version != VERSION => {
                Err(SocketEnd::Refused(Refusal::Version))
            }
            Ok(ClientMessage::Hello { appearance, token, host_key, role, .. }) => {
                Ok(Hello { appearance, token, host_key, role })
            }
            _ => Err(SocketEnd::Refused(Refusal::BadHello)),
        };
    }
}

/// Classifies a socket error: too many bytes, a lost connection, or a protocol violation.
pub fn end_of(error: &Error) -> SocketEnd {
    match error {
        Error::Io(error) if error.kind() == SPENT => SocketEnd::Refused(Refusal::Flood),
        Error::Io(_)
        | Error::ConnectionClosed
        | Error::AlreadyClosed
        | Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => SocketEnd::Gone,
        Error::Capacity(_) => SocketEnd::Violated(Violation::TooLong),
        Error::Utf8(_) => SocketEnd::Violated(Violation::Content),
        _ => SocketEnd::Violated(Violation::Framing),
    }
}

/// Sends the reason, closes, and reads until the peer has closed too. Closing a socket with unread bytes would reset
/// it, and the peer would never see the last message.
pub async fn close(socket: GameSocket, end: SocketEnd) {
    let GameSocket { mut frames, writer } = socket;
    if end == SocketEnd::Gone {
        // Answers the peer's close frame, if the peer sent one.
        let _ = frames.flush();
    }
    let Some(mut writer) = writer.take() else { return };
    if let Some((refusal, code)) = end.refusal() {
        let last = match &end {
            SocketEnd::Moved(url) => ServerMessage::Moved { url: url.to_string() },
            _ => ServerMessage::Refused { refusal },
        };
        let reason = CloseFrame { code: CloseCode::from(code), reason: refusal.message().into() };
        writer.queue(Frame::message(last.encode(), OpCode::Data(Data::Binary), true));
        writer.queue(Frame::close(Some(reason)));
    }
    if writer.finish().await.is_err() {
        return;
    }
    let stream = frames.get_mut().stream.get_mut();
    let mut scratch = [0; limits::READ_BUFFER_BYTES];
    let mut discarded = 0;
    while discarded < CLOSE_DISCARD_BYTES_MAX {
        match stream.read(&mut scratch).await {
            Ok(0) | Err(_) => return,
            Ok(count) => discarded += count,
        }
    }
}
