//! Tests that clippy rejects forbidden code in the simulation and reports its position: each line is put into a
//! separate file and checked with the settings of `sim`.

use crate::shell::{root, target_dir};
use std::fs;
use std::process::Command;

/// Runs clippy on a source file as if it belonged to `sim`; returns whether it passed, and its output.
fn clippy(name: &str, source: &str) -> (bool, String) {
    let root = root();
    let dir = target_dir().join("lints");
    fs::create_dir_all(&dir).expect("the target directory can be written to");
    let file = dir.join(format!("{name}.rs"));
    fs::write(&file, source).expect("the test directory can be written to");
    let output = Command::new("clippy-driver")
        .args(["--edition", "2024", "--crate-type", "lib", "--emit", "metadata"])
        .args(["--deny", "warnings", "--crate-name", name, "--out-dir"])
        .arg(&dir)
        .arg(&file)
        .env("CLIPPY_CONF_DIR", root.join("sim"))
        .current_dir(&root)
        .output()
        .expect("clippy comes with the toolchain");
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn planted_lines_are_refused_with_their_place() {
    let planted = [
        ("sine", "f32::sin", "pub fn f(x: f32) -> f32 {\n    x.sin()\n}\n"),
        ("fused", "f32::mul_add", "pub fn f(x: f32) -> f32 {\n    x.mul_add(x, x)\n}\n"),
        ("larger", "f32::max", "pub fn f(x: f32) -> f32 {\n    x.max(0.0)\n}\n"),
        (
            "order",
            "std::collections::HashMap",
            "pub fn f() -> Vec<u32> {\n    std::collections::HashMap::<u32, u32>::new().into_keys().collect()\n}\n",
        ),
        ("clock", "std::time::Instant", "pub fn f() -> std::time::Instant {\n    panic!()\n}\n"),
        ("thread", "std::thread::spawn", "pub fn f() {\n    drop(std::thread::spawn(|| ()));\n}\n"),
        (
            "environment",
            "std::env::var",
            "pub fn f() -> bool {\n    std::env::var(\"X\").is_ok()\n}\n",
        ),
    ];
    for (name, what, source) in planted {
        let (passed, said) = clippy(name, source);
        let line = if name == "clock" { 1 } else { 2 };
        assert!(!passed, "{name} passed");
        assert!(said.contains(&format!("`{what}`")), "{name}: {said}");
        assert!(said.contains(&format!("{name}.rs:{line}:")), "{name}: {said}");
    }
}

#[test]
fn what_is_allowed_passes() {
    let source = "pub fn f(x: f32) -> f32 {\n    (x * x + 1.0).sqrt()\n}\n";
    let (passed, said) = clippy("allowed", source);
    assert!(passed, "{said}");
}
