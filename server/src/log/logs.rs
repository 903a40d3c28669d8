//! The writers for all rooms' logs.

use super::reader::{LogReader, Policy, Seal, SharedLog, Wants};
use super::recording::Recording;
use super::replay_file::ReplayFile;
use super::restore::SavedRoom;
use super::settings::Settings;
use super::state_dir::StateSettings;
use super::state_file::{StateFile, StateFiles};
use super::store::ReplayStore;
use super::writer::LogWriter;
use crate::limits;
use std::io;
use std::sync::Arc;
use std::time::SystemTime;
use tracing::error;

/// A server's log writer, and the readers given to its rooms' logs. By default there are none.
#[derive(Default)]
pub struct Logs {
    writer: Option<Arc<LogWriter>>,
    /// The replays, if games are recorded.
    pub recording: Option<Recording>,
    /// The `--state` files, if rooms outlive the process.
    pub states: Option<Arc<StateFiles>>,
    /// A fleet's stream, which is used instead of these files.
    pub stream: Option<StreamEnd>,
}

/// A fleet's stream, as the server uses it.
pub struct StreamEnd {
    pub policy: Arc<Policy>,
    /// Waits until everything in the rooms' shared logs has been written.
    pub close: Box<dyn Fn() + Send + Sync>,
}

/// The purpose of a reader for a room's state.
pub const STATE: Wants =
    Wants { file_ticks_max: limits::STATE_FILE_TICKS, is_replay: false, wall: SystemTime::now };

impl Logs {
    /// Opens the directories, and starts the writer for at most `rooms` rooms. Errors come from the state directory.
    pub fn open(
        replays: Option<&Settings>,
        state: Option<&StateSettings>,
        rooms: usize,
    ) -> io::Result<Logs> {
        let store = replays.cloned().map(ReplayStore::new).map(Arc::new);
        let states = state.map(StateFiles::open).transpose()?;
        if store.is_none() && states.is_none() {
            return Ok(Logs::default());
        }
        let writer = Arc::new(LogWriter::start(rooms, store.clone())?);
        let recording = store.map(|store| Recording::new(store, Arc::clone(&writer)));
        Ok(Logs { writer: Some(writer), recording, states, stream: None })
    }

    /// Shares a room's log with its readers or, in a fleet, with the stream. `None` if no logs are kept.
    pub fn share(
        &self,
        code: &str,
        number: u64,
        private: bool,
        of_stream: Option<Arc<SharedLog>>,
    ) -> Option<Arc<SharedLog>> {
        let Some(writer) = &self.writer else { return of_stream };
        let shared = of_stream.unwrap_or_default();
        if let Some(recording) = self.recording.as_ref().filter(|_| !private) {
            let (reader, file) = ReplayFile::of(recording.store(), &shared);
            writer.read(reader, file);
        }
        if let Some(states) = self.states.as_ref().filter(|_| self.stream.is_none()) {
            let reader = LogReader::new(&shared, &states.policy().of_room(), STATE);
            writer.read(reader, StateFile::new(states, code, number));
        }
        Some(shared)
    }

    /// The rooms that were open when the previous process ended.
    pub fn saved_rooms(&self) -> io::Result<Vec<SavedRoom>> {
        self.states.as_ref().map_or(Ok(Vec::new()), |states| states.saved_rooms())
    }

    /// Sets aside the saved state of a room that cannot be restored, and logs the reason. Returns false if the state is
    /// in a stream, since every node would restore it from the same records.
    pub fn set_aside(&self, code: &str, reason: &str) -> bool {
        match self.states.as_ref().filter(|_| self.stream.is_none()) {
            Some(states) => states.set_aside(code, reason),
            None => error!(room = %code, reason, "a room cannot be restored from its records"),
        }
        self.stream.is_none()
    }

    /// Gives up the saved state of a room that failed while being restored, because the same records would make it fail
    /// again.
    pub fn give_up(&self, code: &str, reason: &str) -> Seal {
        if self.set_aside(code, reason) { Seal::Leave } else { Seal::Remove }
    }

    /// Returns whether rooms outlive the process.
    pub fn keeps_rooms(&self) -> bool {
        self.states.is_some() || self.stream.is_some()
    }

    /// Number of times so far that a room's state was given up or set aside.
    pub fn state_errors(&self) -> u64 {
        let of_stream = self.stream.as_ref().map(|stream| &stream.policy);
        let policy = of_stream.or_else(|| self.states.as_ref().map(|states| states.policy()));
        policy.map_or(0, |policy| policy.errors())
    }

    /// Waits until everything in the rooms' shared logs has been written, and then ends the writer.
    pub fn close(&self) {
        self.writer.iter().for_each(|writer| writer.close());
        self.stream.iter().for_each(|stream| (stream.close)());
    }
}
