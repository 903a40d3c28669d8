//! The replay directory: its list, the files still being written, and the deletion of old ones. Files whose names are
//! not replay names are never touched.

use super::index::{IndexedFile, ReplayIndex, Stamp};
use super::name::{CLIP_ENDING, ENDING, UNLISTED_ENDING, is_name, is_unlisted, name, numbered};
use super::reader::Policy;
use super::settings::Settings;
use crate::files::open_regular;
use crate::limits;
use crate::limits::connection_limits::{ConnectionLimits, Permit};
use jostle_protocol::replay::{END_BYTES_MAX, PlayerCount, Record, START_BYTES_MAX, Start};
use jostle_protocol::web::ReplayCard;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::net::IpAddr;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime};
use tracing::{info, warn};

/// Maximum number of files skipped in one pass because they could not be deleted.
const REPLAY_UNDELETABLE_MAX: usize = 16;
/// When the server finds a replay, it looks for the players in this many bytes after the start. They cover minutes of
/// play, and a thousand files add up to 64 MiB.
const REPLAY_BEGINNING_BYTES: usize = 64 << 10;

pub struct ReplayStore {
    settings: Settings,
    files: AtomicU64,
    bytes: AtomicU64,
    policy: Arc<Policy>,
    /// The counters as last logged.
    logged: Mutex<[u64; 3]>,
    /// The clock that determines the age of files.
    clock: AgeClock,
    index: Mutex<ReplayIndex>,
    readers: Arc<ConnectionLimits>,
}

/// The wall clock at the server's start, advanced by a monotonic clock, so that no replay suddenly becomes too old if
/// the wall clock is set forward. If the wall clock is set back, files stamped afterwards would seem too old, so the
/// earlier of the two times counts.
pub struct AgeClock {
    began: Instant,
    wall: SystemTime,
}

impl AgeClock {
    /// Creates a clock that starts with these two times.
    pub fn new(began: Instant, wall: SystemTime) -> AgeClock {
        AgeClock { began, wall }
    }

    /// The time at `now`, when the wall clock reads `wall`.
    pub fn time(&self, now: Instant, wall: SystemTime) -> SystemTime {
        wall.min(self.wall + now.saturating_duration_since(self.began))
    }
}

/// A replay opened for reading.
#[derive(Debug)]
pub struct Readable {
    pub path: PathBuf,
    /// Total length of the replay's complete records, in bytes.
    pub bytes: u64,
    /// Permit to hold while the replay is being read.
    pub permit: Permit,
}

/// The reason why a replay cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// No replay has this name.
    Unknown,
    /// [`limits::REPLAY_READERS_MAX`] replays are already being read, or this address is reading
    /// [`limits::ADDRESS_REPLAY_READERS_MAX`].
    Busy,
}

