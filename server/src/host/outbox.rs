//! The messages that wait for one session's socket: snapshots in order, a few control messages, and the end.
//!
//! The room fills it and never waits; the session empties it at the pace of its socket. Each snapshot is
//! coded against the one before, so none may be left out: a client whose backlog exceeds the size of a
//! keyframe gets a keyframe instead. Where all see the whole world, the subscribers of a rate share the bytes
//! of everything but such keyframes.

use crate::limits::{OUTBOX_CONTROL_MAX, OUTBOX_SNAPSHOTS_MAX};
use bytes::Bytes;
use jostle_protocol::Refusal;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Snapshots that may wait whatever their size: fewer are no sign of a slow reader.
const LATE_SNAPSHOTS_MIN: usize = 4;

/// The queue from a room to one socket.
#[derive(Default)]
pub struct Outbox {
    state: Mutex<State>,
    filled: Notify,
    ended: Notify,
}

#[derive(Default)]
struct State {
    control: VecDeque<Bytes>,
    snapshots: VecDeque<Bytes>,
    /// Bytes of `snapshots`, and of the newest keyframe.
    waiting_bytes: usize,
    keyframe_bytes: usize,
    end: Option<Refusal>,
}

impl Outbox {
    /// Queues a message that must not be replaced; `false` when too many wait.
    pub fn control(&self, bytes: impl Into<Bytes>) -> bool {
        let mut state = self.lock();
        let fits = state.control.len() < OUTBOX_CONTROL_MAX;
        if fits {
            state.control.push_back(bytes.into());
            self.filled.notify_one();
        }
        fits
    }

    /// Queues the next snapshot and returns 0. If the peer is so far behind that it needs a keyframe, drops this
    /// snapshot and all that wait, and returns their number.
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
            return 1 + state.snapshots.drain(..).count();
        }
        state.waiting_bytes = waiting;
        state.snapshots.push_back(bytes.clone());
        self.filled.notify_one();
        0
    }

    /// Replaces all waiting snapshots by a keyframe, and returns how many were dropped.
    pub fn keyframe(&self, bytes: Bytes) -> usize {
        let mut state = self.lock();
        state.keyframe_bytes = bytes.len();
        state.waiting_bytes = bytes.len();
        let dropped = state.snapshots.drain(..).count();
        state.snapshots.push_back(bytes);
        self.filled.notify_one();
        dropped
    }

    /// Returns whether the socket has taken all snapshots.
    pub fn is_drained(&self) -> bool {
        self.lock().snapshots.is_empty()
    }

    /// Ends the session; the first reason counts.
    pub fn end(&self, refusal: Refusal) {
        let mut state = self.lock();
        if state.end.is_none() {
            state.end = Some(refusal);
            self.ended.notify_one();
        }
    }

    /// Takes the next message for the socket, control messages first. Waits until there is one. For one
    /// reader; cancel safe.
    pub async fn take(&self) -> Bytes {
        loop {
            if let Some(bytes) = self.try_take() {
                return bytes;
            }
            self.filled.notified().await;
        }
    }

    fn try_take(&self) -> Option<Bytes> {
        let mut state = self.lock();
        if let Some(bytes) = state.control.pop_front() {
            return Some(bytes);
        }
        let bytes = state.snapshots.pop_front()?;
        state.waiting_bytes -= bytes.len();
        Some(bytes)
    }

    /// Waits for the end and returns its reason. For one reader; cancel safe.
    pub async fn ended(&self) -> Refusal {
        loop {
            if let Some(refusal) = self.lock().end {
                return refusal;
            }
            self.ended.notified().await;
        }
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
