use super::*;

fn block<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().build().expect("a runtime").block_on(future)
}

#[test]
fn only_the_newest_snapshot_waits_and_it_joins_what_was_skipped() {
    let outbox = Outbox::default();
    let mut baselines = Vec::new();
    for tick in 1..=3u8 {
        outbox.snapshot(tick.into(), |baseline| {
            baselines.push(baseline);
            Arc::from([tick])
        });
    }
    assert_eq!(block(outbox.take()), Bytes::from_static(&[3]));
    assert!(outbox.try_take().is_none());
    outbox.snapshot(4, |baseline| {
        baselines.push(baseline);
        Arc::from([4])
    });
    assert_eq!(baselines, [None, None, None, Some(3)]);
}

#[test]
fn control_messages_overtake_snapshots_and_are_bounded() {
    let outbox = Outbox::default();
    outbox.snapshot(1, |_| Arc::from([1]));
    for _ in 0..OUTBOX_CONTROL_MAX {
        assert!(outbox.control(vec![9]));
    }
    assert!(!outbox.control(vec![9]));
    for _ in 0..OUTBOX_CONTROL_MAX {
        assert_eq!(outbox.try_take().expect("a message"), Bytes::from_static(&[9]));
    }
    assert_eq!(outbox.try_take().expect("the snapshot"), Bytes::from_static(&[1]));
}

#[test]
fn the_first_reason_to_end_counts_and_stops_coding() {
    let outbox = Outbox::default();
    outbox.end(Refusal::Flood);
    outbox.end(Refusal::Closing);
    outbox.snapshot(1, |_| unreachable!("an ended session needs no snapshot"));
    assert_eq!(block(outbox.ended()), Refusal::Flood);
}

#[test]
fn a_panic_while_coding_leaves_the_outbox_usable() {
    let outbox = Outbox::default();
    let coded = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        outbox.snapshot(1, |_| panic!("the room failed"));
    }));
    assert!(coded.is_err());
    outbox.end(Refusal::RoomFailed);
    assert_eq!(block(outbox.ended()), Refusal::RoomFailed);
}
