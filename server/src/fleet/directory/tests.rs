//! Tests for each rule: a directory of node `a` among other nodes. The test plays the part of the store and the driver.

mod reconnecting;

use super::*;
use std::time::Duration;

const A: u64 = 100;

fn s(seconds: f64) -> Time {
    Duration::from_secs_f64(seconds)
}

fn node_key(name: &str) -> Key {
    Key::Node(name.into())
}

fn room_key(code: &str) -> Key {
    Key::Room(code.into())
}

fn owner(node: &str, incarnation: u64) -> Owner {
    Owner { node: node.into(), incarnation }
}

fn node(incarnation: u64, rooms_left: usize, used: f64) -> Entry {
    Entry::Node(NodeEntry {
        incarnation,
        url: "https://other.example.org".into(),
        draining: false,
        capacity: 1.0,
        used,
        rooms_left,
        rooms: Vec::new(),
        secret_mark: None,
    })
}

fn facts() -> RoomFacts {
    RoomFacts { scene: "arena".into(), number: 1, private: false, creator: None, guest: false }
}

fn room(owner: Owner, epoch: u64) -> Entry {
    Entry::Room(RoomEntry { owner, epoch, room: facts() })
}

fn written(key: Key, entry: Entry, revision: Revision) -> Change {
    Change::Written(key, entry, revision)
}

/// A new node that knows of no other nodes.
fn unregistered() -> Directory {
    let mut directory = Directory::new(NodeSettings {
        name: "a".into(),
        url: "https://a.example.org".into(),
        capacity: 1.0,
        incarnation: A,
        secret_mark: 0,
    });
    directory.measured(Load { used: 0.0, rooms_left: 10, rooms: Vec::new() });
    directory.connected(false, s(0.0));
    directory.synced_nodes(&BTreeSet::new(), s(0.0));
    directory.synced_rooms(&BTreeSet::new(), s(0.0));
    directory
}

/// Like [`unregistered`], but registered at revision 1 and allowed to claim rooms.
fn registered() -> Directory {
    let mut directory = unregistered();
    directory.poll(s(0.0));
    directory.answered(node_key("a"), Answer::Done(1), s(0.0));
    directory.members.own.claims_from = s(0.0);
    directory.take_actions();
    directory
}

/// Like [`registered`], plus a node `b` with incarnation 7 that has a room.
fn beside_b() -> Directory {
    let mut directory = registered();
    directory.changed(written(node_key("b"), node(7, 0, 0.5), 2), s(0.0));
    directory.changed(written(room_key("x"), room(owner("b", 7), 1), 1), s(0.0));
    assert_eq!(directory.take_actions(), []);
    directory
}

/// Like [`beside_b`], plus a room that node `a` plays, at revision 2.
fn playing() -> Directory {
    let mut directory = beside_b();
    directory.changed(written(room_key("y"), room(owner("a", A), 1), 2), s(0.0));
    directory.room("y", RoomEvent::Opened, s(0.0));
    assert!(matches!(&directory.take_actions()[..], [Action::Open(code, _)] if code == "y"));
    assert_eq!(directory.locate("y"), Located::Here);
    directory
}

fn claim(incarnation: u64, epoch: u64, revision: Revision) -> Action {
    Action::Write(room_key("x"), room(owner("a", incarnation), epoch), revision)
}

/// The actions that a poll produces, without renewals of the node's own lease.
fn polled(directory: &mut Directory, now: Time) -> Vec<Action> {
    directory.poll(now);
    let own = |action: &Action| match action {
        Action::Write(key, ..) => *key == node_key("a"),
        Action::Lease(..) => true,
        _ => false,
    };
    directory.take_actions().into_iter().filter(|action| !own(action)).collect()
}

#[test]
fn a_lease_lasts_from_when_the_write_that_was_answered_was_sent() {
    let mut directory = unregistered();
    directory.poll(s(1.0));
    directory.answered(node_key("a"), Answer::Done(1), s(2.2));
    let lease = Action::Lease(A, s(1.0) + HELD_FOR);
    assert!(directory.take_actions().contains(&lease));
    directory.poll(s(2.9));
    assert_eq!(directory.take_actions(), [], "the next renewal is due 2 s after the first");
    directory.poll(s(3.0));
    assert!(matches!(&directory.take_actions()[..], [Action::Write(_, _, 1)]));
}

#[test]
fn after_a_write_without_an_answer_the_entry_is_looked_up_and_renewed() {
    let mut directory = registered();
    directory.poll(s(2.0));
    directory.answered(node_key("a"), Answer::Unknown, s(3.5));
    directory.take_actions();
    assert_eq!(polled(&mut directory, s(4.0)), [Action::Look(node_key("a"))]);
    directory.looked(node_key("a"), Some((node(A, 10, 0.0), 2)), s(4.1));
    directory.poll(s(4.2));
    assert!(matches!(&directory.take_actions()[..], [Action::Write(_, _, 2)]), "no other lease");
}

