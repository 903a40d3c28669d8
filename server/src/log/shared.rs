//! What a room's thread has logged, as the readers of other threads see it.

use jostle_room::log::RecentBlocks;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// The fate of the state of a room that has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Seal {
    /// It is kept, from its newest keyframe on: the room goes on later, or elsewhere.
    Keep,
    /// It is removed.
    Remove,
    /// It is left as it is: another node plays the room.
    Leave,
}

/// The log of a room, shared with its readers. The room's thread puts blocks into it after its ticks.
#[derive(Default)]
pub struct SharedLog {
    held: Mutex<Contents>,
    /// Wakes a reader that is a task.
    changed: Notify,
}

/// The part that readers see.
#[derive(Default)]
pub struct Contents {
    pub blocks: RecentBlocks,
    /// Whether replays are to have what is played now: an empty room is of no interest.
    pub is_recorded: bool,
    /// What becomes of the room's state once all is read: the room has ended.
    pub seal: Option<Seal>,
}

impl SharedLog {
    /// Shares the newest blocks of a room, unless its log is sealed.
    pub fn publish(&self, blocks: RecentBlocks, is_recorded: bool) {
        let mut held = self.lock();
        if held.seal.is_none() {
            (held.blocks, held.is_recorded) = (blocks, is_recorded);
        }
        drop(held);
        self.changed.notify_one();
    }

    /// Ends the log. The first seal counts: a room that was given up may wake later.
    pub fn seal(&self, seal: Seal) {
        self.lock().seal.get_or_insert(seal);
        self.changed.notify_one();
    }

    /// Waits until there is something new since the last time.
    pub async fn changed(&self) {
        self.changed.notified().await;
    }

    /// Locks the log for a moment, in which blocks are listed and nothing is written.
    pub fn lock(&self) -> MutexGuard<'_, Contents> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
