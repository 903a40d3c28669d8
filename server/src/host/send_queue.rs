//! Sends what rooms have put into outboxes. A room's thread is outside of the sessions' runtime, and a wakeup from there takes
//! the lock of a common queue and may wake a thread by a system call, for each session again. So it wakes one task
//! of each thread that serves sockets, once a tick, and that one sends the messages of all its sessions in one go. A session is
//! woken only if its socket does not take them. Between ticks the thread pauses, so that inputs gather; what is to be sent ends
//! the pause.

use std::convert::Infallible;
use std::mem;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;

/// An outbox, as the queue knows it.
pub trait Sends: Send + Sync {
    /// Sends what waits, on the queue's thread.
    fn send(&self);
}

/// The outboxes of a thread's sessions that have something to send.
#[derive(Default)]
pub struct SendQueue {
    state: Mutex<SendQueueState>,
    /// Wakes the task that sends.
    requested: Notify,
    /// Ends the thread's pause.
    ends_pause: Condvar,
}

#[derive(Default)]
struct SendQueueState {
    filled: Vec<Arc<dyn Sends>>,
    /// Whether they are to be sent.
    is_requested: bool,
}

impl SendQueue {
    /// Adds an outbox to those that the next [`SendQueue::request`] has sent.
    pub fn add(&self, outbox: Arc<dyn Sends>) {
        self.lock().filled.push(outbox);
    }

    /// Has them sent, if there are any.
    pub fn request(&self) {
        let mut state = self.lock();
        if !state.filled.is_empty() {
            state.is_requested = true;
            drop(state);
            self.ends_pause.notify_one();
            self.requested.notify_one();
        }
    }

    /// Lets the queue's thread pause for this long, or until there is something to send.
    pub fn pause(&self, time: Duration) {
        let wait = |state: &mut SendQueueState| !state.is_requested;
        drop(self.ends_pause.wait_timeout_while(self.lock(), time, wait));
    }

    /// Sends them for as long as the thread serves.
    pub async fn serve(&self) -> Infallible {
        let mut filled: Vec<Arc<dyn Sends>> = Vec::new();
        loop {
            self.requested.notified().await;
            self.take(&mut filled);
            filled.drain(..).for_each(|outbox| outbox.send());
        }
    }

    fn take(&self, filled: &mut Vec<Arc<dyn Sends>>) {
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
mod tests {
    use super::*;
    use crate::host::outbox::Outbox;
    use crate::host::socket_writer::SocketWriter;
    use bytes::Bytes;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::task::{Wake, Waker};
    use std::thread;
    use tokio::io::{DuplexStream, duplex};

    #[derive(Default)]
    struct Count(AtomicUsize);

    impl Wake for Count {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// A session whose socket takes ten bytes, with the number of times that it was woken.
    fn session(queue: &Arc<SendQueue>) -> (Arc<Outbox>, DuplexStream, Arc<Count>) {
        let (socket, peer) = duplex(10);
        let outbox = Outbox::new(Arc::clone(queue), Arc::new(SocketWriter::new(socket)));
        let woken = Arc::new(Count::default());
        outbox.register(&Waker::from(Arc::clone(&woken)));
        (Arc::new(outbox), peer, woken)
    }

    #[test]
    fn messages_are_sent_once_that_is_requested_and_only_a_full_socket_wakes_its_session() {
        let queue = Arc::new(SendQueue::default());
        let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
        let serves = Arc::clone(&queue);
        runtime.spawn(async move { serves.serve().await });
        let turn = || runtime.block_on(tokio::task::yield_now());
        let sessions = [session(&queue), session(&queue)];
        for ((outbox, ..), length) in sessions.iter().zip([8, 9]) {
            outbox.snapshot(&Bytes::from(vec![7; length]));
            outbox.send_soon();
        }
        turn();
        assert!(sessions.iter().all(|(outbox, ..)| !outbox.is_drained()));
        queue.request();
        turn();
        turn();
        assert!(sessions.iter().all(|(outbox, ..)| outbox.is_drained()));
        let woken = sessions.each_ref().map(|(_, _, woken)| woken.0.load(Ordering::Relaxed));
        assert_eq!(woken, [0, 1], "eight bytes fit with their header");
    }
    #[test]
    fn a_request_ends_the_pause_of_its_thread() {
        let queue = Arc::new(SendQueue::default());
        let (outbox, _peer, _) = session(&queue);
        outbox.send_soon();
        let pauses = Arc::clone(&queue);
        let pausing = thread::spawn(move || pauses.pause(Duration::MAX));
        queue.request();
        pausing.join().expect("it ends");
    }
}
