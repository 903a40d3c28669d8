use super::*;
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Ending, Replay};
use jostle_room::Room;
use jostle_sim::Scene;
use std::fs;
use std::sync::mpsc::sync_channel;
use std::time::{Instant, SystemTime};
use writer::Clock;

/// Longer than anything takes.
const LONG: Duration = Duration::from_secs(30);

/// An empty directory for one test, removed when the test passed.
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

    /// The replays in it, by name.
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

    /// A file of some bytes that was written so many days ago.
    fn put(&self, name: &str, bytes: &[u8], age_days: u32) {
        fs::write(self.0.join(name), bytes).expect("a written file");
        self.stamp(name, SystemTime::now() - days(age_days));
    }

    /// A file that was written last at this time; it is made if it is missing.
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

/// A recorded room.
struct Stage {
    recording: Arc<Recording>,
    room: Room,
    tape: Tape,
}

impl Stage {
    fn new(settings: Settings) -> Stage {
        Stage::over(Recording::start(settings).expect("a thread"))
    }

    fn over(recording: Arc<Recording>) -> Stage {
        let scene = Arc::new(Scene::built_in().swap_remove(0));
        let mut room = Room::new("k7f3q2", scene, 5);
        let ann = Appearance::new("Ann", 0).expect("a name");
        room.join(ann, None).expect("a seat");
        let tape = Tape::start(Arc::clone(&recording), &mut room, Instant::now());
        Stage { recording, room, tape }
    }

    fn play(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.room.tick();
            self.tape.after_ticks(&mut self.room, Instant::now());
        }
    }

    fn counters(&self) -> [u64; 4] {
        self.recording.shelf().counters().read()
    }

    /// Waits until the writer has done something; the room stands still meanwhile.
    fn until(&self, what: &str, is_so: impl Fn([u64; 4]) -> bool) {
        let started = Instant::now();
        while !is_so(self.counters()) {
            assert!(started.elapsed() < LONG, "{what}: {:?}", self.counters());
            std::thread::yield_now();
        }
    }

    fn end(mut self) -> Arc<Recording> {
        self.tape.end(&mut self.room, Instant::now());
        self.recording.close();
        self.recording
    }
}

#[test]
fn a_room_is_recorded_to_its_end() {
    let dir = Dir::new("end");
    let mut stage = Stage::new(dir.settings());
    stage.play(700);
    let recording = stage.end();
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert_eq!((replay.ending(), replay.last_tick()), (Ending::Whole, 700));
    let start = replay.start();
    assert_eq!((start.room.as_str(), start.scene_name.as_str()), ("k7f3q2", "arena"));
    assert_eq!(start.program, env!("CARGO_PKG_VERSION"));
    let [entry] = &recording.shelf().list()[..] else { panic!("one entry") };
    assert!(entry.name.starts_with("arena-k7f3q2-20"), "{}", entry.name);
    assert_eq!((entry.bytes, entry.recording), (replay.byte_count() as u64, false));
    assert_eq!(recording.shelf().counters().read(), [1, entry.bytes, 0, 0]);
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
    // They may have begun in one second, and then only a number tells them apart.
    spans.sort();
    assert_eq!(spans, [(0, 400), (400, 800), (800, 1000)]);
    assert!(replays.iter().all(|replay| replay.ending() == Ending::Whole));
}

#[test]
fn a_room_that_fails_leaves_a_replay_up_to_its_last_record() {
    let dir = Dir::new("failed");
    let mut stage = Stage::new(dir.settings());
    stage.play(650);
    drop(stage.tape);
    stage.recording.close();
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert_eq!(replay.last_tick(), 600);
    assert!(!stage.recording.shelf().list()[0].recording);
}

#[test]
fn a_room_that_fails_inside_a_tick_leaves_all_whole_ones() {
    let dir = Dir::new("broken-off");
    let mut stage = Stage::new(dir.settings());
    stage.play(650);
    stage.tape.break_off(&mut stage.room, Instant::now());
    stage.recording.close();
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert_eq!(replay.last_tick(), 650);
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
    // The start of the scene, a block of 300 ticks, and half of another.
    Ok(Box::new(SmallDisk { file, left: 3800 }))
}

#[test]
fn a_full_disk_costs_the_file_its_end_and_a_fresh_one_is_tried() {
    let dir = Dir::new("full");
    let retry = Duration::from_secs(3600);
    let mut stage = Stage::new(Settings { create: small_disk, retry, ..dir.settings() });
    for _ in 0..10 {
        stage.play(300);
    }
    stage.until("an error", |[.., errors]| errors == 1);
    stage.play(1);
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    let last = replay.last_tick();
    assert!(last >= 300 && last.is_multiple_of(300), "{last}");
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert_eq!(jostle_room::divergence::verify(&Arc::new(replay.clone()), |_| {}), Ok(None));
    // An hour later.
    stage.room.tick();
    stage.tape.after_ticks(&mut stage.room, Instant::now() + retry);
    stage.until("another file", |[files, ..]| files == 2);
    stage.recording.close();
}

