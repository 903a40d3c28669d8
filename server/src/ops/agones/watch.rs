//! Which rooms have closed, and what follows from it for Agones.

use super::sidecar::{CallError, Sidecar};
use std::collections::BTreeSet;
use std::time::Duration;
use tokio::time::Instant;
use tracing::info;

/// Looks after the rooms of a game server.
pub struct RoomWatch<'a> {
    sidecar: &'a Sidecar,
    /// Numbers of the rooms that were open at the last look.
    open: BTreeSet<u64>,
    /// The counter of rooms, if the game server has one.
    counter: Option<Counter>,
    /// Set when the last room has closed, until another opens.
    is_done: bool,
}

/// The counter of rooms.
pub struct Counter {
    /// Its value at the last look.
    count: usize,
    /// When the allocator was last seen to count up.
    rose: Instant,
    /// Time in which players come once the allocator has counted their room.
    patience: Duration,
    /// Rooms that have closed and may still be counted.
    closed: usize,
}

impl<'a> RoomWatch<'a> {
    /// With these rooms at first.
    pub fn new(
        sidecar: &'a Sidecar,
        open: BTreeSet<u64>,
        counter: Option<Counter>,
    ) -> RoomWatch<'a> {
        RoomWatch { sidecar, open, counter, is_done: false }
    }

    /// Takes note of the rooms that are open now, by their numbers. What fails is done at the next look.
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

    /// Ends a game server that the allocator sent players to. Any other goes on: they may come yet.
    async fn end_if_allocated(&self) -> Result<(), CallError> {
        if self.sidecar.is_allocated().await? {
            self.sidecar.shutdown().await?;
            info!("the last room of an allocated game server has closed; Agones ends it");
        }
        Ok(())
    }
}

impl Counter {
    /// A counter that was set to this value.
    pub fn new(count: usize, patience: Duration) -> Counter {
        Counter { count, rose: Instant::now(), patience, closed: 0 }
    }

    /// Reads the counter, and takes off it the rooms that have closed and those to which no players came in time; true if
    /// there were such.
    ///
    /// The allocator counts up when it sends players here, and the server only counts down: the sidecar gathers
    /// changes, and if both set the count, one would undo the other's. Where the sum of two changes leaves the range
    /// from zero to the capacity, Agones cuts it off without a word. So the count is read before and after each change
    /// instead of believing the answer, and what a lost answer did shows then.
    ///
    /// No more is taken off than keeps the open rooms counted: players may have opened some without the allocator.
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