impl ReplayStore {
    /// Creates the store. The directory is created at the first write.
    pub fn new(settings: Settings) -> ReplayStore {
        let (in_all, of_address) = (limits::REPLAY_READERS_MAX, limits::ADDRESS_REPLAY_READERS_MAX);
        let readers = ConnectionLimits::new(in_all, of_address);
        let cannot =
            "CANNOT RECORD: games go on unrecorded, and a new file is tried after each retry time";
        ReplayStore {
            files: AtomicU64::new(0),
            bytes: AtomicU64::new(0),
            policy: Policy::new(cannot, settings.retry),
            logged: Mutex::default(),
            clock: AgeClock::new(Instant::now(), (settings.wall)()),
            settings,
            index: Mutex::default(),
            readers,
        }
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Counts new files and written bytes.
    pub(super) fn count(&self, files: u64, bytes: u64) {
        self.files.fetch_add(files, Ordering::Relaxed);
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// The policy for write errors.
    pub fn policy(&self) -> &Arc<Policy> {
        &self.policy
    }

    /// Number of files begun, bytes written, and errors.
    pub fn counts(&self) -> [u64; 3] {
        let [files, bytes] =
            [&self.files, &self.bytes].map(|counter| counter.load(Ordering::Relaxed));
        [files, bytes, self.policy.errors()]
    }

    /// The newest replays, newest first, without clips from private rooms.
    pub fn list(&self) -> Vec<ReplayCard> {
        let index = self.lock();
        let listed = index.newest().filter(|entry| !is_unlisted(&entry.name));
        listed.take(limits::REPLAYS_LISTED_MAX).cloned().collect()
    }

    /// Returns whether a replay has this name.
    pub fn knows(&self, name: &str) -> bool {
        self.lock().get(name).is_some()
    }

    /// Opens a replay for reading by a client at this address. Names are only looked up in the list, so that no name
    /// can escape the directory.
    pub fn read(&self, name: &str, address: IpAddr) -> Result<Readable, Refused> {
        let bytes = self.lock().get(name).map(|file| file.entry.bytes).ok_or(Refused::Unknown)?;
        let permit = self.readers.admit(address).ok_or(Refused::Busy)?;
        Ok(Readable { path: self.path(name), bytes, permit })
    }

    /// The path of a replay.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.settings.dir.join(format!("{name}{ENDING}"))
    }

    /// Creates the file for a game, and lists the file as being recorded.
    pub(super) fn create(&self, start: &Start) -> io::Result<(String, Box<dyn Write + Send>)> {
        self.create_as(start, "")
    }

    /// Saves a clip, and returns its name. An unlisted clip can be found only by its name.
    pub(super) fn keep_clip(
        &self,
        start: &Start,
        listed: bool,
        asked_by: Option<IpAddr>,
        bytes: &[u8],
    ) -> io::Result<String> {
        let ending = if listed { CLIP_ENDING } else { UNLISTED_ENDING };
        let (name, mut file) = self.create_as(start, ending)?;
        let count = bytes.len() as u64;
        let written = self.make_room(&name, count).and_then(|()| file.write_all(bytes));
        if let Err(error) = written {
            self.discard(&name);
            return Err(error);
        }
        self.count(1, count);
        let players = PlayerCount::of_beginning(bytes).most;
        let last_tick = Record::last_tick(&bytes[bytes.len().saturating_sub(END_BYTES_MAX)..]);
        self.lock().update(&name, |file| {
            // A clip begins later than the records from which it was cut.
            let start = Start::find(bytes);
            file.first_tick = start.map_or(file.first_tick, |start| start.first_tick);
            file.asked_by = asked_by;
        });
        self.grow(&name, count, last_tick, players);
        self.finish(&name);
        Ok(name)
    }

    fn create_as(
        &self,
        start: &Start,
        ending: &str,
    ) -> io::Result<(String, Box<dyn Write + Send>)> {
        fs::create_dir_all(&self.settings.dir)?;
        self.make_room_for_file()?;
        let plain = name(&start.scene_name, &start.room, start.unix_s) + ending;
        for name in numbered(&plain) {
            match (self.settings.create)(&self.path(&name)) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
                Ok(file) => {
                    let modified = (self.settings.wall)();
                    let entry =
                        ReplayCard { name: name.clone(), recording: true, ..ReplayCard::default() };
                    let mut new = new_file(entry, modified);
                    new.set_start(start);
                    self.lock().insert(new);
                    return Ok((name, file));
                }
            }
        }
        Err(io::Error::other(format!("all names from {plain}{ENDING} on are taken")))
    }

    /// Adds bytes written to a file, along with the last tick in them, if any, and the largest number of players so
    /// far.
    pub(super) fn grow(&self, name: &str, bytes: u64, last_tick: Option<u32>, players: u32) {
        let modified = (self.settings.wall)();
        self.lock().update(name, |file| {
            file.entry.bytes += bytes;
            file.entry.players = players;
            file.modified = modified;
            last_tick.into_iter().for_each(|tick| file.set_last_tick(tick));
        });
    }

