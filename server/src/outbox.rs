//! What waits for one session's socket: the newest snapshot, a few control messages, and the end.
//!
//! The room fills it and never waits; the session empties it at the pace of its socket. A snapshot
//! that was not taken is replaced, so a slow reader costs memory for one.

use crate::limits::OUTBOX_CONTROL_MAX;
use hyper::body::Bytes;
use jostle_protocol::Refusal;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// The way from a room to one socket.
#[derive(Default)]
pub struct Outbox {
    state: Mutex<State>,
    filled: Notify,
    ended: Notify,
}

#[derive(Default)]
struct State {
    control: VecDeque<Bytes>,
    snapshot: Option<(u32, Arc<[u8]>)>,
    /// Tick of the newest snapshot that was taken: the peer holds it, or will before the next one.
    baseline: Option<u32>,
    end: Option<Refusal>,
}

impl Outbox {
    /// Queues a message that must not be replaced; `false` when too many wait.
    pub fn control(&self, bytes: Vec<u8>) -> bool {
        let mut state = self.lock();
        let fits = state.control.len() < OUTBOX_CONTROL_MAX;
        if fits {
            state.control.push_back(bytes.into());
            self.filled.notify_one();
        }
        fits
    }

    /// Stores the snapshot of `tick`, which `code` makes from the baseline that the peer holds. The
    /// lock is held meanwhile, so that the baseline cannot change under it.
    pub fn snapshot(&self, tick: u32, code: impl FnOnce(Option<u32>) -> Arc<[u8]>) {
        let mut state = self.lock();
        if state.end.is_none() {
            let bytes = code(state.baseline);
            state.snapshot = Some((tick, bytes));
            self.filled.notify_one();
        }
    }

    /// Ends the session; the first reason counts.
    pub fn end(&self, refusal: Refusal) {
        let mut state = self.lock();
        if state.end.is_none() {
            state.end = Some(refusal);
            self.ended.notify_one();
        }
    }

    /// The next message for the socket: control messages first, then the newest snapshot. Waits
    /// until there is one. For one reader; safe to cancel.
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
        let (tick, bytes) = state.snapshot.take()?;
        state.baseline = Some(tick);
        Some(Bytes::from_owner(bytes))
    }

    /// Waits for the end and says why. For one reader; safe to cancel.
    pub async fn ended(&self) -> Refusal {
        loop {
            if let Some(refusal) = self.lock().end {
                return refusal;
            }
            self.ended.notified().await;
        }
    }

    /// A room that panicked while it coded a snapshot left the state whole: it is stored after.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
