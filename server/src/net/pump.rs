//! Passes messages to and from a seated session. It is polled more than a hundred times a second for each player, so it
//! is a state machine over one socket with one timer, rather than a future for each direction and each limit.

use crate::host::inbox::InboxSender;
use crate::host::outbox::{NextToSend, Outbox};
use crate::host::room_handle::RoomInfo;
use crate::limits;
use crate::limits::token_bucket::TokenBucket;
use crate::net::game_socket::{GameSocket, SocketEnd, Violation, end_of};
use bytes::{Bytes, BytesMut};
use jostle_protocol::wire::Writer;
use jostle_protocol::{ClientMessage, Refusal, ServerMessage};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::TrySendError;
use std::task::{Context, Poll, ready};
use tokio::time::{Instant, Sleep, sleep_until};
use tungstenite::protocol::frame::Frame;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Message};

/// Memory for one session's pongs, reused once they have been sent.
const PONGS_BYTES: usize = 128;

/// A session's queues to and from the room, and the limits on a peer that is silent or reads nothing.
pub struct Seated {
    pub info: Arc<RoomInfo>,
    /// Messages to the room.
    pub inbox: InboxSender<Option<ClientMessage>>,
    /// Messages from the room.
    pub outbox: Arc<Outbox>,
    pub waits: limits::Timeouts,
}

pub struct Pump<'a> {
    seated: &'a Seated,
    socket: &'a mut GameSocket,
    bucket: TokenBucket,
    pongs: Pongs,
    /// Time when the peer last sent anything.
    heard_at: Instant,
    /// Time since when the socket has held bytes that the peer does not accept.
    stalled_since: Option<Instant>,
    /// Time of the next keepalive.
    keepalive_at: Instant,
    /// Fires no later than the earliest limit. A message from the peer postpones that limit, but not the timer.
    timer: Pin<Box<Sleep>>,
    /// Whether the timer will wake the session.
    timer_is_set: bool,
}

