//! `jostle replay`: what a replay holds, whether it plays again as it was recorded, and how.

mod info;
mod render;
mod trace;
mod verify;

use super::Failure;
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::Replay;
use std::path::Path;

/// Look into replays, check them, and play them again
#[derive(clap::Subcommand)]
pub enum ReplayCommand {
    Info(info::Info),
    Verify(verify::Verify),
    Trace(trace::Trace),
    Render(render::Render),
}

impl ReplayCommand {
    /// Does it.
    pub fn run(self) -> Result<(), Failure> {
        match self {
            ReplayCommand::Info(info) => info.run(),
            ReplayCommand::Verify(verify) => verify.run(),
            ReplayCommand::Trace(trace) => trace.run(),
            ReplayCommand::Render(render) => render.run(),
        }
    }
}

/// Reads a replay. A file that is not there is bad usage, one that is no replay a failed check.
fn read(path: &Path) -> Result<Replay, Failure> {
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
fn size(path: &Path) -> Result<u64, Failure> {
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
fn duration(ticks: u64) -> String {
    let seconds = ticks / u64::from(jostle_sim::TICKS_PER_SECOND);
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}
