//! One scene, one seed, one list of inputs: one trace, however the program was built and however
//! often it runs. And the same as ever: `tests/goldens/hashes.txt` holds the final state hashes.

use crate::shell::{build_server, cargo, output_of, root, run, say, target_dir};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SEED: u64 = 7;
const TICKS: usize = 600;
const INPUTS: &str = "tests/inputs";
const HASHES: &str = "tests/goldens/hashes.txt";
const HEADER: &str =
    "# scene, seed, ticks, final hash; written by `cargo xtask test --update-hashes`\n";

/// A scene was played: every tick, and the last state hash.
struct Played {
    trace: String,
    hash: String,
}

/// Plays every built-in scene and compares the traces with each other and with the golden hashes.
pub fn check() -> Result<()> {
    let played = play_all()?;
    let path = root().join(HASHES);
    let golden = fs::read_to_string(&path)
        .with_context(|| format!("no {HASHES}; `cargo xtask test --update-hashes` writes it"))?;
    let found = differences(&golden, &played);
    if found.is_empty() {
        return Ok(());
    }
    bail!(
        "{HASHES} says otherwise; if this is a wanted change, run `cargo xtask test \
         --update-hashes`:\n  {}",
        found.join("\n  ")
    )
}

/// Plays every built-in scene and writes the golden hashes anew.
pub fn update() -> Result<()> {
    let lines = play_all()?;
    let path = root().join(HASHES);
    fs::write(&path, format!("{HEADER}{}\n", lines.join("\n")))
        .with_context(|| format!("cannot write {}", path.display()))?;
    say("traces", &format!("wrote {HASHES}"));
    Ok(())
}

/// The lines that are in one and not in the other, said as such.
fn differences(golden: &str, played: &[String]) -> Vec<String> {
    let golden: Vec<&str> =
        golden.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
    let missing = golden.iter().filter(|line| !played.iter().any(|other| other == *line));
    let new = played.iter().filter(|line| !golden.contains(&line.as_str()));
    let missing = missing.map(|line| format!("expected {line}"));
    missing.chain(new.map(|line| format!("played   {line}"))).collect()
}

/// Plays each scene twice in a debug build and once in a release build; a golden line for each.
fn play_all() -> Result<Vec<String>> {
    run(&mut cargo(&["build", "--workspace", "--bin", "jostle"]))?;
    build_server(&["--bin", "jostle"])?;
    let dir = target_dir().join("traces");
    fs::create_dir_all(&dir).with_context(|| format!("cannot make {}", dir.display()))?;
    scenes()?.iter().map(|scene| play_thrice(scene, &dir)).collect()
}

fn scenes() -> Result<Vec<String>> {
    let text = output_of(jostle("debug").args(["scene", "list", "--json"]))?;
    let list: Value = serde_json::from_str(&text).context("`jostle scene list --json`")?;
    let scenes = list["scenes"].as_array().filter(|scenes| !scenes.is_empty());
    let scenes = scenes.context("`jostle scene list` lists no scene")?;
    scenes.iter().map(|scene| text_of(scene, "name")).collect()
}

fn play_thrice(scene: &str, dir: &Path) -> Result<String> {
    let inputs = root().join(INPUTS).join(format!("{scene}.jsonl"));
    if !inputs.is_file() {
        bail!("{scene}: no {INPUTS}/{scene}.jsonl; write inputs that use each of its tools");
    }
    let file = |name: &str| dir.join(format!("{scene}-{name}.jsonl"));
    let first = play("debug", scene, &inputs, file("debug"))?;
    let again = play("debug", scene, &inputs, file("again"))?;
    let release = play("release", scene, &inputs, file("release"))?;
    compare(scene, "two debug runs", &first, &again)?;
    compare(scene, "debug and release", &first, &release)?;
    say("traces", &format!("{scene}: {TICKS} ticks, the same three times, {}", first.hash));
    Ok(format!("{scene} {SEED} {TICKS} {}", first.hash))
}

fn play(build: &str, scene: &str, inputs: &Path, file: PathBuf) -> Result<Played> {
    let mut command = jostle(build);
    command.args(["run", scene, "--json", "--ticks", &TICKS.to_string()]);
    command.args(["--seed", &SEED.to_string(), "--inputs"]).arg(inputs);
    let summary = output_of(command.arg("--trace").arg(&file))?;
    let summary = serde_json::from_str(&summary).with_context(|| format!("summary of {scene}"))?;
    let hash = text_of(&summary, "hash")?;
    let trace =
        fs::read_to_string(&file).with_context(|| format!("no trace {}", file.display()))?;
    let lines = trace.lines().count();
    if lines != TICKS {
        bail!("{scene}: {lines} lines for {TICKS} ticks in {}", file.display());
    }
    Ok(Played { trace, hash })
}

fn text_of(value: &Value, field: &str) -> Result<String> {
    let text = value[field].as_str().with_context(|| format!("{value} without {field}"))?;
    Ok(text.to_owned())
}

fn jostle(build: &str) -> Command {
    let mut command = Command::new(target_dir().join(build).join("jostle"));
    command.current_dir(root());
    command
}

fn compare(scene: &str, what: &str, left: &Played, right: &Played) -> Result<()> {
    let lines = || left.trace.lines().zip(right.trace.lines()).enumerate();
    if let Some((index, (left, right))) = lines().find(|(_, (left, right))| left != right) {
        bail!("{scene}: {what} differ from tick {} on:\n  {left}\n  {right}", index + 1);
    }
    if left.trace != right.trace || left.hash != right.hash {
        bail!("{scene}: {what} differ at their end: {} and {}", left.hash, right.hash);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Played, compare, differences};

    fn played(trace: &str) -> Played {
        Played { trace: trace.into(), hash: "0".into() }
    }

    #[test]
    fn a_changed_a_missing_and_a_new_scene_are_found() {
        let golden = "# words\nyard 7 600 aa\nlift 7 600 bb\n";
        let lines = |list: &[&str]| list.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>();
        let same = lines(&["yard 7 600 aa", "lift 7 600 bb"]);
        assert_eq!(differences(golden, &same), Vec::<String>::new());
        let other = lines(&["yard 7 600 ab", "lift 7 600 bb", "pond 7 600 cc"]);
        let found = ["expected yard 7 600 aa", "played   yard 7 600 ab", "played   pond 7 600 cc"];
        assert_eq!(differences(golden, &other), found);
    }

    #[test]
    fn the_first_tick_that_differs_is_named() {
        assert!(compare("yard", "two", &played("a\nb\n"), &played("a\nb\n")).is_ok());
        let error = compare("yard", "two", &played("a\nb\n"), &played("a\nc\n")).unwrap_err();
        assert!(error.to_string().contains("tick 2"), "{error}");
        assert!(compare("yard", "two", &played("a\n"), &played("a\nb\n")).is_err());
    }
}
