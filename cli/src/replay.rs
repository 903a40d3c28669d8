//! `jostle replay` describes, verifies and replays recordings.

mod file;
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
}

impl ReplayCommand {
    /// Runs the command.
    pub fn run(self) -> Result<(), Failure> {
        match self {
            ReplayCommand::Info(info) => info.run(),
            ReplayCommand::Verify(verify) => verify.run(),
            ReplayCommand::Trace(trace) => trace.run(),
            ReplayCommand::Render(render) => render.run(),
        }
    }
}
