//! The simulated store: two buckets of entries, and the records of rooms.

use super::settings::Flaws;
use jostle_server::fleet::directory::{Answer, Change};
use jostle_server::fleet::entry::{Entry, Key, Revision};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// A bucket of entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bucket {
    /// The nodes' entries, which expire unless they are renewed.
    Nodes,
    /// The rooms' entries.
    Rooms,
}

pub const BUCKETS: [Bucket; 2] = [Bucket::Nodes, Bucket::Rooms];

impl Bucket {
    /// Returns the bucket that an entry belongs to.
    pub fn of(key: &Key) -> Bucket {
        match key {
            Key::Node(_) => Bucket::Nodes,
            Key::Room(_) => Bucket::Rooms,
        }
    }
}

/// Requests to a bucket and deliveries to its watchers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Traffic {
    /// Number of accepted writes and removals.
    pub writes: u64,
    /// Total size of the accepted entries in bytes.
    pub written_bytes: u64,
    /// Number of refused writes and removals.
    pub refused: u64,
    /// Number of entries sent to watchers.
    pub deliveries: u64,
    pub delivered_bytes: u64,
    /// Number of individual entries that were read.
    pub looks: u64,
}

/// A written value, or a removal.
#[derive(Clone, Debug)]
pub struct Written {
    pub key: Key,
    /// The value; `None` for a removal.
    pub entry: Option<Arc<Entry>>,
    pub revision: Revision,
    /// When the value was written.
    at: Duration,
    /// Size of the name and value in bytes.
    bytes: u64,
}

impl Written {
    /// Returns the change that a watcher receives.
    pub fn change(&self) -> Change {
        match &self.entry {
            Some(entry) => Change::Written(self.key.clone(), Entry::clone(entry), self.revision),
            None => Change::Gone(self.key.clone(), self.revision),
        }
    }
}

#[derive(Debug, Default)]
struct Log {
    revision: Revision,
    entries: BTreeMap<Key, Written>,
    /// The newest writes, kept for the watchers.
    writes: VecDeque<Written>,
    /// Number of the first write in `writes`.
    first: u64,
    /// Undo log: the keys of the newest writes, with their previous values.
    journal: VecDeque<(Key, Option<Written>)>,
    traffic: Traffic,
}

impl Log {
    /// Undoes the newest `writes` writes. Their revisions are reused.
    fn undo(&mut self, writes: usize) {
        for _ in 0..writes {
            let Some((key, before)) = self.journal.pop_back() else { break };
            self.revision -= 1;
            match before {
                Some(before) => self.entries.insert(key, before),
                None => self.entries.remove(&key),
            };
        }
    }

    /// Forces all watchers to start over.
    fn end_watches(&mut self) {
        self.first += self.writes.len() as u64;
        self.writes.clear();
    }
}

/// Maximum number of writes that the store may lose per bucket, about a minute or two's worth.
pub const FORGOTTEN_MAX: usize = 200;

/// The newest record of a room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tail {
    pub sequence: u64,
    /// The opened room that wrote the record.
    pub writer: u64,
    /// The writer's epoch.
    pub epoch: u64,
}

#[derive(Debug)]
pub struct Store {
    logs: [Log; 2],
    records: BTreeMap<String, Tail>,
    /// Undo log: the rooms of the newest records, with their previous records.
    journal: VecDeque<(String, Option<Tail>)>,
    /// How many times the store has lost data.
    forgot: u64,
    flaws: Flaws,
}

impl Store {
    /// Creates a store without entries.
    pub fn new(flaws: Flaws) -> Store {
        Store {
            logs: [Log::default(), Log::default()],
            records: BTreeMap::new(),
            journal: VecDeque::new(),
            forgot: 0,
            flaws,
        }
    }

    /// How many times the store has lost data.
    pub fn forgot(&self) -> u64 {
        self.forgot
    }

    /// Loses the most recent writes to each bucket and the most recent records.
    pub fn lose(&mut self, writes: [usize; 2], records: usize) {
        self.forgot += 1;
        for (log, writes) in self.logs.iter_mut().zip(writes) {
            log.undo(writes);
            log.end_watches();
        }
        for _ in 0..records {
            let Some((code, before)) = self.journal.pop_back() else { break };
            match before {
                Some(before) => self.records.insert(code, before),
                None => self.records.remove(&code),
            };
        }
    }

    pub fn lose_all(&mut self) {
        self.lose([0; 2], 0);
        for log in &mut self.logs {
            log.revision = 0;
            log.entries.clear();
            log.journal.clear();
        }
        self.records.clear();
        self.journal.clear();
    }

    /// The traffic of a bucket so far.
    pub fn traffic(&self, bucket: Bucket) -> Traffic {
        self.logs[bucket as usize].traffic
    }

    /// The current value of an entry.
    pub fn get(&self, key: &Key, now: Duration) -> Option<(&Entry, Revision)> {
        let written = self.log(key).entries.get(key)?;
        let expired = Bucket::of(key) == Bucket::Nodes && written.at + self.flaws.lease_ttl <= now;
        let entry = written.entry.as_ref().filter(|_| !expired)?;
        Some((entry, written.revision))
    }

