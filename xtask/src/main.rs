//! The project's tasks: build the web client, play, test, tidy. `cargo xtask help` lists them.
//!
//! Each task does the set-up it needs and says what it does, one line a step. Nothing here is
//! needed to use the crates: plain `cargo build` and `cargo test` work without it.

mod shell;
mod web;

use anyhow::Result;
use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Tasks of the Jostle workspace.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build the web client into client-web/dist
    Web {
        /// Compile in seconds instead of minutes; the result is larger and slower
        #[arg(long)]
        dev: bool,
    },
}

fn main() -> ExitCode {
    match run(Arguments::parse().task) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(task: Task) -> Result<ExitCode> {
    match task {
        Task::Web { dev } => web::build(if dev { web::Profile::Dev } else { web::Profile::Small })?,
    }
    Ok(ExitCode::SUCCESS)
}