    /// Marks a file as finished.
    pub(super) fn finish(&self, name: &str) {
        self.lock().update(name, |file| file.entry.recording = false);
    }

    /// Deletes a file that has no inputs.
    pub(super) fn discard(&self, name: &str) {
        // If the file cannot be deleted, the next scan of the directory finds it.
        let _ = fs::remove_file(self.path(name));
        self.lock().remove(name);
    }

    /// Makes room for another `bytes` in a file, deleting finished replays if necessary.
    pub(super) fn make_room(&self, name: &str, bytes: u64) -> io::Result<()> {
        let max = self.settings.bytes_max;
        let is_full = |index: &ReplayIndex| index.charged_bytes_with(name, bytes) > max;
        if self.delete_until_fits("the directory is full", is_full) {
            return Ok(());
        }
        let max = max >> 20;
        let text = format!("the games being recorded alone take all {max} MB that are allowed");
        Err(io::Error::new(io::ErrorKind::QuotaExceeded, text))
    }

    fn make_room_for_file(&self) -> io::Result<()> {
        let is_full = |index: &ReplayIndex| index.len() >= limits::REPLAY_FILES_MAX;
        if self.delete_until_fits("too many files", is_full) {
            return Ok(());
        }
        let text = format!("{} files, and none can be deleted", limits::REPLAY_FILES_MAX);
        Err(io::Error::new(io::ErrorKind::QuotaExceeded, text))
    }

    /// Deletes finished replays for as long as there are too many. Returns whether that succeeded.
    fn delete_until_fits(&self, reason: &str, is_full: impl Fn(&ReplayIndex) -> bool) -> bool {
        self.delete_while(reason, |index, passed| {
            let next = index.next_to_go(self.settings.bytes_max, passed);
            next.filter(|_| is_full(index)).cloned()
        });
        !is_full(&self.lock())
    }

    /// Scans the directory, and logs the counters if they have changed.
    pub(super) fn look_now(&self) {
        let now = self.clock.time(Instant::now(), (self.settings.wall)());
        if let Err(error) = self.look(now) {
            self.policy.failed(&format!("{}: {error}", self.settings.dir.display()));
        }
        let counts = self.counts();
        let mut logged = self.logged.lock().unwrap_or_else(PoisonError::into_inner);
        if std::mem::replace(&mut *logged, counts) != counts {
            let [files, bytes, errors] = counts;
            info!(files, bytes, errors, "recording");
        }
    }

    /// Rescans the directory, and deletes replays that are too old or exceed the limits.
    pub(super) fn look(&self, now: SystemTime) -> io::Result<()> {
        fs::create_dir_all(&self.settings.dir)?;
        let new = self.scan()?;
        let age = |stamp: &Stamp| now.duration_since(stamp.0).unwrap_or_default();
        self.delete_while("too old", |index, passed| {
            let oldest = index.oldest_finished(passed).cloned();
            oldest.filter(|oldest| age(oldest) > self.settings.age_max)
        });
        let bytes_max = self.settings.bytes_max;
        self.delete_until_fits("the directory is full", |index| index.charged_bytes() > bytes_max);
        self.delete_until_fits("too many files", |index| index.len() > limits::REPLAY_FILES_MAX);
        // This is done last, so that files about to be deleted are not read.
        for name in new.iter().filter(|name| self.knows(name)) {
            if let Some((start, players)) = self.start_of(name) {
                let last_tick = self.last_tick_of(name);
                self.lock().update(name, |file| {
                    file.set_start(&start);
                    file.entry.players = players.most;
                    last_tick.into_iter().for_each(|tick| file.set_last_tick(tick));
                });
            }
        }
        Ok(())
    }

