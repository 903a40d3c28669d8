//! Watches for rooms that have closed, and informs Agones.

use super::sidecar::{CallError, Sidecar};
use std::collections::BTreeSet;
use std::time::Duration;
use tokio::time::Instant;
use tracing::info;

/// Watches a game server's rooms.
pub struct RoomWatch<'a> {
    sidecar: &'a Sidecar,
    /// Numbers of the rooms that were open at the previous check.
    open: BTreeSet<u64>,
    /// The room counter, if the game server has one.
    counter: Option<Counter>,
    /// Set once the last room has closed, until another one opens.
    is_done: bool,
}

pub struct Counter {
    /// The counter's value at the previous check.
    count: usize,
    /// Time when the allocator was last seen to increase the counter.
    rose: Instant,
    /// Time within which players should arrive after the allocator has counted their room.
    patience: Duration,
    /// Number of rooms that have closed but may still be counted.
    closed: usize,
}

impl<'a> RoomWatch<'a> {
    /// Starts with these rooms open.
    pub fn new(
        sidecar: &'a Sidecar,
        open: BTreeSet<u64>,
        counter: Option<Counter>,
    ) -> RoomWatch<'a> {
        RoomWatch { sidecar, open, counter, is_done: false }
    }

    /// Updates the set of open rooms, which are given by number. If a call fails, it is retried at the next check.
    pub async fn look(&mut self, open: BTreeSet<u64>) -> Result<(), CallError> {
        let closed = self.open.difference(&open).count();
        self.open = open;
        self.is_done = self.open.is_empty() && (self.is_done || closed > 0);
        if let Some(counter) = &mut self.counter {
            counter.closed += closed;
            let was_vain = counter.look(self.sidecar, self.open.len()).await?;
            self.is_done |= was_vain && self.open.is_empty();
        }
        if self.is_done && self.counter.as_ref().is_none_or(|counter| counter.count == 0) {
            self.end_if_allocated().await?;
            self.is_done = false;
        }
        Ok(())
    }

    /// Ends a game server to which the allocator has sent players. Other servers continue, since players may still
    /// arrive.
    async fn end_if_allocated(&self) -> Result<(), CallError> {
        if self.sidecar.is_allocated().await? {
            self.sidecar.shutdown().await?;
            info!("the last room of an allocated game server has closed; Agones ends it");
        }
        Ok(())
    }
}

impl Counter {
    /// A counter that has been set to this value.
    pub fn new(count: usize, patience: Duration) -> Counter {
        Counter { count, rose: Instant::now(), patience, closed: 0 }
    }

    /// Reads the counter, and subtracts the rooms that have closed and those whose players did not arrive in time.
    /// Returns whether there were any of the latter.
    ///
    /// The allocator counts up when it sends players here, and the server only counts down. The sidecar batches
    /// changes, so if both of them set the count, one would undo the other's change. If two changes together leave the
    /// range from zero to the capacity, Agones silently clamps the result. The count is therefore read before and after
    /// each change, and the answer is not trusted; this also reveals the effect of a call whose answer was lost.
    ///
    /// The count stays at least as high as the number of open rooms, since players may have opened some without the
    /// allocator.
    async fn look(&mut self, sidecar: &Sidecar, open: usize) -> Result<bool, CallError> {
        self.read(sidecar).await?;
        let spare = self.count.saturating_sub(open);
        let was_vain = spare > self.closed && self.rose.elapsed() >= self.patience;
        let due = if was_vain { spare } else { spare.min(self.closed) };
        if due > 0 {
            sidecar.count_down(due).await?;
            self.read(sidecar).await?;
        }
        self.closed = 0;
        Ok(was_vain)
    }

    async fn read(&mut self, sidecar: &Sidecar) -> Result<(), CallError> {
        let count = sidecar.count().await?;
        if count > self.count {
            self.rose = Instant::now();
        }
        self.count = count;
        Ok(())
    }
}
