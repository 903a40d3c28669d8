//! Rooms that outlive the process in their files.

use super::super::state_file::{StateFile, StateFiles};
use super::super::writer::Readers;
use super::super::*;
use crate::host::admission::{Admission, KickScope};
use crate::host::room_handle::RoomInfo;
use crate::limits;
use jostle_game::{Input, Scene};
use jostle_protocol::Appearance;
use jostle_room::{Claim, Room};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A unique directory, deleted when dropped.
struct TestDir(PathBuf);

impl TestDir {
    fn new(name: &str) -> TestDir {
        let number = crate::host::random();
        TestDir(std::env::temp_dir().join(format!("jostle-state-{name}-{number:016x}")))
    }

    fn settings(&self) -> StateSettings {
        StateSettings { dir: self.0.clone(), sync: Sync::Second }
    }
}

impl Drop for TestDir {
    fn drop(&mut self) {
        // A test that failed early may not have created the directory.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A room whose state is written as soon as it has been played.
struct Written {
    files: Arc<StateFiles>,
    shared: Arc<SharedLog>,
    readers: Readers,
    room: Room,
    admission: Admission,
    log: RoomLog,
    now: Instant,
}

impl Written {
    fn new(dir: &TestDir, code: &str) -> Written {
        let scene = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
        let scene = Arc::new(scene.expect("a shipped scene"));
        let info = RoomInfo::new(code, 77, true, Some([10, 0, 0, 1].into()), &scene);
        let info = Arc::new(RoomInfo { guest: true, ..info });
        Written::of(dir, info, Room::new(code, scene, 5), Admission::default())
    }

    fn of(dir: &TestDir, info: Arc<RoomInfo>, room: Room, admission: Admission) -> Written {
        let files = StateFiles::open(&dir.settings()).expect("a directory");
        Written::among(files, info, room, admission)
    }

    fn among(
        files: Arc<StateFiles>,
        info: Arc<RoomInfo>,
        mut room: Room,
        admission: Admission,
    ) -> Written {
        let (shared, mut readers) = (Arc::default(), Readers::default());
        let reader = LogReader::new(&shared, files.policy(), STATE);
        let file = StateFile::new(&files, &info.code, info.number);
        readers.add(reader, Box::new(file));
        let mut logs = Logs::default();
        logs.states = Some(Arc::clone(&files));
        let log =
            RoomLog::begin(&logs, Some(Arc::clone(&shared)), info.notes(), &mut room, &admission);
        let now = Instant::now();
        readers.step(now);
        Written { files, shared, readers, room, admission, log, now }
    }

    fn join(&mut self, name: &str) -> Claim {
        let look = Appearance::new(name, 0).expect("a name");
        let claim = self.room.join(look, None).expect("a seat").claim;
        self.admission.seated(claim.seat, [10, 0, 0, 2].into(), name);
        claim
    }

    fn play(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.room.tick();
            self.now += Duration::from_secs(1) / 60;
            self.log.after_ticks(&mut self.room, &self.admission, false);
            self.readers.step(self.now);
        }
    }

    /// Ends like a process that was asked to end. Returns the game's tick and hash.
    fn close(self) -> (u32, u64) {
        self.end(Seal::Keep)
    }

    /// Ends like a process that was killed. Returns the game's tick and hash.
    fn kill(self) -> (u32, u64) {
        (self.room.game().tick_count(), self.room.game().hash())
    }

    fn end(mut self, seal: Seal) -> (u32, u64) {
        self.log.end(&mut self.room, &self.admission, true, seal);
        self.readers.step(self.now);
        (self.room.game().tick_count(), self.room.game().hash())
    }
}

fn saved(dir: &TestDir) -> SavedRoom {
    let files = StateFiles::open(&dir.settings()).expect("the directory is free again");
    let mut rooms = files.saved_rooms().expect("a directory");
    assert_eq!(rooms.len(), 1);
    rooms.remove(0)
}

fn restored(dir: &TestDir) -> Room {
    played_up(&saved(dir))
}

fn played_up(saved: &SavedRoom) -> Room {
    saved.restore(|| true).expect("a room").expect("it keeps to its budget")
}

fn file(dir: &TestDir, name: &str) -> PathBuf {
    dir.0.join("rooms").join(name)
}

#[test]
fn a_closed_room_loses_no_tick_and_a_killed_one_half_a_second_at_most() {
    for ticks in [0, 1, 29, 30, 200, limits::STATE_FILE_TICKS + 45, 2 * limits::STATE_FILE_TICKS] {
        let dir = TestDir::new("closed");
        let mut written = Written::new(&dir, "oak");
        let ann = written.join("Ann");
        written.play(ticks);
        let (tick, hash) = written.close();
        let saved = saved(&dir);
        assert_eq!((saved.notes.number, saved.notes.private), (77, true));
        assert!(saved.notes.guest, "its share outlives the process too");
        assert_eq!(saved.notes.creator, Some([10, 0, 0, 1].into()));
        assert_eq!(saved.seed(), 5);
        let mut room = played_up(&saved);
        assert_eq!((room.game().tick_count(), room.game().hash()), (tick, hash));
        let comes_back = room.join(Appearance::new("Ann", 0).expect("a name"), Some(ann));
        assert_eq!(comes_back.is_ok(), ticks > 0, "who joined in no tick was never there");

        let dir = TestDir::new("killed");
        let mut written = Written::new(&dir, "oak");
        written.join("Ann");
        written.play(ticks);
        let (tick, _) = written.kill();
        let lost = tick - restored(&dir).game().tick_count();
        assert!(lost <= 30, "{lost} ticks");
    }
}

#[test]
fn a_file_without_its_tail_is_restored_up_to_its_last_whole_record() {
    let dir = TestDir::new("tail");
    let mut written = Written::new(&dir, "oak");
    let path = file(&dir, "oak.jostle");
    // The file is put in place as a whole, including the first notes.
    let begun = fs::read(&path).expect("a file").len();
    written.join("Ann");
    written.play(50);
    written.join("Bob");
    written.play(50);
    let (last, _) = written.kill();
    let whole = fs::read(&path).expect("a file");
    let mut ticks = Vec::new();
    for length in (begun..=whole.len()).step_by(7) {
        fs::write(&path, &whole[..length]).expect("a place");
        let mut room = restored(&dir);
        let tick = room.game().tick_count();
        assert!(tick <= last && room.players() <= 2);
        // A player leaves who joined in ticks whose notes were lost.
        room.tick();
        assert_eq!(room.game().players().count(), room.players(), "at tick {tick}");
        ticks.push(tick);
    }
    assert!(ticks.is_sorted() && ticks.iter().any(|&tick| tick < 60), "{ticks:?}");
}

#[test]
fn players_who_come_and_go_in_every_tick_fill_no_file() {
    let dir = TestDir::new("notes");
    let mut written = Written::new(&dir, "oak");
    for _ in 0..120 {
        let claim = written.join("Ann");
        written.play(1);
        written.room.leave(claim.seat);
        written.play(1);
    }
    written.kill();
    let bytes = fs::read(file(&dir, "oak.jostle")).expect("a file");
    let notes = bytes.windows(9).filter(|part| *part == b"{\"number\"").count();
    assert!((20..=240 / limits::STATE_NOTES_EVERY_TICKS as usize + 5).contains(&notes), "{notes}");
}

#[test]
fn a_kicked_player_stays_out_and_seats_keep_their_networks() {
    let dir = TestDir::new("kicked");
    let mut written = Written::new(&dir, "oak");
    let ann = written.join("Ann");
    written.play(10);
    written.room.leave(ann.seat);
    let claims = [Some(ann.serial), None];
    written.admission.kicked(ann.seat, claims, KickScope::Player, 10);
    written.play(5);
    written.kill();
    let saved = saved(&dir);
    assert!(saved.notes.admission.is_shut([10, 0, 0, 3].into(), "Bob", Some(ann), 20));
    assert!(saved.notes.members.seats.is_empty());
}

#[test]
fn a_room_that_is_over_leaves_no_file_and_not_that_of_the_next_room() {
    let dir = TestDir::new("over");
    let first = Written::new(&dir, "oak");
    let info = Arc::new(RoomInfo::new("oak", 78, false, None, first.room.scene()));
    let room = Room::new("oak", Arc::clone(first.room.scene()), 6);
    let next = Written::among(Arc::clone(&first.files), info, room, Admission::default());
    first.end(Seal::Remove);
    next.close();
    assert_eq!(saved(&dir).notes.number, 78);

    let dir = TestDir::new("gone");
    Written::new(&dir, "oak").end(Seal::Remove);
    assert_eq!(fs::read_dir(dir.0.join("rooms")).expect("a directory").count(), 0);
}

#[test]
fn a_room_that_was_given_up_writes_nothing_over_the_file_of_the_next() {
    let dir = TestDir::new("given-up");
    let mut first = Written::new(&dir, "oak");
    first.shared.seal(Seal::Remove);
    first.readers.step(first.now);
    let info = Arc::new(RoomInfo::new("oak", 78, false, None, first.room.scene()));
    let room = Room::new("oak", Arc::clone(first.room.scene()), 5);
    let next = Written::among(Arc::clone(&first.files), info, room, Admission::default());
    // The thread of the room that was given up wakes up while the server is closing.
    first.play(limits::STATE_FILE_TICKS);
    first.close();
    next.kill();
    assert_eq!(saved(&dir).notes.number, 78);
}

#[test]
fn a_room_that_could_not_be_kept_leaves_no_file_once_it_is_over() {
    let dir = TestDir::new("full");
    let mut written = Written::new(&dir, "oak");
    // The disk stalls for longer than a clip.
    for _ in 0..jostle_room::log::CLIP_TICKS + 120 {
        written.room.tick();
        written.log.after_ticks(&mut written.room, &written.admission, false);
    }
    written.readers.step(written.now);
    assert_eq!((written.files.policy().errors(), written.files.policy().dropped()), (1, 1));
    written.end(Seal::Remove);
    assert_eq!(fs::read_dir(dir.0.join("rooms")).expect("a directory").count(), 0);
}

#[test]
fn a_disk_that_fails_costs_the_file_and_not_the_game_and_a_new_file_begins() {
    let dir = TestDir::new("disk");
    let mut written = Written::new(&dir, "oak");
    written.play(40);
    fs::remove_dir_all(dir.0.join("rooms")).expect("a directory");
    written.play(limits::STATE_FILE_TICKS);
    assert!(written.files.policy().errors() > 0);
    fs::create_dir(dir.0.join("rooms")).expect("a place");
    written.play(60 * limits::STATE_RETRY.as_secs() as u32 + 10);
    let (tick, hash) = written.close();
    let room = restored(&dir);
    assert_eq!((room.game().tick_count(), room.game().hash()), (tick, hash));
}

#[test]
fn one_server_at_a_time_uses_a_directory() {
    let dir = TestDir::new("lock");
    let first = StateDir::open(&dir.0).expect("a directory");
    let error = StateDir::open(&dir.0).expect_err("it is in use").to_string();
    assert!(error.contains("lock: another server uses this directory"), "{error}");
    let key = *first.key();
    drop(first);
    assert_eq!(*StateDir::open(&dir.0).expect("free again").key(), key, "the key stays");
    assert_ne!(*StateDir::open(&TestDir::new("other").0).expect("another").key(), key);
}

#[cfg(unix)]
#[test]
fn only_the_owner_can_read_what_is_kept() {
    use std::os::unix::fs::PermissionsExt;
    let dir = TestDir::new("mode");
    let mut written = Written::new(&dir, "oak");
    written.play(30);
    written.close();
    let mode = |path: &Path| fs::metadata(path).expect("a file").permissions().mode() & 0o777;
    assert_eq!(mode(&dir.0.join("key")), 0o600);
    assert_eq!(mode(&file(&dir, "oak.jostle")), 0o600);
    assert_eq!(mode(&dir.0.join("rooms")), 0o700);
}

#[test]
fn files_of_something_else_are_named_and_set_aside() {
    let dir = TestDir::new("damaged");
    Written::new(&dir, "oak").close();
    let whole = fs::read(file(&dir, "oak.jostle")).expect("a file");
    fs::write(dir.0.join("key"), [1; 31]).expect("a place");
    let error = StateDir::open(&dir.0).expect_err("no key").to_string();
    assert!(error.contains("key: found 31 bytes; allowed: a key of 32 bytes"), "{error}");
    fs::remove_file(dir.0.join("key")).expect("a file");

    fs::write(file(&dir, "elm.jostle"), &whole).expect("a place");
    fs::write(file(&dir, "ash.jostle"), b"GIF89a").expect("a place");
    fs::write(file(&dir, "yew.new"), b"half").expect("a place");
    fs::write(file(&dir, "fir.jostle"), &whole[..whole.len() - 3]).expect("a place");
    assert_eq!(saved(&dir).code, "oak");
    let names = fs::read_dir(dir.0.join("rooms")).expect("a directory");
    let mut names: Vec<_> = names.map(|entry| entry.expect("an entry").file_name()).collect();
    names.sort();
    assert_eq!(names, ["ash.damaged", "elm.damaged", "fir.damaged", "oak.jostle"]);
}

#[test]
fn a_restored_room_is_written_and_restored_again() {
    let dir = TestDir::new("again");
    let mut written = Written::new(&dir, "oak");
    let mut claim = written.join("Ann");
    written.room.input(claim.seat, 1, Input::default());
    written.play(100);
    written.kill();
    for _ in 0..3 {
        let saved = saved(&dir);
        let info = Arc::new(RoomInfo::new("oak", 77, true, None, &saved.scene));
        let room = played_up(&saved);
        let mut written = Written::of(&dir, info, room, saved.notes.admission);
        let look = Appearance::new("Ann", 0).expect("a name");
        let welcome = written.room.join(look, Some(claim)).expect("the seat is held");
        assert!(welcome.resumed);
        claim = welcome.claim;
        written.play(100);
        written.kill();
    }
    assert_eq!(restored(&dir).players(), 1);
}

/// 200 bodies in one place, each touching all the others.
const HEAP: &str = "title = \"Heap\"\nsize = [100, 100]\ngroups = [\"block\"]\npairs = [[\"block\", \"block\"]]\n\
                    [[layouts]]\nkind = \"block\"\ncount = 200\nradius = 10\narea = [[49, 49], [51, 51]]\n\
                    exact = true\ngrid = [20, 10]\n";

#[test]
fn a_guests_room_whose_scene_takes_too_much_is_not_restored() {
    for (guest, is_restored) in [(false, true), (true, false)] {
        let dir = TestDir::new("heap");
        let scene = Arc::new(Scene::parse("guest.toml", HEAP).expect("a scene"));
        let info = RoomInfo::new("oak", 77, true, None, &scene);
        let info = Arc::new(RoomInfo { guest, ..info });
        // This is a file from an older program that did not know about the budget.
        let mut written = Written::of(&dir, info, Room::new("oak", scene, 5), Admission::default());
        written.play(40);
        written.kill();
        let room = saved(&dir).restore(|| true).expect("a whole file");
        assert_eq!(room.is_some(), is_restored, "a guest's: {guest}");
    }
}

#[test]
fn a_room_is_restored_as_long_as_it_may_take() {
    let dir = TestDir::new("long");
    let mut written = Written::new(&dir, "oak");
    written.play(200);
    written.kill();
    let asked = std::cell::Cell::new(0);
    let room = saved(&dir).restore(|| {
        asked.set(asked.get() + 1);
        asked.get() < 50
    });
    assert!(room.expect("a whole file").is_none());
    assert_eq!(asked.get(), 50);
}
