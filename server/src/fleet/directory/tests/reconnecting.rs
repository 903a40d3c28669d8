//! Tests with a store that comes back complete, without its last writes, or empty.

use super::*;

/// Reconnects at this time, with these room entries and no node entries.
fn connect(directory: &mut Directory, forgot: bool, rooms: &[(&str, Entry, Revision)], now: Time) {
    directory.connected(forgot, now);
    for (code, entry, revision) in rooms {
        directory.changed(written(room_key(code), entry.clone(), *revision), now);
    }
    let present = rooms.iter().map(|(code, ..)| room_key(code)).collect();
    directory.synced_nodes(&BTreeSet::new(), now);
    directory.synced_rooms(&present, now);
}

/// Makes the node find that its entry is gone, and register again.
fn register_again(directory: &mut Directory, now: Time) {
    directory.poll(now);
    directory.looked(node_key("a"), None, now);
    directory.poll(now);
    directory.take_actions();
    directory.answered(node_key("a"), Answer::Done(1), now);
}

#[test]
fn a_room_that_is_played_is_written_back_into_an_empty_store() {
    let mut directory = playing();
    connect(&mut directory, true, &[], s(5.0));
    assert_eq!(directory.locate("x"), Located::Lost, "its node may write it back");
    register_again(&mut directory, s(5.1));
    // The room no longer had an entry, so this one is new.
    let back = Action::Write(room_key("y"), room(owner("a", A + 1), 2), 0);
    assert_eq!(polled(&mut directory, s(5.6)), [back]);
    directory.answered(room_key("y"), Answer::Done(1), s(5.7));
    assert_eq!(directory.take_actions(), [Action::Resume("y".into())]);
    assert_eq!(directory.locate("y"), Located::Here);
    assert_eq!(polled(&mut directory, s(30.0)), [], "it is a room of b that is gone");
    assert_eq!(directory.locate("x"), Located::Unknown);
}

#[test]
fn a_room_whose_lease_was_over_is_written_back_after_others_had_time_to() {
    let back = |epoch| Action::Write(room_key("y"), room(owner("a", A + 1), epoch), 0);
    let mut directory = playing();
    connect(&mut directory, true, &[], s(16.0));
    register_again(&mut directory, s(16.1));
    assert_eq!(polled(&mut directory, s(35.9)), []);
    assert_eq!(polled(&mut directory, s(36.0)), [back(2)]);

    let mut directory = playing();
    connect(&mut directory, true, &[], s(16.0));
    register_again(&mut directory, s(16.1));
    directory.changed(written(room_key("y"), room(owner("b", 7), 2), 1), s(17.0));
    assert!(directory.take_actions().contains(&Action::Stop("y".into(), None)));
}

/// A new connection to an empty store raises doubt twice: because the server is different, and because its buckets are
/// new.
#[test]
fn a_second_doubt_right_after_the_first_takes_no_room_away() {
    let mut directory = playing();
    connect(&mut directory, true, &[], s(5.0));
    directory.poll(s(5.1));
    directory.looked(node_key("a"), None, s(5.1));
    connect(&mut directory, true, &[], s(5.2));
    register_again(&mut directory, s(5.3));
    let actions = polled(&mut directory, s(5.9));
    assert!(
        matches!(&actions[..], [Action::Write(key, _, 0)] if *key == room_key("y")),
        "{actions:?}"
    );
}

#[test]
fn an_entry_that_went_back_to_another_node_is_written_again_before_the_lease_is_renewed() {
    let mut directory = playing();
    directory.changed(written(room_key("y"), room(owner("b", 7), 2), 3), s(0.5));
    directory.changed(written(room_key("y"), room(owner("a", A), 3), 4), s(0.6));
    directory.room("y", RoomEvent::Opened, s(0.7));
    directory.take_actions();
    connect(&mut directory, true, &[("y", room(owner("b", 7), 2), 3)], s(5.0));
    directory.poll(s(5.0));
    directory.looked(node_key("a"), Some((node(A, 10, 0.0), 9)), s(5.1));
    directory.take_actions();
    directory.poll(s(5.2));
    let back = Action::Write(room_key("y"), room(owner("a", A), 4), 3);
    assert_eq!(directory.take_actions(), [back], "no renewal");
    directory.answered(room_key("y"), Answer::Done(5), s(5.3));
    directory.poll(s(5.4));
    let actions = directory.take_actions();
    assert!(actions.contains(&Action::Resume("y".into())), "{actions:?}");
    let renews =
        |action: &Action| matches!(action, Action::Write(key, _, 9) if *key == node_key("a"));
    assert!(actions.iter().any(renews), "{actions:?}");
}