#[test]
fn a_lost_lease_gives_another_incarnation_under_which_rooms_are_claimed_again() {
    let mut directory = playing();
    directory.poll(s(30.0));
    directory.answered(node_key("a"), Answer::Refused, s(30.1));
    directory.poll(s(30.2));
    directory.looked(node_key("a"), None, s(30.3));
    assert!(directory.take_actions().contains(&Action::Lease(A + 1, Duration::ZERO)));
    directory.poll(s(30.4));
    directory.answered(node_key("a"), Answer::Done(9), s(30.5));
    directory.take_actions();
    let again = Action::Write(room_key("y"), room(owner("a", A + 1), 2), 2);
    assert!(polled(&mut directory, s(30.6)).contains(&again));
    directory.answered(room_key("y"), Answer::Done(3), s(30.7));
    assert!(directory.take_actions().contains(&Action::Resume("y".into())));
    assert_eq!(directory.locate("y"), Located::Here);
}

#[test]
fn an_incarnation_of_which_a_write_may_have_been_seen_is_not_used_again() {
    let mut directory = unregistered();
    directory.poll(s(0.0));
    directory.answered(node_key("a"), Answer::Unknown, s(1.5));
    directory.poll(s(2.0));
    directory.looked(node_key("a"), None, s(2.1));
    directory.take_actions();
    directory.poll(s(2.2));
    let actions = directory.take_actions();
    let [Action::Write(_, Entry::Node(entry), 0)] = &actions[..] else { panic!("{actions:?}") };
    assert_eq!(entry.incarnation, A + 1);
    // The first write arrived late and is overwritten.
    directory.answered(node_key("a"), Answer::Refused, s(2.3));
    directory.poll(s(2.4));
    directory.looked(node_key("a"), Some((node(A, 10, 0.0), 5)), s(2.5));
    directory.take_actions();
    directory.poll(s(2.6));
    assert!(matches!(&directory.take_actions()[..], [Action::Write(_, _, 5)]));
}

#[test]
fn a_name_that_another_process_has_is_waited_for() {
    let mut directory = unregistered();
    directory.poll(s(0.0));
    directory.answered(node_key("a"), Answer::Refused, s(0.1));
    directory.poll(s(0.1));
    directory.looked(node_key("a"), Some((node(55, 10, 0.0), 5)), s(0.2));
    assert!(!directory.is_registered());
    directory.take_actions();
    directory.poll(s(0.3));
    assert_eq!(directory.take_actions(), [], "a moment");
    directory.poll(s(0.7));
    assert!(matches!(&directory.take_actions()[..], [Action::Write(_, _, 0)]), "if it is free");
}

#[test]
fn a_node_that_leaves_stops_its_rooms_first_and_renews_no_more() {
    let mut directory = playing();
    directory.poll(s(2.0));
    directory.take_actions();
    directory.leave();
    assert_eq!(
        directory.take_actions(),
        [Action::Lease(A, Duration::ZERO)],
        "a write is on its way"
    );
    directory.answered(node_key("a"), Answer::Done(8), s(2.1));
    assert_eq!(directory.take_actions(), [Action::Remove(node_key("a"), 8)]);
    directory.poll(s(9.0));
    assert_eq!(directory.take_actions(), []);
}

#[test]
fn rooms_of_a_node_that_left_are_claimed() {
    let mut directory = beside_b();
    directory.changed(Change::Gone(node_key("b"), 3), s(1.0));
    assert_eq!(directory.take_actions(), [claim(A, 2, 1)]);
    directory.answered(room_key("x"), Answer::Done(4), s(1.1));
    assert!(matches!(&directory.take_actions()[..], [Action::Open(code, _)] if code == "x"));
}

#[test]
fn rooms_of_a_node_with_another_incarnation_are_claimed() {
    let mut directory = beside_b();
    directory.changed(written(node_key("b"), node(8, 0, 0.5), 3), s(1.0));
    assert_eq!(directory.take_actions(), [claim(A, 2, 1)]);
}

#[test]
fn a_silent_node_is_looked_for_and_the_others_are_told_that_it_is_gone() {
    let mut directory = beside_b();
    assert_eq!(polled(&mut directory, LEASE_TTL), []);
    let late = LEASE_TTL + s(0.1);
    assert_eq!(polled(&mut directory, late), [Action::Look(node_key("b"))]);
    directory.looked(node_key("b"), None, late);
    let told = Action::Remove(node_key("b"), 0);
    assert_eq!(directory.take_actions(), [claim(A, 2, 1), told]);
    directory.answered(node_key("b"), Answer::Done(4), late);
    assert!(directory.is_registered(), "that was not its own entry");
}

