//! The command line. Its exit status is 0 for success, 1 for a failed check and 2 for incorrect usage. Errors are
//! reported as one line on stderr.

mod bot_input;
pub mod bots;
mod config_file;
mod descriptors;
mod doctor;
mod inputs;
mod layers;
mod output;
mod plan;
mod rehearsal;
mod replay;
mod run;
mod scene;
mod scenes;
mod serve;
mod signals;
mod systemd;
pub mod tiled;
mod trace;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use output::{Failure, OrFail};
use std::process::ExitCode;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;

/// Maximum number of log lines waiting to be written; more are dropped and counted, so that nothing has to wait for the
/// log.
const LOG_LINES_WAITING_MAX: usize = 4096;

/// A multiplayer physics playground.
#[derive(Parser)]
#[command(name = "jostle", version, arg_required_else_help = true)]
struct CommandLine {
    /// Log level for stderr: error, warn, info, debug, trace, or a filter like `info,jostle_server=debug`. [default:
    /// RUST_LOG, or else info for `serve` and warn otherwise]
    #[arg(long, global = true, value_name = "FILTER")]
    log: Option<String>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Serve(serve::Serve),
    Doctor(doctor::Doctor),
    Run(run::Run),
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    Bots(bots::Bots),
    #[command(subcommand)]
    Replay(replay::ReplayCommand),
}

/// Runs the command with which the process was started.
pub fn main() -> ExitCode {
    let words = std::env::args_os().collect();
    let words = match layers::complete(CommandLine::command(), words, |name| std::env::var_os(name))
    {
        Ok(words) => words,
        Err(failure) => return fail(failure),
    };
    let arguments = match CommandLine::try_parse_from(words) {
        Ok(arguments) => arguments,
        // Help and version texts keep clap's own layout.
        Err(error) if is_help(&error) => error.exit(),
        Err(error) => return fail(Failure::Usage(one_line(&error.to_string()))),
    };
    let (log_drops, log) = match start_log(&arguments) {
        Ok(started) => started,
        Err(failure) => return fail(failure),
    };
    let done = match arguments.command {
        Command::Serve(serve) => serve.run(log_drops),
        Command::Doctor(doctor) => doctor.run(),
        Command::Run(run) => run.run(),
        Command::Scene(scene) => scene.run(),
        Command::Bots(bots) => bots.run(),
        Command::Replay(replay) => replay.run(),
    };
    // This flushes the log.
    drop(log);
    done.map_or_else(fail, |()| ExitCode::SUCCESS)
}

fn fail(failure: Failure) -> ExitCode {
    let (text, status) = match failure {
        Failure::Check(text) => (text, 1),
        Failure::Usage(text) => (text, 2),
    };
    eprintln!("error: {}", output::plain(&text));
    ExitCode::from(status)
}

/// Starts the log. A separate thread writes it and lives as long as the guard. Lines beyond the limit are dropped and
/// counted, so that a reader that stalls blocks nothing else.
fn start_log(arguments: &CommandLine) -> Result<(ErrorCounter, WorkerGuard), Failure> {
    let named = arguments.log.clone().or_else(|| std::env::var("RUST_LOG").ok());
    let usual = if matches!(arguments.command, Command::Serve(_)) {
        // The NATS client logs each connection attempt; the server logs the same information less often.
        "info,async_nats=error"
    } else {
        "warn"
    };
    let filter = EnvFilter::try_new(named.as_deref().unwrap_or(usual)).or_usage("--log")?;
    let color = std::io::IsTerminal::is_terminal(&std::io::stderr());
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_target(false);
    let (writer, guard) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(LOG_LINES_WAITING_MAX)
        .thread_name("log")
        .finish(std::io::stderr());
    let drops = writer.error_counter();
    log.with_ansi(color).with_writer(writer).init();
    Ok((drops, guard))
}

fn is_help(error: &clap::Error) -> bool {
    !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
}

/// A clap error without usage and hints, which take up several lines.
fn one_line(complaint: &str) -> String {
    let complaint = complaint.strip_prefix("error: ").unwrap_or(complaint);
    let complaint = complaint.split("\n\n").next().unwrap_or_default();
    let words: Vec<_> = complaint.split_whitespace().collect();
    format!("{}; see --help", words.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        CommandLine::command().debug_assert();
    }
}
