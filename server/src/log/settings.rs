//! Settings for recording.

use crate::limits;
use jostle_sim::TICKS_PER_SECOND;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Maximum number of ticks in one file: an hour's worth. After that, a new file starts in the middle of the game.
const REPLAY_FILE_TICKS_MAX: u32 = 60 * 60 * TICKS_PER_SECOND;
/// Interval at which the directory is scanned, and minimum time between log lines with counters.
const REPLAY_LOOK_EVERY: Duration = Duration::from_secs(60);

/// Creates a new file; fails if the file exists.
pub type Create = fn(&Path) -> io::Result<Box<dyn Write + Send>>;

#[derive(Clone, Debug)]
pub struct Settings {
    /// The directory, which is created if it is missing.
    pub dir: PathBuf,
    /// Maximum total size of the replays in the directory, bytes. Each file counts as at least
    /// [`limits::REPLAY_FILE_CHARGE_MIN`]. The oldest files are deleted first.
    pub bytes_max: u64,
    /// Age after which a replay is deleted.
    pub age_max: Duration,
    /// [`REPLAY_FILE_TICKS_MAX`]; tests shorten it.
    pub file_ticks_max: u32,
    /// [`limits::REPLAY_RETRY`]; tests shorten it.
    pub retry: Duration,
    /// [`REPLAY_LOOK_EVERY`]; tests shorten it.
    pub look_every: Duration,
    /// Creates files. Tests replace it with a function that fails.
    pub create: Create,
    /// The wall clock. Tests replace it with one that they can set.
    pub wall: fn() -> SystemTime,
}

impl Settings {
    /// The usual limits for a directory.
    pub fn new(dir: PathBuf) -> Settings {
        Settings {
            dir,
            bytes_max: u64::from(limits::REPLAYS_MB) << 20,
            age_max: days(limits::REPLAYS_DAYS),
            file_ticks_max: REPLAY_FILE_TICKS_MAX,
            retry: limits::REPLAY_RETRY,
            look_every: REPLAY_LOOK_EVERY,
            create: create_file,
            wall: SystemTime::now,
        }
    }
}

/// A duration of this many days.
pub fn days(count: u32) -> Duration {
    Duration::from_secs(u64::from(count) * 24 * 60 * 60)
}

/// Unbuffered, so that everything written survives even if the process is killed.
fn create_file(path: &Path) -> io::Result<Box<dyn Write + Send>> {
    Ok(Box::new(File::options().write(true).create_new(true).open(path)?))
}
