//! A TOML configuration file that contains a command's flags under their own names. Nothing is declared here, so no
//! flag can be forgotten: each flag's own definition gives the allowed values, and its own parser checks them.

use crate::output::Failure;
use clap::builder::Resettable;
use clap::{Arg, ArgAction, Command};
use jostle_game::scene::line_at;
use std::any::TypeId;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A flag from the file, in the form it would have on a command line.
#[derive(Debug, PartialEq)]
pub struct ConfigEntry {
    /// The flag's name, without hyphens.
    pub name: String,
    /// One word per value; empty if the flag is switched off.
    pub words: Vec<String>,
}

/// Reads a file in which these flags may appear. The error names the file, line and field, the value found, and the
/// allowed values.
pub fn read(file: &str, source: &str, flags: &[&Arg]) -> Result<Vec<ConfigEntry>, Failure> {
    let table = DeTable::parse(source).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        let found = error.message().lines().next().unwrap_or("an error");
        let found = format!("a line that is not TOML ({found})");
        refused(file, source, at, "file", &found, "TOML")
    })?;
    let entries = table.get_ref().iter().map(|(key, value)| {
        let name = key.get_ref().as_ref();
        let Some(flag) = flags.iter().find(|flag| flag.get_long() == Some(name)) else {
            let names: Vec<_> = flags.iter().filter_map(|flag| flag.get_long()).collect();
            let allowed = format!("the flags of `jostle serve`: {}", names.join(", "));
            return Err(refused(
                file,
                source,
                key.span().start,
                name,
                "an unknown field",
                &allowed,
            ));
        };
        words(flag, value).map_err(|(at, allowed)| {
            refused(file, source, at.start, name, &quoted(source, at), &allowed)
        })
    });
    entries.collect()
}

/// Checks a value with the flag's own parser. The error describes the allowed values.
pub fn check(flag: &Arg, value: &str) -> Result<(), String> {
    let command = Command::new("value").no_binary_name(true);
    // Any flags that this one requires may be set elsewhere.
    let command = command.arg(flag.clone().requires(Resettable::Reset));
    let Err(error) = command.try_get_matches_from([word(flag, value)]) else { return Ok(()) };
    let choices = flag.get_possible_values();
    if !choices.is_empty() {
        let names: Vec<_> = choices.iter().map(|choice| choice.get_name()).collect();
        return Err(format!("one of {}", names.join(", ")));
    }
    let reason = std::error::Error::source(&error).map(ToString::to_string).unwrap_or_default();
    Err(reason.strip_prefix("allowed: ").map_or_else(|| wanted(flag).to_owned(), str::to_owned))
}

/// A value in the form it would have on a command line.
pub fn word(flag: &Arg, value: &str) -> String {
    format!("--{}={value}", flag.get_long().unwrap_or_default())
}

/// Turns a value into words. The error consists of the position in the file and the allowed values.
fn words(flag: &Arg, value: &Spanned<DeValue>) -> Result<ConfigEntry, (Range<usize>, String)> {
    let name = flag.get_long().unwrap_or_default().to_owned();
    let words = match (flag.get_action(), value.get_ref()) {
        (ArgAction::SetTrue, DeValue::Boolean(true)) => vec![format!("--{name}")],
        (ArgAction::SetTrue, DeValue::Boolean(false)) => Vec::new(),
        (ArgAction::Append, DeValue::Array(items)) => {
            items.iter().map(|item| one_word(flag, item)).collect::<Result<_, _>>()?
        }
        _ => vec![one_word(flag, value)?],
    };
    Ok(ConfigEntry { name, words })
}

fn one_word(flag: &Arg, value: &Spanned<DeValue>) -> Result<String, (Range<usize>, String)> {
    let text = match value.get_ref() {
        DeValue::String(text) if !takes_number(flag) => Some(text.to_string()),
        DeValue::Integer(number) if takes_number(flag) => {
            i64::from_str_radix(number.as_str(), number.radix())
                .ok()
                .map(|number| number.to_string())
        }
        DeValue::Float(number) if takes_fraction(flag) => Some(number.as_str().to_owned()),
        _ => None,
    };
    let text = text.filter(|_| !matches!(flag.get_action(), ArgAction::SetTrue));
    // A value of the wrong type gets the same error as a value out of range.
    let checked =
        text.ok_or_else(|| check(flag, "").err().unwrap_or_else(|| wanted(flag).to_owned()));
    let checked = checked.and_then(|text| check(flag, &text).map(|()| word(flag, &text)));
    checked.map_err(|allowed| (value.span(), allowed))
}

