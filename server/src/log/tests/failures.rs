//! How each reader behaves when a disk fails, is full or stalls, following the table in `docs/faults.md`.

use super::super::writer::{LogWriter, Readers};
use super::super::*;
use crate::host::admission::Admission;
use crate::limits;
use jostle_game::Scene;
use jostle_protocol::ClipRefusal;
use jostle_protocol::replay::{Record, Replay, header};
use jostle_room::Room;
use jostle_room::log::CLIP_TICKS;
use std::io;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant, SystemTime};

/// The records that a sink received, file by file, and the disk's error.
#[derive(Default)]
struct Disk {
    files: Vec<Vec<Arc<Record>>>,
    error: Option<io::ErrorKind>,
}

/// A sink whose disk the test controls.
#[derive(Clone, Default)]
struct FakeSink(Arc<Mutex<Disk>>);

impl FakeSink {
    fn with<R>(&self, work: impl FnOnce(&mut Disk) -> R) -> R {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The first and last tick of each file.
    fn spans(&self) -> Vec<(u32, u32)> {
        let span = |records: &Vec<Arc<Record>>| {
            let bytes = header().into_iter().chain(records.iter().flat_map(|record| record.seal()));
            let replay = Replay::read(bytes.collect()).expect("a replay");
            (replay.first_tick(), replay.last_tick())
        };
        self.with(|disk| disk.files.iter().map(span).collect())
    }
}

impl Sink for FakeSink {
    fn begin(&mut self, records: &[Arc<Record>]) -> io::Result<()> {
        self.with(|disk| match disk.error {
            Some(error) => Err(error.into()),
            None => {
                disk.files.push(records.to_vec());
                Ok(())
            }
        })
    }

    fn append(&mut self, records: &[Arc<Record>]) -> io::Result<()> {
        self.with(|disk| match disk.error {
            Some(error) => Err(error.into()),
            None => {
                disk.files.last_mut().expect("a file was begun").extend_from_slice(records);
                Ok(())
            }
        })
    }

    fn seal(&mut self, _: &Seal) -> io::Result<()> {
        Ok(())
    }
}

const RETRY: Duration = Duration::from_secs(5);

/// A room with one reader.
struct Read {
    room: Room,
    log: RoomLog,
    readers: Readers,
    policy: Arc<Policy>,
    sink: FakeSink,
    now: Instant,
}

impl Read {
    fn new(is_replay: bool) -> Read {
        let scene = Arc::new(Scene::built_in().swap_remove(0));
        let mut room = Room::new("oak", scene, 5);
        let (shared, policy) = (Arc::default(), Policy::new("CANNOT", RETRY));
        let wants = Wants { file_ticks_max: u32::MAX, is_replay, wall: SystemTime::now };
        let (mut readers, sink) = (Readers::default(), FakeSink::default());
        readers.add(LogReader::new(&shared, &policy, wants), Box::new(sink.clone()));
        let admission = Admission::default();
        let log = RoomLog::begin(
            &Logs::default(),
            Some(shared),
            HostNotes::default(),
            &mut room,
            &admission,
        );
        Read { room, log, readers, policy, sink, now: Instant::now() }
    }

    /// Plays more ticks.
    fn play(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.room.tick();
            self.log.after_ticks(&mut self.room, &Admission::default(), false);
        }
    }

    /// Runs the writer once this much time has passed.
    fn write(&mut self, later: Duration) {
        self.now += later;
        self.readers.step(self.now);
    }
}

#[test]
fn a_disk_that_fails_or_is_full_costs_a_file_and_a_new_one_begins_after_a_while() {
    for is_replay in [true, false] {
        for error in [io::ErrorKind::Other, io::ErrorKind::StorageFull] {
            let mut read = Read::new(is_replay);
            read.write(Duration::ZERO);
            read.play(100);
            read.write(Duration::ZERO);
            read.sink.with(|disk| disk.error = Some(error));
            for round in 0..3 {
                read.play(60);
                read.write(if round == 0 { Duration::ZERO } else { RETRY });
                assert_eq!(read.policy.errors(), round + 1, "one for each attempt");
                read.play(60);
                read.write(RETRY / 2);
                assert_eq!(read.policy.errors(), round + 1, "and none before it is time");
            }
            read.sink.with(|disk| disk.error = None);
            read.write(RETRY);
            read.play(30);
            read.write(Duration::ZERO);
            // The newest state is at tick 480, and blocks end at 480 and at 490.
            let spans = read.sink.spans();
            assert_eq!((spans[0], spans[1].0), ((0, 90), 460 / 60 * 60), "{spans:?}");
            assert_eq!((spans.len(), read.policy.dropped()), (2, 0));
        }
    }
}

