mod failures;
mod state;

use super::replay_file::ReplayFile;
use super::store::AgeClock;
use super::writer::Readers;
use super::*;
use crate::host::admission::Admission;
use crate::limits;
use jostle_game::{Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Ending, Record, Replay};
use jostle_room::Room;
use std::fs::{self, File};
use std::io::{self, Write};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

/// An empty directory for one test, removed if the test passes.
struct Dir(PathBuf);

impl Dir {
    fn new(test: &str) -> Dir {
        let name = format!("jostle-replays-{}-{test}", std::process::id());
        let dir = std::env::temp_dir().join(name);
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).expect("a directory");
        Dir(dir)
    }

    fn settings(&self) -> Settings {
        Settings::new(self.0.clone())
    }

    /// The replays in the directory, by name.
    fn replays(&self) -> Vec<Replay> {
        let names = self.names();
        let bytes = names.iter().map(|name| fs::read(self.0.join(name)).expect("a file"));
        bytes.map(|bytes| Replay::read(bytes).expect("a replay")).collect()
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).expect("a directory");
        let name = |entry: io::Result<fs::DirEntry>| {
            entry.expect("an entry").file_name().into_string().expect("text")
        };
        let mut names: Vec<_> = entries.map(name).collect();
        names.sort();
        names
    }

    /// Creates a file with these bytes, last written `age_days` ago.
    fn put(&self, name: &str, bytes: &[u8], age_days: u32) {
        fs::write(self.0.join(name), bytes).expect("a written file");
        self.stamp(name, SystemTime::now() - days(age_days));
    }

    /// Sets the time of a file's last write, creating the file if it is missing.
    fn stamp(&self, name: &str, modified: SystemTime) {
        let file = File::options().append(true).create(true).open(self.0.join(name));
        file.and_then(|file| file.set_modified(modified)).expect("a time");
    }
}

impl Drop for Dir {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = fs::remove_dir_all(&self.0);
        }
    }
}

/// A room being recorded. The test decides when the room's log is read.
struct Stage {
    store: Arc<ReplayStore>,
    shared: Arc<SharedLog>,
    readers: Readers,
    room: Room,
    seat: Seat,
    seq: u32,
    log: RoomLog,
}

impl Stage {
    fn new(settings: Settings) -> Stage {
        let store = Arc::new(ReplayStore::new(settings));
        store.look_now();
        let scene = Arc::new(Scene::built_in().swap_remove(0));
        let mut room = Room::new("k7f3q2", scene, 5);
        let ann = Appearance::new("Ann", 0).expect("a name");
        let seat = room.join(ann, None).expect("a seat").claim.seat;
        let shared = Arc::default();
        let (reader, file) = ReplayFile::of(&store, &shared);
        let mut readers = Readers::default();
        readers.add(reader, Box::new(file));
        let (logs, held, admission) =
            (Logs::default(), Some(Arc::clone(&shared)), Admission::default());
        let log = RoomLog::begin(&logs, held, HostNotes::default(), &mut room, &admission);
        Stage { store, shared, readers, room, seat, seq: 0, log }
    }

    fn shares(&mut self, empty: bool) {
        self.log.after_ticks(&mut self.room, &Admission::default(), empty);
    }

    /// Plays ticks, with an input in each.
    fn play(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.seq += 1;
            self.room.input(self.seat, self.seq, Input::default());
            self.idle(1);
        }
    }

    /// Plays ticks with no inputs.
    fn idle(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.room.tick();
            self.shares(false);
            self.readers.step(Instant::now());
        }
    }

    fn end(self) -> Arc<ReplayStore> {
        self.end_as(true)
    }

    fn end_as(mut self, whole: bool) -> Arc<ReplayStore> {
        self.log.end(&mut self.room, &Admission::default(), whole, Seal::Remove);
        self.readers.step(Instant::now());
        self.store
    }
}

