//! Reading the files that the commands are given.

use crate::output::Failure;
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::Replay;
use std::path::Path;

/// Reads a replay. A file that is not there is bad usage, one that is no replay a failed check.
pub fn read(path: &Path) -> Result<Replay, Failure> {
    let file = path.display();
    let bytes = size(path)?;
    if bytes > REPLAY_BYTES_MAX as u64 {
        let text = format!("{file}: {bytes} bytes; a replay has at most {REPLAY_BYTES_MAX}");
        return Err(Failure::Check(text));
    }
    let bytes = std::fs::read(path).map_err(|error| Failure::Check(format!("{file}: {error}")))?;
    Replay::read(bytes).map_err(|error| Failure::Check(format!("{file}: {error}")))
}

/// Length of a file that is there, bytes.
pub fn size(path: &Path) -> Result<u64, Failure> {
    let failed = |error| Failure::Usage(format!("{}: {error}", path.display()));
    let facts = std::fs::metadata(path).map_err(failed)?;
    match facts.is_file() {
        true => Ok(facts.len()),
        false => {
            Err(Failure::Usage(format!("{}: found no file; allowed: replays", path.display())))
        }
    }
}

/// Ticks as hours, minutes and seconds of play.
pub fn duration(ticks: u64) -> String {
    let seconds = ticks / u64::from(jostle_sim::TICKS_PER_SECOND);
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}
