//! `jostle replay` describes, verifies, draws and replays recordings.

mod file;
mod flashes;
mod info;
mod render;
mod trace;
mod verify;

use crate::output::Failure;

/// Inspect replays, verify them, and play them again
#[derive(clap::Subcommand)]
pub enum ReplayCommand {
    Info(info::Info),
    Verify(verify::Verify),
    Trace(trace::Trace),
    Render(render::Render),
    Flashes(flashes::FlashCount),
}

impl ReplayCommand {
    /// Runs the command.
    pub fn run(self) -> Result<(), Failure> {
        match self {
            ReplayCommand::Info(info) => info.run(),
            ReplayCommand::Verify(verify) => verify.run(),
            ReplayCommand::Trace(trace) => trace.run(),
            ReplayCommand::Render(render) => render.run(),
            ReplayCommand::Flashes(count) => count.run(),
        }
    }
}
