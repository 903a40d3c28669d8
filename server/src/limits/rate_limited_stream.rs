//! A rate limit on the bytes that a session's peer may send. The session counts messages, but a message may arrive in
//! any number of fragments, including empty ones, and may never be complete. Bytes are therefore counted here, below
//! the level of frames.

use crate::limits::token_bucket::TokenBucket;
use crate::limits::{MESSAGES_BURST_MAX, MESSAGES_PER_SECOND_MAX};
use jostle_protocol::limits::CLIENT_MESSAGE_BYTES_MAX;
use std::io::{self, ErrorKind};
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Instant;
use tokio::io::{AsyncRead, ReadBuf};

/// Length of the longest message including its frame, bytes: two for opcode and length, two for the extended length,
/// and the mask.
const FRAME_BYTES_MAX: u32 = CLIENT_MESSAGE_BYTES_MAX as u32 + 2 + 2 + 4;
/// Sustained rate in bytes per second. Messages are counted only once they are complete; this also counts fragments, of
/// which a message may have any number, and pings before the hello.
const BYTES_PER_SECOND_MAX: u32 = MESSAGES_PER_SECOND_MAX * FRAME_BYTES_MAX;
/// Largest burst of bytes: [`MESSAGES_BURST_MAX`] messages of maximum length.
const BYTES_BURST_MAX: u32 = MESSAGES_BURST_MAX * FRAME_BYTES_MAX;

/// Kind of error returned after too many bytes; sockets never return this kind.
pub const SPENT: ErrorKind = ErrorKind::QuotaExceeded;

/// A stream whose reads fail with [`SPENT`] once the peer has sent too many bytes.
pub struct RateLimitedStream<S> {
    stream: S,
    bytes: TokenBucket,
}

impl<S> RateLimitedStream<S> {
    /// Wraps a stream from which nothing has been read yet.
    pub fn new(stream: S) -> RateLimitedStream<S> {
        let bytes = TokenBucket::new(BYTES_PER_SECOND_MAX, BYTES_BURST_MAX, Instant::now());
        RateLimitedStream { stream, bytes }
    }

    /// The underlying stream, without the limit.
    pub fn get_mut(&mut self) -> &mut S {
        &mut self.stream
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for RateLimitedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let held = buffer.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(context, buffer))?;
        let count = buffer.filled().len() - held;
        let allowed = self.bytes.take_many(count, Instant::now());
        Poll::Ready(if allowed { Ok(()) } else { Err(SPENT.into()) })
    }
}
