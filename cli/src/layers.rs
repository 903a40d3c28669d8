//! Server settings that are missing from the command line. They come from the environment (`JOSTLE_LISTEN` for
//! `--listen`), or else from the configuration file, and are appended to the command line, so that all later code
//! treats them the same way.

use crate::config_file::{self, check, word};
use crate::output::{Failure, OrFail};
use crate::scenes::text_of;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, Command};
use jostle_server::files::read_regular;
use jostle_server::limits::SETTINGS_FILE_BYTES_MAX;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The command that takes the settings as flags.
const COMMAND: &str = "serve";
/// Flags of `serve` that are not server settings.
const OTHER_FLAGS: [&str; 4] = [FILE_FLAG, "check", "help", "version"];
const FILE_FLAG: &str = "config";
/// Names the configuration file if the command line does not do so.
const FILE_VARIABLE: &str = "JOSTLE_CONFIG";
/// Separates the values in a variable whose flag may be given more than once.
const BETWEEN_VALUES: char = ',';

/// Appends the words from the environment and the file to those on a command line. Commands that take no configuration
/// file are left unchanged.
pub fn complete(
    mut command: Command,
    mut words: Vec<OsString>,
    variable: impl Fn(&str) -> Option<OsString>,
) -> Result<Vec<OsString>, Failure> {
    command.build();
    // Errors are reported later, when the completed command line is parsed.
    let parsed = command.clone().ignore_errors(true).try_get_matches_from(&words);
    let Ok(matches) = parsed else { return Ok(words) };
    let Some((name, given)) = matches.subcommand() else { return Ok(words) };
    let takes_file =
        |command: &Command| command.get_arguments().any(|flag| flag.get_long() == Some(FILE_FLAG));
    if !command.find_subcommand(name).is_some_and(takes_file) {
        return Ok(words);
    }
    let mut open = settings(&command);
    open.retain(|flag| {
        given.value_source(flag.get_id().as_str()) != Some(ValueSource::CommandLine)
    });
    let (set, open): (Vec<_>, Vec<_>) = open
        .into_iter()
        .map(|flag| (flag, value_of(flag, &variable)))
        .partition(|(_, value)| value.is_some());
    for (flag, value) in set {
        words.extend(from_variable(flag, &value.unwrap_or_default())?);
    }
    let mut file = given.get_one::<PathBuf>(FILE_FLAG).cloned();
    if file.is_none()
        && let Some(named) = variable(FILE_VARIABLE).filter(|value| !value.is_empty())
    {
        words.extend([OsString::from(format!("--{FILE_FLAG}")), named.clone()]);
        file = Some(named.into());
    }
    let is_open = |name: &str| open.iter().any(|(flag, _)| flag.get_long() == Some(name));
    if let Some(file) = file {
        let entries = from_file(&file, &settings(&command))?;
        let entries = entries.into_iter().filter(|entry| is_open(&entry.name));
        words.extend(entries.flat_map(|entry| entry.words).map(OsString::from));
    }
    Ok(words)
}

/// The flags that may appear in a file.
pub fn settings(command: &Command) -> Vec<&Arg> {
    let serve = command.find_subcommand(COMMAND).expect("the program serves");
    let is_setting = |flag: &&Arg| flag.get_long().is_some_and(|name| !OTHER_FLAGS.contains(&name));
    serve.get_arguments().filter(is_setting).collect()
}

/// A flag's environment variable.
fn variable_name(flag: &Arg) -> String {
    match flag.get_long().unwrap_or_default() {
        "log" => "RUST_LOG".to_owned(),
        name => format!("JOSTLE_{}", name.to_ascii_uppercase().replace('-', "_")),
    }
}

/// The variable's value. An empty value counts as unset.
fn value_of(flag: &Arg, variable: impl Fn(&str) -> Option<OsString>) -> Option<OsString> {
    variable(&variable_name(flag)).filter(|value| !value.is_empty())
}

fn from_variable(flag: &Arg, value: &OsString) -> Result<Vec<OsString>, Failure> {
    let name = variable_name(flag);
    let text = value.to_str();
    let text =
        text.ok_or_else(|| Failure::Usage(format!("{name}: found bytes that are not UTF-8")))?;
    if matches!(flag.get_action(), ArgAction::SetTrue) {
        let switched = match text {
            "true" => {
                Some(vec![OsString::from(format!("--{}", flag.get_long().unwrap_or_default()))])
            }
            "false" => Some(Vec::new()),
            _ => None,
        };
        let text = format!("{name}: found {text:?}; allowed: one of true, false");
        return switched.ok_or(Failure::Usage(text));
    }
    let values: Vec<&str> = match flag.get_action() {
        ArgAction::Append => text.split(BETWEEN_VALUES).map(str::trim).collect(),
        _ => vec![text],
    };
    let words = values.into_iter().map(|value| {
        check(flag, value).map_err(|allowed| {
            Failure::Usage(format!("{name}: found {value:?}; allowed: {allowed}"))
        })?;
        Ok(OsString::from(word(flag, value)))
    });
    words.collect()
}

fn from_file(file: &Path, flags: &[&Arg]) -> Result<Vec<config_file::ConfigEntry>, Failure> {
    let name = file.display().to_string();
    let bytes = read_regular(file, SETTINGS_FILE_BYTES_MAX);
    let bytes = bytes.or_usage(format_args!("--config {name}"))?;
    config_file::read(&name, &text_of(&name, bytes)?, flags)
}

#[cfg(test)]
mod tests;
