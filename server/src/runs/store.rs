//! The run directory, and the queue in which replays are verified.

use super::best_runs::{BestRuns, Record, RunFileChange};
use super::proof::{NoRun, prove};
use crate::files::read_regular;
use crate::host::thread_time;
use crate::limits;
use crate::limits::connection_limits::ConnectionLimits;
use crate::limits::trial_queue::{QueuePlace, TrialQueue};
use crate::log::{Readable, write_closed};
use jostle_game::Scene;
use jostle_room::{Measure, Run};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};
use tracing::{error, info, warn};

/// Maximum number of runs from one address that are being checked or waiting to be.
const ADDRESS_RUN_TRIALS_MAX: usize = 2;

/// Ending of run files.
const ENDING: &str = "jostle";
/// Ending of a file that is no longer valid but is kept for diagnosis.
const DAMAGED: &str = "damaged";
/// Ending of a displaced run's file, after the time of displacement in seconds since 1970.
const DISPLACED: &str = "displaced";
/// Ending of a file that an operator removed. Its run is not accepted again.
const REMOVED: &str = "removed";
/// Ending of a file that is still being written.
const NEW: &str = "new";

/// A server's stored runs.
pub struct Records {
    dir: PathBuf,
    scenes: Vec<Arc<Scene>>,
    /// Processor time allowed for each replay.
    most: Duration,
    /// Best runs by scene name.
    tables: Mutex<BTreeMap<String, BestRuns>>,
    /// Held while files are written, so that none is entered twice, and while incomplete files are deleted.
    files: Mutex<()>,
    trials: Arc<TrialQueue>,
    readers: Arc<ConnectionLimits>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entered {
    pub run: Run,
    /// Name of the run's file.
    pub name: String,
    /// The run's rank, starting at 1; `None` if it is not among the best.
    pub rank: Option<usize>,
}

impl Records {
    /// Opens the runs of these scenes. The directory is created with the first run, so that a failing disk costs no
    /// game.
    pub fn open(dir: PathBuf, scenes: &[Scene], most: Duration) -> Arc<Records> {
        Arc::new(Records {
            dir,
            scenes: scenes.iter().cloned().map(Arc::new).collect(),
            most,
            tables: Mutex::default(),
            files: Mutex::default(),
            trials: TrialQueue::new(limits::RUN_TRIALS_MAX, ADDRESS_RUN_TRIALS_MAX),
            readers: ConnectionLimits::new(
                limits::REPLAY_READERS_MAX,
                limits::ADDRESS_REPLAY_READERS_MAX,
            ),
        })
    }

    /// Starts verifying the directory's files again, on a separate thread.
    pub fn reload(self: &Arc<Records>) -> io::Result<JoinHandle<()>> {
        let records = Arc::clone(self);
        std::thread::Builder::new().name("records".to_owned()).spawn(move || {
            thread_time::go_after_others(limits::GUEST_NICENESS);
            if let Err(error) = records.reload_here() {
                warn!(dir = %records.dir.display(), %error, "cannot read the records");
            }
        })
    }

    fn reload_here(&self) -> io::Result<()> {
        let (mut kept, mut others) = (0, 0);
        for path in self.files(lock(&self.files))? {
            match self.read_again(&path) {
                Ok(()) => kept += 1,
                Err(reason) if reason.is_of_other_scene() => others += 1,
                Err(reason) if reason.may_pass() => {
                    warn!(file = %path.display(), %reason, "a record is not counted this time");
                }
                Err(reason) => self.set_aside(&path, &reason),
            }
        }
        if kept + others > 0 {
            info!(kept, of_other_scenes = others, "records played again");
        }
        Ok(())
    }