#[test]
fn a_room_is_recorded_to_its_end() {
    let dir = Dir::new("end");
    let mut stage = Stage::new(dir.settings());
    stage.play(700);
    let store = stage.end();
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert_eq!((replay.ending(), replay.last_tick()), (Ending::Whole, 700));
    let start = replay.start();
    assert_eq!((start.room.as_str(), start.scene_name.as_str()), ("k7f3q2", "arena"));
    assert_eq!(start.program, env!("CARGO_PKG_VERSION"));
    let [entry] = &store.list()[..] else { panic!("one entry") };
    assert!(entry.name.starts_with("arena-k7f3q2-20"), "{}", entry.name);
    assert_eq!((entry.bytes, entry.recording), (replay.byte_count() as u64, false));
    assert_eq!(store.counts(), [1, entry.bytes, 0]);
}

#[test]
fn a_long_game_goes_on_in_another_file() {
    let dir = Dir::new("long");
    let mut stage = Stage::new(Settings { file_ticks_max: 400, ..dir.settings() });
    stage.play(1000);
    stage.end();
    let replays = dir.replays();
    let mut spans: Vec<_> =
        replays.iter().map(|replay| (replay.first_tick(), replay.last_tick())).collect();
    // The files may have begun in the same second, in which case their names differ only by a number.
    spans.sort();
    // Each file begins with a state that was kept for clips.
    assert_eq!(spans, [(0, 420), (420, 840), (840, 1000)]);
    assert!(replays.iter().all(|replay| replay.ending() == Ending::Whole));
}

#[test]
fn an_empty_room_is_not_recorded() {
    let dir = Dir::new("paused");
    let mut stage = Stage::new(dir.settings());
    stage.play(360);
    stage.idle(40);
    for _ in 0..7200 {
        stage.room.tick();
        stage.shares(true);
        stage.readers.step(Instant::now());
    }
    stage.play(120);
    let store = stage.end();
    let replays = dir.replays();
    let mut spans: Vec<_> =
        replays.iter().map(|replay| (replay.first_tick(), replay.last_tick())).collect();
    spans.sort();
    // Tick 401 ends the first file, and the second one begins after the first tick with a player.
    assert_eq!(spans, [(0, 401), (7601, 7720)]);
    assert!(replays.iter().all(|replay| replay.ending() == Ending::Whole));
    let facts = |store: &ReplayStore| {
        let list = store.list();
        let mut facts: Vec<_> = list.iter().map(|entry| (entry.seconds, entry.players)).collect();
        facts.sort();
        facts
    };
    let listed = facts(&store);
    assert_eq!(listed, [(Some(2), 1), (Some(7), 1)]);
    // A server that restarts with these files finds the same list.
    let later = ReplayStore::new(dir.settings());
    later.look_now();
    assert_eq!(facts(&later), listed);
}

#[test]
fn a_room_that_is_given_up_leaves_a_replay_up_to_its_last_block() {
    let dir = Dir::new("failed");
    let mut stage = Stage::new(dir.settings());
    stage.play(650);
    stage.shared.seal(Seal::Remove);
    stage.readers.step(Instant::now());
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert_eq!(replay.last_tick(), 630);
    assert!(!stage.store.list()[0].recording);
}

#[test]
fn a_room_that_fails_inside_a_tick_leaves_all_whole_ones() {
    let dir = Dir::new("broken-off");
    let mut stage = Stage::new(dir.settings());
    stage.play(650);
    stage.end_as(false);
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert_eq!(replay.last_tick(), 650);
}

#[test]
fn a_recording_without_an_input_leaves_no_file() {
    let dir = Dir::new("idle");
    let mut stage = Stage::new(Settings { file_ticks_max: 400, ..dir.settings() });
    stage.idle(300);
    stage.play(60);
    // The second file begins after the last input, long after the buttons were released.
    stage.idle(700);
    let store = stage.end();
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert_eq!((replay.first_tick(), replay.last_tick()), (0, 420));
    assert_eq!(store.list().len(), 1);
    assert_eq!(store.counts()[0], 3, "files were begun");
}

