use super::*;
use crate::CommandLine;
use clap::{CommandFactory, Parser};
use std::fs;

/// The example from the documentation.
const EXAMPLE: &str = include_str!("../../../docs/examples/jostle.toml");

/// Writes a configuration file for one test.
fn file(test: &str, text: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("jostle-{test}-{}.toml", std::process::id()));
    fs::write(&path, text).expect("a writable directory");
    path
}

/// The words that these variables and the file add to a command line.
fn added(words: &[&str], variables: &[(&str, &str)]) -> Result<Vec<String>, Failure> {
    let variable = |name: &str| {
        let value = variables.iter().find(|(known, _)| *known == name);
        value.map(|(_, value)| OsString::from(value))
    };
    let words: Vec<OsString> = ["jostle"].iter().chain(words).map(OsString::from).collect();
    let completed = complete(CommandLine::command(), words.clone(), variable)?;
    assert!(completed.starts_with(&words), "{completed:?}");
    let added = completed[words.len()..].iter();
    Ok(added.map(|word| word.to_str().expect("text").to_owned()).collect())
}

#[test]
fn a_flag_is_stronger_than_a_variable_and_that_than_the_file() {
    let path = file(
        "layers",
        "listen = '127.0.0.1:1'\nops = '127.0.0.1:2'\nhost = ['a', 'b']\nlog = 'warn'\nreplays-mb = 5\n",
    );
    let config = format!("--config={}", path.display());
    let variables = [
        ("JOSTLE_LISTEN", "127.0.0.1:3"),
        ("JOSTLE_HOST", "c, d"),
        ("RUST_LOG", "error"),
        ("JOSTLE_SCENES", ""),
    ];
    for command in ["serve", "doctor"] {
        let of_file = [
            "--host=a",
            "--host=b",
            "--listen=127.0.0.1:1",
            "--log=warn",
            "--ops=127.0.0.1:2",
            "--replays-mb=5",
        ];
        let sorted = |words: &[&str], variables: &[(&str, &str)]| {
            let mut added = added(words, variables).expect("good settings");
            added.sort();
            added
        };
        assert_eq!(sorted(&[command, &config], &[]), of_file);
        let of_both = [
            "--host=c",
            "--host=d",
            "--listen=127.0.0.1:3",
            "--log=error",
            "--ops=127.0.0.1:2",
            "--replays-mb=5",
        ];
        assert_eq!(sorted(&[command, &config], &variables), of_both);
        let flags = [
            "--log",
            "info",
            command,
            &config,
            "--listen",
            "127.0.0.1:4",
            "--host=e",
            "--ops=127.0.0.1:5",
        ];
        assert_eq!(sorted(&flags, &variables), ["--replays-mb=5"]);
    }
    let by_variable =
        added(&["serve"], &[(FILE_VARIABLE, path.to_str().expect("text"))]).expect("good settings");
    assert!(by_variable.contains(&"--ops=127.0.0.1:2".to_owned()), "{by_variable:?}");
    fs::remove_file(path).expect("a file of ours");
}

#[test]
fn a_wrong_variable_is_named() {
    for (name, value, error) in [
        (
            "JOSTLE_LISTEN",
            "here",
            "JOSTLE_LISTEN: found \"here\"; allowed: an IP address and a port",
        ),
        ("JOSTLE_ADDRESS_SOCKETS", "0", "found \"0\"; allowed: a whole number from 1 to 65536"),
        ("JOSTLE_HOST", "a,https://b", "JOSTLE_HOST: found \"https://b\"; allowed: a name without"),
        ("JOSTLE_STATE_SYNC", "never", "allowed: one of second, system"),
    ] {
        match added(&["serve"], &[(name, value)]) {
            Err(Failure::Usage(text)) => assert!(text.contains(error), "{text}"),
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn nothing_is_added_to_other_commands_and_to_those_that_are_refused() {
    let variables = [("JOSTLE_LISTEN", "127.0.0.1:3")];
    for words in [&["scene", "list"][..], &["serve", "--help"], &[], &["dance"]] {
        assert_eq!(added(words, &variables).expect("no settings"), [""; 0], "{words:?}");
    }
    // A wrong flag is refused first, whatever the file contains.
    let words =
        ["jostle", "serve", "--listen", "here", "--config", "/no/such/file"].map(OsString::from);
    let completed =
        complete(CommandLine::command(), words.into(), |_| None).expect("no file is read");
    let error =
        CommandLine::try_parse_from(completed).map(drop).expect_err("no address").to_string();
    assert!(error.contains("--listen"), "{error}");
}

#[test]
fn the_example_has_every_setting() {
    let mut command = CommandLine::command();
    command.build();
    let settings = settings(&command);
    let read = |text: &str| {
        config_file::read("jostle.toml", text, &settings)
            .unwrap_or_else(|error| panic!("{error:?}"))
    };
    assert!(!read(EXAMPLE).is_empty(), "as it is");
    // Settings that are switched off begin with `#`, and sentences with `# `.
    let switched_on = |line: &str| match line.strip_prefix('#') {
        Some(setting) if !setting.starts_with(' ') => setting.to_owned(),
        _ => line.to_owned(),
    };
    let all: Vec<String> = EXAMPLE.lines().map(switched_on).collect();
    let all = read(&all.join("\n"));
    for flag in settings {
        let name = flag.get_long().expect("a flag");
        assert!(
            all.iter().any(|entry| entry.name == name),
            "{name} is missing in docs/examples/jostle.toml"
        );
    }
}
