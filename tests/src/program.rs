//! The program `jostle`, built for tests that start it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Path of the program `jostle`. `cargo xtask test` has already built it and sets `JOSTLE_PROGRAM`; otherwise it is
/// built once per test process.
pub fn jostle() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    let named = || std::env::var_os("JOSTLE_PROGRAM").map(PathBuf::from);
    PROGRAM.get_or_init(|| named().unwrap_or_else(build))
}

/// Builds `jostle` with this test's profile, since an older binary could be misleading. Building it as part of the
/// whole workspace gives it the same features, and therefore the same compiled dependencies, as this test.
fn build() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    let profile_dir = test.ancestors().nth(2).expect("target/PROFILE/deps/test");
    let target_dir = profile_dir.parent().expect("target/PROFILE");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--bin", "jostle", "--workspace"]);
    cargo.args(["--exclude", "xtask-web", "--exclude", "jostle-picture"]);
    cargo.arg("--target-dir").arg(target_dir);
    if profile_dir.ends_with("release") {
        cargo.arg("--release");
    }
    // Cargo sets these variables for this test. Some build scripts depend on them and would run again if they were set.
    for (name, _) in std::env::vars_os() {
        let name = name.to_string_lossy();
        if name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_") {
            cargo.env_remove(&*name);
        }
    }
    assert!(cargo.status().expect("cargo starts").success(), "jostle builds");
    profile_dir.join(format!("jostle{}", std::env::consts::EXE_SUFFIX))
}
