//! The index of the replay directory, ordered so that recording, deleting and listing touch only a few files, no matter
//! how many there are.

use super::name::is_clip;
use crate::limits::{CLIPS_SHARE, REPLAY_FILE_CHARGE_MIN, REPLAY_FILES_MAX};
use jostle_protocol::replay::Start;
use jostle_protocol::web::ReplayCard;
use jostle_sim::TICKS_PER_SECOND;
use std::collections::{BTreeMap, BTreeSet};
use std::net::IpAddr;
use std::time::SystemTime;

/// The directory's files by name, with a running total and two orders by time.
#[derive(Debug, Default)]
pub struct ReplayIndex {
    files: BTreeMap<String, IndexedFile>,
    /// Finished files, least recently written first.
    finished: BTreeSet<Stamp>,
    /// The clips among these, by the network that asked for them; `None` if the network is no longer known.
    clips: BTreeMap<Option<IpAddr>, BTreeSet<Stamp>>,
    /// Number of clips, and the sum of their [`charge`].
    clips_held: (usize, u64),
    /// Readable files by start time in seconds.
    begun: BTreeSet<(u64, String)>,
    /// Sum of [`charge`] over all files.
    charged_bytes: u64,
}

/// The time of the last write to a file, and the file's name.
pub type Stamp = (SystemTime, String);

/// A file in the directory.
#[derive(Clone, Debug)]
pub struct IndexedFile {
    /// The file as shown in lists.
    pub entry: ReplayCard,
    /// Whether the file's start can be read; if not, the file is not listed.
    pub is_readable: bool,
    /// Time of the last write.
    pub modified: SystemTime,
    /// Number of ticks played before the first recorded one.
    pub first_tick: u32,
    /// The network that asked for a clip, if known.
    pub asked_by: Option<IpAddr>,
}

impl IndexedFile {
    /// Sets the listed fields that come from the file's start record.
    pub fn set_start(&mut self, start: &Start) {
        self.entry.scene.clone_from(&start.scene_name);
        self.entry.room.clone_from(&start.room);
        self.entry.unix_s = start.unix_s;
        self.first_tick = start.first_tick;
        self.is_readable = true;
    }

    /// Sets the listed length, for a game that has reached this tick.
    pub fn set_last_tick(&mut self, tick: u32) {
        let ticks = tick.saturating_sub(self.first_tick);
        self.entry.seconds = Some(ticks.div_ceil(TICKS_PER_SECOND));
    }
}

/// Number of bytes that a file of this length counts towards the directory's limit.
fn charge(bytes: u64) -> u64 {
    bytes.max(REPLAY_FILE_CHARGE_MIN)
}

impl ReplayIndex {
    /// Adds a file, or replaces the existing one with the same name.
    pub fn insert(&mut self, file: IndexedFile) {
        let name = file.entry.name.clone();
        self.remove(&name);
        self.charged_bytes += charge(file.entry.bytes);
        if !file.entry.recording {
            self.finished.insert((file.modified, name.clone()));
            if is_clip(&name) {
                let clips = self.clips.entry(file.asked_by).or_default();
                clips.insert((file.modified, name.clone()));
                self.clips_held.0 += 1;
                self.clips_held.1 += charge(file.entry.bytes);
            }
        }
        if file.is_readable {
            self.begun.insert((file.entry.unix_s, name.clone()));
        }
        self.files.insert(name, file);
    }

    pub fn remove(&mut self, name: &str) -> Option<IndexedFile> {
        let (name, file) = self.files.remove_entry(name)?;
        self.charged_bytes -= charge(file.entry.bytes);
        self.begun.remove(&(file.entry.unix_s, name.clone()));
        let stamp = (file.modified, name);
        self.finished.remove(&stamp);
        if let Some(clips) = self.clips.get_mut(&file.asked_by)
            && clips.remove(&stamp)
        {
            self.clips_held.0 -= 1;
            self.clips_held.1 -= charge(file.entry.bytes);
            if clips.is_empty() {
                self.clips.remove(&file.asked_by);
            }
        }
        Some(file)
    }

    /// Changes the file with this name, if it exists.
    pub fn update(&mut self, name: &str, change: impl FnOnce(&mut IndexedFile)) {
        if let Some(mut file) = self.remove(name) {
            change(&mut file);
            self.insert(file);
        }
    }

    /// The file with this name.
    pub fn get(&self, name: &str) -> Option<&IndexedFile> {
        self.files.get(name)
    }

    /// All names, in order.
    pub fn names(&self) -> impl Iterator<Item = &String> {
        self.files.keys()
    }

    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Total bytes counted for all files.
    pub fn charged_bytes(&self) -> u64 {
        self.charged_bytes
    }

    /// The total if `bytes` more were appended to a file, which need not exist yet.
    pub fn charged_bytes_with(&self, name: &str, bytes: u64) -> u64 {
        match self.get(name) {
            Some(file) => {
                self.charged_bytes - charge(file.entry.bytes) + charge(file.entry.bytes + bytes)
            }
            None => self.charged_bytes + charge(bytes),
        }
    }

