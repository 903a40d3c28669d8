//! A rate limit on the bytes that a session's socket may send. The session counts messages, but one
//! message may come in any number of fragments, empty ones included, and never be completed. Bytes are
//! therefore counted here, below the frames.

use crate::limits::token_bucket::TokenBucket;
use crate::limits::{MESSAGES_BURST_MAX, MESSAGES_PER_SECOND_MAX};
use jostle_protocol::limits::CLIENT_MESSAGE_BYTES_MAX;
use std::io::{self, ErrorKind};
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Instant;
use tokio::io::{AsyncRead, ReadBuf};

/// Bytes of the longest message with its frame: two of opcode and length, two more of length, a mask.
const FRAME_BYTES_MAX: u32 = CLIENT_MESSAGE_BYTES_MAX as u32 + 2 + 2 + 4;
/// Bytes a second in the long run. Messages are counted when they are whole; this counts fragments,
/// of which a message may have any number, and pings before the hello.
const BYTES_PER_SECOND_MAX: u32 = MESSAGES_PER_SECOND_MAX * FRAME_BYTES_MAX;
/// Burst of bytes: [`MESSAGES_BURST_MAX`] of the longest messages.
const BYTES_BURST_MAX: u32 = MESSAGES_BURST_MAX * FRAME_BYTES_MAX;

/// Kind of the error after too many bytes; no socket has it.
pub const SPENT: ErrorKind = ErrorKind::QuotaExceeded;

/// A stream whose reading fails with [`SPENT`] once the peer sent too many bytes.
pub struct RateLimitedStream<S> {
    stream: S,
    bytes: TokenBucket,
}

impl<S> RateLimitedStream<S> {
    /// Wraps a stream of which nothing was read.
    pub fn new(stream: S) -> RateLimitedStream<S> {
        let bytes = TokenBucket::new(BYTES_PER_SECOND_MAX, BYTES_BURST_MAX, Instant::now());
        RateLimitedStream { stream, bytes }
    }

    /// The stream, without the limit.
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
