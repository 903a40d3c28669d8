//! The `--state` directory: the key that signs tokens, and a file for each open room. Only one server may use it at a
//! time.

use crate::files::{open_regular, without_waiting};
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Length of the key, in bytes.
const KEY_BYTES: usize = 32;
const KEY: &str = "key";
const LOCK: &str = "lock";
const ROOMS: &str = "rooms";
const BANS: &str = "bans.json";
/// Ending of rooms' files.
const ENDING: &str = ".jostle";
/// Ending of a file that replaces a room's file once it is complete.
const NEW_ENDING: &str = ".new";
/// Ending of a file from which no room could be restored; it is kept for diagnosis.
const DAMAGED_ENDING: &str = ".damaged";

/// When files are synced to the disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sync {
    /// Every half second. A power failure loses at most a second of play.
    #[default]
    Second,
    /// Whenever the system does so. If the process is killed, no more is lost than with [`Sync::Second`], but a power
    /// failure may lose half a minute of play.
    System,
}

/// Location of the rooms' state, and when it is synced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StateSettings {
    /// The directory, which is created if it is missing and is inaccessible to other users.
    pub dir: PathBuf,
    /// When the directory's files are synced to the disk.
    pub sync: Sync,
}

/// An open state directory, locked against other servers until it is dropped.
#[derive(Debug)]
pub struct StateDir {
    dir: PathBuf,
    key: [u8; KEY_BYTES],
    _lock: File,
}

impl StateDir {
    /// Opens or creates the directory. Errors name the file that is in use by another server, cannot be read or
    /// written, or has unexpected contents.
    pub fn open(dir: &Path) -> io::Result<StateDir> {
        let rooms = dir.join(ROOMS);
        make_closed_dir(&rooms).map_err(|error| about(&rooms, error))?;
        let lock = dir.join(LOCK);
        let lock = lock_file(&lock).map_err(|error| about(&lock, error))?;
        let key = dir.join(KEY);
        let key = read_or_make_key(&key).map_err(|error| about(&key, error))?;
        Ok(StateDir { dir: dir.to_owned(), key, _lock: lock })
    }

    /// Returns whether a server is currently using this directory. Errors come from its lock file.
    pub fn is_in_use(dir: &Path) -> io::Result<bool> {
        let lock = match open_regular(&dir.join(LOCK)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            opened => opened?,
        };
        match lock.try_lock() {
            Ok(()) => Ok(false),
            Err(TryLockError::WouldBlock) => Ok(true),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// The key that signs tokens.
    pub fn key(&self) -> &[u8; KEY_BYTES] {
        &self.key
    }

    /// The path of the ban file.
    pub fn bans(&self) -> PathBuf {
        self.dir.join(BANS)
    }

    /// The rooms' files with their codes, sorted by code. Files that were incomplete when the process ended are
    /// deleted.
    pub fn rooms(&self) -> io::Result<Vec<(String, PathBuf)>> {
        let mut rooms = Vec::new();
        for entry in fs::read_dir(self.dir.join(ROOMS))? {
            let path = entry?.path();
            let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
            if name.ends_with(NEW_ENDING) {
                fs::remove_file(&path).map_err(|error| about(&path, error))?;
            } else if let Some(code) = name.strip_suffix(ENDING) {
                rooms.push((code.to_owned(), path));
            }
        }
        rooms.sort();
        Ok(rooms)
    }

    /// The path of a room's file.
    pub fn room(&self, code: &str) -> PathBuf {
        self.file(code, ENDING)
    }

    /// Creates the file that will replace a room's file.
    pub fn create(&self, code: &str) -> io::Result<File> {
        closed_file().truncate(true).open(self.file(code, NEW_ENDING))
    }

    /// Renames that file over the room's file. With `sync`, the change survives a power failure.
    pub fn replace(&self, code: &str, sync: bool) -> io::Result<()> {
        fs::rename(self.file(code, NEW_ENDING), self.room(code))?;
        if sync { sync_dir(&self.dir.join(ROOMS)) } else { Ok(()) }
    }

    /// Removes a room's file, if it exists.
    pub fn remove(&self, code: &str) -> io::Result<()> {
        match fs::remove_file(self.room(code)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }

    /// Sets aside a room's file that could not be restored, and returns the file's new name.
    pub fn set_aside(&self, code: &str) -> io::Result<PathBuf> {
        let aside = self.file(code, DAMAGED_ENDING);
        fs::rename(self.room(code), &aside)?;
        Ok(aside)
    }

    fn file(&self, code: &str, ending: &str) -> PathBuf {
        self.dir.join(ROOMS).join(format!("{code}{ending}"))
    }
}

/// Adds the file's name to an error.
fn about(path: &Path, error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

fn lock_file(path: &Path) -> io::Result<File> {
    let file = without_waiting(&mut closed_file()).open(path)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            let text = "another server uses this directory; each needs its own";
            Err(io::Error::new(io::ErrorKind::ResourceBusy, text))
        }
        Err(TryLockError::Error(error)) => Err(error),
    }
}

fn read_or_make_key(path: &Path) -> io::Result<[u8; KEY_BYTES]> {
    let mut key = [0; KEY_BYTES];
    match open_regular(path) {
        Ok(mut file) => {
            let bytes = file.metadata()?.len();
            if bytes != KEY_BYTES as u64 {
                let text = format!("found {bytes} bytes; allowed: a key of {KEY_BYTES} bytes");
                return Err(io::Error::new(io::ErrorKind::InvalidData, text));
            }
            file.read_exact(&mut key)?;
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            getrandom::fill(&mut key).map_err(io::Error::other)?;
            write_closed(path, &key)?;
        }
        Err(error) => return Err(error),
    }
    Ok(key)
}

/// Writes a file that only its owner can read. Under its final name, the file is always complete, even after a power
/// failure.
pub fn write_closed(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let new = path.with_extension("new");
    let mut file = without_waiting(closed_file().truncate(true)).open(&new)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    fs::rename(new, path)?;
    path.parent().map_or(Ok(()), sync_dir)
}

/// Options for writing files that only their owner can read, because the files contain players' addresses.
fn closed_file() -> fs::OpenOptions {
    let mut options = File::options();
    options.write(true).create(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options
}

fn make_closed_dir(path: &Path) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path)
}

/// Ensures that the names in a directory survive a power failure.
fn sync_dir(path: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(path)?.sync_all() } else { Ok(()) }
}
