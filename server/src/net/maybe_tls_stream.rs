//! A connection of the players' port, with or without TLS. The layers above do not distinguish the two.

use std::pin::Pin;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio_io_timeout::TimeoutStream;
use tokio_rustls::server::TlsStream;
use tokio_util::either::Either;

/// A socket whose writes fail when they make no progress for some time. The limit is below TLS, where it
/// sees what the peer takes and not what the encryption buffers.
pub type Socket = Pin<Box<TimeoutStream<TcpStream>>>;

/// Bytes to and from a peer: as they are on the wire, or under TLS after the handshake. The latter is boxed,
/// for its state is a kilobyte.
pub type MaybeTlsStream = Either<Socket, Box<TlsStream<Socket>>>;

/// Limits the time for which writes to a stream may make no progress.
pub fn with_write_timeout<S>(stream: S, limit: Duration) -> Pin<Box<TimeoutStream<S>>>
where
    S: AsyncRead + AsyncWrite,
{
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(limit));
    Box::pin(stream)
}

/// Lifts the limit of [`with_write_timeout`].
pub fn lift_write_timeout(stream: &mut MaybeTlsStream) {
    let socket = match stream {
        Either::Left(socket) => socket,
        Either::Right(stream) => stream.get_mut().0,
    };
    socket.as_mut().set_write_timeout_pinned(None);
}
