//! The messages of a seated session, in both directions. It is polled more than a hundred times a second for each player, so it is one
//! state machine over one socket, with one timer, instead of a future for each direction and each limit.

use crate::host::inbox::InboxSender;
use crate::host::outbox::{Next, Outbox};
use crate::host::room_handle::{FromSession, RoomInfo};
use crate::limits;
use crate::limits::token_bucket::TokenBucket;
use crate::net::game_socket::{End, Socket, Violation, end_of};
use crate::net::pongs::Pongs;
use futures_util::{SinkExt, StreamExt};
use jostle_protocol::{ClientMessage, Refusal};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::TrySendError;
use std::task::{Context, Poll, ready};
use tokio::time::{Instant, Sleep, sleep_until};
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::{self, Message};

/// The ends of a session: its queues to the room and from it, and how long the peer may be silent or read nothing.
pub struct Seated {
    /// The room.
    pub info: Arc<RoomInfo>,
    /// Messages to the room.
    pub inbox: InboxSender<FromSession>,
    /// Messages from the room.
    pub outbox: Arc<Outbox>,
    /// The limits.
    pub waits: limits::Waits,
}

/// The traffic of a session.
pub struct Pump<'a> {
    seated: &'a Seated,
    socket: &'a mut Socket,
    bucket: TokenBucket,
    pongs: Pongs,
    /// Whether the socket may hold bytes of a message.
    unflushed: bool,
    /// When the peer was heard last.
    heard_at: Instant,
    /// Since when the socket holds bytes that the peer does not take.
    stalled_since: Option<Instant>,
    /// When the next keepalive is due.
    keepalive_at: Instant,
    /// Fires no later than the first of the limits is reached. Being heard moves that limit and not the timer.
    timer: Pin<Box<Sleep>>,
}

impl<'a> Pump<'a> {
    /// The traffic of a session that begins now.
    pub fn new(seated: &'a Seated, socket: &'a mut Socket) -> Pump<'a> {
        let now = Instant::now();
        let (rate, burst) = (limits::MESSAGES_PER_SECOND_MAX, limits::MESSAGES_BURST_MAX);
        let keepalive_at = now + seated.waits.keepalive;
        Pump {
            seated,
            socket,
            bucket: TokenBucket::new(rate, burst, now.into_std()),
            pongs: Pongs::default(),
            unflushed: false,
            heard_at: now,
            stalled_since: None,
            keepalive_at,
            timer: Box::pin(sleep_until(keepalive_at.min(now + seated.waits.silence))),
        }
    }

    /// Reads and writes all that it can; ready once one side has ended the session.
    pub fn poll(&mut self, cx: &mut Context<'_>) -> Poll<End> {
        let now = Instant::now();
        if let Poll::Ready(end) = self.poll_read(cx, now) {
            return Poll::Ready(end);
        }
        if let Poll::Ready(end) = self.poll_write(cx, now) {
            return Poll::Ready(end);
        }
        self.poll_limits(cx, now)
    }

    fn poll_read(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<End> {
        loop {
            let message = ready!(self.socket.poll_next_unpin(cx));
            self.heard_at = now;
            if !self.bucket.take(now.into_std()) {
                return Poll::Ready(End::Refused(Refusal::Flood));
            }
            if let Err(end) = self.accept(message) {
                return Poll::Ready(end);
            }
        }
    }

    fn accept(&mut self, message: Option<tungstenite::Result<Message>>) -> Result<(), End> {
        match message {
            Some(Ok(Message::Binary(bytes))) => self.accept_bytes(&bytes),
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(()),
            Some(Ok(Message::Close(frame))) => Err(self.leave(frame)),
            Some(Err(error)) => Err(end_of(&error)),
            Some(Ok(_)) => Err(End::Violated(Violation::Text)),
            None => Err(End::Gone),
        }
    }

    fn accept_bytes(&mut self, bytes: &[u8]) -> Result<(), End> {
        match ClientMessage::decode(bytes) {
            Ok(ClientMessage::Input { seq, ack_tick, input }) => {
                self.pass_on(FromSession::Input { seq, ack_tick, input })
            }
            Ok(ClientMessage::Ping { stamp }) => {
                let tick = self.seated.info.tick.load(Ordering::Relaxed);
                self.seated.outbox.control(self.pongs.pong(stamp, tick));
                Ok(())
            }
            Ok(ClientMessage::View { size }) => self.pass_on(FromSession::View { size }),
            Ok(ClientMessage::Kick { seat }) => self.pass_on(FromSession::Kick { seat }),
            Ok(ClientMessage::CloseRoom) => self.pass_on(FromSession::CloseRoom),
            Ok(ClientMessage::Hello { .. }) => Err(End::Violated(Violation::Order)),
            Err(_) => Err(End::Violated(Violation::Content)),
        }
    }

    fn pass_on(&self, message: FromSession) -> Result<(), End> {
        match self.seated.inbox.try_send(message) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => Err(End::Refused(Refusal::Flood)),
            // The room dropped this session; the reason is in the outbox.
            Err(TrySendError::Disconnected(_)) => Ok(()),
        }
    }

    /// Gives the seat up after a close with 1000; after a reload or a lost network it is held.
    fn leave(&self, frame: Option<CloseFrame>) -> End {
        if frame.is_some_and(|frame| frame.code == CloseCode::Normal) {
            let _ = self.pass_on(FromSession::Leave);
        }
        End::Gone
    }

    /// Sends what the outbox has, one message after another: what waits there can still be replaced by a keyframe.
    fn poll_write(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<End> {
        self.seated.outbox.register(cx.waker());
        loop {
            if self.unflushed {
                match self.socket.poll_flush_unpin(cx) {
                    Poll::Ready(Ok(())) => (self.unflushed, self.stalled_since) = (false, None),
                    Poll::Ready(Err(_lost)) => return Poll::Ready(End::Gone),
                    Poll::Pending => return self.stall(now),
                }
            }
            let message = match self.seated.outbox.take() {
                Next::Message(bytes) => Message::Binary(bytes),
                Next::End(refusal) => return Poll::Ready(End::Refused(refusal)),
                Next::Nothing if now >= self.keepalive_at => {
                    self.keepalive_at = now + self.seated.waits.keepalive;
                    Message::Ping(Default::default())
                }
                Next::Nothing => return Poll::Pending,
            };
            // A socket that was flushed is ready.
            if self.socket.start_send_unpin(message).is_err() {
                return Poll::Ready(End::Gone);
            }
            self.unflushed = true;
        }
    }

    /// The peer takes nothing at the moment. Its session may end all the same.
    fn stall(&mut self, now: Instant) -> Poll<End> {
        if self.stalled_since.is_none() {
            self.stalled_since = Some(now);
            let limit = now + self.seated.waits.stall;
            if limit < self.timer.deadline() {
                self.timer.as_mut().reset(limit);
            }
        }
        match self.seated.outbox.end_reason() {
            Some(refusal) => Poll::Ready(End::Refused(refusal)),
            None => Poll::Pending,
        }
    }

    fn poll_limits(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<End> {
        let waits = &self.seated.waits;
        while self.timer.as_mut().poll(cx).is_ready() {
            let silence = self.heard_at + waits.silence;
            if silence <= now || self.stalled_since.is_some_and(|since| since + waits.stall <= now)
            {
                return Poll::Ready(End::Refused(Refusal::Silent));
            }
            // No keepalive is due while the peer takes nothing.
            let next = self.stalled_since.map_or(self.keepalive_at, |since| since + waits.stall);
            self.timer.as_mut().reset(next.min(silence));
        }
        Poll::Pending
    }
}
