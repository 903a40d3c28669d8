//! The same scene, seed and inputs always give the same game. `tests/goldens/hashes.txt` holds the final state hashes.
//! Each run is also recorded, and the replays are verified along with the golden ones, by this build and others.

use crate::shell::{cargo, output_of, root, run, say, target_dir};
use crate::workspace::USUAL_CRATES;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

const SEED: u64 = 7;
const TICKS: usize = 600;
const INPUTS: &str = "tests/inputs";
const HASHES: &str = "tests/goldens/hashes.txt";
const HEADER: &str =
    "# scene, seed, ticks, final hash; written by `cargo xtask test --update-hashes`\n";

/// Plays every built-in scene and compares the final state hashes with the golden ones. Expects the program to be
/// compiled already.
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

/// Plays every built-in scene and updates the golden hashes.
pub fn update() -> Result<()> {
    run(cargo(&["build", "--bin", "jostle"]).args(USUAL_CRATES))?;
    let lines = play_all()?;
    let path = root().join(HASHES);
    fs::write(&path, format!("{HEADER}{}\n", lines.join("\n")))
        .with_context(|| format!("cannot write {}", path.display()))?;
    say("golden hashes", &format!("wrote {HASHES}"));
    Ok(())
}

/// Describes the lines that are in one list but not in the other.
fn differences(golden: &str, played: &[String]) -> Vec<String> {
    let golden: Vec<&str> =
        golden.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
    let missing = golden.iter().filter(|line| !played.iter().any(|other| other == *line));
    let new = played.iter().filter(|line| !golden.contains(&line.as_str()));
    let missing = missing.map(|line| format!("expected {line}"));
    missing.chain(new.map(|line| format!("played   {line}"))).collect()
}

/// The replays recorded by the most recent [`check`].
pub fn replays() -> Result<Vec<String>> {
    let scenes = scenes()?;
    let paths = scenes.iter().map(|scene| replay_of(scene).display().to_string());
    Ok(paths.collect())
}

/// Plays all scenes and returns a golden line for each.
fn play_all() -> Result<Vec<String>> {
    let dir = dir();
    fs::create_dir_all(&dir).with_context(|| format!("cannot make {}", dir.display()))?;
    scenes()?.iter().map(|scene| play(scene)).collect()
}

fn scenes() -> Result<Vec<String>> {
    let text = output_of(jostle().args(["scene", "list", "--json"]))?;
    let list: Value = serde_json::from_str(&text).context("`jostle scene list --json`")?;
    let scenes = list["scenes"].as_array().filter(|scenes| !scenes.is_empty());
    let scenes = scenes.context("`jostle scene list` lists no scene")?;
    scenes.iter().map(|scene| text_of(scene, "name")).collect()
}

/// Plays a scene with its inputs, records it, and returns its golden line.
fn play(scene: &str) -> Result<String> {
    let inputs = root().join(INPUTS).join(format!("{scene}.jsonl"));
    if !inputs.is_file() {
        bail!("{scene}: no {INPUTS}/{scene}.jsonl; write inputs that use each of its tools");
    }
    let replay = replay_of(scene);
    // The program does not overwrite replays.
    if replay.is_file() {
        fs::remove_file(&replay).with_context(|| format!("cannot remove {}", replay.display()))?;
    }
    let mut command = jostle();
    command.args(["run", scene, "--json", "--ticks", &TICKS.to_string()]);
    command.args(["--seed", &SEED.to_string(), "--inputs"]).arg(inputs);
    let summary = output_of(command.arg("--replay").arg(&replay))?;
    let summary = serde_json::from_str(&summary).with_context(|| format!("summary of {scene}"))?;
    let hash = text_of(&summary, "hash")?;
    say("golden hashes", &format!("{scene}: {TICKS} ticks, {hash}"));
    Ok(format!("{scene} {SEED} {TICKS} {hash}"))
}

fn dir() -> PathBuf {
    target_dir().join("golden-runs")
}

fn replay_of(scene: &str) -> PathBuf {
    dir().join(format!("{scene}.jostle"))
}

fn text_of(value: &Value, field: &str) -> Result<String> {
    let text = value[field].as_str().with_context(|| format!("{value} without {field}"))?;
    Ok(text.to_owned())
}

fn jostle() -> Command {
    let mut command = Command::new(target_dir().join("debug/jostle"));
    command.current_dir(root());
    command
}

#[cfg(test)]
mod tests {
    use super::differences;

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
}
