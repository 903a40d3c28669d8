//! Tests `jostle serve --config` and `jostle doctor`.

use crate::{directory, fails, jostle, path_text, succeeds};
use serde_json::Value;
use std::path::Path;

#[test]
fn a_configuration_is_checked_without_serving() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples/jostle.toml");
    let config = ["--config", path_text(&example)];
    let said = succeeds(&[&["serve", "--check"], &config[..]].concat());
    assert_eq!(said, format!("{}: ok\n", example.display()));
    assert_eq!(succeeds(&["serve", "--check"]), "settings: ok\n");
}

#[test]
fn a_refused_configuration_is_named_with_line_and_field() {
    let file = directory("config").join("wrong.toml");
    let refuses = |text: &[u8], status, error: &str| {
        std::fs::write(&file, text).expect("a written file");
        for command in ["serve", "doctor"] {
            fails(&[command, "--config", path_text(&file)], status, error);
        }
    };
    let place = |line: u32| format!("{}:{line}: ", path_text(&file));
    let found = "listen: found \"here\"; allowed: an IP address and a port";
    refuses(b"\nlisten = \"here\"", 1, &format!("{}{found}", place(2)));
    let found = "address-sockets: found 70000; allowed: a whole number from 1 to 65536";
    refuses(b"address-sockets = 70000", 1, &format!("{}{found}", place(1)));
    refuses(b"port = 80", 1, &format!("{}port: found an unknown field; allowed: ", place(1)));
    refuses(b"listen = ", 1, &format!("{}file: found ", place(1)));
    refuses(b"# \xff", 1, "found bytes that are not UTF-8");
    // A flag that requires another one does so in the file too.
    refuses(b"tls-cert = \"chain.pem\"", 2, "--tls-key");
    fails(&["serve", "--config", "/no/such/file.toml"], 2, "/no/such/file.toml");
}

#[test]
fn the_doctor_looks_at_everything() {
    let state = directory("doctor");
    let flags = ["--listen", "127.0.0.1:0", "--ops", "127.0.0.1:0", "--json"];
    let dirs = ["--state", path_text(&state), "--replays", path_text(&state)];
    let output = jostle(&[&["doctor"], &flags[..], &dirs[..]].concat());
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let findings = report["findings"].as_array().expect("a list");
    let about: Vec<_> = findings.iter().filter_map(|finding| finding["about"].as_str()).collect();
    let expected = [
        "open files",
        "--listen",
        "--ops",
        "--state",
        "--replays",
        "clock",
        "processor",
        "steal",
        "memory",
    ];
    assert_eq!(about, expected);
    // Results depend on the machine, but the status must match the lines.
    let is_fine = findings.iter().all(|finding| finding["change"].is_null());
    assert_eq!(report["fine"], is_fine);
    assert_eq!(output.status.code(), Some(if is_fine { 0 } else { 1 }));
    assert!(findings[1]["change"].is_null(), "{report}");
    assert_eq!(std::fs::read_dir(state).expect("a directory").count(), 0, "nothing is left");
}

#[test]
fn a_server_that_cannot_serve_does_not_say_where_it_is() {
    let directory = directory("locked");
    let lock = std::fs::File::create(directory.join("lock")).expect("a file");
    lock.lock().expect("no one else holds it");
    let state = path_text(&directory);
    let output = jostle(&["serve", "--listen", "127.0.0.1:0", "--state", state]);
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("text"));
    assert_eq!((output.status.code(), said[0].as_str()), (Some(1), ""), "{}", said[1]);
    assert!(said[1].contains("another server uses this directory"), "{}", said[1]);
}
