//! Wakes sessions whose outboxes were filled. A room's thread is outside of the runtime, and a wakeup from there takes
//! the lock of a common queue and may wake a thread by a system call, for each session again. So it wakes one task,
//! once a tick, and that one wakes all sessions from inside, where a wakeup is a few instructions.

use crate::host::outbox::Outbox;
use std::convert::Infallible;
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// The sessions of a server that are to be woken.
#[derive(Default)]
pub struct Wakeups {
    filled: Mutex<Vec<Arc<Outbox>>>,
    due: Notify,
}

impl Wakeups {
    /// Has the sessions of these outboxes woken, and empties the list.
    pub fn request(&self, filled: &mut Vec<Arc<Outbox>>) {
        if !filled.is_empty() {
            self.lock().append(filled);
            self.due.notify_one();
        }
    }

    /// Wakes them for as long as the server lives.
    pub async fn deliver(&self) -> Infallible {
        let mut filled = Vec::new();
        loop {
            self.due.notified().await;
            mem::swap(&mut filled, &mut *self.lock());
            filled.drain(..).for_each(|outbox: Arc<Outbox>| outbox.wake());
        }
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> MutexGuard<'_, Vec<Arc<Outbox>>> {
        self.filled.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