#[test]
fn a_silent_node_that_is_there_keeps_its_rooms() {
    let mut directory = beside_b();
    let late = LEASE_TTL + s(0.1);
    polled(&mut directory, late);
    directory.looked(node_key("b"), Some((node(7, 0, 0.5), 9)), late);
    assert_eq!(polled(&mut directory, late + s(5.0)), [], "it was heard of");
}

#[test]
fn an_owner_that_was_not_heard_of_is_looked_for_before_its_rooms_are_claimed() {
    let mut directory = registered();
    directory.changed(written(room_key("x"), room(owner("b", 7), 1), 1), s(1.0));
    assert_eq!(directory.take_actions(), [Action::Look(node_key("b"))]);
    directory.looked(node_key("b"), Some((node(7, 0, 0.5), 2)), s(1.1));
    assert_eq!(polled(&mut directory, s(9.0)), [], "it is there, and was not heard of yet");

    let mut directory = registered();
    directory.changed(written(room_key("x"), room(owner("b", 7), 1), 1), s(1.0));
    directory.take_actions();
    directory.look_failed(&node_key("b"), s(1.1));
    assert_eq!(polled(&mut directory, s(1.2)), []);
    assert_eq!(polled(&mut directory, s(1.7)), [Action::Look(node_key("b"))]);
    directory.looked(node_key("b"), None, s(1.8));
    assert_eq!(directory.take_actions(), [claim(A, 2, 1)]);
}

#[test]
fn a_late_answer_does_not_undo_what_was_heard_since() {
    let mut directory = beside_b();
    let late = LEASE_TTL + s(0.1);
    polled(&mut directory, late);
    directory.changed(written(node_key("b"), node(7, 0, 0.5), 9), late);
    directory.looked(node_key("b"), None, late);
    assert_eq!(polled(&mut directory, late + s(1.0)), [], "b registered after it was looked for");

    let mut directory = playing();
    directory.room("y", RoomEvent::Fenced, s(1.0));
    directory.changed(written(room_key("y"), room(owner("a", A), 3), 8), s(1.1));
    directory.looked(room_key("y"), None, s(1.2));
    directory.take_actions();
    let opened = polled(&mut directory, s(2.0));
    assert!(matches!(&opened[..], [Action::Open(code, _)] if code == "y"), "{opened:?}");
}

#[test]
fn a_room_that_was_removed_does_not_come_back() {
    let mut directory = playing();
    directory.room("y", RoomEvent::Ended, s(1.0));
    assert_eq!(directory.take_actions(), [Action::Remove(room_key("y"), 2)]);
    directory.answered(room_key("y"), Answer::Unknown, s(2.5));
    assert_eq!(directory.take_actions(), [Action::Look(room_key("y"))]);
    directory.changed(Change::Gone(room_key("y"), 3), s(2.6));
    let before = (room(owner("a", A), 1), 2);
    directory.looked(room_key("y"), Some(before.clone()), s(2.7));
    assert_eq!(polled(&mut directory, s(3.5)), [], "the look was answered before the removal");

    let mut directory = playing();
    directory.room("y", RoomEvent::Ended, s(1.0));
    directory.answered(room_key("y"), Answer::Done(3), s(1.1));
    directory.take_actions();
    directory.changed(written(room_key("y"), before.0, before.1), s(1.2));
    assert_eq!(polled(&mut directory, s(2.0)), [], "the watcher was behind");
    directory.changed(written(room_key("y"), room(owner("b", 7), 1), 4), s(2.1));
    assert_eq!(directory.locate("y"), Located::At("https://other.example.org".into()));
}

#[test]
fn a_removed_room_is_remembered_until_the_watcher_tells_of_it() {
    let removal = Change::Gone(room_key("y"), 3);
    for watcher_is_first in [false, true] {
        let mut directory = playing();
        directory.room("y", RoomEvent::Ended, s(1.0));
        if watcher_is_first {
            directory.changed(removal.clone(), s(1.1));
        }
        directory.answered(room_key("y"), Answer::Done(3), s(1.2));
        assert_eq!(directory.placements.removed.is_empty(), watcher_is_first);
        directory.changed(removal.clone(), s(1.3));
        assert!(directory.placements.removed.is_empty() && directory.holds() == 0);
    }
}