#[test]
fn a_room_that_this_node_had_before_is_not_opened_while_another_may_play_it() {
    let mut directory = playing();
    directory.changed(written(room_key("y"), room(owner("b", 7), 2), 3), s(0.5));
    directory.take_actions();
    // The store has forgotten that b claimed the room.
    connect(&mut directory, true, &[("y", room(owner("a", A), 1), 2)], s(5.0));
    directory.poll(s(5.0));
    directory.looked(node_key("a"), Some((node(A, 10, 0.0), 1)), s(5.1));
    directory.take_actions();
    assert_eq!(polled(&mut directory, s(24.9)), []);
    let claimed = Action::Write(room_key("y"), room(owner("a", A), 2), 2);
    assert_eq!(polled(&mut directory, s(25.0)), [claimed]);
    directory.answered(room_key("y"), Answer::Done(9), s(25.1));
    let opened = directory.take_actions();
    assert!(matches!(&opened[..], [Action::Open(code, _)] if code == "y"), "{opened:?}");
}

#[test]
fn after_an_outage_rooms_stay_where_they_were() {
    let rooms = [("x", room(owner("b", 7), 1), 1), ("y", room(owner("a", A), 1), 2)];
    let mut directory = playing();
    connect(&mut directory, false, &rooms, s(30.0));
    register_again(&mut directory, s(30.1));
    let again = Action::Write(room_key("y"), room(owner("a", A + 1), 2), 2);
    assert_eq!(polled(&mut directory, s(30.7)), [again]);
    directory.looked(node_key("b"), None, s(30.8));
    assert_eq!(polled(&mut directory, s(49.0)), [], "b may be about to connect");
    // When b connects, it reclaims its own room.
    directory.changed(written(node_key("b"), node(8, 0, 0.5), 30), s(49.1));
    directory.changed(written(room_key("x"), room(owner("b", 8), 2), 3), s(49.2));
    assert_eq!(polled(&mut directory, s(55.0)), []);
}

#[test]
fn a_room_of_a_node_that_is_not_back_after_an_outage_is_claimed() {
    let mut directory = beside_b();
    connect(&mut directory, false, &[("x", room(owner("b", 7), 1), 1)], s(30.0));
    register_again(&mut directory, s(30.1));
    directory.looked(node_key("b"), None, s(30.8));
    assert_eq!(polled(&mut directory, s(50.0)), []);
    assert_eq!(polled(&mut directory, s(50.2)), [claim(A + 1, 2, 1)]);
}

#[test]
fn a_room_whose_records_are_newer_than_its_entry_goes_on_after_them() {
    let mut directory = registered();
    directory.changed(written(room_key("y"), room(owner("a", A), 1), 2), s(0.0));
    directory.take_actions();
    directory.outdated("y", 6, s(1.0));
    directory.take_actions();
    directory.looked(room_key("y"), Some((room(owner("a", A), 1), 2)), s(1.1));
    let after = Action::Write(room_key("y"), room(owner("a", A), 7), 2);
    assert_eq!(polled(&mut directory, s(1.6)), [after]);
    directory.answered(room_key("y"), Answer::Done(3), s(1.7));
    assert!(matches!(&directory.take_actions()[..], [Action::Open(_, entry)] if entry.epoch == 7));
}

#[test]
fn what_was_asked_over_the_connection_before_is_not_answered() {
    let mut directory = playing();
    directory.room("y", RoomEvent::Ended, s(1.0));
    connect(&mut directory, false, &[("y", room(owner("a", A), 1), 2)], s(2.0));
    assert!(polled(&mut directory, s(2.1)).iter().all(|action| matches!(action, Action::Look(_))));
    directory.looked(node_key("a"), Some((node(A, 10, 0.0), 1)), s(2.2));
    directory.take_actions();
    assert_eq!(polled(&mut directory, s(2.6)), [Action::Remove(room_key("y"), 2)]);
}
