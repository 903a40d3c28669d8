//! Tests `jostle run --replay` and `jostle replay`.

use crate::{directory, fails, jostle, path_text, succeeds};
use jostle_protocol::replay::{Block, Record, Replay, header};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Records bots playing in a scene.
fn record(directory: &Path, name: &str, scene: &str, ticks: u32) -> PathBuf {
    let file = directory.join(name);
    let (ticks, path) = (ticks.to_string(), path_text(&file));
    succeeds(&["run", scene, "--bots", "2", "--seed", "5", "--ticks", &ticks, "--replay", path]);
    file
}

/// Rewrites a replay with changed ticks and without keyframes.
fn rewrite(file: &Path, name: &str, change: impl Fn(&mut Block)) -> PathBuf {
    let replay = Replay::read(std::fs::read(file).expect("a file")).expect("a replay");
    let mut records = vec![Record::Start(replay.start().clone())];
    let mut next = 1;
    while let Some(mut block) = replay.block_with(next) {
        next = block.last() + 1;
        change(&mut block);
        records.push(Record::Ticks(block));
    }
    let hash = replay.end_hash().expect("a whole replay");
    records.push(Record::End { tick: replay.last_tick(), hash });
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    let other = file.with_file_name(name);
    std::fs::write(&other, bytes).expect("a written file");
    other
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn the_same_run_gives_the_same_replay_byte_for_byte() {
    let directory = directory("replay-same");
    let read = |file: PathBuf| std::fs::read(file).expect("a file");
    let one = read(record(&directory, "a.jostle", "arena", 400));
    assert_eq!(one, read(record(&directory, "b.jostle", "arena", 400)));
    let trace = |replay: &str| {
        let path = directory.join("t.jsonl");
        let run = ["run", "arena", "--bots", "2", "--ticks", "400", "--trace", path_text(&path)];
        succeeds(&[&run[..], &["--replay", replay]].concat());
        read(path)
    };
    let file = directory.join("c.jostle");
    let traced = trace(path_text(&file));
    assert_eq!(traced, succeeds(&["replay", "trace", path_text(&file)]).into_bytes());
}

#[test]
fn bots_have_limits() {
    fails(&["run", "arena", "--bots", "0"], 2, "--bots");
    fails(&["run", "arena", "--bots", "65"], 2, "--bots: found 65; allowed: 1 to ");
    fails(&["run", "arena", "--bots", "1", "--inputs", "keys.jsonl"], 2, "--inputs");
    fails(&["run", "arena", "--replay", "/no/such/file"], 2, "/no/such/file");
}

#[test]
fn info_describes_a_replay() {
    let file = record(&directory("replay-info"), "a.jostle", "impulse", 700);
    let bytes = std::fs::read(&file).expect("a file");
    let text = succeeds(&["replay", "info", path_text(&file)]);
    assert!(text.contains("impulse with seed 5") && text.contains("ticks 1 to 700"), "{text}");
    let info = json(&succeeds(&["replay", "info", path_text(&file), "--json"]));
    assert_eq!((&info["scene"], &info["seed"]), (&"impulse".into(), &5.into()));
    assert_eq!((&info["first_tick"], &info["last_tick"]), (&0.into(), &700.into()));
    assert_eq!((&info["whole"], &info["cut"]), (&true.into(), &Value::Null));
    assert_eq!(info["program"], env!("CARGO_PKG_VERSION"));
    assert_eq!(info["player_ticks"], 1400);
    let players = info["players"].as_array().expect("a list");
    let names: Vec<_> = players.iter().map(|player| player["name"].as_str()).collect();
    assert_eq!(names, [Some("Bot 1"), Some("Bot 2")]);
    let kinds = info["bytes"].as_object().expect("an object");
    let parts = kinds.iter().filter(|(kind, _)| *kind != "total");
    let sum: u64 = parts.map(|(_, bytes)| bytes.as_u64().expect("a number")).sum();
    assert_eq!((sum, kinds["total"].as_u64()), (bytes.len() as u64, Some(bytes.len() as u64)));

    let cut = file.with_file_name("cut.jostle");
    std::fs::write(&cut, &bytes[..bytes.len() - 3]).expect("a written file");
    let info = json(&succeeds(&["replay", "info", path_text(&cut), "--json"]));
    assert_eq!(info["whole"], false);
    assert!(info["cut"]["offset"].as_u64().is_some_and(|offset| offset < bytes.len() as u64));
    assert_eq!(info["cut"]["reason"], "the file ends within a record");
}

#[test]
fn equal_and_truncated_replays_verify() {
    let directory = directory("replay-verify");
    let files: Vec<_> = ["arena", "pile", "particles"]
        .iter()
        .map(|scene| record(&directory, &format!("{scene}.jostle"), scene, 700))
        .collect();
    let cut = directory.join("cut.jostle");
    let bytes = std::fs::read(&files[0]).expect("a file");
    std::fs::write(&cut, &bytes[..bytes.len() - 40]).expect("a written file");
    let mut paths: Vec<_> = files.iter().map(|file| path_text(file)).collect();
    paths.push(path_text(&cut));
    let text = succeeds(&[&["replay", "verify", "--jobs", "2"], &paths[..]].concat());
    let lines: Vec<_> = text.lines().collect();
    assert_eq!(lines.len(), 5, "{text}");
    for (line, path) in lines.iter().zip(&paths[..3]) {
        assert_eq!(*line, format!("{path}: ok"));
    }
    let cut_line = format!("{}: ok, cut at byte ", paths[3]);
    assert!(lines[3].starts_with(&cut_line) && lines[3].ends_with("equal to tick 600"), "{text}");
    assert!(lines[4].starts_with("4 files: 4 equal, 1 of them cut; 2700 ticks, 0:00:45 of play"));
    assert!(lines[4].ends_with("times real time"));

    let report = json(&succeeds(&[&["replay", "verify", "--json"], &paths[..]].concat()));
    assert_eq!((&report["equal"], &report["cut"]), (&3.into(), &1.into()));
    assert_eq!(report["files"][3]["result"], "cut");
    assert!(report["times_real_time"].as_f64().is_some_and(|times| times > 0.0));
}

#[test]
fn a_planted_difference_is_found_at_its_tick() {
    let directory = directory("replay-differs");
    let good = record(&directory, "good.jostle", "arena", 700);
    let bad = rewrite(&good, "bad.jostle", |block| {
        if block.first == 301 {
            block.ticks[122].hash ^= 1 << 9;
        }
    });
    let (good, bad) = (path_text(&good), path_text(&bad));
    fails(&["replay", "verify", good, bad], 1, &format!("1 of 2 replays did not verify; {bad}: "));
    fails(&["replay", "verify", bad], 1, "DIFFERS: tick 423: ");
    let printed = String::from_utf8(jostle(&["replay", "verify", good, bad]).stdout).expect("text");
    assert!(printed.starts_with(&format!("{good}: ok\n{bad}: DIFFERS: tick 423: ")), "{printed}");
    let output = jostle(&["replay", "verify", "--json", bad]);
    let report = json(&String::from_utf8(output.stdout).expect("text"));
    assert_eq!((&report["differ"], &report["files"][0]["tick"]), (&1.into(), &423.into()));
    fails(
        &["replay", "trace", bad, "--every", "100"],
        1,
        "tick 423: the hash is not the recorded one",
    );
}

#[test]
fn other_files_are_status_1_and_missing_files_status_2() {
    let directory = directory("replay-wrong");
    let file = directory.join("wrong.jostle");
    std::fs::write(&file, "what is this").expect("a written file");
    let (file, none) = (path_text(&file), "/no/such/replay.jostle");
    for command in ["info", "verify", "trace"] {
        fails(&["replay", command, file], 1, "byte 0: this is not a replay");
        fails(&["replay", command, none], 2, none);
        fails(&["replay", command, path_text(&directory)], 2, "found no file");
        fails(&["replay", command], 2, "<FILE>");
    }
    fails(&["replay", "verify", "--jobs", "0", file], 2, "--jobs");
    // This is a scene that the current program cannot play.
    let good = record(&directory, "good.jostle", "pile", 100);
    let replay = Replay::read(std::fs::read(&good).expect("a file")).expect("a replay");
    let mut start = replay.start().clone();
    start.scene = "title = 7".to_owned();
    let bytes = [header(), Record::Start(start).seal()].concat();
    std::fs::write(&good, bytes).expect("a written file");
    fails(&["replay", "verify", path_text(&good)], 1, "the scene of the replay is refused");
}

#[test]
fn texts_of_a_replay_cannot_control_the_terminal() {
    let directory = directory("replay-escapes");
    let file = record(&directory, "a.jostle", "impulse", 60);
    let replay = Replay::read(std::fs::read(&file).expect("a file")).expect("a replay");
    let mut start = replay.start().clone();
    start.scene_name = "\u{1b}[2J".to_owned();
    start.program = "\u{1b}]0;mine\u{7}".to_owned();
    let bytes = [header(), Record::Start(start).seal()].concat();
    std::fs::write(&file, bytes).expect("a written file");
    let text = succeeds(&["replay", "info", path_text(&file)]);
    assert!(text.contains("\\u{1b}[2J") && !text.contains('\u{1b}'), "{text:?}");
}

#[test]
fn phases_of_a_tick_can_be_compared() {
    let file = record(&directory("replay-phases"), "a.jostle", "bounds", 90);
    let file = path_text(&file);
    let phases = ["replay", "trace", file, "--tick", "60", "--phases"];
    let text = succeeds(&phases);
    assert_eq!(text, succeeds(&phases));
    let lines: Vec<_> = text.lines().map(json).collect();
    let names: Vec<_> = lines.iter().map(|line| line["phase"].as_str().expect("text")).collect();
    assert_eq!(names, ["inputs", "integrate", "pairs", "relax", "events", "particles"]);
    for line in &lines {
        assert_eq!(line["tick"], 60);
        assert!(line["hash"].as_str().is_some_and(|hash| hash.len() == 16));
    }
    let one = succeeds(&["replay", "trace", file, "--tick", "60"]);
    assert!(succeeds(&["replay", "trace", file]).contains(&one) && one.lines().count() == 1);
    fails(&["replay", "trace", file, "--phases"], 2, "--tick");
    fails(&["replay", "trace", file, "--tick", "91"], 2, "--tick: found 91; allowed: 1 to 90");
}
