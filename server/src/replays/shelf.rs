//! The directory of replays: what is in it, which files are still written, and which have to go.
//! Files that are not named as replays are never touched.

use super::name::{ENDING, is_name, name, numbered};
use super::{Counters, Settings};
use crate::limits;
use jostle_protocol::replay::{START_BYTES_MAX, Start};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tracing::{info, warn};

/// What others may know about a replay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its name, without the ending.
    pub name: String,
    /// Name of the scene.
    pub scene: String,
    /// Code of the room.
    pub room: String,
    /// When it began, seconds since 1970; 0 if unknown.
    pub unix_s: u64,
    /// Length of the file, whole records alone.
    pub bytes: u64,
    /// Whether it is still written.
    pub recording: bool,
}

/// A file of the directory.
struct Held {
    /// What it begins with; `None` if that cannot be read.
    start: Option<Facts>,
    bytes: u64,
    recording: bool,
    /// When it was written last.
    modified: SystemTime,
}

#[derive(Clone)]
struct Facts {
    scene: String,
    room: String,
    unix_s: u64,
}

impl Facts {
    fn of(start: &Start) -> Facts {
        let Start { scene_name, room, unix_s, .. } = start;
        Facts { scene: scene_name.clone(), room: room.clone(), unix_s: *unix_s }
    }
}

/// The replays of a server.
pub struct Shelf {
    settings: Settings,
    counters: Counters,
    /// By name.
    files: Mutex<BTreeMap<String, Held>>,
    readers: Arc<Semaphore>,
}

/// A replay that somebody may read.
#[derive(Debug)]
pub struct Readable {
    /// Where it is.
    pub path: PathBuf,
    /// How much of it is written whole.
    pub bytes: u64,
    /// Kept while it is read.
    pub permit: OwnedSemaphorePermit,
}

/// Why a replay cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// There is none of that name.
    Unknown,
    /// [`limits::REPLAY_READERS_MAX`] are being read.
    Busy,
}

impl Shelf {
    pub(super) fn new(settings: Settings) -> Shelf {
        let readers = Arc::new(Semaphore::new(limits::REPLAY_READERS_MAX));
        Shelf { settings, counters: Counters::default(), files: Mutex::default(), readers }
    }

    /// Where, and how many.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What happened so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The newest replays, newest first.
    pub fn list(&self) -> Vec<Entry> {
        let files = self.lock();
        let entry = |(name, held): (&String, &Held)| {
            let Facts { scene, room, unix_s } = held.start.clone()?;
            let (name, bytes, recording) = (name.clone(), held.bytes, held.recording);
            Some(Entry { name, scene, room, unix_s, bytes, recording })
        };
        let mut entries: Vec<_> = files.iter().filter_map(entry).collect();
        drop(files);
        entries.sort_by(|a, b| (b.unix_s, &b.name).cmp(&(a.unix_s, &a.name)));
        entries.truncate(limits::REPLAYS_LISTED_MAX);
        entries
    }

    /// Whether there is a replay of this name.
    pub fn knows(&self, name: &str) -> bool {
        self.lock().contains_key(name)
    }

    /// A replay to read. Names are only looked up, so no name leads anywhere else.
    pub fn read(&self, name: &str) -> Result<Readable, Refused> {
        let bytes = self.lock().get(name).map(|held| held.bytes).ok_or(Refused::Unknown)?;
        let permit = Arc::clone(&self.readers).try_acquire_owned().map_err(|_| Refused::Busy)?;
        Ok(Readable { path: self.path(name), bytes, permit })
    }

