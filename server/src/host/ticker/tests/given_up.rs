//! Rooms whose thread wakes after the room has been given up.

use super::*;

#[test]
fn a_room_that_was_given_up_leaves_the_records_of_its_name_alone() {
    // The thread wakes while it plays, while the server closes, or while it is paused without a lease.
    for (closes, has_lease) in [(false, true), (true, true), (false, false)] {
        let (mut ends, outside) = room("given-up", Duration::MAX);
        let shared = Arc::new(SharedLog::default());
        ends.shared = Some(Arc::clone(&shared));
        let lease = Arc::new(Lease::new(Instant::now()));
        ends.lease = (!has_lease).then(|| RoomLease::new(lease, INCARNATION));
        let mut clock = TestClock {
            gives_up: Some((1, Arc::clone(&ends.info))),
            // Otherwise the room would stay paused forever.
            closes: Some((if closes { 1 } else { 100 }, outside.phase.clone())),
            ..TestClock::new()
        };
        run(&ends, RoomOrigin::New(1), &mut clock);
        assert_eq!((clock.sleeps, shared.lock().seal.clone()), (1, Some(Seal::Leave)));
    }
}

#[test]
fn a_room_that_was_given_up_before_it_failed_leaves_the_records_of_its_name_alone() {
    for given_up in [false, true] {
        // This code makes the room panic before it has played.
        let (ends, _outside) = room(&"x".repeat(ROOM_CODE_BYTES_MAX + 1), Duration::MAX);
        if given_up {
            ends.info.given_up.cancel();
        }
        assert_eq!(seal_of(ends), (!given_up).then_some(Seal::Leave));
    }
}
