//! The command line: what is asked for, and how it ends. Exit status 0 done, 1 a check failed, 2 bad
//! usage; errors are one line on stderr.

mod bots;
mod hands;
mod inputs;
mod plan;
mod replay;
mod run;
mod scene;
mod serve;
mod trace;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use jostle_sim::Scene;
use std::fmt::Display;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// A multiplayer physics playground.
#[derive(Parser)]
#[command(name = "jostle", version, arg_required_else_help = true)]
struct Arguments {
    /// What to log on stderr: error, warn, info, debug, trace, or a filter like
    /// `info,jostle_server=debug`. [default: RUST_LOG, else info for `serve` and warn otherwise]
    #[arg(long, global = true, value_name = "FILTER")]
    log: Option<String>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Serve(serve::Serve),
    Run(run::Run),
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    Bots(bots::Bots),
    #[command(subcommand)]
    Replay(replay::ReplayCommand),
}

/// Why a command ended without success.
#[derive(Debug)]
enum Failure {
    /// Something was checked and is wrong, or did not work: status 1.
    Check(String),
    /// The command line asks for something that is not there: status 2.
    Usage(String),
}

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        // Help and version, in clap's own layout.
        Err(error) if is_help(&error) => error.exit(),
        Err(error) => return fail(Failure::Usage(one_line(&error.to_string()))),
    };
    if let Err(failure) = start_log(&arguments) {
        return fail(failure);
    }
    let done = match arguments.command {
        Command::Serve(serve) => serve.run(),
        Command::Run(run) => run.run(),
        Command::Scene(scene) => scene.run(),
        Command::Bots(bots) => bots.run(),
        Command::Replay(replay) => replay.run(),
    };
    done.map_or_else(fail, |()| ExitCode::SUCCESS)
}

fn fail(failure: Failure) -> ExitCode {
    let (text, status) = match failure {
        Failure::Check(text) => (text, 1),
        Failure::Usage(text) => (text, 2),
    };
    eprintln!("error: {text}");
    ExitCode::from(status)
}

fn start_log(arguments: &Arguments) -> Result<(), Failure> {
    let named = arguments.log.clone().or_else(|| std::env::var("RUST_LOG").ok());
    let usual = if matches!(arguments.command, Command::Serve(_)) { "info" } else { "warn" };
    let filter = EnvFilter::try_new(named.as_deref().unwrap_or(usual))
        .map_err(|error| Failure::Usage(format!("--log: {error}")))?;
    let color = std::io::IsTerminal::is_terminal(&std::io::stderr());
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_target(false);
    log.with_ansi(color).with_writer(std::io::stderr).init();
    Ok(())
}

fn is_help(error: &clap::Error) -> bool {
    !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
}

/// What clap complains about, without its usage and hints, which take several lines.
fn one_line(complaint: &str) -> String {
    let complaint = complaint.strip_prefix("error: ").unwrap_or(complaint);
    let complaint = complaint.split("\n\n").next().unwrap_or_default();
    let words: Vec<_> = complaint.split_whitespace().collect();
    format!("{}; see --help", words.join(" "))
}

/// Prints a line. Whoever closes our stdout, as `head` does, has seen enough.
fn say(line: impl Display) -> Result<(), Failure> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Check(format!("stdout: {error}")))
        }
        _ => Ok(()),
    }
}

/// The scene that SCENE means: a built-in name, or a path to a TOML file.
fn scene_named(name: &str) -> Result<Scene, Failure> {
    let mut scenes = Scene::built_in();
    if let Some(index) = scenes.iter().position(|scene| scene.name == name) {
        return Ok(scenes.swap_remove(index));
    }
    if !Path::new(name).exists() {
        let names: Vec<_> = scenes.iter().map(|scene| scene.name.as_str()).collect();
        let allowed = names.join(", ");
        let text = format!("scene: found {name:?}; allowed: {allowed}, or the path of a TOML file");
        return Err(Failure::Usage(text));
    }
    scene_file(Path::new(name))
}

/// Reads and checks a scene file.
fn scene_file(path: &Path) -> Result<Scene, Failure> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| Failure::Usage(format!("{file}: {error}")))?;
    let source = String::from_utf8(bytes).map_err(|error| {
        let text = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = text.iter().filter(|&&byte| byte == b'\n').count() + 1;
        let found = "found bytes that are not UTF-8; allowed: UTF-8 text";
        Failure::Check(format!("{file}:{line}: file: {found}"))
    })?;
    Scene::parse(&file, &source).map_err(|error| Failure::Check(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed() {
        Arguments::command().debug_assert();
    }
}
