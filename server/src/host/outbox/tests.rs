use super::*;
use crate::host::socket_writer::SocketWriter;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::{Wake, Waker};
use std::thread;
use tokio::io::{DuplexStream, duplex};

fn take(outbox: &Outbox) -> Option<Bytes> {
    match outbox.take() {
        NextToSend::Message(bytes) => Some(bytes),
        NextToSend::Nothing => None,
        NextToSend::End(refusal) => panic!("{refusal:?}"),
    }
}

fn bytes(fill: u8, count: usize) -> Bytes {
    vec![fill; count].into()
}

#[test]
fn snapshots_are_taken_in_order() {
    let outbox = Outbox::default();
    outbox.keyframe(bytes(0, 100), None);
    for tick in 1..4 {
        assert_eq!(outbox.snapshot(&bytes(tick, 1)), 0);
    }
    assert_eq!(take(&outbox).expect("a message").len(), 100);
    for tick in 1..4 {
        assert!(!outbox.is_drained());
        assert_eq!(take(&outbox).expect("a message"), Bytes::from(vec![tick]));
    }
    assert!(outbox.is_drained() && take(&outbox).is_none());
}

#[test]
fn a_backlog_beyond_a_keyframe_is_replaced_by_one() {
    let outbox = Outbox::default();
    outbox.keyframe(bytes(0, 100), None);
    take(&outbox).expect("the keyframe");
    let fitted = (1..20).take_while(|&tick| outbox.snapshot(&bytes(tick, 18)) == 0).count();
    assert_eq!(fitted, 5, "five times 18 bytes are less than 100");
    assert!(outbox.is_drained(), "what cannot be used is dropped");
    outbox.keyframe(bytes(9, 80), None);
    assert_eq!(take(&outbox).expect("the keyframe").len(), 80);
}

#[test]
fn many_small_snapshots_do_not_wait_for_ever_and_a_few_large_ones_may() {
    let outbox = Outbox::default();
    outbox.keyframe(bytes(0, 10_000), None);
    take(&outbox).expect("the keyframe");
    let fitted = (0..100).take_while(|&tick| outbox.snapshot(&bytes(tick, 2)) == 0).count();
    assert_eq!(fitted, OUTBOX_SNAPSHOTS_MAX);
    assert_eq!(outbox.keyframe(bytes(0, 10), None), 0, "all that waited was counted before");
    take(&outbox).expect("the keyframe");
    let fitted = (0..100).take_while(|&tick| outbox.snapshot(&bytes(tick, 50)) == 0).count();
    assert_eq!(fitted, LATE_SNAPSHOTS_MIN);
    outbox.snapshot(&bytes(0, 1));
    assert_eq!(outbox.keyframe(bytes(0, 10), None), 1);
}

#[test]
fn control_messages_overtake_snapshots_and_are_bounded() {
    let outbox = Outbox::default();
    outbox.keyframe(bytes(1, 1), None);
    for _ in 0..OUTBOX_CONTROL_MAX {
        assert!(outbox.control(vec![9]));
    }
    assert!(!outbox.control(vec![9]));
    for _ in 0..OUTBOX_CONTROL_MAX {
        assert_eq!(take(&outbox).expect("a message"), Bytes::from_static(&[9]));
    }
    assert_eq!(take(&outbox).expect("the snapshot"), Bytes::from_static(&[1]));
}

#[test]
fn the_first_reason_to_end_counts_and_nothing_more_is_queued() {
    let outbox = Outbox::default();
    outbox.end(Refusal::Flood);
    outbox.end(Refusal::Closing);
    assert_eq!(outbox.snapshot(&bytes(1, 1)), 0);
    assert!(outbox.is_drained());
    assert_eq!(outbox.end_reason(), Some(Refusal::Flood));
    assert_eq!(outbox.take(), NextToSend::End(Refusal::Flood));
}

#[test]
fn a_permit_is_kept_as_long_as_its_keyframe() {
    let semaphore = Arc::new(tokio::sync::Semaphore::new(1));
    let permit = || Some(Arc::clone(&semaphore).try_acquire_owned().expect("it is free"));
    let is_kept = || semaphore.available_permits() == 0;

    let outbox = Outbox::default();
    outbox.keyframe(bytes(0, 10), permit());
    outbox.control(bytes(1, 1));
    take(&outbox).expect("the control message");
    assert!(is_kept());
    take(&outbox).expect("the keyframe");
    assert!(is_kept(), "the socket may have sent a part of it");
    assert!(take(&outbox).is_none() && !is_kept());

    outbox.keyframe(bytes(0, 10), permit());
    outbox.keyframe(bytes(0, 10), None);
    assert!(!is_kept(), "it was replaced");

    outbox.keyframe(bytes(0, 10), permit());
    while outbox.snapshot(&bytes(2, 10)) == 0 {
        assert!(is_kept());
    }
    assert!(!is_kept(), "it was dropped with what waited behind it");

    outbox.keyframe(bytes(0, 10), permit());
    drop(outbox);
    assert!(!is_kept());
}

#[derive(Default)]
struct Count(AtomicUsize);

impl Wake for Count {
    fn wake(self: Arc<Self>) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

/// A session whose socket accepts ten bytes, with a counter of the session's wakeups.
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
