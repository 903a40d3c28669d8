//! Where the records of rooms go, as the rooms see it.

use super::job::Job;

/// Takes the records of rooms, and keeps them: in the files of a [`super::StateWriter`], or for another node of a fleet.
pub trait RecordSink: Send + Sync {
    /// Queues a job without waiting; `false` if the sink is too far behind.
    fn try_send(&self, job: Job) -> bool;

    /// Queues a job, and waits for a place in the queue.
    fn send(&self, job: Job);

    /// Sets aside the records of a room that cannot be restored, and logs the reason.
    fn set_aside(&self, code: &str, reason: &str);

    /// Times that the records of a room were given up, so far.
    fn errors(&self) -> u64;

    /// Counts one more: they did not fit the queue.
    fn count_error(&self);

    /// Waits until everything that was handed over is kept, and ends the sink.
    fn close(&self);
}
