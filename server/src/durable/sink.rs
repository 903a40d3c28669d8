//! Where the records of rooms go, as the rooms see it.

use super::job::Job;
use std::sync::Arc;

/// Takes the records of rooms, and keeps them: in the files of a [`super::StateWriter`], or for another node of a fleet.
pub trait RecordSink: Send + Sync {
    /// Queues a job without waiting; `false` if the sink is too far behind.
    fn try_send(&self, job: Job) -> bool;

    /// Queues a job, and waits for a place in the queue.
    fn send(&self, job: Job);

    /// Sets aside the records of a room that cannot be restored, and logs the reason.
    fn set_aside(&self, code: &str, reason: &str);

    /// Gives up the records of a room that failed as it was restored, and logs the reason: the same records would
    /// make it fail again.
    fn give_up(&self, code: &str, reason: &str);
}

/// What keeps the records of all rooms.
pub trait RecordKeeper: Send + Sync {
    /// The sink for every room; `None` if each is opened with one of its own.
    fn common_sink(self: Arc<Self>) -> Option<Arc<dyn RecordSink>>;

    /// Times that the records of a room were given up, so far.
    fn errors(&self) -> u64;

    /// Waits until everything that was handed over is kept, and ends.
    fn close(&self);
}
