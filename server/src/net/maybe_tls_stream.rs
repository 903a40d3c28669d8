//! A connection to the players' port, with or without TLS. The layers above do not distinguish the two.

use std::mem;
use std::pin::Pin;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, Empty, ReadHalf, WriteHalf, empty, split};
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio_io_timeout::TimeoutStream;
use tokio_rustls::server::TlsStream;
use tokio_util::either::Either;

/// A socket whose writes fail if they make no progress for some time. The limit applies below TLS, where it sees the
/// bytes that the peer accepts rather than those that encryption buffers. A session extracts the TCP socket from it.
pub type Socket = Pin<Box<TimeoutStream<Either<TcpStream, Empty>>>>;

/// Bytes to and from a peer, either plain or encrypted with TLS after the handshake. The TLS stream is boxed, because
/// its state takes a kilobyte.
pub type MaybeTlsStream = Either<Socket, Box<TlsStream<Socket>>>;

/// The bytes from a peer to its session.
pub type FromPeer = Either<OwnedReadHalf, ReadHalf<Box<TlsStream<Socket>>>>;

/// The bytes from a session to its peer.
pub type ToPeer = Either<OwnedWriteHalf, WriteHalf<Box<TlsStream<Socket>>>>;

/// Limits how long writes to a stream may make no progress.
pub fn with_write_timeout<S>(stream: S, limit: Duration) -> Pin<Box<TimeoutStream<S>>>
where
    S: AsyncRead + AsyncWrite,
{
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(limit));
    Box::pin(stream)
}

/// Splits a connection into its two directions, and removes the limit set by [`with_write_timeout`]. On a plain socket,
/// the directions share no lock and no timer, which would cost a session time with every message.
pub fn into_directions(stream: MaybeTlsStream) -> (FromPeer, ToPeer) {
    match stream {
        Either::Left(mut socket) => {
            let tcp = mem::replace(socket.as_mut().get_pin_mut().get_mut(), Either::Right(empty()));
            let Either::Left(tcp) = tcp else { unreachable!("it is taken once") };
            let (from_peer, to_peer) = tcp.into_split();
            (Either::Left(from_peer), Either::Left(to_peer))
        }
        Either::Right(mut stream) => {
            stream.get_mut().0.as_mut().set_write_timeout_pinned(None);
            let (from_peer, to_peer) = split(stream);
            (Either::Right(from_peer), Either::Right(to_peer))
        }
    }
}
