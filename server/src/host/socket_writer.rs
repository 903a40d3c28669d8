//! The sending side of a game socket. It frames messages and keeps what the socket has not accepted yet. A session
//! shares it with its thread's [`SendQueue`](crate::host::outbox::SendQueue), which sends snapshots without waking the
//! session.

use crate::limits::READ_BUFFER_BYTES;
use bytes::Bytes;
use jostle_protocol::limits::SERVER_MESSAGE_BYTES_MAX;
use std::future::poll_fn;
use std::io::{self, ErrorKind};
use std::pin::Pin;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker, ready};
use tokio::io::{AsyncWrite, AsyncWriteExt};
use tungstenite::protocol::frame::Frame;
use tungstenite::protocol::frame::coding::{Data, OpCode};

/// Memory that a session keeps for framing its messages: enough for a snapshot of a busy room. Larger messages are
/// allocated.
const FRAMES_BYTES_KEPT: usize = 4096;
/// Maximum size of the frames waiting for the socket, bytes: one message, plus pongs. Beyond this, only the newest pong
/// is kept.
const FRAMES_BYTES_MAX: usize = SERVER_MESSAGE_BYTES_MAX + READ_BUFFER_BYTES;

/// A [`FrameWriter`] shared by the session and its thread, until the session takes it to close the socket. Both run on
/// the same thread, so neither waits for the lock.
#[derive(Default)]
pub struct SocketWriter(Mutex<Option<FrameWriter>>);

impl SocketWriter {
    /// Wraps the sending side of a socket on which no frame has been sent yet.
    pub fn new(socket: impl AsyncWrite + Send + Unpin + 'static) -> SocketWriter {
        let socket = Box::new(socket);
        let writer = FrameWriter { socket, frames: Vec::new(), taken: 0, is_flushed: true };
        SocketWriter(Mutex::new(Some(writer)))
    }

    /// Sends the waiting bytes, then one message after another as long as `next` returns any. A message that has not
    /// been taken yet can still be replaced.
    pub fn poll_send(
        &self,
        cx: &mut Context<'_>,
        next: impl FnMut() -> Option<Bytes>,
    ) -> Poll<io::Result<()>> {
        match &mut *self.lock() {
            Some(writer) => writer.poll_send(cx, next),
            None => Poll::Ready(Err(ErrorKind::NotConnected.into())),
        }
    }

    /// Sends messages as long as the socket accepts them immediately. Returns `false` if the session has to be woken to
    /// continue.
    pub fn send_now(&self, next: impl FnMut() -> Option<Bytes>) -> bool {
        match &mut *self.lock() {
            // The session is already waiting for the socket, and will continue.
            Some(writer) if !writer.is_clear() => true,
            Some(writer) => {
                let mut cx = Context::from_waker(Waker::noop());
                matches!(writer.poll_send(&mut cx, next), Poll::Ready(Ok(())))
            }
            None => false,
        }
    }

    /// Queues a frame to be sent before the next message.
    pub fn queue(&self, frame: Frame) {
        if let Some(writer) = &mut *self.lock() {
            writer.queue(frame);
        }
    }

    /// Queues formatted frames. If too many are already waiting, queues none and returns `false`.
    pub fn queue_bytes(&self, frames: &[u8]) -> bool {
        match &mut *self.lock() {
            Some(writer) if writer.frames.len() + frames.len() > FRAMES_BYTES_MAX => false,
            Some(writer) => {
                writer.frames.extend_from_slice(frames);
                true
            }
            None => true,
        }
    }

    /// Takes the writer permanently. From then on, only its holder can send.
    pub fn take(&self) -> Option<FrameWriter> {
        self.lock().take()
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> MutexGuard<'_, Option<FrameWriter>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes frames to a socket.
pub struct FrameWriter {
    socket: Box<dyn AsyncWrite + Send + Unpin>,
    /// Frames that the socket has not accepted yet, starting at byte `taken`.
    frames: Vec<u8>,
    taken: usize,
    /// Whether the socket has sent everything it accepted. Under TLS it may still be holding some bytes.
    is_flushed: bool,
}

impl FrameWriter {
    fn poll_send(
        &mut self,
        cx: &mut Context<'_>,
        mut next: impl FnMut() -> Option<Bytes>,
    ) -> Poll<io::Result<()>> {
        loop {
            ready!(self.poll_flush(cx))?;
            match next() {
                Some(message) => {
                    self.queue(Frame::message(message, OpCode::Data(Data::Binary), true))
                }
                None => return Poll::Ready(Ok(())),
            }
        }
    }

    /// Queues a frame after the waiting ones.
    pub fn queue(&mut self, frame: Frame) {
        frame.format(&mut self.frames).expect("a Vec takes everything");
    }

    /// Sends the waiting bytes, then shuts down the sending side.
    pub async fn finish(&mut self) -> io::Result<()> {
        poll_fn(|cx| self.poll_flush(cx)).await?;
        self.socket.shutdown().await
    }

    fn is_clear(&self) -> bool {
        self.frames.is_empty() && self.is_flushed
    }

    fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        while self.taken < self.frames.len() {
            let socket = Pin::new(&mut self.socket);
            match ready!(socket.poll_write(cx, &self.frames[self.taken..]))? {
                0 => return Poll::Ready(Err(ErrorKind::WriteZero.into())),
                count => self.taken += count,
            }
            self.is_flushed = false;
        }
        self.taken = 0;
        self.frames.clear();
        // Buffers as large as a keyframe are not kept.
        self.frames.shrink_to(FRAMES_BYTES_KEPT);
        if !self.is_flushed {
            ready!(Pin::new(&mut self.socket).poll_flush(cx))?;
            self.is_flushed = true;
        }
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests;
