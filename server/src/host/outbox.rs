//! The messages waiting for one session's socket: snapshots in order, a few control messages, and the session's end.
//!
//! The room fills the outbox and never waits; the session's thread empties it at the pace of its socket. Each snapshot
//! is coded against the previous one, so none may be skipped. If a client's backlog exceeds the size of a keyframe, a
//! keyframe replaces it. If all players see the whole world, subscribers at the same rate share the bytes of all
//! messages except such keyframes.

use crate::host::socket_writer::SocketWriter;
use bytes::Bytes;
use futures_util::task::AtomicWaker;
use jostle_protocol::Refusal;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::mem;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::Waker;
use std::time::Duration;
use tokio::sync::{Notify, OwnedSemaphorePermit};

/// Maximum number of control messages waiting for the socket; further pongs are dropped.
const OUTBOX_CONTROL_MAX: usize = 16;
/// Maximum number of snapshots waiting for the socket; after half a second's worth, a keyframe replaces them.
const OUTBOX_SNAPSHOTS_MAX: usize = 32;

/// Number of snapshots that may wait regardless of size; so few do not indicate a slow reader.
const LATE_SNAPSHOTS_MIN: usize = 4;

/// The queue from a room to one socket.
#[derive(Default)]
pub struct Outbox {
    state: Mutex<OutboxState>,
    waker: AtomicWaker,
    /// Sends the queued messages.
    send_queue: Arc<SendQueue>,
    writer: Arc<SocketWriter>,
}

/// The next item for a socket.
#[derive(Debug, PartialEq)]
pub enum NextToSend {
    /// A message to send.
    Message(Bytes),
    End(Refusal),
    /// Nothing for now.
    Nothing,
}

#[derive(Default)]
struct OutboxState {
    control: VecDeque<Bytes>,
    snapshots: VecDeque<Bytes>,
    /// Total size of `snapshots`, and the size of the newest keyframe, in bytes.
    waiting_bytes: usize,
    keyframe_bytes: usize,
    /// Permit for the particles in the waiting keyframe, which is the first of `snapshots`.
    permit: Option<OwnedSemaphorePermit>,
    /// Permit for the most recently taken keyframe. It is released when the socket asks for more, having sent that
    /// keyframe.
    permit_sending: Option<OwnedSemaphorePermit>,
    end: Option<Refusal>,
    /// Address at which the room continues, if the session ends because the room moved.
    moved_to: Option<Arc<str>>,
}

impl Outbox {
    /// Queues a message that must not be dropped, and wakes the session; returns `false` if too many are waiting.
    pub fn control(&self, bytes: impl Into<Bytes>) -> bool {
        self.queue_control(bytes, OUTBOX_CONTROL_MAX)
    }

    /// Like [`Outbox::control`], for messages that may be lost. They leave half of the queue to other messages.
    pub fn aside(&self, bytes: impl Into<Bytes>) -> bool {
        self.queue_control(bytes, OUTBOX_CONTROL_MAX / 2)
    }

    fn queue_control(&self, bytes: impl Into<Bytes>, most: usize) -> bool {
        let mut state = self.lock();
        let fits = state.control.len() < most;
        if fits {
            state.control.push_back(bytes.into());
            self.waker.wake();
        }
        fits
    }

    /// Queues the next snapshot and returns 0; the caller must then call [`Outbox::send_soon`]. If the client is so far
    /// behind that it needs a keyframe, drops this snapshot and all waiting ones, and returns how many were dropped.
    pub fn snapshot(&self, bytes: &Bytes) -> usize {
        let mut state = self.lock();
        if state.end.is_some() {
            return 0;
        }
        let waiting = state.waiting_bytes + bytes.len();
        let late = !state.snapshots.is_empty() && waiting > state.keyframe_bytes.max(bytes.len());
        if late && state.snapshots.len() >= LATE_SNAPSHOTS_MIN
            || state.snapshots.len() >= OUTBOX_SNAPSHOTS_MAX
        {
            state.waiting_bytes = 0;
            state.permit = None;
            return 1 + state.snapshots.drain(..).count();
        }
        state.waiting_bytes = waiting;
        state.snapshots.push_back(bytes.clone());
        0
    }

    /// Replaces all waiting snapshots with a keyframe, and returns the number dropped; the caller must then call
    /// [`Outbox::send_soon`]. Keeps the permit for the keyframe's particles while the keyframe is in memory.
    pub fn keyframe(&self, bytes: Bytes, permit: Option<OwnedSemaphorePermit>) -> usize {
        let mut state = self.lock();
        state.keyframe_bytes = bytes.len();
        state.waiting_bytes = bytes.len();
        state.permit = permit;
        let dropped = state.snapshots.drain(..).count();
        state.snapshots.push_back(bytes);
        dropped
    }

