//! A room's replay, as files in the replay directory.

use super::reader::{LogReader, Seal, SharedLog, Sink, Wants};
use super::store::ReplayStore;
use crate::limits;
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::{PlayerCount, Record, header};
use jostle_room::log::ReplayTail;
use std::io::{self, Write};
use std::sync::Arc;

/// The files of a room's replay, one after another.
pub struct ReplayFile {
    store: Arc<ReplayStore>,
    open: Option<Open>,
}

/// A file being written.
struct Open {
    name: String,
    file: Box<dyn Write + Send>,
    bytes: u64,
    /// Whether a player has sent any input; a file without inputs is useless.
    has_inputs: bool,
    players: PlayerCount,
    tail: ReplayTail,
}

impl ReplayFile {
    /// Creates a reader for a room's replay, and the reader's sink.
    pub fn of(store: &Arc<ReplayStore>, shared: &Arc<SharedLog>) -> (LogReader, ReplayFile) {
        let settings = store.settings();
        let (file_ticks_max, wall) = (settings.file_ticks_max, settings.wall);
        let wants = Wants { file_ticks_max, is_replay: true, wall };
        let file = ReplayFile { store: Arc::clone(store), open: None };
        (LogReader::new(shared, store.policy(), wants), file)
    }

    /// Closes a file, or deletes it if it has no inputs.
    fn close(&mut self, last: &[Record]) -> io::Result<()> {
        let Some(mut open) = self.open.take() else { return Ok(()) };
        let written = open.write(last, &self.store).and_then(|_| open.file.flush());
        drop(open.file);
        match open.has_inputs {
            true => self.store.finish(&open.name),
            false => self.store.discard(&open.name),
        }
        written
    }
}

impl Sink for ReplayFile {
    fn begin(&mut self, records: &[Arc<Record>]) -> io::Result<()> {
        let Some(Record::Start(start)) = records.first().map(|record| &**record) else {
            return Err(io::ErrorKind::InvalidInput.into());
        };
        // Ends a file that was given up because the disk was too slow.
        self.seal(&Seal::Keep)?;
        let (name, file) = self.store.create(start)?;
        self.store.count(1, 0);
        let (players, tail) = (PlayerCount::default(), ReplayTail::default());
        self.open = Some(Open { name, file, bytes: 0, has_inputs: false, players, tail });
        self.append(records)
    }

    fn append(&mut self, records: &[Arc<Record>]) -> io::Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        records.iter().for_each(|record| open.tail.take(record));
        let ready = open.tail.ready();
        let written = open.write(&ready, &self.store);
        if written.is_err() || matches!(ready.last(), Some(Record::End { .. })) {
            // After an error, the part that has been written stays.
            self.close(&[])?;
        }
        written
    }

    fn is_full(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.bytes >= limits::REPLAY_FILE_BYTES_MAX)
    }

    /// If the game failed, its replay gets its last ticks but no end record.
    fn seal(&mut self, _: &Seal) -> io::Result<()> {
        self.open.iter_mut().for_each(|open| open.tail.flush());
        let last = self.open.as_mut().map(|open| open.tail.ready()).unwrap_or_default();
        self.close(&last)
    }
}

impl Drop for ReplayFile {
    fn drop(&mut self) {
        // Any error would belong to a file that has already been given up.
        let _ = self.seal(&Seal::Keep);
    }
}

impl Open {
    /// Writes records. Errors name the file.
    fn write(&mut self, records: &[Record], store: &ReplayStore) -> io::Result<()> {
        let written = records.iter().try_for_each(|record| self.write_one(record, store));
        let path = store.path(&self.name);
        written
            .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))
    }

    fn write_one(&mut self, record: &Record, store: &ReplayStore) -> io::Result<()> {
        let mut bytes = record.seal();
        if let Record::Start(_) = record {
            bytes.splice(..0, header());
        }
        let count = bytes.len() as u64;
        if self.bytes + count > REPLAY_BYTES_MAX as u64 {
            return Err(io::Error::new(
                io::ErrorKind::FileTooLarge,
                "it would be too long to be read",
            ));
        }
        // Otherwise, writes to a file that has been removed would count towards the directory's limit.
        if store.path(&self.name).symlink_metadata().is_err() {
            return Err(io::Error::new(io::ErrorKind::NotFound, "it was removed"));
        }
        store.make_room(&self.name, count)?;
        self.file.write_all(&bytes)?;
        self.bytes += count;
        self.players.note(record);
        let mut last_tick = None;
        if let Record::Ticks(block) = record {
            last_tick = Some(block.last());
            self.has_inputs |= block.ticks.iter().any(|tick| !tick.inputs.is_empty());
        }
        store.grow(&self.name, count, last_tick, self.players.most);
        store.count(0, count);
        Ok(())
    }
}
