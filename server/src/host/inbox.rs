//! The queue from a session to its room. The room takes all waiting messages at once, and both ends keep reusing the
//! same small buffers. With a ring large enough for a burst, each message would touch cold memory.

use std::collections::VecDeque;
use std::mem;
use std::sync::mpsc::{TryRecvError, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Creates a queue for at most `max` waiting messages.
pub fn inbox<T>(max: usize) -> (InboxSender<T>, Inbox<T>) {
    let queue = InboxQueue { waiting: VecDeque::new(), is_open: true };
    let shared = Arc::new(Mutex::new(queue));
    let sender = InboxSender { shared: Arc::clone(&shared), max };
    (sender, Inbox { shared, taken: VecDeque::new() })
}

pub struct InboxSender<T> {
    shared: Arc<Mutex<InboxQueue<T>>>,
    max: usize,
}

pub struct Inbox<T> {
    shared: Arc<Mutex<InboxQueue<T>>>,
    /// Messages that were taken together.
    taken: VecDeque<T>,
}

struct InboxQueue<T> {
    waiting: VecDeque<T>,
    /// Whether both ends still exist.
    is_open: bool,
}

impl<T> InboxSender<T> {
    /// Queues a message. Fails if too many messages are waiting or the other end is gone.
    pub fn try_send(&self, message: T) -> Result<(), TrySendError<T>> {
        let mut queue = lock(&self.shared);
        if !queue.is_open {
            return Err(TrySendError::Disconnected(message));
        }
        if queue.waiting.len() >= self.max {
            return Err(TrySendError::Full(message));
        }
        queue.waiting.push_back(message);
        Ok(())
    }
}

impl<T> Inbox<T> {
    /// Takes the next message. Fails if none is waiting; the error then says whether the other end is gone.
    pub fn try_recv(&mut self) -> Result<T, TryRecvError> {
        if self.taken.is_empty() {
            let mut queue = lock(&self.shared);
            if queue.waiting.is_empty() && !queue.is_open {
                return Err(TryRecvError::Disconnected);
            }
            mem::swap(&mut self.taken, &mut queue.waiting);
        }
        self.taken.pop_front().ok_or(TryRecvError::Empty)
    }
}

impl<T> Drop for InboxSender<T> {
    fn drop(&mut self) {
        lock(&self.shared).is_open = false;
    }
}

impl<T> Drop for Inbox<T> {
    fn drop(&mut self) {
        lock(&self.shared).is_open = false;
    }
}

/// Ignores poisoning: no operation here panics halfway.
fn lock<T>(shared: &Mutex<InboxQueue<T>>) -> MutexGuard<'_, InboxQueue<T>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_in_order_and_those_before_the_end_are_not_lost() {
        let (sender, mut inbox) = inbox(3);
        assert_eq!(inbox.try_recv(), Err(TryRecvError::Empty));
        sender.try_send(1).expect("a place");
        sender.try_send(2).expect("a place");
        assert_eq!(inbox.try_recv(), Ok(1));
        sender.try_send(3).expect("a place");
        drop(sender);
        assert_eq!([inbox.try_recv(), inbox.try_recv()], [Ok(2), Ok(3)]);
        assert_eq!(inbox.try_recv(), Err(TryRecvError::Disconnected));
    }

    #[test]
    fn it_is_bounded_and_says_when_the_room_is_gone() {
        let (sender, mut inbox) = inbox(2);
        for message in 0..2 {
            sender.try_send(message).expect("a place");
        }
        assert_eq!(sender.try_send(2), Err(TrySendError::Full(2)));
        assert_eq!(inbox.try_recv(), Ok(0));
        sender.try_send(3).expect("the room has taken what waited");
        drop(inbox);
        assert_eq!(sender.try_send(4), Err(TrySendError::Disconnected(4)));
    }
}