#[test]
fn a_disk_that_stalls_for_as_long_as_a_clip_costs_nothing_and_then_a_file() {
    for is_replay in [true, false] {
        let mut read = Read::new(is_replay);
        read.write(Duration::ZERO);
        read.play(CLIP_TICKS);
        read.write(Duration::ZERO);
        assert_eq!((read.sink.spans(), read.policy.errors()), (vec![(0, CLIP_TICKS)], 0));
        read.play(CLIP_TICKS + 120);
        read.write(Duration::ZERO);
        assert_eq!((read.policy.errors(), read.policy.dropped()), (1, 1));
        read.write(RETRY);
        let end = 2 * CLIP_TICKS + 120;
        assert_eq!(read.sink.spans(), [(0, CLIP_TICKS), (end, end)]);
    }
}

#[test]
fn a_room_that_ends_while_its_disk_fails_is_let_go() {
    for (seal, begun) in
        [(Seal::Keep, false), (Seal::Remove, false), (Seal::Leave, false), (Seal::Keep, true)]
    {
        let mut read = Read::new(false);
        if !begun {
            read.sink.with(|disk| disk.error = Some(io::ErrorKind::Other));
        }
        read.write(Duration::ZERO);
        read.sink.with(|disk| disk.error = Some(io::ErrorKind::Other));
        read.play(10);
        let is_kept = seal == Seal::Keep;
        read.log.end(&mut read.room, &Admission::default(), true, seal);
        read.readers.step(read.now);
        // State that must be kept is tried once more.
        let errors = u64::from(!begun) + u64::from(is_kept);
        assert_eq!(read.policy.errors(), errors);
        read.readers.step(read.now + RETRY);
        assert_eq!(read.policy.errors(), errors);
    }
}

/// The answer to a player who asks for a clip when the files are created this way.
fn clip_on(create: Create) -> Result<String, ClipRefusal> {
    let dir = std::env::temp_dir().join(format!("jostle-clip-{:016x}", crate::host::random()));
    let store = Arc::new(ReplayStore::new(Settings { create, ..Settings::new(dir.clone()) }));
    let writer = Arc::new(LogWriter::start(1, None).expect("a thread"));
    let recording = Recording::new(Arc::clone(&store), Arc::clone(&writer));
    let mut read = Read::new(true);
    read.play(100);
    let records = read.room.clip(9).expect("clips are kept");
    let (sender, answer) = mpsc::channel();
    recording.keep_clip(records, true, None, move |kept| drop(sender.send(kept)));
    let answer = answer.recv().expect("an answer");
    writer.close();
    assert_eq!(store.policy().errors(), u64::from(answer.is_err()));
    std::fs::remove_dir_all(dir).expect("a directory");
    answer
}

#[test]
fn a_clip_on_a_disk_that_fails_or_is_full_is_refused() {
    assert_eq!(clip_on(|_| Err(io::ErrorKind::Other.into())), Err(ClipRefusal::Failed));
    assert_eq!(clip_on(|_| Err(io::ErrorKind::StorageFull.into())), Err(ClipRefusal::Failed));
    assert!(clip_on(|_| Ok(Box::new(io::sink()))).is_ok());
}

#[test]
fn clips_beyond_four_are_refused_while_the_disk_stalls() {
    let store = Arc::new(ReplayStore::new(Settings::new(std::env::temp_dir().join("jostle-none"))));
    let writer = Arc::new(LogWriter::start(1, None).expect("a thread"));
    let recording = Recording::new(store, Arc::clone(&writer));
    let (goes_on, stalls) = mpsc::channel::<()>();
    assert!(writer.once(move || assert!(stalls.recv().is_err())));
    let read = Read::new(true);
    let (sender, answers) = mpsc::channel();
    for _ in 0..=limits::CLIPS_WAITING_MAX {
        let (records, sender) = (read.room.clip(9).expect("clips are kept"), sender.clone());
        recording.keep_clip(records, true, None, move |kept| drop(sender.send(kept)));
    }
    assert_eq!(answers.recv(), Ok(Err(ClipRefusal::TooMany)), "the fifth, at once");
    drop(goes_on);
    writer.close();
}
