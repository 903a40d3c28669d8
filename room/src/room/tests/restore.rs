//! Checks that a room restored from its recording resumes where the recording ends, and that its players get their
//! seats back.

use super::*;
use crate::SavedMembers;
use crate::playback::{Moment, Playback};
use jostle_protocol::replay::{Replay, header};

/// A room with a recording from which to restore it, and the bytes written so far.
struct Kept {
    room: Room,
    file: Vec<u8>,
    position: u64,
}

impl Kept {
    fn new(room: Room) -> Kept {
        let mut kept = Kept { room, file: header(), position: 0 };
        kept.room.keep_clips("test");
        let (tick, blocks) = (kept.room.game().tick_count(), kept.room.log().unwrap().blocks());
        kept.file.extend(blocks.start(0, tick).seal());
        // The initial state follows from the scene and the seed.
        kept.position = u64::from(tick == 0);
        kept.write(false);
        kept
    }

    fn write(&mut self, flush: bool) {
        if flush {
            self.room.flush_log();
        }
        let blocks = self.room.log().unwrap().blocks();
        let records = blocks.since(self.position).unwrap();
        self.position = blocks.end();
        records.iter().for_each(|record| self.file.extend(record.seal()));
    }

    fn play(&mut self, count: u32) {
        for _ in 0..count {
            self.room.tick();
            self.write(false);
        }
    }

    /// The last moment in the file.
    fn moment(&self) -> Moment {
        let mut playback =
            Playback::new(Arc::new(Replay::read(self.file.clone()).unwrap())).unwrap();
        while let Some(played) = playback.step().unwrap() {
            assert!(played.agrees, "{played:?}");
        }
        playback.into_moment()
    }

    fn restore(&self, saved: &SavedMembers) -> Room {
        let mut room = Room::restore("oak", 7, self.moment(), saved);
        room.begin_epoch(9);
        room
    }
}

#[test]
fn half_a_second_at_most_is_not_in_the_recording_and_nothing_after_a_flush() {
    let mut kept = Kept::new(yard());
    join(&mut kept.room, "Ann");
    for count in [1, 28, 1, 44, 120] {
        kept.play(count);
        let lost = kept.room.game().tick_count() - kept.moment().game.tick_count();
        assert!(lost < 30, "{lost} ticks");
    }
    kept.write(true);
    assert_eq!(kept.moment().game.hash(), kept.room.game().hash());
}

