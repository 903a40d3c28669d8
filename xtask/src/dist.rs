//! `cargo xtask dist`: builds a release in `target/dist`. For each target, an archive contains a static program, which
//! needs no system libraries, and the files for installing it. The release also has lists of the crates used and
//! digests of all files.

mod papers;
mod program;
mod trial;

use crate::shell::{in_path, output_of, root, run, say, target_dir};
use crate::{packages, web};
use anyhow::{Context, Result, bail, ensure};
use program::{ReleaseTarget, TARGETS};
use std::fs::{self, File};
use std::path::Path;
use std::process::Command;

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Files and directories in an archive, in addition to the program and third-party licences.
const ENCLOSED: [&str; 8] = [
    "README.md",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "docs",
    "deploy",
    "assets/gallery",
];

/// The file with the digests of all others.
const DIGESTS: &str = "SHA256SUMS";
/// The purpose of the signatures; one made for another purpose is not valid here.
const NAMESPACE: &str = "jostle-release";

/// Builds, tests and packs everything, and signs the digests if a key is given.
pub fn dist(key: Option<&Path>) -> Result<()> {
    if let Some(key) = key {
        ensure!(key.is_file(), "--sign {}: found no file", key.display());
    }
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        bail!(
            "releases are built on Linux on a 64-bit x86 machine, where both programs can be tried"
        );
    }
    web::build(web::Profile::Release)?;
    let out = target_dir().join("dist");
    if out.exists() {
        fs::remove_dir_all(&out).with_context(|| format!("cannot clear {}", out.display()))?;
    }
    fs::create_dir_all(&out)?;
    let licences = papers::licences()?;
    papers::crates(
        "client-web",
        web::TARGET,
        &out.join(format!("jostle-{VERSION}-page.cdx.json")),
    )?;
    for target in &TARGETS {
        let program = program::build(target)?;
        trial::play(target, &program)?;
        say("dist", &format!("pack {}", name(target)));
        pack(target, &program, &licences, &out)?;
        papers::crates("cli", target.name, &out.join(format!("{}.cdx.json", name(target))))?;
    }
    digests(&out)?;
    if let Some(key) = key {
        sign(&out, &key.canonicalize()?)?;
    }
    say("dist", &format!("all in {}", out.display()));
    Ok(())
}

/// Name of an archive without its extension, and of the directory that it unpacks to.
fn name(target: &ReleaseTarget) -> String {
    format!("jostle-{VERSION}-{}", target.name)
}

/// Packs an archive reproducibly: entries are sorted by name, have the commit's date and belong to no user.
fn pack(target: &ReleaseTarget, program: &Path, licences: &Path, out: &Path) -> Result<()> {
    let dir = out.join(name(target));
    fs::create_dir_all(&dir)?;
    fs::copy(program, dir.join("jostle"))?;
    fs::copy(licences, dir.join("LICENSES-OF-OTHERS.txt"))?;
    run(Command::new("cp")
        .args(["--recursive", "--parents"])
        .args(ENCLOSED)
        .arg(&dir)
        .current_dir(root()))?;
    let mut date = Command::new("git");
    date.args(["log", "--max-count=1", "--format=@%ct"]).current_dir(root());
    let date = output_of(&mut date)?;
    let mut tar = Command::new("tar");
    tar.args(["--create", "--gzip", "--sort=name", "--owner=0", "--group=0", "--numeric-owner"]);
    tar.args(["--mode=u=rwX,go=rX", "--mtime", date.trim()]);
    tar.arg("--file").arg(format!("{}.tar.gz", name(target))).arg(name(target));
    run(tar.current_dir(out))?;
    fs::remove_dir_all(dir)?;
    Ok(())
}

/// Writes the digests of all files in the format of `sha256sum --check`.
fn digests(out: &Path) -> Result<()> {
    let entries = fs::read_dir(out)?.map(|entry| Ok(entry?.file_name()));
    let mut names = entries.collect::<Result<Vec<_>>>()?;
    names.sort();
    let sums = output_of(Command::new("sha256sum").args(names).current_dir(out))?;
    fs::write(out.join(DIGESTS), sums)?;
    Ok(())
}

/// Signs the digests with an SSH key, which may be held by an agent or a token, and checks the signature.
fn sign(out: &Path, key: &Path) -> Result<()> {
    if !in_path("ssh-keygen") {
        packages::provide("signatures", &["openssh-client"])?;
    }
    say("dist", &format!("sign {DIGESTS}"));
    let signature = format!("{DIGESTS}.sig");
    let mut sign = Command::new("ssh-keygen");
    sign.args(["-Y", "sign", "-n", NAMESPACE, "-f"]).arg(key).arg(DIGESTS);
    run(sign.current_dir(out))?;
    let mut check = Command::new("ssh-keygen");
    check.args(["-Y", "check-novalidate", "-n", NAMESPACE, "-s", &signature]);
    run(check.stdin(File::open(out.join(DIGESTS))?).current_dir(out))
}
