//! The sink of one room's records in a fleet, which its thread holds. Once that has dropped it, the room's task ends.

use crate::durable::{Job, RecordSink, RoomFile};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tokio::sync::mpsc;
use tracing::error;

/// Hands the jobs of a room to its task.
pub struct RoomSink {
    jobs: mpsc::Sender<Job>,
    /// Jobs of all rooms that were given up.
    errors: Arc<AtomicU64>,
}

impl RoomSink {
    /// The sink of the task that takes these jobs, and counts here those that find no place.
    pub fn new(jobs: mpsc::Sender<Job>, errors: Arc<AtomicU64>) -> RoomSink {
        RoomSink { jobs, errors }
    }
}

impl RecordSink for RoomSink {
    fn try_send(&self, job: Job) -> bool {
        let sent = self.jobs.try_send(job).is_ok();
        self.errors.fetch_add(u64::from(!sent), Ordering::Relaxed);
        sent
    }

    fn send(&self, job: Job) {
        // A task that is gone has logged why.
        let _ = self.jobs.blocking_send(job);
    }

    fn set_aside(&self, code: &str, reason: &str) {
        error!(room = %code, reason, "a room cannot be restored from its records");
    }

    /// Ends the room in the whole fleet: every node would restore it from the same records.
    fn give_up(&self, code: &str, reason: &str) {
        error!(room = %code, reason, "a room cannot be restored from its records, and is removed");
        let file = RoomFile::new(code.to_owned(), 0);
        self.send(Job::Remove(Arc::new(file)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_that_fails_as_it_is_restored_is_removed() {
        let (sender, mut jobs) = mpsc::channel(1);
        RoomSink::new(sender, Arc::default()).give_up("k7f3q2", "a panic");
        let job = jobs.blocking_recv();
        assert!(matches!(job, Some(Job::Remove(file)) if file.code == "k7f3q2"));
        assert!(jobs.blocking_recv().is_none(), "the sink is gone");
    }
}
