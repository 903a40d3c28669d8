//! Simulates a power cut: the rooms' files are truncated within the data that had not been synced to disk.
#![cfg(unix)]

use jostle_server::limits::STATE_SYNC_EVERY;
use jostle_sim::{Rng, TICKS_PER_SECOND};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval at which the files are polled.
const LOOK_EVERY: Duration = Duration::from_millis(10);
/// Maximum time between consecutive blocks of ticks in a room's file, unless the machine is busy.
const BLOCK: Duration = Duration::from_millis(600);

/// Lengths of the rooms' files by path and inode, so that a replacement counts as a different file. Each length comes
/// with the earliest time at which the file may have had it, which is the time of the previous poll.
type Lengths = BTreeMap<(PathBuf, u64), Vec<(Instant, u64)>>;

/// Watches how the rooms' files grow.
pub struct Watch {
    rooms: PathBuf,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Lengths>,
}

/// How the files grew, as recorded.
pub struct Growth {
    rooms: PathBuf,
    lengths: Lengths,
}

impl Watch {
    /// Starts watching the files in a state directory.
    pub fn start(state: &Path) -> Watch {
        let (rooms, stop) = (state.join("rooms"), Arc::new(AtomicBool::new(false)));
        let (watched, ended) = (rooms.clone(), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut lengths = Lengths::new();
            let mut looked = Instant::now();
            while !ended.load(Ordering::Relaxed) {
                let before = std::mem::replace(&mut looked, Instant::now());
                for (path, inode, length) in files(&watched) {
                    let seen = lengths.entry((path, inode)).or_default();
                    if seen.last().is_none_or(|&(_, known)| known != length) {
                        seen.push((before, length));
                    }
                }
                std::thread::sleep(LOOK_EVERY);
            }
            lengths
        });
        Watch { rooms, stop, thread }
    }

    pub fn end(self) -> Growth {
        self.stop.store(true, Ordering::Relaxed);
        let lengths = self.thread.join().expect("a watch that ends well");
        Growth { rooms: self.rooms, lengths }
    }
}

impl Growth {
    /// Truncates each file at a random position within the bytes written since the last sync, which may not have
    /// reached the disk at that moment. A file is always synced before it gets its name.
    pub fn cut_power(&self, killed: Instant, rng: &mut Rng) {
        for (path, inode, length) in files(&self.rooms) {
            let Some(seen) = self.lengths.get(&(path.clone(), inode)) else { continue };
            let synced = synced(seen, killed);
            let kept = synced
                + u64::from(rng.below(u32::try_from(length - synced).expect("a short tail") + 1));
            let file = File::options().write(true).open(&path).expect("a file");
            file.set_len(kept).expect("a shorter file");
            println!("{}: {synced} bytes synced, {kept} of {length} kept", path.display());
        }
    }

    /// The largest delay of the latest writes to any file, in ticks, in excess of the delay on an idle machine.
    pub fn lateness(&self, killed: Instant) -> u32 {
        let seen = files(&self.rooms).into_iter();
        let seen = seen.filter_map(|(path, inode, _)| self.lengths.get(&(path, inode)));
        seen.map(|seen| lateness(seen, killed)).max().unwrap_or_default()
    }
}

/// The length of a file at the last sync before the power cut, assuming the longest allowed time since that sync.
fn synced(seen: &[(Instant, u64)], killed: Instant) -> u64 {
    let synced_at =
        killed.checked_sub(STATE_SYNC_EVERY).expect("a machine that is up for a second");
    let after = seen.partition_point(|&(at, _)| at <= synced_at);
    seen[after.saturating_sub(1)].1
}

/// The delay, in ticks, of the last writes before a given moment.
fn lateness(seen: &[(Instant, u64)], killed: Instant) -> u32 {
    let last = seen.iter().rev().take(3).map(|&(at, _)| at);
    let moments: Vec<Instant> = std::iter::once(killed).chain(last).collect();
    let longest = moments.windows(2).map(|pair| pair[0].saturating_duration_since(pair[1])).max();
    let late = longest.unwrap_or_default().saturating_sub(BLOCK);
    (late.as_secs_f64() * f64::from(TICKS_PER_SECOND)).ceil() as u32
}

/// The rooms' files, with their inodes and lengths.
fn files(rooms: &Path) -> Vec<(PathBuf, u64, u64)> {
    let entries = fs::read_dir(rooms).expect("a directory").flatten();
    let rooms = entries.map(|entry| entry.path());
    let rooms = rooms.filter(|path| path.extension().is_some_and(|ending| ending == "jostle"));
    // A file may be replaced at any time.
    let file = |path: PathBuf| {
        let data = fs::metadata(&path).ok()?;
        Some((path, data.ino(), data.len()))
    };
    rooms.filter_map(file).collect()
}