    /// Run files, with those of displaced runs last. Incomplete files are deleted; no file is being written while
    /// `held` is locked.
    fn files(&self, held: MutexGuard<'_, ()>) -> io::Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        let entries = match fs::read_dir(&self.dir) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(files),
            entries => entries?,
        };
        for entry in entries {
            let path = entry?.path();
            match path.extension().and_then(|ending| ending.to_str()) {
                Some(ENDING | DISPLACED) if path.is_file() => files.push(path),
                Some(NEW) => drop(fs::remove_file(&path)),
                _ => {}
            }
        }
        files.sort_by_key(|path| (displaced_s(path), path.clone()));
        files.truncate(limits::RECORD_FILES_MAX * self.scenes.len());
        drop(held);
        Ok(files)
    }

    fn read_again(&self, path: &Path) -> Result<(), NoRun> {
        let length = fs::metadata(path).map_or(0, |metadata| metadata.len() as usize);
        if length > limits::RUN_BYTES_MAX {
            return Err(NoRun::TooLong(length));
        }
        let bytes = read_regular(path, limits::RUN_BYTES_MAX);
        let bytes = bytes.map_err(|error| NoRun::File(error.to_string()))?;
        let modified = fs::metadata(path).and_then(|metadata| metadata.modified());
        let (scene, run) = prove(bytes.clone(), &self.scenes, self.most, || true)?;
        let came = modified.unwrap_or(SystemTime::UNIX_EPOCH);
        let record =
            Record { displaced_s: displaced_s(path), ..record(scene, run, came, bytes.len()) };
        let right = match record.displaced_s {
            None => self.path(&record.name),
            Some(at_s) => self.displaced_path(&record.name, at_s),
        };
        let _files = lock(&self.files);
        if path != right && fs::rename(path, &right).is_err() {
            return Ok(());
        }
        self.enter(&scene.name, record);
        Ok(())
    }

    fn set_aside(&self, path: &Path, reason: &NoRun) {
        let aside = path.with_extension(DAMAGED);
        let moved = fs::rename(path, &aside);
        let file = path.display();
        match moved {
            Ok(()) => warn!(%file, aside = %aside.display(), %reason, "a record is set aside"),
            Err(error) => warn!(%file, %reason, %error, "a record cannot be set aside"),
        }
    }

    /// Plays a replay from a client at this address, and enters its run if that is among the best, even if the request
    /// is gone. `None` if too many replays are waiting. The outer error is a server error.
    pub async fn submit(
        self: &Arc<Records>,
        bytes: Vec<u8>,
        address: IpAddr,
    ) -> io::Result<Option<Result<Entered, NoRun>>> {
        let records = Arc::clone(self);
        let played =
            self.trials.run(address, "record", move |place| records.submit_here(bytes, place));
        played.await?.transpose()
    }

    fn submit_here(
        &self,
        bytes: Vec<u8>,
        place: &QueuePlace,
    ) -> io::Result<Result<Entered, NoRun>> {
        let proven = prove(bytes.clone(), &self.scenes, self.most, || place.pass());
        let (scene, run) = match proven {
            Ok(proven) => proven,
            Err(reason) => return Ok(Err(reason)),
        };
        let record = record(scene, run.clone(), SystemTime::now(), bytes.len());
        let name = record.name.clone();
        let path = self.path(&name);
        let _files = lock(&self.files);
        if path.with_extension(REMOVED).exists() {
            return Ok(Err(NoRun::Removed));
        }
        // A file that has not been verified since the server started is never overwritten, because it may belong to
        // another run.
        if self.table(&scene.name).takes(&record) && !path.exists() {
            let made = fs::create_dir_all(&self.dir);
            if let Err(error) = made.and_then(|()| write_closed(&path, &bytes)) {
                error!(file = %path.display(), %error, "CANNOT KEEP A RECORD");
                return Err(error);
            }
            self.enter(&scene.name, record);
        }
        let rank = self.table(&scene.name).rank(&name);
        Ok(Ok(Entered { run, name, rank }))
    }

    /// Enters a run whose file has already been written.
    fn enter(&self, scene: &str, record: Record) {
        let moved = lock(&self.tables).entry(scene.to_owned()).or_default().enter(record, unix_s());
        self.move_files(&moved);
    }