#[test]
fn no_directory_is_one_error_and_no_file() {
    let dir = Dir::new("nowhere");
    dir.put("file", b"in the way", 0);
    let settings = Settings::new(dir.0.join("file"));
    let mut stage = Stage::new(settings);
    stage.play(10);
    // One at the first look at the directory, one when the room's file was to be made.
    stage.until("two errors", |counters| counters == [0, 0, 0, 2]);
    stage.play(600);
    let recording = stage.end();
    assert_eq!(recording.shelf().counters().read(), [0, 0, 0, 2]);
    assert_eq!(recording.shelf().list(), []);
    assert_eq!(fs::read(dir.0.join("file")).expect("still there"), b"in the way");
}

#[test]
fn a_writer_that_is_behind_costs_the_recording_and_no_time() {
    let dir = Dir::new("behind");
    let (queue, jobs) = sync_channel(2);
    let recording = Arc::new(Recording {
        shelf: Arc::new(Shelf::new(dir.settings())),
        queue,
        waiting_bytes: Arc::default(),
        thread: Mutex::default(),
    });
    let mut stage = Stage::over(Arc::clone(&recording));
    stage.play(900);
    // Start and first block wait; the second was dropped, and nothing was tried after it.
    assert_eq!(recording.shelf().counters().read(), [0, 0, 1, 0]);
    assert_eq!(jobs.try_iter().count(), 2);
    assert!(stage.room.take_records().is_empty());
}

#[test]
fn the_oldest_go_first_and_nothing_but_replays_goes() {
    let dir = Dir::new("prune");
    dir.put("old.jostle", &[0; 600], 9);
    dir.put("older.jostle", &[0; 600], 20);
    dir.put("ancient.jostle", &[0; 600], 31);
    dir.put("new.jostle", &[0; 600], 0);
    dir.put("notes.txt", &[0; 9000], 400);
    dir.put("My Game.jostle", &[0; 9000], 400);
    fs::create_dir(dir.0.join("folder.jostle")).expect("a directory");
    let shelf = Shelf::new(Settings { bytes_max: 1300, ..dir.settings() });
    shelf.look(SystemTime::now()).expect("a directory");
    let others = ["My Game.jostle", "folder.jostle", "new.jostle", "notes.txt", "old.jostle"];
    assert_eq!(dir.names(), others);
    shelf.make_room(200).expect("room");
    assert!(!dir.names().contains(&"old.jostle".to_owned()));
    assert!(shelf.make_room(1300).is_ok(), "the last one goes too");
    assert_eq!(dir.names(), ["My Game.jostle", "folder.jostle", "notes.txt"]);
    assert!(shelf.make_room(1301).is_err());
}

#[test]
fn a_clock_that_steps_deletes_nothing() {
    let (began, today) = (Instant::now(), SystemTime::now());
    let unset = SystemTime::UNIX_EPOCH;
    // Set for the first time, set on, and set back.
    for (first, then) in [(unset, today), (today, today + days(40)), (today, today - days(40))] {
        let dir = Dir::new("stepped");
        let clock = Clock::new(began, first);
        let shelf = Shelf::new(dir.settings());
        let look = |day| {
            shelf.look(clock.time(began + days(day), then + days(day))).expect("a directory");
            dir.names()
        };
        // Files are stamped by the wall clock.
        dir.stamp("before.jostle", first);
        dir.stamp("later.jostle", then);
        assert_eq!(look(1), ["before.jostle", "later.jostle"]);
        // Age goes on all the same.
        assert!(look(32).len() < 2);
        assert!(first == unset || look(32 + 40).is_empty());
    }
}

#[test]
fn a_file_that_is_written_is_never_deleted() {
    let dir = Dir::new("written");
    dir.put("finished.jostle", &[0; 4000], 1);
    let mut stage = Stage::new(Settings { bytes_max: 6000, ..dir.settings() });
    for _ in 0..30 {
        stage.play(300);
    }
    stage.until("an error", |[.., errors]| errors == 1);
    let recording = stage.end();
    let [replay] = &dir.replays()[..] else { panic!("{:?}", dir.names()) };
    assert!(replay.last_tick() >= 300 && replay.byte_count() <= 6000);
    assert!(!recording.shelf().list()[0].recording);
}

#[test]
fn the_newest_are_listed_and_what_cannot_be_read_is_not() {
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
    let shelf = Shelf::new(dir.settings());
    shelf.look(SystemTime::now()).expect("a directory");
    let rooms: Vec<_> = shelf.list().into_iter().map(|entry| entry.room).collect();
    let expected: Vec<_> = (0..limits::REPLAYS_LISTED_MAX).map(|age| format!("r{age}")).collect();
    assert_eq!(rooms, expected);
    assert!(shelf.knows("broken") && !shelf.knows("../replays") && !shelf.knows(""));
    assert!(matches!(shelf.read("other"), Err(Refused::Unknown)));
    // What somebody removed is forgotten.
    fs::remove_file(dir.0.join("broken.jostle")).expect("removed");
    shelf.look(SystemTime::now()).expect("a directory");
    assert!(!shelf.knows("broken"));
}

#[test]
fn only_so_many_read_at_a_time() {
    let dir = Dir::new("readers");
    dir.put("a.jostle", b"bytes", 0);
    let shelf = Shelf::new(dir.settings());
    shelf.look(SystemTime::now()).expect("a directory");
    let mut readers: Vec<_> =
        (0..limits::REPLAY_READERS_MAX).map(|_| shelf.read("a").expect("a permit")).collect();
    assert!(matches!(shelf.read("a"), Err(Refused::Busy)));
    readers.pop();
    assert!(shelf.read("a").is_ok());
}