    /// Creates the outbox for a socket on the thread that this queue belongs to.
    pub fn new(send_queue: Arc<SendQueue>, writer: Arc<SocketWriter>) -> Outbox {
        Outbox { send_queue, writer, ..Outbox::default() }
    }

    /// Schedules sending by the session's thread at the next request to the thread's [`SendQueue`].
    pub fn send_soon(self: &Arc<Outbox>) {
        self.send_queue.add(Arc::clone(self));
    }

    /// Returns whether the socket has taken all snapshots.
    pub fn is_drained(&self) -> bool {
        self.lock().snapshots.is_empty()
    }

    /// Ends the session. The first reason given counts.
    pub fn end(&self, refusal: Refusal) {
        let mut state = self.lock();
        if state.end.is_none() {
            state.end = Some(refusal);
            self.waker.wake();
        }
    }

    /// Ends the session because its room continues on another node.
    pub fn move_to(&self, url: Arc<str>) {
        self.lock().moved_to = Some(url);
        self.end(Refusal::Moved);
    }

    /// The address of the node where the room continues.
    pub fn moved_to(&self) -> Option<Arc<str>> {
        self.lock().moved_to.clone()
    }

    /// Registers the session to be woken when an item can be taken. Register before checking for items.
    pub fn register(&self, waker: &Waker) {
        self.waker.register(waker);
    }

    /// Takes the next item for the socket: first the end, then control messages, then snapshots.
    pub fn take(&self) -> NextToSend {
        let mut state = self.lock();
        state.permit_sending = None;
        if let Some(refusal) = state.end {
            return NextToSend::End(refusal);
        }
        if let Some(bytes) = state.control.pop_front() {
            return NextToSend::Message(bytes);
        }
        let Some(bytes) = state.snapshots.pop_front() else { return NextToSend::Nothing };
        state.waiting_bytes -= bytes.len();
        state.permit_sending = state.permit.take();
        NextToSend::Message(bytes)
    }

    /// The reason why the session must end.
    pub fn end_reason(&self) -> Option<Refusal> {
        self.lock().end
    }

    /// Sends what is waiting, on the session's thread. If the socket does not accept everything at once, wakes the
    /// session to continue.
    fn send(&self) {
        let next = || match self.take() {
            NextToSend::Message(bytes) => Some(bytes),
            NextToSend::End(_) | NextToSend::Nothing => None,
        };
        if !self.writer.send_now(next) {
            self.waker.wake();
        }
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> MutexGuard<'_, OutboxState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The outboxes of a thread's sessions that have something to send. A room's thread is outside the sessions' runtime.
/// Each wakeup from there takes the lock of a shared queue and may need a system call to wake a thread, so waking every
/// session would be expensive. Instead, once per tick, the room wakes one task on each thread that serves sockets, and
/// that task sends the messages of all its sessions in one go. A session is woken only if its socket does not accept
/// them. Between ticks the thread pauses to let inputs gather; a request to send ends the pause.
#[derive(Default)]
pub struct SendQueue {
    state: Mutex<SendQueueState>,
    /// Wakes the sending task.
    requested: Notify,
    /// Ends the thread's pause.
    ends_pause: Condvar,
}

#[derive(Default)]
struct SendQueueState {
    filled: Vec<Arc<Outbox>>,
    /// Whether sending was requested.
    is_requested: bool,
}

impl SendQueue {
    /// Adds an outbox to be sent at the next [`SendQueue::request`].
    pub fn add(&self, outbox: Arc<Outbox>) {
        self.lock().filled.push(outbox);
    }

    /// Requests that all added outboxes be sent.
    pub fn request(&self) {
        let mut state = self.lock();
        if !state.filled.is_empty() {
            state.is_requested = true;
            drop(state);
            self.ends_pause.notify_one();
            self.requested.notify_one();
        }
    }

    /// Pauses the queue's thread for this long, or until a request arrives.
    pub fn pause(&self, time: Duration) {
        let wait = |state: &mut SendQueueState| !state.is_requested;
        drop(self.ends_pause.wait_timeout_while(self.lock(), time, wait));
    }

    /// Sends outboxes whenever requested, forever.
    pub async fn serve(&self) -> Infallible {
        let mut filled: Vec<Arc<Outbox>> = Vec::new();
        loop {
            self.requested.notified().await;
            self.take(&mut filled);
            filled.drain(..).for_each(|outbox| outbox.send());
        }
    }

    fn take(&self, filled: &mut Vec<Arc<Outbox>>) {
        let mut state = self.lock();
        mem::swap(filled, &mut state.filled);
        state.is_requested = false;
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> MutexGuard<'_, SendQueueState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