    /// Reads an entry for a node.
    pub fn look(&mut self, key: &Key, now: Duration) -> Option<(Entry, Revision)> {
        self.logs[Bucket::of(key) as usize].traffic.looks += 1;
        self.get(key, now).map(|(entry, revision)| (entry.clone(), revision))
    }

    /// Writes or removes an entry if its revision is as expected.
    pub fn put(
        &mut self,
        key: &Key,
        entry: Option<Entry>,
        expected: Revision,
        now: Duration,
    ) -> Answer {
        let present = self.get(key, now).map_or(0, |(_, revision)| revision);
        let log = &mut self.logs[Bucket::of(key) as usize];
        if present != expected && !self.flaws.ignores_revisions {
            log.traffic.refused += 1;
            return Answer::Refused;
        }
        log.revision += 1;
        let bytes = bytes(key, entry.as_ref());
        let (entry, revision) = (entry.map(Arc::new), log.revision);
        let written = Written { key: key.clone(), entry, revision, at: now, bytes };
        log.traffic.writes += 1;
        log.traffic.written_bytes += bytes;
        let before = log.entries.insert(key.clone(), written.clone());
        keep(&mut log.journal, (key.clone(), before));
        log.writes.push_back(written);
        Answer::Done(revision)
    }

    /// Returns all entries of a bucket and the number of the next write. Removed rooms are included, marked as removed.
    pub fn snapshot(&mut self, bucket: Bucket, now: Duration) -> (Vec<Written>, u64) {
        let log = &self.logs[bucket as usize];
        let told =
            |written: &&Written| written.entry.is_none() || self.get(&written.key, now).is_some();
        let found: Vec<Written> = log.entries.values().filter(told).cloned().collect();
        let next = self.end(bucket);
        self.deliver(bucket, &found);
        (found, next)
    }

    /// The number of the next write.
    pub fn end(&self, bucket: Bucket) -> u64 {
        let log = &self.logs[bucket as usize];
        log.first + log.writes.len() as u64
    }

    /// Returns a write by its number, and whether it has been overwritten since.
    pub fn written(&self, bucket: Bucket, number: u64) -> (&Written, bool) {
        let log = &self.logs[bucket as usize];
        let written = &log.writes[(number - log.first) as usize];
        (written, log.entries[&written.key].revision != written.revision)
    }

    /// Counts entries sent to a watcher.
    pub fn deliver(&mut self, bucket: Bucket, sent: &[Written]) {
        let traffic = &mut self.logs[bucket as usize].traffic;
        traffic.deliveries += sent.len() as u64;
        traffic.delivered_bytes += sent.iter().map(|written| written.bytes).sum::<u64>();
    }

    /// Drops the writes before the given number from the watchers' log.
    pub fn forget(&mut self, bucket: Bucket, before: u64) {
        let log = &mut self.logs[bucket as usize];
        let count = before.saturating_sub(log.first) as usize;
        log.writes.drain(..count);
        log.first += count as u64;
    }

    /// The entries of all rooms.
    pub fn rooms(&self) -> impl Iterator<Item = (&str, &Entry)> {
        let written = self.logs[Bucket::Rooms as usize].entries.values();
        written.filter_map(|written| match &written.key {
            Key::Room(code) => Some((code.as_str(), written.entry.as_deref()?)),
            Key::Node(_) => None,
        })
    }

    /// The newest record of a room.
    pub fn tail(&self, code: &str) -> Option<Tail> {
        self.records.get(code).copied()
    }

    /// Appends a record if the newest one is as expected, was written by the same writer, or is older because the store
    /// has lost later ones. Returns the number of the new record.
    pub fn append(&mut self, code: &str, expected: u64, writer: u64, epoch: u64) -> Option<u64> {
        let tail = self.tail(code);
        let sequence = tail.map_or(0, |tail| tail.sequence);
        let is_by_another = tail.is_some_and(|tail| tail.epoch > epoch);
        let accepted = sequence == expected
            || tail.is_some_and(|tail| tail.writer == writer)
            || (sequence < expected && !is_by_another);
        accepted.then(|| {
            let tail = Tail { sequence: sequence + 1, writer, epoch };
            let before = self.records.insert(code.to_owned(), tail);
            keep(&mut self.journal, (code.to_owned(), before));
            tail.sequence
        })
    }

    /// Removes the records of a room.
    pub fn forget_records(&mut self, code: &str) {
        let before = self.records.remove(code);
        keep(&mut self.journal, (code.to_owned(), before));
    }

    fn log(&self, key: &Key) -> &Log {
        &self.logs[Bucket::of(key) as usize]
    }
}

fn keep<T>(journal: &mut VecDeque<T>, write: T) {
    journal.push_back(write);
    if journal.len() > FORGOTTEN_MAX {
        journal.pop_front();
    }
}

fn bytes(key: &Key, entry: Option<&Entry>) -> u64 {
    let (Key::Node(name) | Key::Room(name)) = key;
    let value = match entry {
        Some(Entry::Node(entry)) => serde_json::to_vec(entry),
        Some(Entry::Room(entry)) => serde_json::to_vec(entry),
        None => Ok(Vec::new()),
    };
    (name.len() + value.expect("entries are plain data").len()) as u64
}
