//! Wakes sessions whose outboxes were filled. A room's thread is outside of their runtime, and a wakeup from there takes
//! the lock of a common queue and may wake a thread by a system call, for each session again. So it wakes one task
//! of each thread that serves sockets, once a tick, and that one wakes its sessions from inside, where a wakeup is a few
//! instructions.

use std::convert::Infallible;
use std::mem;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::Waker;
use tokio::sync::Notify;

/// The sessions of a thread that are to be woken.
#[derive(Default)]
pub struct Wakeups {
    wakers: Mutex<Vec<Waker>>,
    due: Notify,
}

impl Wakeups {
    /// Adds a session to those that the next [`Wakeups::request`] has woken.
    pub fn add(&self, waker: Waker) {
        self.lock().push(waker);
    }

    /// Has them woken, if there are any.
    pub fn request(&self) {
        if !self.lock().is_empty() {
            self.due.notify_one();
        }
    }

    /// Wakes them for as long as the thread serves.
    pub async fn deliver(&self) -> Infallible {
        let mut wakers = Vec::new();
        loop {
            self.due.notified().await;
            mem::swap(&mut wakers, &mut *self.lock());
            wakers.drain(..).for_each(Waker::wake);
        }
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> MutexGuard<'_, Vec<Waker>> {
        self.wakers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::outbox::Outbox;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::task::Wake;

    #[derive(Default)]
    struct Count(AtomicUsize);

    impl Wake for Count {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn sessions_are_woken_once_their_wakeups_are_requested() {
        let wakeups = Arc::new(Wakeups::default());
        let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
        let delivered = Arc::clone(&wakeups);
        runtime.spawn(async move { delivered.deliver().await });
        let turn = || runtime.block_on(tokio::task::yield_now());
        let session = || {
            let (count, outbox) =
                (Arc::new(Count::default()), Outbox::of_thread(Arc::clone(&wakeups)));
            outbox.register(&Waker::from(Arc::clone(&count)));
            (count, Arc::new(outbox))
        };
        let (woken, other) = (session(), session());
        let counts = || [&woken, &other].map(|(count, _)| count.0.load(Ordering::Relaxed));
        woken.1.wake_soon();
        turn();
        assert_eq!(counts(), [0, 0]);
        wakeups.request();
        turn();
        turn();
        assert_eq!(counts(), [1, 0]);
        wakeups.request();
        other.1.wake_soon();
        turn();
        turn();
        assert_eq!(counts(), [1, 0], "there was none to wake");
        wakeups.request();
        turn();
        turn();
        assert_eq!(counts(), [1, 1]);
    }
}
