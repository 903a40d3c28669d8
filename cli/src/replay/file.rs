//! Reads replays.

use crate::output::{Failure, OrFail};
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::Replay;
use std::path::Path;

/// Reads a replay. A missing file is a usage error; a file that is not a replay fails the check.
pub fn read(path: &Path) -> Result<Replay, Failure> {
    let file = path.display();
    let bytes = size(path)?;
    if bytes > REPLAY_BYTES_MAX as u64 {
        let text = format!("{file}: {bytes} bytes; a replay has at most {REPLAY_BYTES_MAX}");
        return Err(Failure::Check(text));
    }
    Replay::read(std::fs::read(path).or_check(&file)?).or_check(file)
}

/// Length of an existing file, in bytes.
pub fn size(path: &Path) -> Result<u64, Failure> {
    let metadata = std::fs::metadata(path).or_usage(path.display())?;
    match metadata.is_file() {
        true => Ok(metadata.len()),
        false => Err("found no file; allowed: replays").or_usage(path.display()),
    }
}

/// Formats ticks as hours, minutes and seconds of play.
pub fn duration(ticks: u64) -> String {
    let seconds = ticks / u64::from(jostle_sim::TICKS_PER_SECOND);
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}
