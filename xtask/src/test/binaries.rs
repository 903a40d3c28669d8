//! The test programs: compiled once by cargo, then started without it. Cargo holds a lock on its directory while it
//! compiles, and steps of other lanes would wait for that.

use crate::shell::{cargo, line_of, run, target_dir};
use crate::workspace::USUAL_CRATES;
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Read by tests that start the program `jostle`, which would otherwise build it.
const PROGRAM_VARIABLE: &str = "JOSTLE_PROGRAM";

/// A compiled test program.
#[derive(Deserialize, Serialize)]
pub struct Binary {
    /// The crate's name.
    pub package: String,
    /// The target's name: that of an integration test, a library or a program.
    pub name: String,
    /// Whether it is an integration test.
    pub is_integration: bool,
    /// The crate's directory, in which its tests run.
    dir: PathBuf,
    program: PathBuf,
}

/// Compiles all test programs, and the programs that tests start.
pub fn compile() -> Result<()> {
    // Where it fails, no step may take the programs of an earlier run for these.
    fs::remove_file(list()).or_else(|error| match error.kind() {
        ErrorKind::NotFound => Ok(()),
        _ => Err(error),
    })?;
    let mut build = cargo(&["test", "--no-run", "--message-format", "json-render-diagnostics"]);
    build.args(USUAL_CRATES).arg("--tests");
    let output = build.stderr(Stdio::inherit()).output().context("cannot start cargo")?;
    if !output.status.success() {
        bail!("`{}` failed ({})", line_of(&build), output.status);
    }
    let text = String::from_utf8(output.stdout).context("cargo printed no UTF-8")?;
    let found = text.lines().map(parse).collect::<Result<Vec<_>>>()?;
    let found: Vec<Binary> = found.into_iter().flatten().collect();
    fs::write(list(), serde_json::to_vec(&found)?).context("cannot write the list of tests")?;
    println!("{} test programs", found.len());
    // Those that tests start. Not xtask itself: a program that runs must not be replaced.
    run(cargo(&["build", "--bin", "jostle", "--bin", "jostle-goldens"]).args(USUAL_CRATES))
}

/// A line of what cargo says: a test program, or something else.
fn parse(line: &str) -> Result<Option<Binary>> {
    let message: Value = serde_json::from_str(line).context("a message of cargo")?;
    let is_test = message["profile"]["test"] == true;
    let Some(program) = message["executable"].as_str().filter(|_| is_test) else {
        return Ok(None);
    };
    let manifest = Path::new(message["manifest_path"].as_str().context("no manifest")?);
    let dir = manifest.parent().context("a manifest lies in a directory")?;
    let text = fs::read_to_string(manifest).with_context(|| format!("{}", manifest.display()))?;
    let package = text.lines().find_map(|line| line.strip_prefix("name = "));
    let package = package.context("a manifest without a name")?.trim_matches('"');
    let target = &message["target"];
    Ok(Some(Binary {
        package: package.to_owned(),
        name: target["name"].as_str().context("no name")?.to_owned(),
        is_integration: target["kind"][0] == "test",
        dir: dir.to_owned(),
        program: program.into(),
    }))
}

/// The programs that [`compile`] made.
pub fn all() -> Result<Vec<Binary>> {
    let path = list();
    let text = fs::read(&path).with_context(|| format!("no {}", path.display()))?;
    serde_json::from_slice(&text).with_context(|| path.display().to_string())
}

fn list() -> PathBuf {
    target_dir().join("test/binaries.json")
}

/// Runs each to its end, also after one has failed.
pub fn run_all(binaries: &[&Binary], args: &[&str]) -> Result<()> {
    if binaries.is_empty() {
        bail!("no such tests were compiled");
    }
    let mut failed = Vec::new();
    for binary in binaries {
        println!("\n{} of {}", binary.name, binary.package);
        let mut command = Command::new(&binary.program);
        command.args(args).current_dir(&binary.dir).env("CARGO_MANIFEST_DIR", &binary.dir);
        command.env(PROGRAM_VARIABLE, target_dir().join("debug/jostle"));
        if run(&mut command).is_err() {
            failed.push(binary.name.as_str());
        }
    }
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn only_test_programs_are_kept() {
        let line = |test: bool, executable: &str| {
            format!(
                r#"{{"manifest_path": "{}/Cargo.toml", "profile": {{"test": {test}}}, "executable": {executable},
                "target": {{"name": "lints", "kind": ["test"]}}}}"#,
                env!("CARGO_MANIFEST_DIR")
            )
        };
        let found = parse(&line(true, r#""target/debug/deps/lints-1""#)).expect("a message");
        let found = found.expect("a test program");
        assert_eq!((found.package.as_str(), found.name.as_str()), ("xtask", "lints"));
        assert!(found.is_integration);
        assert!(parse(&line(false, r#""target/debug/xtask""#)).expect("a message").is_none());
        assert!(parse(&line(true, "null")).expect("a message").is_none());
        assert!(parse(r#"{"reason": "build-finished"}"#).expect("a message").is_none());
        assert!(parse("{").is_err());
    }
}
