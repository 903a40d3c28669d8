//! A room's file in the `--state` directory: a replay that begins with a keyframe and continues in short blocks, with
//! notes about the players and their seats. After a while a new file replaces it, so that a restart has little to
//! replay.

use super::reader::{Policy, Seal, Sink};
use super::restore::SavedRoom;
use super::state_dir::{StateDir, StateSettings, Sync};
use crate::limits;
use jostle_protocol::replay::{Record, header};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use tracing::error;

/// The files of all rooms.
pub struct StateFiles {
    dir: StateDir,
    sync: Sync,
    policy: Arc<Policy>,
    /// Numbers of the rooms that own the existing files, by code. By now, a code may belong to another room.
    owners: Mutex<BTreeMap<String, u64>>,
}

impl StateFiles {
    /// Opens the directory. See [`StateDir::open`] for the errors.
    pub fn open(settings: &StateSettings) -> io::Result<Arc<StateFiles>> {
        let dir = StateDir::open(&settings.dir)?;
        let cannot = "CANNOT KEEP A ROOM: the game goes on, but a restart would lose what is played from here on";
        let policy = Policy::new(cannot, limits::STATE_RETRY);
        Ok(Arc::new(StateFiles { dir, sync: settings.sync, policy, owners: Mutex::default() }))
    }

    pub fn dir(&self) -> &StateDir {
        &self.dir
    }

    /// The policy for files that cannot be written.
    pub fn policy(&self) -> &Arc<Policy> {
        &self.policy
    }

    /// The rooms that were open when the previous process ended. Files that cannot be read are set aside, and this is
    /// logged.
    pub fn saved_rooms(&self) -> io::Result<Vec<SavedRoom>> {
        let read = |(code, path): (String, PathBuf)| {
            let read = SavedRoom::read(code.clone(), &path);
            read.inspect_err(|reason| self.set_aside(&code, reason)).ok()
        };
        Ok(self.dir.rooms()?.into_iter().filter_map(read).collect())
    }

    /// Sets aside the file of a room that cannot be restored, and logs the reason.
    pub fn set_aside(&self, code: &str, reason: &str) {
        self.policy.count();
        let to = match self.dir.set_aside(code) {
            Ok(path) => path.display().to_string(),
            Err(error) => format!("nowhere ({error})"),
        };
        error!(room = %code, reason, file = %to, "a room cannot be restored; its file was set aside");
    }
}

pub struct StateFile {
    files: Arc<StateFiles>,
    code: String,
    /// Distinguishes the room from another one with the same code.
    number: u64,
    open: Option<File>,
}

impl StateFile {
    /// Creates the sink for a room's file, which is not open yet.
    pub fn new(files: &Arc<StateFiles>, code: &str, number: u64) -> StateFile {
        StateFile { files: Arc::clone(files), code: code.to_owned(), number, open: None }
    }

    /// Operates on the open file, if there is one. An error names the file, which is then given up.
    fn with(
        &mut self,
        work: impl FnOnce(&mut File, &StateFiles) -> io::Result<()>,
    ) -> io::Result<()> {
        let done = self.open.as_mut().map_or(Ok(()), |file| work(file, &self.files));
        done.map_err(|error| {
            self.open = None;
            let file = self.files.dir.room(&self.code);
            io::Error::new(error.kind(), format!("{}: {error}", file.display()))
        })
    }
}

impl Sink for StateFile {
    /// Writes a new file, which replaces the old one once it is complete.
    fn begin(&mut self, records: &[Arc<Record>]) -> io::Result<()> {
        let (code, number) = (self.code.clone(), self.number);
        self.open = Some(self.files.dir.create(&code)?);
        self.with(|file, files| {
            file.write_all(&bytes(header(), records))?;
            let syncs = files.sync == Sync::Second;
            if syncs {
                file.sync_data()?;
            }
            let mut owners = files.owners.lock().unwrap_or_else(PoisonError::into_inner);
            owners.insert(code.clone(), number);
            files.dir.replace(&code, syncs)
        })
    }

    fn append(&mut self, records: &[Arc<Record>]) -> io::Result<()> {
        // This is a single write, so that if the process is killed, the notes and the ticks before them are lost
        // together or not at all.
        self.with(|file, _| file.write_all(&bytes(Vec::new(), records)))
    }

    fn sync(&mut self) -> io::Result<()> {
        self.with(|file, files| if files.sync == Sync::Second { file.sync_data() } else { Ok(()) })
    }

    fn seal(&mut self, seal: &Seal) -> io::Result<()> {
        if *seal == Seal::Keep {
            return self.with(|file, _| file.sync_data());
        }
        let mut owners = self.files.owners.lock().unwrap_or_else(PoisonError::into_inner);
        match owners.get(&self.code) {
            Some(owner) if *owner != self.number => Ok(()),
            _ => {
                owners.remove(&self.code);
                self.files.dir.remove(&self.code)
            }
        }
    }
}

fn bytes(mut bytes: Vec<u8>, records: &[Arc<Record>]) -> Vec<u8> {
    records.iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}