    /// Deletes the finished files that `next` names, until it names no more. `next` receives the files that cannot be
    /// deleted.
    fn delete_while(&self, reason: &str, next: impl Fn(&ReplayIndex, &[Stamp]) -> Option<Stamp>) {
        let mut passed: Vec<Stamp> = Vec::new();
        while passed.len() < REPLAY_UNDELETABLE_MAX {
            let Some(next) = next(&self.lock(), &passed) else { return };
            if !self.delete(&next.1, reason) {
                passed.push(next);
            }
        }
    }

    /// Deletes a file. Returns whether it is gone.
    fn delete(&self, name: &str, reason: &str) -> bool {
        let file = self.path(name);
        match fs::remove_file(&file) {
            Ok(()) => info!(file = %file.display(), reason, "replay deleted"),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => {
                self.policy.count();
                warn!(file = %file.display(), reason, %error, "cannot delete a replay");
                return false;
            }
        }
        self.lock().remove(name);
        true
    }

    /// Adds files that have appeared in the directory, and returns their names. Drops files that have disappeared.
    fn scan(&self) -> io::Result<Vec<String>> {
        let found = self.found()?;
        let mut index = self.lock();
        let is_gone = |name: &&String| {
            !found.contains_key(*name) && index.get(name).is_some_and(|file| !file.entry.recording)
        };
        let gone: Vec<_> = index.names().filter(is_gone).cloned().collect();
        for name in gone {
            index.remove(&name);
        }
        let mut new = Vec::new();
        for (name, (bytes, modified)) in found {
            match index.get(&name) {
                Some(file) if file.entry.recording => {}
                Some(_) => {
                    index.update(&name, |file| {
                        (file.entry.bytes, file.modified) = (bytes, modified)
                    });
                }
                None => {
                    let entry = ReplayCard { name: name.clone(), bytes, ..ReplayCard::default() };
                    index.insert(new_file(entry, modified));
                    new.push(name);
                }
            }
        }
        Ok(new)
    }

    /// The length and time of each replay in the directory.
    fn found(&self) -> io::Result<BTreeMap<String, (u64, SystemTime)>> {
        let mut found = BTreeMap::new();
        for entry in fs::read_dir(&self.settings.dir)? {
            let entry = entry?;
            let file_name = entry.file_name();
            let name = file_name.to_str().and_then(|name| name.strip_suffix(ENDING));
            let Some(name) = name.filter(|name| is_name(name)) else { continue };
            // Directories and links are not replays recorded by this server.
            if let Ok(metadata) = entry.metadata()
                && metadata.is_file()
            {
                let modified = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                found.insert(name.to_owned(), (metadata.len(), modified));
            }
        }
        Ok(found)
    }

    /// A file's start record, and the players near its start; players who join later are not counted.
    fn start_of(&self, name: &str) -> Option<(Start, PlayerCount)> {
        let mut bytes = Vec::new();
        let file = open_regular(&self.path(name)).ok()?;
        let looked_at = (START_BYTES_MAX + REPLAY_BEGINNING_BYTES) as u64;
        file.take(looked_at).read_to_end(&mut bytes).ok()?;
        Some((Start::find(&bytes).ok()?, PlayerCount::of_beginning(&bytes)))
    }

    fn last_tick_of(&self, name: &str) -> Option<u32> {
        let mut file = open_regular(&self.path(name)).ok()?;
        let bytes = file.metadata().ok()?.len();
        file.seek(SeekFrom::Start(bytes.saturating_sub(END_BYTES_MAX as u64))).ok()?;
        let mut tail = Vec::new();
        file.take(END_BYTES_MAX as u64).read_to_end(&mut tail).ok()?;
        Record::last_tick(&tail)
    }

    fn lock(&self) -> MutexGuard<'_, ReplayIndex> {
        self.index.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A new file about which nothing but the directory's information is known.
fn new_file(entry: ReplayCard, modified: SystemTime) -> IndexedFile {
    IndexedFile { entry, is_readable: false, modified, first_tick: 0, asked_by: None }
}
