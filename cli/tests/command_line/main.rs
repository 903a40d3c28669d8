//! The command line as scripts see it: exit status, one-line errors, traces and reports.

mod configuration;
mod replays;

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn jostle(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_jostle"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .expect("jostle starts")
}

fn path_text(path: &Path) -> &str {
    path.to_str().expect("a path of plain characters")
}

/// A directory for one test's files.
fn directory(test: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    std::fs::create_dir_all(&directory).expect("a directory");
    directory
}

/// Expects this status and a one-line error that contains `part`.
fn fails(arguments: &[&str], status: i32, part: &str) {
    let output = jostle(arguments);
    let error = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {error}");
    assert_eq!(error.lines().count(), 1, "{arguments:?}: {error}");
    assert!(error.starts_with("error: ") && error.contains(part), "{arguments:?}: {error}");
}

fn succeeds(arguments: &[&str]) -> String {
    let output = jostle(arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn bad_usage_is_status_2_and_one_line() {
    fails(&["run"], 2, "<SCENE>");
    fails(&["run", "arena", "--ticks=-1"], 2, "--ticks");
    fails(&["run", "arena", "--every", "0"], 2, "--every");
    fails(&["run", "nothing"], 2, "allowed: arena, ");
    fails(&["run", "arena", "--inputs", "/no/such/file"], 2, "/no/such/file");
    fails(&["run", "arena", "--trace", "/no/such/file"], 2, "/no/such/file");
    fails(&["scene", "check", "/no/such/file.toml"], 2, "/no/such/file.toml");
    fails(&["serve", "--listen", "here"], 2, "--listen");
    fails(&["serve", "--scenes", "/no/such/directory"], 2, "/no/such/directory");
    fails(&["bots", "http://localhost/arena", "--clients", "1", "--seconds", "1"], 2, "ws://");
    fails(&["serve", "--replays-mb", "5"], 2, "--replays");
    fails(&["serve", "--replays", "there", "--replays-days", "0"], 2, "--replays-days");
    fails(&["dance"], 2, "dance");
    fails(&["scene", "list", "--log", "=,="], 2, "--log");
}

#[test]
fn a_refused_scene_is_status_1_with_file_line_and_field() {
    let directory = directory("refused");
    let file = directory.join("wrong.toml");
    let text = "title = \"Wrong\"\nsize = [100, -5]\ngroups = [\"block\"]\npairs = []\n";
    std::fs::write(&file, text).expect("a written file");
    let file = path_text(&file);
    fails(&["scene", "check", file], 1, &format!("{file}:2: size"));
    fails(&["run", file], 1, &format!("{file}:2: size"));
    fails(&["scene", "plan", file], 1, &format!("{file}:2: size"));
    fails(&["serve", "--scenes", path_text(&directory)], 1, "wrong.toml:2: size");
}

#[test]
fn a_scene_that_is_not_text_is_refused_with_its_line() {
    let file = directory("bytes").join("wrong.toml");
    std::fs::write(&file, b"title = \"Wrong\"\nabout = \"\xff\"\n").expect("a written file");
    let file = path_text(&file);
    let part = format!("{file}:2: file: found bytes that are not UTF-8; allowed: UTF-8 text");
    fails(&["scene", "check", file], 1, &part);
    fails(&["run", file, "--trace", "-"], 1, &part);
}

#[test]
fn a_trace_can_go_to_stdout_alone() {
    let file = directory("stdout").join("trace.jsonl");
    let run = ["run", "pile", "--ticks", "40", "--every", "10", "--trace"];
    let printed = succeeds(&[&run[..], &["-"]].concat());
    let said = succeeds(&[&run[..], &[path_text(&file)]].concat());
    assert_eq!(printed, std::fs::read_to_string(&file).expect("a trace"));
    assert_eq!((printed.lines().count(), said.lines().count()), (4, 1));
}

#[test]
fn bad_inputs_are_status_1_with_file_and_line() {
    let file = directory("inputs").join("keys.jsonl");
    std::fs::write(&file, "{\"tick\":1}\n{\"tick\":2,\"buttons\":[\"jump\"]}\n").expect("a file");
    let file = path_text(&file);
    fails(&["run", "arena", "--inputs", file], 1, &format!("{file}:2: buttons: found \"jump\""));
}

#[test]
fn shipped_scenes_are_listed_planned_and_played() {
    let list: Value = serde_json::from_str(&succeeds(&["scene", "list", "--json"])).expect("JSON");
    let scenes = list["scenes"].as_array().expect("a list");
    assert!(scenes.len() >= 5, "{list}");
    for scene in scenes {
        let name = scene["name"].as_str().expect("a name");
        assert!(succeeds(&["scene", "list"]).contains(name));
        let plan: Value =
            serde_json::from_str(&succeeds(&["scene", "plan", name, "--json"])).expect("JSON");
        assert!(plan["bodies"].as_array().is_some_and(|bodies| !bodies.is_empty()), "{plan}");
        let run: Value = serde_json::from_str(&succeeds(&["run", name, "--ticks", "30", "--json"]))
            .expect("JSON");
        assert_eq!((&run["scene"], &run["ticks"]), (&scene["name"], &Value::from(30)));
    }
}

#[test]
fn a_trace_repeats_byte_for_byte_and_has_every_field() {
    let directory = directory("trace");
    let keys = directory.join("keys.jsonl");
    let text = "{\"tick\":10,\"buttons\":[\"make\",\"fire\"],\"pointer\":[90,80]}\n\
                {\"tick\":60,\"seat\":1,\"buttons\":[\"right\"]}\n{\"tick\":90}\n";
    std::fs::write(&keys, text).expect("a written file");
    let run = |name: &str, seed: &str| {
        let trace = directory.join(name);
        let arguments = ["run", "impulse", "--ticks", "120", "--every", "4", "--json"];
        let files = ["--inputs", path_text(&keys), "--trace", path_text(&trace), "--seed", seed];
        let summary = succeeds(&[&arguments[..], &files[..]].concat());
        let trace = std::fs::read_to_string(&trace).expect("a trace");
        (trace, serde_json::from_str::<Value>(&summary).expect("JSON"))
    };
    let (trace, summary) = run("a.jsonl", "7");
    assert_eq!(trace, run("b.jsonl", "7").0);
    assert_ne!(trace, run("c.jsonl", "8").0);

    let lines: Vec<Value> =
        trace.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let ticks: Vec<_> = lines.iter().map(|line| line["tick"].as_u64()).collect();
    assert_eq!(ticks, (1..=30).map(|index| Some(4 * index)).collect::<Vec<_>>());
    let last = lines.last().expect("30 lines");
    let fields: Vec<_> = last.as_object().expect("an object").keys().map(String::as_str).collect();
    for field in [
        "tick",
        "hash",
        "bodies",
        "particles",
        "emitters",
        "contacts",
        "deepest",
        "kinetic",
        "momentum",
    ] {
        assert!(fields.contains(&field), "{field} is missing");
    }
    assert_eq!(fields.len(), 9);
    assert_eq!(last["hash"], summary["hash"]);
    assert!(last["hash"].as_str().is_some_and(|hash| hash.len() == 16));
    assert_eq!(summary["players"], 2);
    let body = &last["bodies"][0];
    assert!(body["id"].is_u64() && body["kind"].is_string(), "{body}");
    assert!(body["pos"][1].is_f64() && body["vel"][1].is_f64(), "{body}");
    let kinds: Vec<_> = lines
        .iter()
        .flat_map(|line| line["bodies"].as_array().expect("bodies"))
        .filter_map(|body| body["kind"].as_str())
        .collect();
    assert!(kinds.contains(&"dumb") && kinds.contains(&"pack"), "the keys do something");
}