#[test]
fn files_past_the_limit_are_deleted() {
    const MORE: usize = 20;
    let dir = Dir::new("many");
    let name = |at: usize| format!("old-{at:05}.jostle");
    for at in 0..limits::REPLAY_FILES_MAX + MORE {
        fs::write(dir.0.join(name(at)), b"").expect("a written file");
    }
    let store = ReplayStore::new(dir.settings());
    store.look(SystemTime::now()).expect("a directory");
    let names = dir.names();
    assert_eq!((names.len(), &names[0]), (limits::REPLAY_FILES_MAX, &name(MORE)));
    let start = jostle_protocol::replay::Start {
        scene_name: "arena".to_owned(),
        room: "k7f3q2".to_owned(),
        ..Default::default()
    };
    let (made, _file) = store.create(&start).expect("a file");
    let names = dir.names();
    assert_eq!(names.len(), limits::REPLAY_FILES_MAX);
    assert!(names.contains(&format!("{made}.jostle")) && !names.contains(&name(MORE)));
}

#[test]
fn an_empty_file_counts_for_a_block_of_the_disk() {
    let dir = Dir::new("blocks");
    for at in 0..10 {
        dir.put(&format!("file-{at}.jostle"), b"", at);
    }
    let store = ReplayStore::new(Settings { bytes_max: 5 * 4096, ..dir.settings() });
    store.look(SystemTime::now()).expect("a directory");
    assert_eq!(dir.names().len(), 5);
}

