//! The thread that writes the files of rooms, and syncs them with the disk.

use super::dir::{StateDir, Sync};
use super::job::{Job, RoomFile};
use crate::limits;
use jostle_protocol::replay::{Record, header};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Instant;
use tracing::error;

/// State of the writer's thread.
pub struct Writer {
    dir: Arc<StateDir>,
    sync: Sync,
    errors: Arc<AtomicU64>,
    /// Open files by the codes of their rooms.
    files: BTreeMap<String, Open>,
}

struct Open {
    file: File,
    room_file: Arc<RoomFile>,
    /// Whether something was written that is not synced.
    is_dirty: bool,
}

impl Writer {
    /// A writer without open files.
    pub fn new(dir: Arc<StateDir>, sync: Sync, errors: Arc<AtomicU64>) -> Writer {
        Writer { dir, sync, errors, files: BTreeMap::new() }
    }

    /// Writes until it is told to end or the queue is dropped.
    pub fn run(mut self, jobs: &Receiver<Job>) {
        let mut sync_at = Instant::now() + limits::STATE_SYNC_EVERY;
        loop {
            match jobs.recv_timeout(sync_at.saturating_duration_since(Instant::now())) {
                Ok(Job::End) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(job) => self.work(job),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if Instant::now() >= sync_at {
                if self.sync == Sync::Second {
                    self.sync_all();
                }
                sync_at = Instant::now() + limits::STATE_SYNC_EVERY;
            }
        }
        self.sync_all();
    }

    fn work(&mut self, job: Job) {
        match job {
            // The thread of a room that was given up may have sent this when it woke.
            Job::Begin(room_file, _) if room_file.room_given_up.is_cancelled() => {}
            Job::Begin(room_file, records) => {
                let begun = self.begin(&room_file, &records);
                self.note(&room_file, begun);
            }
            // Another room with this code may have begun a file of its own by now.
            Job::Append(room_file, _) | Job::Close(room_file) if self.is_replaced(&room_file) => {}
            Job::Remove(room_file) if self.is_of_other_room(&room_file) => {}
            Job::Append(room_file, records) => {
                // There is none if it was given up.
                let open = self.files.get_mut(&room_file.code);
                let appended = open.map_or(Ok(()), |open| open.append(&records));
                self.note(&room_file, appended);
            }
            Job::Close(room_file) => {
                if let Some(mut open) = self.files.remove(&room_file.code) {
                    let synced = open.sync();
                    self.note(&room_file, synced);
                }
            }
            Job::Remove(room_file) => {
                self.files.remove(&room_file.code);
                let removed = self.dir.remove(&room_file.code);
                self.note(&room_file, removed);
            }
            Job::End => {}
        }
    }

    /// Whether the open file of this code is another one.
    fn is_replaced(&self, room_file: &Arc<RoomFile>) -> bool {
        let open = self.files.get(&room_file.code);
        open.is_some_and(|open| !Arc::ptr_eq(&open.room_file, room_file))
    }

    /// Whether the open file of this code is another room's. One that could not keep up may have an older file open.
    fn is_of_other_room(&self, room_file: &RoomFile) -> bool {
        let open = self.files.get(&room_file.code);
        open.is_some_and(|open| open.room_file.number != room_file.number)
    }

    /// Writes a new file, and puts it in the place of the old one once it is complete.
    fn begin(&mut self, room_file: &Arc<RoomFile>, records: &[Record]) -> io::Result<()> {
        let syncs = self.sync == Sync::Second;
        let mut file = self.dir.create(&room_file.code)?;
        file.write_all(&header())?;
        let mut open = Open { file, room_file: Arc::clone(room_file), is_dirty: false };
        open.append(records)?;
        if syncs {
            open.sync()?;
        }
        self.dir.replace(&room_file.code, syncs)?;
        self.files.insert(room_file.code.clone(), open);
        Ok(())
    }

    fn sync_all(&mut self) {
        let failed: Vec<_> = self
            .files
            .values_mut()
            .filter_map(|open| Some((Arc::clone(&open.room_file), open.sync().err()?)))
            .collect();
        for (room_file, error) in failed {
            self.note(&room_file, Err(error));
        }
    }

    /// Gives a file up after an error: its room begins a new one after a while.
    fn note(&mut self, room_file: &RoomFile, result: io::Result<()>) {
        let Err(error) = result else { return };
        self.files.remove(&room_file.code);
        self.errors.fetch_add(1, Ordering::Relaxed);
        if !room_file.failed.swap(true, Ordering::Relaxed) {
            let file = self.dir.room(&room_file.code);
            error!(
                file = %file.display(), %error, retry_s = limits::STATE_RETRY.as_secs(),
                "CANNOT KEEP A ROOM: the game goes on, but a restart would lose what is played from here on"
            );
        }
    }
}

impl Open {
    fn append(&mut self, records: &[Record]) -> io::Result<()> {
        // In one write: a process that is killed loses notes and the ticks before them together or not at all.
        let bytes: Vec<u8> = records.iter().flat_map(Record::seal).collect();
        self.is_dirty = true;
        self.file.write_all(&bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        if std::mem::take(&mut self.is_dirty) { self.file.sync_data() } else { Ok(()) }
    }
}
