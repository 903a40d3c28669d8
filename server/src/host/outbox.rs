//! The messages waiting for one session's socket: snapshots in order, a few control messages, and the end of the
//! session.
//!
//! The room fills the outbox and never waits; the session's thread empties it at the pace of its socket. Each snapshot
//! is coded against the previous one, so none may be skipped: a client whose backlog exceeds the size of a keyframe
//! gets a keyframe in its place. If all players see the whole world, the subscribers at the same rate share the bytes
//! of all messages except such keyframes.

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

/// Control messages that may wait for the socket; further pongs are dropped.
const OUTBOX_CONTROL_MAX: usize = 16;
/// Snapshots that may wait for the socket; after half a second of them it gets a keyframe in their place.
const OUTBOX_SNAPSHOTS_MAX: usize = 32;

/// Number of snapshots that may wait regardless of their size; that few do not indicate a slow reader.
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
    /// Nothing at the moment.
    Nothing,
}

#[derive(Default)]
struct OutboxState {
    control: VecDeque<Bytes>,
    snapshots: VecDeque<Bytes>,
    /// Total bytes of `snapshots`, and bytes of the newest keyframe.
    waiting_bytes: usize,
    keyframe_bytes: usize,
    /// Permit for the particles of the waiting keyframe, which is the first of `snapshots`.
    permit: Option<OwnedSemaphorePermit>,
    /// Permit of the keyframe that was taken last. It is released when the socket asks for more, having sent that
    /// keyframe.
    permit_sending: Option<OwnedSemaphorePermit>,
    end: Option<Refusal>,
    /// Address at which the room continues, if it ends because it moved.
    moved_to: Option<Arc<str>>,
}

impl Outbox {
    /// Queues a message that must not be dropped, and wakes the session; `false` if too many are waiting.
    pub fn control(&self, bytes: impl Into<Bytes>) -> bool {
        self.queue_control(bytes, OUTBOX_CONTROL_MAX)
    }

    /// Like [`Outbox::control`], for messages that may be lost. They leave half of the queue to the others.
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
    /// behind that it needs a keyframe, drops this snapshot and all waiting ones, and returns their number.
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

    /// Replaces all waiting snapshots by a keyframe, and returns the number dropped; the caller must then call
    /// [`Outbox::send_soon`]. Keeps the permit for the keyframe's particles while it is in memory.
    pub fn keyframe(&self, bytes: Bytes, permit: Option<OwnedSemaphorePermit>) -> usize {
        let mut state = self.lock();
        state.keyframe_bytes = bytes.len();
        state.waiting_bytes = bytes.len();
        state.permit = permit;
        let dropped = state.snapshots.drain(..).count();
        state.snapshots.push_back(bytes);
        dropped
    }

    /// Creates the outbox of a socket on the thread with this queue.
    pub fn new(send_queue: Arc<SendQueue>, writer: Arc<SocketWriter>) -> Outbox {
        Outbox { send_queue, writer, ..Outbox::default() }
    }

    /// Schedules sending by the session's thread, at the next request to its [`SendQueue`].
    pub fn send_soon(self: &Arc<Outbox>) {
        self.send_queue.add(Arc::clone(self));
    }

    /// Returns whether the socket has taken all snapshots.
    pub fn is_drained(&self) -> bool {
        self.lock().snapshots.is_empty()
    }

    /// Ends the session. The first reason counts.
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

    /// The address of that node.
    pub fn moved_to(&self) -> Option<Arc<str>> {
        self.lock().moved_to.clone()
    }

    /// Registers the session to be woken when an item can be taken. Register before checking for items.
    pub fn register(&self, waker: &Waker) {
        self.waker.register(waker);
    }

    /// Takes the next item for the socket: the end first, then control messages, then snapshots.
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

    /// Sends what waits, on the session's thread. If the socket does not take it at once, wakes the session to go on.
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

/// The outboxes of a thread's sessions that have something to send. A room's thread is outside of the sessions' runtime, and a
/// wakeup from there takes the lock of a common queue and may wake a thread by a system call, for each session again. So it wakes
/// one task of each thread that serves sockets, once a tick, and that one sends the messages of all its sessions in one go. A
/// session is woken only if its socket does not take them. Between ticks the thread pauses, so that inputs gather; what is to be
/// sent ends the pause.
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
    /// Adds an outbox, to be sent at the next [`SendQueue::request`].
    pub fn add(&self, outbox: Arc<Outbox>) {
        self.lock().filled.push(outbox);
    }

    /// Requests the sending of all added outboxes.
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

    /// Sends outboxes on request, forever.
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