    /// Permanently removes one of the best runs, and returns the names of those that are among the best again; `None`
    /// if no run has this name. This function blocks.
    pub fn remove(&self, name: &str) -> io::Result<Option<Vec<String>>> {
        let _files = lock(&self.files);
        let has_it = |runs: &BestRuns| runs.rank(name).is_some();
        if !lock(&self.tables).values().any(has_it) {
            return Ok(None);
        }
        let path = self.path(name);
        fs::rename(&path, path.with_extension(REMOVED))?;
        let mut tables = lock(&self.tables);
        let runs = tables.values_mut().find(|runs| has_it(runs));
        let moved = runs.map_or_else(Vec::new, |runs| runs.remove(name, unix_s()));
        drop(tables);
        self.move_files(&moved);
        let back = moved.into_iter().filter_map(|moved| match moved {
            RunFileChange::Listed(name, _) => Some(name),
            RunFileChange::Displaced(..) | RunFileChange::Gone(..) => None,
        });
        Ok(Some(back.collect()))
    }

    /// Renames or deletes run files to match the table.
    fn move_files(&self, moved: &[RunFileChange]) {
        for moved in moved {
            let done = match moved {
                RunFileChange::Displaced(name, at_s) => {
                    fs::rename(self.path(name), self.displaced_path(name, *at_s))
                }
                RunFileChange::Listed(name, at_s) => {
                    fs::rename(self.displaced_path(name, *at_s), self.path(name))
                }
                RunFileChange::Gone(name, at_s) => {
                    fs::remove_file(self.displaced_path(name, *at_s))
                }
            };
            if let Err(error) = done {
                warn!(?moved, %error, "the file of a record cannot follow it");
            }
        }
    }

    /// Scenes whose runs are compared, with their measures and best runs.
    pub fn tables(&self) -> Vec<(Arc<Scene>, Measure, BestRuns)> {
        let compared = |scene: &Arc<Scene>| {
            Some((Arc::clone(scene), Measure::of(scene)?, self.table(&scene.name)))
        };
        self.scenes.iter().filter_map(compared).collect()
    }

    fn table(&self, scene: &str) -> BestRuns {
        lock(&self.tables).get(scene).cloned().unwrap_or_default()
    }

    /// Opens a run's file for a client at this address. Returns `Ok(None)` if no run has this name, and an error if too
    /// many are being read. Names are only looked up, so that no name can escape the directory.
    pub fn read(&self, name: &str, address: IpAddr) -> Result<Option<Readable>, Busy> {
        let tables = lock(&self.tables);
        let mut all = tables.values().flat_map(BestRuns::list);
        let Some(record) = all.find(|record| record.name == name) else { return Ok(None) };
        let permit = self.readers.admit(address).ok_or(Busy)?;
        Ok(Some(Readable { path: self.path(name), bytes: record.bytes, permit }))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.join(format!("{name}.{ENDING}"))
    }

    fn displaced_path(&self, name: &str, at_s: u64) -> PathBuf {
        self.dir.join(format!("{name}.{at_s}.{DISPLACED}"))
    }
}

/// Too many runs are being read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Busy;

fn record(scene: &Scene, run: Run, came: SystemTime, bytes: usize) -> Record {
    let name = format!("{}-{:016x}", scene.name, run.hash);
    Record { name, run, unix_s: seconds(came), bytes: bytes as u64, displaced_s: None }
}

/// Time when the run in this file was displaced, taken from the file's name.
fn displaced_s(path: &Path) -> Option<u64> {
    let stem = path.file_name()?.to_str()?.strip_suffix(DISPLACED)?.strip_suffix('.')?;
    Some(stem.rsplit_once('.').and_then(|(_, at_s)| at_s.parse().ok()).unwrap_or_default())
}

fn unix_s() -> u64 {
    seconds(SystemTime::now())
}

fn seconds(time: SystemTime) -> u64 {
    time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs()
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
