//! `cargo xtask fuzz`: tries the properties in `tests/fuzz` on millions of inputs, guided by coverage. cargo-fuzz
//! builds a libFuzzer program with a nightly compiler, once without and once with the server. Missing tools are
//! installed, cargo-fuzz into the target directory.

use crate::shell::{cargo, in_path, line_of, root, run, say, target_dir};
use anyhow::{Context, Result, bail};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const FUZZ_DIR: &str = "tests/fuzz/targets";
const TARGET: &str = "property";
const TOOL: &str = "cargo-fuzz";
const TOOL_VERSION: &str = "0.13.2";
/// Folders of the corpus, one per fuzzing program, each with the program's build flags.
const PROGRAMS: [(&str, &[&str]); 2] = [("rooms", &[]), ("servers", &["--features", "server"])];
/// Folders with additional inputs, by property.
const MORE_INPUTS: [(&str, &str); 2] = [("scene", "assets/scenes"), ("scene", "tests/scenes")];
/// Number of lines of the fuzzer's output to show after a failure.
const LINES_SHOWN: usize = 60;
/// Limits on the length of an input, the seconds per input, and the megabytes in total and per allocation.
const LIMITS: [&str; 4] =
    ["-max_len=8192", "-timeout=20", "-rss_limit_mb=2048", "-malloc_limit_mb=256"];

/// Tries one property, or all of them one after another, for `seconds` each. Failures are reported at the end.
pub fn fuzz(only: Option<&str>, seconds: u32) -> Result<()> {
    let corpus = ["run", "--quiet", "--package", "jostle-fuzz", "--example", "corpus", "--"];
    run(cargo(&corpus).arg(dir("seeds")))?;
    let chosen = chosen(only)?;
    provide()?;
    let (mut inputs, mut failed) = (0, Vec::new());
    for Chosen { seeds, features, name } in &chosen {
        say("fuzz", &format!("{name}: build, then {seconds} s"));
        run(tool("build", features).arg(TARGET))?;
        let (tried, failure) = try_property(name, seeds, features, seconds)?;
        say("fuzz", &format!("{name}: {tried} inputs"));
        inputs += tried;
        if let Some(last_lines) = failure {
            last_lines.iter().for_each(|line| println!("  {line}"));
            failed.push(name.as_str());
        }
    }
    say(
        "fuzz",
        &format!("{inputs} inputs for {} properties, {} failed", chosen.len(), failed.len()),
    );
    if failed.is_empty() { Ok(()) } else { bail!("found something: {}", failed.join(", ")) }
}

/// A property to try.
struct Chosen {
    /// Folder of the corpus.
    seeds: PathBuf,
    features: &'static [&'static str],
    name: String,
}

/// The properties that have a corpus, in the order in which the programs are built.
fn chosen(only: Option<&str>) -> Result<Vec<Chosen>> {
    let mut all = Vec::new();
    for (program, features) in PROGRAMS {
        let folder = dir("seeds").join(program);
        let entries = fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
        for entry in entries {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            all.push(Chosen { seeds: entry.path(), features, name });
        }
    }
    all.sort_by(|a, b| a.seeds.cmp(&b.seeds));
    let Some(only) = only else { return Ok(all) };
    let known: Vec<String> = all.iter().map(|chosen| chosen.name.clone()).collect();
    all.retain(|chosen| chosen.name == only);
    if all.is_empty() {
        bail!("no property {only:?}; there are {}", known.join(", "));
    }
    Ok(all)
}

/// Installs the compiler and cargo-fuzz if they are missing.
fn provide() -> Result<()> {
    let known = nightly("rustc").arg("--version").stdout(Stdio::null()).status();
    if !known.context("rustup, which brings the nightly compiler")?.success() {
        let install = ["toolchain", "install", "nightly", "--profile", "minimal"];
        run(Command::new("rustup").args(install))?;
    }
    if !in_path(TOOL) && !installed().is_file() {
        let mut install = cargo(&["install", TOOL, "--locked", "--version", TOOL_VERSION]);
        run(install.arg("--root").arg(dir("tools")))?;
    }
    Ok(())
}

/// A folder for files that the fuzzer builds, reads or keeps.
fn dir(name: &str) -> PathBuf {
    target_dir().join("fuzz").join(name)
}

fn installed() -> PathBuf {
    dir("tools/bin").join(TOOL)
}

/// A command that runs in the environment of the nightly compiler instead of this task's.
fn nightly(program: &str) -> Command {
    let mut command = Command::new("rustup");
    command.args(["run", "nightly", program]).current_dir(root()).env_remove("CARGO");
    command
}

fn tool(task: &str, features: &[&str]) -> Command {
    let own = installed();
    let program = if own.is_file() { own.to_string_lossy().into_owned() } else { TOOL.to_owned() };
    let mut command = nightly(&program);
    command.args(["fuzz", task, "--fuzz-dir", FUZZ_DIR, "--target-dir"]).arg(dir("build"));
    command.args(features);
    command
}

/// Returns the number of inputs tried and, after a failure, the fuzzer's last lines, which name the input and say how
/// to reproduce it. New inputs are kept next to the corpus for the next run.
fn try_property(
    name: &str,
    seeds: &Path,
    features: &[&str],
    seconds: u32,
) -> Result<(u64, Option<Vec<String>>)> {
    let (found, broken) = (dir("corpus").join(name), dir("artifacts").join(name));
    fs::create_dir_all(&found)?;
    fs::create_dir_all(&broken)?;
    let mut command = tool("run", features);
    command.env("JOSTLE_PROPERTY", name).arg(TARGET).arg(found).arg(seeds);
    command.args(MORE_INPUTS.iter().filter(|(property, _)| *property == name).map(|(_, dir)| dir));
    command.arg("--").args(LIMITS).arg("-print_final_stats=1");
    command.arg(format!("-max_total_time={seconds}"));
    command.arg(format!("-artifact_prefix={}/", broken.display()));
    let mut child = command
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start {}", line_of(&command)))?;
    let stderr = child.stderr.take().context("the fuzzer's messages")?;
    let (mut inputs, mut last_lines) = (0, Vec::new());
    for line in BufReader::new(stderr).lines() {
        let line = line?;
        if let Some(count) = line.strip_prefix("stat::number_of_executed_units:") {
            inputs = count.trim().parse()?;
        }
        last_lines.push(line);
        let more = last_lines.len().saturating_sub(LINES_SHOWN);
        last_lines.drain(..more);
    }
    let passed = child.wait()?.success();
    Ok((inputs, (!passed).then_some(last_lines)))
}