#[test]
fn a_restored_room_plays_on_as_if_nothing_had_happened() {
    let mut kept = Kept::new(yard());
    let [ann, bob] = ["Ann", "Bob"].map(|name| join(&mut kept.room, name));
    for seq in 1..=90 {
        kept.room.input(ann, seq, down(Buttons::RIGHT));
        kept.room.input(bob, seq, down(Buttons::LEFT));
        kept.play(1);
    }
    let saved = kept.room.saved_members();
    let mut restored = kept.restore(&saved);
    assert_eq!(restored.game().hash(), kept.room.game().hash());
    assert_eq!(restored.snapshot().bodies, kept.room.snapshot().bodies);
    let names = |room: &Room| {
        let players = room.snapshot().players.iter();
        players.map(|player| player.appearance.clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(&restored), names(&kept.room));
    // The players were briefly without sockets.
    [ann, bob].into_iter().for_each(|seat| kept.room.disconnect(seat));
    ticks(&mut kept.room, 200);
    ticks(&mut restored, 200);
    assert_eq!(restored.game().hash(), kept.room.game().hash());
    // The new recording begins in the middle of the game, and can be restored again.
    let mut again = Kept::new(restored);
    again.play(90);
    assert_eq!(again.moment().game.hash(), again.room.game().hash());
}

#[test]
fn bots_of_a_restored_room_play_on() {
    let hockey = Scene::built_in().into_iter().find(|scene| scene.name == "hockey");
    let hockey = Arc::new(hockey.expect("a shipped scene"));
    let mut kept = Kept::new(Room::new("oak", hockey, 7));
    let ann = join(&mut kept.room, "Ann");
    kept.play(300);
    kept.write(true);
    let mut restored = kept.restore(&kept.room.saved_members());
    assert_eq!(restored.bots(), 3);
    ticks(&mut restored, 120);
    let bots = restored.snapshot().players.iter().filter(|player| player.seat != ann);
    let played: Vec<u32> = bots.map(|bot| bot.input_seq).collect();
    assert!(played.iter().all(|played| *played > 100), "{played:?}");
}

#[test]
fn claims_of_before_give_the_seats_back_and_no_new_one_equals_them() {
    let mut kept = Kept::new(yard());
    let (ann, _) = claim(&mut kept.room, "Ann", None);
    let (bob, _) = claim(&mut kept.room, "Bob", None);
    kept.room.input(ann.seat, 1, Input::default());
    kept.play(30);
    let saved = kept.room.saved_members();
    // A third player joins in a moment that is missing from the file.
    let (lost, _) = claim(&mut kept.room, "Cid", None);
    kept.room.tick();

    let mut room = kept.restore(&saved);
    assert_eq!((room.players(), room.connected()), (2, 0));
    assert_eq!(room.held(), [ann.seat, bob.seat]);
    assert_eq!(room.join(look("Cid"), Some(lost)).unwrap_err(), Refusal::BadToken);
    let (dan, resumed) = claim(&mut room, "Dan", None);
    assert!(!resumed && dan.seat == lost.seat && dan.serial != lost.serial);
    let (next, resumed) = claim(&mut room, "Ann", Some(ann));
    assert!(resumed && next.seat == ann.seat);
    assert!(claim(&mut room, "Bob", Some(bob)).1);
    ticks(&mut room, SEAT_HELD_TICKS + 1);
    assert_eq!(room.players(), 3);
}

#[test]
fn an_unknown_player_leaves_also_after_a_second_restart_at_once() {
    let mut kept = Kept::new(yard());
    join(&mut kept.room, "Ann");
    kept.play(30);
    let mut again = Kept::new(kept.restore(&SavedMembers::default()));
    // The restored room's file still contains the player; its members do not.
    let room = again.restore(&again.room.saved_members());
    let mut last = Kept::new(room);
    last.play(1);
    assert_eq!(last.room.game().players().count(), 0);
    let bob = join(&mut last.room, "Bob");
    last.play(1);
    assert!(player(&last.room, bob).is_some());
    again.play(1);
    assert_eq!(again.room.game().players().count(), 0);
}

#[test]
fn seats_are_held_for_a_while_after_the_restart_and_unknown_ones_are_freed() {
    let mut kept = Kept::new(yard());
    let [ann, bob] = ["Ann", "Bob"].map(|name| join(&mut kept.room, name));
    kept.play(30);
    let mut saved = kept.room.saved_members();
    saved.seats.retain(|seat| seat.seat == bob.0);
    let mut room = kept.restore(&saved);
    room.tick();
    assert!(player(&room, ann).is_none() && player(&room, bob).is_some());
    ticks(&mut room, SEAT_HELD_TICKS - 2);
    assert_eq!(room.players(), 1);
    ticks(&mut room, 2);
    assert_eq!(room.players(), 0);
}

#[test]
fn bots_play_on_and_those_that_were_dismissed_stay_away() {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "hill").unwrap();
    let mut kept = Kept::new(Room::new("oak", Arc::new(scene), 7));
    let (ann, _) = claim(&mut kept.room, "Ann", None);
    kept.play(60);
    let bots = kept.room.bots();
    assert!(bots > 1);
    let seat = kept.room.saved_members().seats.iter().find(|seat| seat.is_bot).unwrap().seat;
    assert!(kept.room.dismiss_bot(Seat(seat)));
    kept.play(30);
    let mut room = kept.restore(&kept.room.saved_members());
    assert!(claim(&mut room, "Ann", Some(ann)).1);
    ticks(&mut room, 300);
    assert_eq!((room.players(), room.bots()), (1, bots - 1));
}

#[test]
fn the_revision_grows_with_every_change_of_the_members_and_with_nothing_else() {
    let mut room = yard();
    let mut saved = (room.members_revision(), room.saved_members());
    let mut note = |room: &Room, changes: bool| {
        let now = (room.members_revision(), room.saved_members());
        assert_eq!(now.0 != saved.0, changes, "{now:?}");
        assert!(changes || now.1 == saved.1, "{now:?}");
        saved = now;
    };
    let (ann, _) = claim(&mut room, "Ann", None);
    note(&room, true);
    ticks(&mut room, 3);
    note(&room, false);
    let (ann, _) = claim(&mut room, "Ann", Some(ann));
    note(&room, true);
    for seq in 1..4 {
        room.input(ann.seat, seq, Input::default());
        room.tick();
        note(&room, seq == 1);
    }
    room.disconnect(ann.seat);
    note(&room, true);
    room.leave(ann.seat);
    note(&room, true);
}