    /// The least recently written finished file that is not in `passed`.
    pub fn oldest_finished(&self, passed: &[Stamp]) -> Option<&Stamp> {
        self.finished.iter().find(|stamp| !passed.contains(stamp))
    }

    /// The next finished file to delete that is not in `passed`, in a directory limited to `bytes_max`. If clips exceed
    /// their share, it is the oldest clip from the network that has the most; otherwise it is the oldest file.
    pub fn next_to_go(&self, bytes_max: u64, passed: &[Stamp]) -> Option<&Stamp> {
        let (files, bytes) = self.clips_held;
        let too_many =
            files > REPLAY_FILES_MAX / CLIPS_SHARE || bytes > bytes_max / CLIPS_SHARE as u64;
        let most = self.clips.values().max_by_key(|clips| clips.len()).filter(|_| too_many);
        let clip = most.and_then(|clips| clips.iter().find(|stamp| !passed.contains(stamp)));
        clip.or_else(|| self.oldest_finished(passed))
    }

    /// Readable files, newest first.
    pub fn newest(&self) -> impl Iterator<Item = &ReplayCard> {
        self.begun.iter().rev().filter_map(|(_, name)| Some(&self.files.get(name)?.entry))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::{REPLAY_FILES_MAX, REPLAYS_LISTED_MAX};
    use rustix::time::{ClockId, clock_gettime};
    use std::time::{Duration, UNIX_EPOCH};

    fn file(name: &str, at_s: u64, bytes: u64, recording: bool) -> IndexedFile {
        let (name, modified) = (name.to_owned(), UNIX_EPOCH + Duration::from_secs(at_s));
        let entry = ReplayCard { name, unix_s: at_s, bytes, recording, ..ReplayCard::default() };
        IndexedFile { entry, is_readable: true, modified, first_tick: 0, asked_by: None }
    }

    fn filled(count: usize) -> ReplayIndex {
        let mut index = ReplayIndex::default();
        for at in 0..count as u64 {
            index.insert(file(&format!("old-{at}"), at, 2000 + 5000 * (at % 2), false));
        }
        index
    }

    #[test]
    fn the_total_and_both_orders_follow_every_change() {
        let mut index = filled(100);
        assert_eq!((index.len(), index.charged_bytes()), (100, 50 * (4096 + 7000)));
        index.insert(file("new", 200, 0, true));
        assert_eq!(index.charged_bytes_with("new", 4096), index.charged_bytes());
        assert_eq!(index.charged_bytes_with("new", 5000), index.charged_bytes() + 904);
        assert_eq!(index.charged_bytes_with("other", 1), index.charged_bytes() + 4096);
        index.update("new", |file| file.entry.bytes += 5000);
        index.remove("old-0");
        index.remove("old-0");
        assert_eq!(index.charged_bytes(), 50 * (4096 + 7000) - 4096 + 5000);
        let oldest = index.oldest_finished(&[]).expect("a finished file").clone();
        assert_eq!(oldest.1, "old-1");
        assert_eq!(index.oldest_finished(&[oldest]).expect("another").1, "old-2");
        let newest: Vec<_> = index.newest().take(2).map(|entry| entry.name.as_str()).collect();
        assert_eq!(newest, ["new", "old-99"]);
        for at in 1..100 {
            let oldest = index.oldest_finished(&[]).expect("a finished file");
            assert_eq!(oldest.1, format!("old-{at}"));
            index.remove(&format!("old-{at}"));
        }
        assert_eq!(index.oldest_finished(&[]), None, "the last one is still written");
        index.update("new", |file| file.entry.recording = false);
        assert_eq!(index.oldest_finished(&[]).map(|(_, name)| name.as_str()), Some("new"));
    }

    /// Processor time that this thread takes for a hundred records, deletions and new files, and ten lists. The minimum
    /// of several tries is used, since other threads may share the processor's caches.
    fn cost(index: &mut ReplayIndex) -> Duration {
        let now = || {
            let time = clock_gettime(ClockId::ThreadCPUTime);
            Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
        };
        let tries = (0..7).map(|round| {
            let began = now();
            for at in 0..100 {
                let name = format!("new-{round}-{at}");
                index.insert(file(&name, 1_000_000 + round * 100 + at, 0, true));
                assert!(index.charged_bytes_with(&name, 100) > 0);
                index.update(&name, |file| file.entry.bytes += 100);
                index.update(&name, |file| file.entry.recording = false);
                let (_, oldest) = index.next_to_go(u64::MAX, &[]).expect("a file").clone();
                index.remove(&oldest);
                if at % 10 == 0 {
                    assert!(index.newest().take(REPLAYS_LISTED_MAX).count() > 0);
                }
            }
            now() - began
        });
        tries.min().expect("some tries")
    }

    #[test]
    fn ten_thousand_files_cost_a_record_no_more_than_a_hundred() {
        let few = cost(&mut filled(REPLAYS_LISTED_MAX));
        let many = cost(&mut filled(REPLAY_FILES_MAX));
        // The cost would be a hundred times as high if any operation visited all files.
        assert!(many < 10 * few, "{many:?} with many files, {few:?} with few");
    }
}
