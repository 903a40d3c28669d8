//! The test programs, which cargo compiles once and which are then started without it. Cargo locks its directory while
//! it compiles, which would make steps of other lanes wait.

use crate::shell::{cargo, line_of, target_dir};
use crate::workspace::USUAL_CRATES;
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::thread;

/// Environment variable read by tests that start the program `jostle`; without it they would build the program.
const PROGRAM_VARIABLE: &str = "JOSTLE_PROGRAM";

/// A compiled test program.
#[derive(Deserialize, Serialize)]
pub struct Binary {
    pub package: String,
    /// Name of the target, which is an integration test, a library or a program.
    pub name: String,
    /// Whether it is an integration test.
    pub is_integration: bool,
    /// The crate's directory, which its tests run in.
    dir: PathBuf,
    program: PathBuf,
}

/// Compiles all test programs and the programs that tests start, and keeps clippy's output.
///
/// Clippy's driver is a compiler with more lints, so one pass gives both results; `cargo clippy` would check every
/// dependency a second time.
pub fn compile() -> Result<()> {
    // If compilation fails, no step may mistake the results of an earlier run for current ones.
    for path in [list(), warnings()] {
        fs::remove_file(path).or_else(|error| match error.kind() {
            ErrorKind::NotFound => Ok(()),
            _ => Err(error),
        })?;
    }
    // Programs that tests start, by name. xtask itself is excluded, because a running program must not be replaced.
    let targets = ["--tests", "--examples", "--bin", "jostle", "--bin", "jostle-goldens"];
    let mut build = cargo(&["build", "--message-format", "json"]);
    build.args(USUAL_CRATES).args(targets).env("RUSTC_WORKSPACE_WRAPPER", "clippy-driver");
    let output = build.stderr(Stdio::inherit()).output().context("cannot start cargo")?;
    let text = String::from_utf8(output.stdout).context("cargo printed no UTF-8")?;
    let said = text.lines().map(parse).collect::<Result<Vec<_>>>()?;
    let mut found = Vec::new();
    // Warnings that occur both with and without a library's tests are shown only once.
    let mut warned = BTreeSet::new();
    for said in said.into_iter().flatten() {
        match said {
            Said::Test(binary) => found.push(binary),
            Said::Warning(text) => drop(warned.insert(text)),
            Said::Error(text) => println!("{text}"),
        }
    }
    if !output.status.success() {
        bail!("`{}` failed ({})", line_of(&build), output.status);
    }
    fs::write(list(), serde_json::to_vec(&found)?).context("cannot write the list of tests")?;
    let warned: Vec<String> = warned.into_iter().collect();
    fs::write(warnings(), warned.concat()).context("cannot write what clippy says")?;
    println!("{} test programs, {} warnings", found.len(), warned.len());
    Ok(())
}

/// Fails if [`compile`] collected warnings from the compiler or clippy.
pub fn check_warnings() -> Result<()> {
    let path = warnings();
    let text = fs::read_to_string(&path).with_context(|| format!("no {}", path.display()))?;
    if !text.is_empty() {
        bail!("{text}\nwarnings are not allowed");
    }
    Ok(())
}

/// A relevant message from cargo.
enum Said {
    Test(Binary),
    /// A warning, as printed by the compiler.
    Warning(String),
    Error(String),
}

/// Parses a line of cargo's output: a test program, a warning, or something else.
fn parse(line: &str) -> Result<Option<Said>> {
    let message: Value = serde_json::from_str(line).context("a message of cargo")?;
    if let Some(text) = message["message"]["rendered"].as_str() {
        // Summaries such as "3 warnings emitted" do not have a position.
        let has_place = message["message"]["spans"].as_array().is_some_and(|all| !all.is_empty());
        return Ok(match message["message"]["level"].as_str() {
            Some("warning") if has_place => Some(Said::Warning(text.to_owned())),
            Some("error" | "error: internal compiler error") => Some(Said::Error(text.to_owned())),
            _ => None,
        });
    }
    let is_test = message["profile"]["test"] == true && message["target"]["kind"][0] != "example";
    let Some(program) = message["executable"].as_str().filter(|_| is_test) else {
        return Ok(None);
    };
    let manifest = Path::new(message["manifest_path"].as_str().context("no manifest")?);
    let dir = manifest.parent().context("a manifest lies in a directory")?;
    let text = fs::read_to_string(manifest).with_context(|| format!("{}", manifest.display()))?;
    let package = text.lines().find_map(|line| line.strip_prefix("name = "));
    let package = package.context("a manifest without a name")?.trim_matches('"');
    let target = &message["target"];
    Ok(Some(Said::Test(Binary {
        package: package.to_owned(),
        name: target["name"].as_str().context("no name")?.to_owned(),
        is_integration: target["kind"][0] == "test",
        dir: dir.to_owned(),
        program: program.into(),
    })))
}