impl<'a> Pump<'a> {
    /// Creates the state for a session that begins now.
    pub fn new(seated: &'a Seated, socket: &'a mut GameSocket) -> Pump<'a> {
        let now = Instant::now();
        let (rate, burst) = (limits::MESSAGES_PER_SECOND_MAX, limits::MESSAGES_BURST_MAX);
        let keepalive_at = now + seated.waits.keepalive;
        Pump {
            seated,
            socket,
            bucket: TokenBucket::new(rate, burst, now.into_std()),
            pongs: Pongs::default(),
            heard_at: now,
            stalled_since: None,
            keepalive_at,
            timer: Box::pin(sleep_until(keepalive_at.min(now + seated.waits.silence))),
            timer_is_set: false,
        }
    }

    /// Reads and writes as much as possible. Ready once either side has ended the session.
    pub fn poll(&mut self, cx: &mut Context<'_>) -> Poll<SocketEnd> {
        let now = Instant::now();
        if let Poll::Ready(end) = self.poll_read(cx, now) {
            return Poll::Ready(end);
        }
        if let Poll::Ready(end) = self.poll_write(cx, now) {
            return Poll::Ready(end);
        }
        self.poll_limits(cx, now)
    }

    fn poll_read(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<SocketEnd> {
        loop {
            let message = ready!(self.socket.poll_next(cx));
            self.heard_at = now;
            if !self.bucket.take(now.into_std()) {
                return Poll::Ready(SocketEnd::Refused(Refusal::Flood));
            }
            if let Err(end) = self.accept(message) {
                return Poll::Ready(end);
            }
        }
    }

    fn accept(&mut self, message: tungstenite::Result<Message>) -> Result<(), SocketEnd> {
        match message {
            Ok(Message::Binary(bytes)) => self.accept_bytes(&bytes),
            Ok(Message::Ping(_) | Message::Pong(_)) => Ok(()),
            Ok(Message::Close(frame)) => Err(self.leave(frame)),
            Err(error) => Err(end_of(&error)),
            Ok(_) => Err(SocketEnd::Violated(Violation::Text)),
        }
    }

    fn accept_bytes(&mut self, bytes: &[u8]) -> Result<(), SocketEnd> {
        match ClientMessage::decode(bytes) {
            Ok(ClientMessage::Ping { stamp }) => {
                let tick = self.seated.info.tick.load(Ordering::Relaxed);
                self.seated.outbox.control(self.pongs.pong(stamp, tick));
                Ok(())
            }
            Ok(ClientMessage::Hello { .. }) => Err(SocketEnd::Violated(Violation::Order)),
            Ok(message) => self.pass_on(Some(message)),
            Err(_) => Err(SocketEnd::Violated(Violation::Content)),
        }
    }

    fn pass_on(&self, message: Option<ClientMessage>) -> Result<(), SocketEnd> {
        match self.seated.inbox.try_send(message) {
            Ok(()) => Ok(()),
            // The token bucket limits floods. A full inbox means that the room's thread is stalled, which is not the
            // player's fault, so the message is dropped.
            Err(TrySendError::Full(_)) => Ok(()),
            // The room has dropped this session. The reason is in the outbox.
            Err(TrySendError::Disconnected(_)) => Ok(()),
        }
    }

    /// Gives up the seat after a close with code 1000. After a reload or a lost network, the seat is held.
    fn leave(&self, frame: Option<CloseFrame>) -> SocketEnd {
        if frame.is_some_and(|frame| frame.code == CloseCode::Normal) {
            let _ = self.pass_on(None);
        }
        SocketEnd::Gone
    }

    /// Sends the messages that the thread's queue has not sent, one by one, since a keyframe can still replace messages
    /// in the outbox.
    fn poll_write(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<SocketEnd> {
        let outbox = &self.seated.outbox;
        outbox.register(cx.waker());
        // No keepalives are sent while the peer accepts nothing.
        if now >= self.keepalive_at && self.stalled_since.is_none() {
            self.keepalive_at = now + self.seated.waits.keepalive;
            self.socket.writer.queue(Frame::ping(Bytes::new()));
        }
        let mut end = None;
        let sent = self.socket.writer.poll_send(cx, || match outbox.take() {
            NextToSend::Message(bytes) => Some(bytes),
            NextToSend::End(refusal) => {
                end = Some(SocketEnd::Refused(refusal));
                None
            }
            NextToSend::Nothing => None,
        });
        match sent {
            Poll::Ready(Ok(())) => {
                self.stalled_since = None;
                end.map_or(Poll::Pending, Poll::Ready)
            }
            Poll::Ready(Err(_lost)) => Poll::Ready(SocketEnd::Gone),
            Poll::Pending => self.stall(now),
        }
    }

    /// Handles a peer that is currently accepting no bytes. Its session may still end.
    fn stall(&mut self, now: Instant) -> Poll<SocketEnd> {
        if self.stalled_since.is_none() {
            self.stalled_since = Some(now);
            let limit = now + self.seated.waits.stall;
            if limit < self.timer.deadline() {
                self.timer.as_mut().reset(limit);
                self.timer_is_set = false;
            }
        }
        match self.seated.outbox.end_reason() {
            Some(refusal) => Poll::Ready(SocketEnd::Refused(refusal)),
            None => Poll::Pending,
        }
    }

    fn poll_limits(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<SocketEnd> {
        let waits = &self.seated.waits;
        if self.timer_is_set && now < self.timer.deadline() {
            return Poll::Pending;
        }
        self.timer_is_set = true;
        while self.timer.as_mut().poll(cx).is_ready() {
            let silence = self.heard_at + waits.silence;
            if silence <= now || self.stalled_since.is_some_and(|since| since + waits.stall <= now)
            {
                return Poll::Ready(SocketEnd::Refused(Refusal::Silent));
            }
            let next = self.stalled_since.map_or(self.keepalive_at, |since| since + waits.stall);
            self.timer.as_mut().reset(next.min(silence));
        }
        Poll::Pending
    }
}

/// One session's pongs. Clients ping several times a second, and in a steady tick the pongs are all that a session
/// sends apart from shared snapshots, so their memory is reused once they have been sent.
#[derive(Default)]
struct Pongs {
    writer: Writer,
    memory: BytesMut,
}

impl Pongs {
    /// Encodes the answer to a ping that has this stamp, at this tick.
    fn pong(&mut self, stamp: u32, tick: u32) -> Bytes {
        self.writer.clear();
        ServerMessage::Pong { stamp, tick }.write(&mut self.writer);
        let bytes = self.writer.bytes();
        if self.memory.capacity() < bytes.len() {
            self.memory.reserve(PONGS_BYTES);
        }
        self.memory.extend_from_slice(bytes);
        self.memory.split().freeze()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn pongs_are_right_and_reuse_the_memory_of_those_sent() {
        let mut pongs = Pongs::default();
        let mut addresses = BTreeSet::new();
        for stamp in 0..1000 {
            let pong = pongs.pong(stamp, 70_000);
            let answer = ServerMessage::Pong { stamp, tick: 70_000 };
            assert_eq!(ServerMessage::decode(&pong), Ok(answer));
            addresses.insert(pong.as_ptr() as usize);
        }
        let (first, last) = (addresses.first().unwrap(), addresses.last().unwrap());
        assert!(last - first < PONGS_BYTES, "all in the same memory");
    }

    #[test]
    fn waiting_pongs_are_not_overwritten() {
        let mut pongs = Pongs::default();
        let waiting: Vec<Bytes> = (0..100).map(|stamp| pongs.pong(stamp, 5)).collect();
        for (stamp, pong) in (0..).zip(&waiting) {
            let answer = ServerMessage::Pong { stamp, tick: 5 };
            assert_eq!(ServerMessage::decode(pong), Ok(answer));
        }
    }
}