    /// Where a replay of this name is.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.settings.dir.join(format!("{name}{ENDING}"))
    }

    /// Makes the file for a game, and lists it as one that is written.
    pub(super) fn create(&self, start: &Start) -> io::Result<(String, Box<dyn Write + Send>)> {
        fs::create_dir_all(&self.settings.dir)?;
        let plain = name(&start.scene_name, &start.room, start.unix_s);
        for name in numbered(&plain) {
            match (self.settings.create)(&self.path(&name)) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
                Ok(file) => {
                    let modified = (self.settings.wall)();
                    let start = Some(Facts::of(start));
                    let held = Held { start, bytes: 0, recording: true, modified };
                    self.lock().insert(name.clone(), held);
                    return Ok((name, file));
                }
            }
        }
        Err(io::Error::other(format!("all names from {plain}{ENDING} on are taken")))
    }

    /// Files bytes that were written.
    pub(super) fn grow(&self, name: &str, bytes: u64) {
        if let Some(held) = self.lock().get_mut(name) {
            held.bytes += bytes;
            held.modified = (self.settings.wall)();
        }
    }

    /// A file is no longer written.
    pub(super) fn finish(&self, name: &str) {
        if let Some(held) = self.lock().get_mut(name) {
            held.recording = false;
        }
    }

    /// Deletes a file that holds no game, and whatever is left of it.
    pub(super) fn discard(&self, name: &str) {
        // If it cannot be deleted either, the next look at the directory finds it.
        let _ = fs::remove_file(self.path(name));
        self.lock().remove(name);
    }

    /// Makes room for some bytes: deletes the oldest finished replays if it has to.
    pub(super) fn make_room(&self, bytes: u64) -> io::Result<()> {
        if self.total() + bytes > self.settings.bytes_max {
            self.delete_while("the directory is full", |shelf, _| {
                shelf.total() + bytes > shelf.settings.bytes_max
            });
        }
        if self.total() + bytes > self.settings.bytes_max {
            let max = self.settings.bytes_max >> 20;
            let text = format!("the games of this moment alone take all {max} MB that are allowed");
            return Err(io::Error::new(io::ErrorKind::QuotaExceeded, text));
        }
        Ok(())
    }

    /// Looks at the directory again, and deletes what is too old or too much.
    pub(super) fn look(&self, now: SystemTime) -> io::Result<()> {
        fs::create_dir_all(&self.settings.dir)?;
        self.scan()?;
        self.delete_while("too old", |shelf, oldest| {
            let age = now.duration_since(oldest).unwrap_or_default();
            age > shelf.settings.age_max
        });
        self.delete_while("the directory is full", |shelf, _| {
            shelf.total() > shelf.settings.bytes_max
        });
        Ok(())
    }

    /// Bytes of all files.
    fn total(&self) -> u64 {
        self.lock().values().map(|held| held.bytes).sum()
    }

    /// Deletes finished files, the one that was written longest ago first, as long as `is_wrong`.
    fn delete_while(&self, reason: &str, is_wrong: impl Fn(&Shelf, SystemTime) -> bool) {
        let finished: Vec<_> = {
            let files = self.lock();
            let finished = files.iter().filter(|(_, held)| !held.recording);
            finished.map(|(name, held)| (held.modified, name.clone())).collect()
        };
        let mut finished = finished;
        finished.sort();
        for (modified, name) in finished {
            if !is_wrong(self, modified) {
                return;
            }
            let file = self.path(&name);
            match fs::remove_file(&file) {
                Ok(()) => info!(file = %file.display(), reason, "replay deleted"),
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => {
                    self.counters.errors.fetch_add(1, Ordering::Relaxed);
                    warn!(file = %file.display(), reason, %error, "cannot delete a replay");
                    continue;
                }
            }
            self.lock().remove(&name);
        }
    }

    /// Takes up what others put into the directory, and forgets what they took away.
    fn scan(&self) -> io::Result<()> {
        let mut found = BTreeMap::new();
        for entry in fs::read_dir(&self.settings.dir)? {
            let entry = entry?;
            let file_name = entry.file_name();
            let name = file_name.to_str().and_then(|name| name.strip_suffix(ENDING));
            let Some(name) = name.filter(|name| is_name(name)) else { continue };
            // Neither directories nor links: what they lead to is not ours.
            if let Ok(facts) = entry.metadata()
                && facts.is_file()
            {
                let modified = facts.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                found.insert(name.to_owned(), (facts.len(), modified));
            }
        }
        let known: Vec<_> = self.lock().keys().cloned().collect();
        let news = found.keys().filter(|name| known.binary_search(name).is_err());
        let news: Vec<_> = news.map(|name| (name.clone(), self.start_of(name))).collect();
        let mut files = self.lock();
        for (name, start) in news {
            let held = Held { start, bytes: 0, recording: false, modified: SystemTime::UNIX_EPOCH };
            files.entry(name).or_insert(held);
        }
        files.retain(|name, held| held.recording || found.contains_key(name));
        for (name, held) in files.iter_mut().filter(|(_, held)| !held.recording) {
            (held.bytes, held.modified) = found[name];
        }
        Ok(())
    }

    fn start_of(&self, name: &str) -> Option<Facts> {
        let mut bytes = Vec::new();
        let file = File::open(self.path(name)).ok()?;
        file.take(START_BYTES_MAX as u64).read_to_end(&mut bytes).ok()?;
        Start::find(&bytes).ok().map(|start| Facts::of(&start))
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Held>> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