fn takes_number(flag: &Arg) -> bool {
    let parsed = flag.get_value_parser().type_id();
    let numbers =
        [TypeId::of::<u16>(), TypeId::of::<u32>(), TypeId::of::<u64>(), TypeId::of::<usize>()];
    numbers.into_iter().any(|number| parsed == number) || takes_fraction(flag)
}

fn takes_fraction(flag: &Arg) -> bool {
    flag.get_value_parser().type_id() == TypeId::of::<f64>()
}

/// The allowed values for a flag whose parser does not describe them.
fn wanted(flag: &Arg) -> &'static str {
    match flag.get_action() {
        ArgAction::Append => "a text, or a list of texts",
        _ if takes_number(flag) => "a whole number",
        _ => "a text",
    }
}

fn refused(
    file: &str,
    source: &str,
    at: usize,
    field: &str,
    found: &str,
    allowed: &str,
) -> Failure {
    let line = line_at(source.as_bytes(), at);
    Failure::Check(format!("{file}:{line}: {field}: found {found}; allowed: {allowed}"))
}

/// The first line of a value, as written in the file.
fn quoted(source: &str, at: Range<usize>) -> String {
    source.get(at).and_then(|text| text.lines().next()).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, value_parser};

    /// One flag of each kind.
    #[derive(Args)]
    struct Flags {
        #[arg(long, value_parser = |text: &str| match text {
            "one" => Ok(1u8),
            _ => Err("allowed: one".to_owned()),
        })]
        _parsed: Option<u8>,
        #[arg(long, value_parser = value_parser!(u32).range(1..=9), requires = "_path")]
        _number: Option<u32>,
        #[arg(long)]
        _share: Option<f64>,
        #[arg(long)]
        _path: Option<std::path::PathBuf>,
        #[arg(long)]
        _names: Vec<String>,
        #[arg(long, value_parser = ["red", "blue"])]
        _choice: Option<String>,
        #[arg(long)]
        _switch: bool,
    }

    fn entries(source: &str) -> Result<Vec<(String, Vec<String>)>, String> {
        let command = Flags::augment_args(Command::new("flags"));
        let flags: Vec<&Arg> = command.get_arguments().collect();
        let read = read("a.toml", source, &flags).map_err(|failure| match failure {
            Failure::Check(text) => text,
            Failure::Usage(text) => panic!("{text}"),
        });
        Ok(read?.into_iter().map(|entry| (entry.name, entry.words)).collect())
    }

    #[test]
    fn each_kind_of_flag_is_read() {
        for (source, words) in [
            ("parsed = 'one'", &["--parsed=one"][..]),
            ("number = 0x9", &["--number=9"]),
            ("share = 0.5", &["--share=0.5"]),
            ("share = 2", &["--share=2"]),
            ("path = 'a b'", &["--path=a b"]),
            ("names = ['a', '-b']", &["--names=a", "--names=-b"]),
            ("names = 'a'", &["--names=a"]),
            ("names = []", &[]),
            ("choice = 'red'", &["--choice=red"]),
            ("switch = true", &["--switch"]),
            ("switch = false", &[]),
        ] {
            let entries = entries(source).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(entries[0].1, words, "{source}");
        }
    }

    #[test]
    fn errors_name_file_line_field_found_and_allowed() {
        for (source, error) in [
            ("\nparsed = 'two'", "a.toml:2: parsed: found 'two'; allowed: one"),
            ("parsed = 1", "a.toml:1: parsed: found 1; allowed: one"),
            ("number = '5'", "a.toml:1: number: found '5'; allowed: a whole number"),
            ("number = 2.5", "a.toml:1: number: found 2.5; allowed: a whole number"),
            ("path = 5", "a.toml:1: path: found 5; allowed: a text"),
            ("path = ''", "a.toml:1: path: found ''; allowed: a text"),
            (
                "names = [\n'a',\n7]",
                "a.toml:3: names: found 7; allowed: a text, or a list of texts",
            ),
            ("choice = 'green'", "a.toml:1: choice: found 'green'; allowed: one of red, blue"),
            ("switch = 'on'", "a.toml:1: switch: found 'on'; allowed: one of true, false"),
            ("path = ['a']", "a.toml:1: path: found ['a']; allowed: a text"),
            (
                "path = 'a'\npath = 'b'",
                "a.toml:2: file: found a line that is not TOML (duplicate key); allowed: TOML",
            ),
        ] {
            assert_eq!(entries(source), Err(error.to_owned()), "{source}");
        }
        let unknown = entries("\n\ncolour = 1").expect_err("an unknown field");
        assert!(
            unknown.starts_with("a.toml:3: colour: found an unknown field; allowed: "),
            "{unknown}"
        );
        assert!(
            unknown.ends_with(": parsed, number, share, path, names, choice, switch"),
            "{unknown}"
        );
    }
}