#[test]
fn a_fenced_room_is_stopped_and_opened_again_if_it_is_still_ones_own() {
    let mut directory = playing();
    directory.room("y", RoomEvent::Fenced, s(1.0));
    let stop = Action::Stop("y".into(), None);
    assert_eq!(directory.take_actions(), [stop, Action::Look(room_key("y"))]);
    directory.looked(room_key("y"), Some((room(owner("a", A), 1), 2)), s(1.1));
    assert_eq!(polled(&mut directory, s(1.2)), []);
    let opened = polled(&mut directory, s(1.6));
    assert!(matches!(&opened[..], [Action::Open(code, _)] if code == "y"), "{opened:?}");
}

#[test]
fn a_room_that_another_claimed_is_stopped_and_its_players_are_sent_there() {
    let mut directory = playing();
    directory.changed(written(room_key("y"), room(owner("b", 7), 2), 5), s(1.0));
    let url = Some("https://other.example.org".into());
    assert_eq!(directory.take_actions(), [Action::Stop("y".into(), url)]);
}

#[test]
fn a_draining_node_parts_with_a_room_and_then_gives_it_away() {
    let mut directory = playing();
    directory.drain(s(1.0));
    assert_eq!(directory.take_actions(), [], "no other has room");
    directory.changed(written(node_key("b"), node(7, 3, 0.5), 3), s(1.1));
    assert_eq!(polled(&mut directory, s(1.2)), [Action::Part("y".into())]);
    directory.room("y", RoomEvent::Parted, s(1.3));
    let given = Action::Write(room_key("y"), room(owner("b", 7), 2), 2);
    assert_eq!(directory.take_actions(), [given]);
    directory.answered(room_key("y"), Answer::Done(3), s(1.4));
    assert_eq!(directory.holds(), 0);
    directory.take_actions();
    directory.changed(Change::Gone(node_key("b"), 9), s(2.0));
    assert_eq!(polled(&mut directory, s(9.0)), [], "a draining node claims nothing");
}

#[test]
fn a_room_that_cannot_be_opened_here_is_given_to_another_later() {
    let mut directory = beside_b();
    directory.changed(written(room_key("y"), room(owner("a", A), 1), 2), s(0.0));
    directory.changed(written(node_key("b"), node(7, 3, 0.5), 3), s(0.0));
    directory.room("y", RoomEvent::OpenFailed, s(0.0));
    directory.take_actions();
    assert_eq!(polled(&mut directory, s(4.9)), []);
    let given = Action::Write(room_key("y"), room(owner("b", 7), 2), 2);
    assert_eq!(polled(&mut directory, s(5.0)), [given]);
}

#[test]
fn rooms_go_where_most_is_left_and_nowhere_when_all_are_full() {
    let mut directory = registered();
    directory.changed(written(node_key("b"), node(7, 2, 0.0), 2), s(0.0));
    directory.changed(written(node_key("c"), node(8, 1, 0.97), 3), s(0.0));
    let mut placed = Vec::new();
    for number in 0..20 {
        if directory.place(&format!("r{number}"), facts(), s(0.0)).is_ok() {
            placed.push(());
        }
    }
    // There are ten rooms on this node, two on b and one on c.
    let mut owners: Vec<String> = Vec::new();
    for action in directory.take_actions() {
        let Action::Write(_, Entry::Room(entry), 0) = action else { panic!("{action:?}") };
        owners.push(entry.owner.node);
    }
    owners.sort();
    assert_eq!(owners.concat(), "aaaaaaaaaabbc");
    assert_eq!(placed.len(), 13);
    assert_eq!(directory.place("r0", facts(), s(0.0)), Err(PlaceError::Taken));
    assert_eq!(directory.place("r99", facts(), s(0.0)), Err(PlaceError::Full));
}

#[test]
fn of_all_nodes_that_know_of_each_other_one_claims_first() {
    let fleet = ["a", "b", "c", "d", "e"];
    let directories = fleet.map(|name| {
        let mut directory = Directory::new(NodeSettings {
            name: name.into(),
            url: String::new(),
            capacity: 1.0,
            incarnation: 1,
            secret_mark: 0,
        });
        for (name, revision) in fleet.iter().zip(1..) {
            directory.changed(written(node_key(name), node(1, 9, 0.0), revision), s(0.0));
        }
        directory
    });
    for code in ["x", "y", "z"] {
        for count in 1..=5 {
            let claim =
                directories.iter().filter(|directory| directory.members.may_claim(code, count));
            assert_eq!(claim.count(), count, "{code}");
        }
    }
}

#[test]
fn what_is_not_among_the_entries_of_new_watchers_is_gone() {
    let mut directory = playing();
    directory.synced_nodes(&BTreeSet::from([node_key("a")]), s(1.0));
    assert_eq!(directory.take_actions(), [Action::Look(node_key("b"))], "it may be behind");
    directory.synced_rooms(&BTreeSet::from([room_key("x")]), s(1.0));
    assert_eq!(directory.take_actions(), [Action::Stop("y".into(), None)]);
}