/// The programs built by [`compile`].
pub fn all() -> Result<Vec<Binary>> {
    let path = list();
    let text = fs::read(&path).with_context(|| format!("no {}", path.display()))?;
    serde_json::from_slice(&text).with_context(|| path.display().to_string())
}

fn list() -> PathBuf {
    target_dir().join("test/binaries.json")
}

fn warnings() -> PathBuf {
    target_dir().join("test/warnings.txt")
}

/// Runs all programs to completion, even after failures, and always two concurrently, because most end with one or two
/// slow tests.
pub fn run_all(binaries: &[&Binary], args: &[&str]) -> Result<()> {
    if binaries.is_empty() {
        bail!("no such tests were compiled");
    }
    let (left, failed) = (Mutex::new(binaries.iter()), Mutex::new(Vec::new()));
    let next = || left.lock().expect("no test program panics here").next();
    let work = || {
        while let Some(binary) = next() {
            if let Err(error) = run_one(binary, args, binaries.len() == 1) {
                println!("{error:#}");
                failed.lock().expect("no test program panics here").push(binary.name.as_str());
            }
        }
    };
    thread::scope(|scope| {
        scope.spawn(work);
        work();
    });
    let failed = failed.into_inner().expect("no test program panics here");
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    Ok(())
}

/// Runs one program. If it is `alone`, its output goes directly to the terminal; otherwise it is printed at the end.
fn run_one(binary: &Binary, args: &[&str], alone: bool) -> Result<()> {
    let mut command = Command::new(&binary.program);
    command.args(args).current_dir(&binary.dir).env("CARGO_MANIFEST_DIR", &binary.dir);
    command.env(PROGRAM_VARIABLE, target_dir().join("debug/jostle"));
    let title = format!("{} of {}", binary.name, binary.package);
    let started = if alone {
        println!("{title}");
        command.status()
    } else {
        command.output().map(|output| {
            let said = [output.stdout, output.stderr].concat();
            println!("\n{title}\n{}", String::from_utf8_lossy(&said));
            output.status
        })
    };
    let status = started.with_context(|| format!("cannot start {}", line_of(&command)))?;
    if !status.success() {
        bail!("`{}` failed ({status})", line_of(&command));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Said, parse};

    #[test]
    fn only_test_programs_are_kept() {
        let line = |test: bool, kind: &str, executable: &str| {
            format!(
                r#"{{"manifest_path": "{}/Cargo.toml", "profile": {{"test": {test}}}, "executable": {executable},
                "target": {{"name": "lints", "kind": ["{kind}"]}}}}"#,
                env!("CARGO_MANIFEST_DIR")
            )
        };
        let found = parse(&line(true, "test", r#""target/debug/deps/lints-1""#));
        let Ok(Some(Said::Test(found))) = found else { panic!("a test program") };
        assert_eq!((found.package.as_str(), found.name.as_str()), ("xtask", "lints"));
        assert!(found.is_integration);
        let other = |line: &str| parse(line).expect("a message").is_none();
        assert!(other(&line(false, "bin", r#""target/debug/xtask""#)));
        assert!(other(&line(true, "example", r#""target/debug/examples/icons""#)));
        assert!(other(&line(true, "lib", "null")));
        assert!(other(r#"{"reason": "build-finished"}"#));
        assert!(parse("{").is_err());
    }

    #[test]
    fn warnings_with_a_place_are_kept() {
        let line = |level: &str, spans: &str| {
            format!(
                r#"{{"message": {{"rendered": "unused", "level": "{level}", "spans": [{spans}]}}}}"#
            )
        };
        let said = |level, spans| parse(&line(level, spans)).expect("a message");
        assert!(matches!(said("warning", "{}"), Some(Said::Warning(text)) if text == "unused"));
        assert!(said("warning", "").is_none());
        assert!(matches!(said("error", "{}"), Some(Said::Error(text)) if text == "unused"));
        assert!(said("note", "{}").is_none());
    }
}