/// A disk with so little space that the second block of ticks does not fit.
struct SmallDisk {
    file: File,
    left: usize,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.left == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let count = bytes.len().min(self.left);
        self.left -= count;
        self.file.write(&bytes[..count])
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

fn small_disk(path: &Path) -> io::Result<Box<dyn Write + Send>> {
    let file = File::options().write(true).create_new(true).open(path)?;
    // There is space for the start of the scene, a block of 300 ticks, and half of another block.
    Ok(Box::new(SmallDisk { file, left: 3800 }))
}

#[test]
fn a_full_disk_truncates_the_file_and_a_new_one_is_tried() {
    let dir = Dir::new("full");
    let retry = Duration::from_secs(3600);
    let mut stage = Stage::new(Settings { create: small_disk, retry, ..dir.settings() });
    for _ in 0..10 {
        stage.play(300);
    }
    assert_eq!(stage.store.counts()[2], 1);
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    let last = replay.last_tick();
    assert!(last >= 300 && last.is_multiple_of(300), "{last}");
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert_eq!(jostle_room::divergence::verify(&Arc::new(replay.clone()), |_| {}), Ok(None));
    // A while later, the reader may begin another file.
    assert_eq!(stage.store.counts()[0], 1);
    stage.readers.step(Instant::now() + retry);
    assert_eq!(stage.store.counts()[0], 2, "another file");
}

#[test]
fn no_directory_is_one_error_and_no_file() {
    let dir = Dir::new("nowhere");
    dir.put("file", b"in the way", 0);
    let settings = Settings::new(dir.0.join("file"));
    let mut stage = Stage::new(settings);
    stage.play(10);
    stage.play(600);
    let store = stage.end();
    // There is one error at the first scan of the directory, and another when the room's file was to be created.
    assert_eq!(store.counts(), [0, 0, 2]);
    assert_eq!(store.list(), []);
    assert_eq!(fs::read(dir.0.join("file")).expect("still there"), b"in the way");
}

#[test]
fn a_disk_that_stands_still_costs_the_file_and_no_tick_and_a_new_one_begins() {
    let dir = Dir::new("behind");
    let mut stage = Stage::new(dir.settings());
    stage.play(310);
    let wait = limits::REPLAY_RETRY;
    // A stall as long as a clip loses nothing.
    for (ticks, lost) in
        [(jostle_room::log::CLIP_TICKS - 60, 0), (jostle_room::log::CLIP_TICKS + 120, 1)]
    {
        for _ in 0..ticks {
            stage.room.tick();
            stage.shares(false);
        }
        stage.readers.step(Instant::now());
        assert_eq!((stage.store.counts()[2], stage.store.policy().dropped()), (lost, lost));
    }
    stage.readers.step(Instant::now() + wait);
    stage.play(30);
    stage.end();
    let mut spans: Vec<_> = dir.replays().iter().map(|replay| replay.last_tick()).collect();
    spans.sort();
    assert_eq!(spans[0], 300 + jostle_room::log::CLIP_TICKS - 60, "{spans:?}");
    assert_eq!(spans[1], 310 + 2 * jostle_room::log::CLIP_TICKS + 60 + 30);
}

#[test]
fn the_oldest_replays_are_deleted_first_and_no_other_files() {
    let dir = Dir::new("prune");
    dir.put("old.jostle", &[0; 600], 9);
    dir.put("older.jostle", &[0; 600], 20);
    dir.put("ancient.jostle", &[0; 600], 31);
    dir.put("new.jostle", &[0; 600], 0);
    dir.put("notes.txt", &[0; 9000], 400);
    dir.put("My Game.jostle", &[0; 9000], 400);
    fs::create_dir(dir.0.join("folder.jostle")).expect("a directory");
    let store = ReplayStore::new(Settings { bytes_max: 2 * 4096 + 100, ..dir.settings() });
    store.look(SystemTime::now()).expect("a directory");
    let others = ["My Game.jostle", "folder.jostle", "new.jostle", "notes.txt", "old.jostle"];
    assert_eq!(dir.names(), others);
    store.make_room("next", 200).expect("room");
    assert!(!dir.names().contains(&"old.jostle".to_owned()));
    assert!(store.make_room("next", 2 * 4096 + 100).is_ok(), "the last one goes too");
    assert_eq!(dir.names(), ["My Game.jostle", "folder.jostle", "notes.txt"]);
    assert!(store.make_room("next", 2 * 4096 + 101).is_err());
}

#[test]
fn a_clock_that_steps_deletes_nothing() {
    let (began, today) = (Instant::now(), SystemTime::now());
    let unset = SystemTime::UNIX_EPOCH;
    // The clock is set for the first time, set forward, and set back.
    for (first, then) in [(unset, today), (today, today + days(40)), (today, today - days(40))] {
        let dir = Dir::new("stepped");
        let clock = AgeClock::new(began, first);
        let store = ReplayStore::new(dir.settings());
        let look = |day| {
            store.look(clock.time(began + days(day), then + days(day))).expect("a directory");
            dir.names()
        };
        // Files are stamped by the wall clock.
        dir.stamp("before.jostle", first);
        dir.stamp("later.jostle", then);
        assert_eq!(look(1), ["before.jostle", "later.jostle"]);
        // Files still grow older.
        assert!(look(32).len() < 2);
        assert!(first == unset || look(32 + 40).is_empty());
    }
}

#[test]
fn a_file_that_is_written_is_never_deleted() {
    let dir = Dir::new("written");
    dir.put("finished.jostle", &[0; 4000], 1);
    let mut stage = Stage::new(Settings { bytes_max: 6000, retry: days(1), ..dir.settings() });
    for _ in 0..30 {
        stage.play(300);
    }
    assert_eq!(stage.store.counts()[2], 1);
    let store = stage.end();
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert!(replay.last_tick() >= 300 && replay.byte_count() <= 6000);
    assert!(!store.list()[0].recording);
}

#[test]
fn the_newest_are_listed_and_unreadable_files_are_not() {
    let dir = Dir::new("list");
    for age_days in 0..limits::REPLAYS_LISTED_MAX as u32 + 20 {
        let unix_s = 1_800_000_000 - 86_400 * u64::from(age_days);
        let start = jostle_protocol::replay::Start {
            unix_s,
            room: format!("r{age_days}"),
            scene_name: "arena".to_owned(),
            ..Default::default()
        };
        let bytes = [jostle_protocol::replay::header(), Record::Start(start).seal()].concat();
        dir.put(&format!("{}.jostle", name::name("arena", "room", unix_s)), &bytes, 0);
    }
    dir.put("broken.jostle", b"what is this", 0);
    let store = ReplayStore::new(dir.settings());
    store.look(SystemTime::now()).expect("a directory");
    let rooms: Vec<_> = store.list().into_iter().map(|entry| entry.room).collect();
    let expected: Vec<_> = (0..limits::REPLAYS_LISTED_MAX).map(|age| format!("r{age}")).collect();
    assert_eq!(rooms, expected);
    assert!(store.knows("broken") && !store.knows("../replays") && !store.knows(""));
    assert!(matches!(store.read("other", IpAddr::from([10, 0, 0, 1])), Err(Refused::Unknown)));
    // A file that is removed disappears from the list.
    fs::remove_file(dir.0.join("broken.jostle")).expect("removed");
    store.look(SystemTime::now()).expect("a directory");
    assert!(!store.knows("broken"));
}

#[test]
fn readers_past_the_limit_are_refused() {
    let dir = Dir::new("readers");
    dir.put("a.jostle", b"bytes", 0);
    let store = ReplayStore::new(dir.settings());
    store.look(SystemTime::now()).expect("a directory");
    let address = |last: usize| IpAddr::from([10, 0, last as u8, 1]);
    let of_one = limits::ADDRESS_REPLAY_READERS_MAX;
    let mut readers: Vec<_> =
        (0..of_one).map(|_| store.read("a", address(0)).expect("a permit")).collect();
    assert!(matches!(store.read("a", address(0)), Err(Refused::Busy)));
    for reader in of_one..limits::REPLAY_READERS_MAX {
        readers.push(store.read("a", address(reader)).expect("a permit"));
    }
    assert!(matches!(store.read("a", address(1)), Err(Refused::Busy)));
    readers.pop();
    assert!(store.read("a", address(1)).is_ok());
}

#[test]
fn clips_of_one_network_push_out_few_games_and_no_clips_of_others() {
    const FILES: usize = 64;
    let dir = Dir::new("clip-flood");
    for at in 0..FILES as u64 {
        let game = format!("{}.jostle", name::name("arena", "k7f3q2", at));
        dir.put(&game, b"a game", 9);
    }
    let store = ReplayStore::new(Settings { bytes_max: FILES as u64 * 4096, ..dir.settings() });
    store.look(SystemTime::now()).expect("a directory");
    let start = |unix_s| jostle_protocol::replay::Start {
        scene_name: "arena".to_owned(),
        room: "k7f3q2".to_owned(),
        unix_s,
        ..Default::default()
    };
    let clip = |unix_s, last| {
        let asked_by = Some(IpAddr::from([203, 0, 113, last]));
        store.keep_clip(&start(unix_s), true, asked_by, b"a clip").expect("space")
    };
    let honest = [clip(100, 1), clip(101, 1)];
    (200..400).for_each(|unix_s| drop(clip(unix_s, 2)));
    assert!(honest.iter().all(|name| store.knows(name)), "{:?}", dir.names());
    let clips = dir.names().iter().filter(|name| name.contains("clip")).count();
    assert_eq!((dir.names().len(), clips), (FILES, FILES / limits::CLIPS_SHARE + 1));
    // When games need space, the remaining clips are deleted only once they are the oldest files.
    for unix_s in 1000..1020 {
        let (game, _) = store.create(&start(unix_s)).expect("space");
        store.make_room(&game, 1).expect("space");
        store.grow(&game, 1, None, 1);
        store.finish(&game);
    }
    assert!(honest.iter().all(|name| store.knows(name)), "{:?}", dir.names());
}

#[test]
fn an_address_gets_few_clips_a_minute_in_all_rooms() {
    let mut rates = recording::clip_rates();
    let (began, address) = (Instant::now(), |last| IpAddr::from([203, 0, 113, last]));
    let mut admitted = |last, second| {
        rates.admit(address(last), began + Duration::from_secs(second)).then_some(second)
    };
    // For ten minutes, clips are requested as fast as eight rooms with eight seats allow.
    let of_one = (0..600).filter_map(|second| admitted(1, second)).count();
    assert!((80..=88).contains(&of_one), "{of_one} in ten minutes");
    assert!(admitted(2, 599).is_some(), "each has its own");
}
