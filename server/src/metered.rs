//! The socket of a session, read no faster than honest play could fill it. Messages are counted by
//! the session; but one message may come in any number of fragments, empty ones too, and no message
//! ever comes of them: so bytes are counted here, below the frames.

use crate::limits::{BYTES_BURST_MAX, BYTES_PER_SECOND_MAX};
use crate::rate::TokenBucket;
use crate::stream::Stream;
use std::io::{self, ErrorKind};
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Instant;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// A stream whose reading fails with [`Metered::SPENT`] once the peer sent too many bytes.
pub struct Metered {
    stream: Stream,
    bytes: TokenBucket,
}

impl Metered {
    /// Kind of the error after too many bytes; no socket has it.
    pub const SPENT: ErrorKind = ErrorKind::QuotaExceeded;

    /// A stream of which nothing was read.
    pub fn new(stream: Stream) -> Metered {
        let bytes = TokenBucket::new(BYTES_PER_SECOND_MAX, BYTES_BURST_MAX, Instant::now());
        Metered { stream, bytes }
    }

    /// The stream alone.
    pub fn into_inner(self) -> Stream {
        self.stream
    }
}

impl AsyncRead for Metered {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let held = buffer.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(context, buffer))?;
        let count = buffer.filled().len() - held;
        let allowed = self.bytes.take_many(count, Instant::now());
        Poll::Ready(if allowed { Ok(()) } else { Err(Metered::SPENT.into()) })
    }
}

impl AsyncWrite for Metered {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
