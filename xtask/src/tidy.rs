//! `cargo xtask tidy`: checks the conventions of this code base, so that reviews do not have to. Each check reads
//! tracked files and returns findings, and none modifies anything.

mod arrows;
mod circles;
mod citations;
mod figures;
mod files;
mod finding;
mod imports;
mod links;
mod source;
mod text;
mod types;
mod vocabulary;

use crate::shell::{root, say};
use crate::workspace::packages;
use anyhow::{Result, bail};
use files::File;
use finding::Finding;
use std::path::Path;

/// Maximum size of a tracked file; the largest are pictures.
const FILE_BYTES_MAX: usize = 1_500_000;

/// Runs all checks and prints all findings; fails if there are any.
pub fn tidy() -> Result<()> {
    let files = files::read(&root())?;
    let sources = source::parse(&files)?;
    let mut findings = sizes(&files);
    findings.extend(text::check(&files));
    findings.extend(links::check(&files));
    findings.extend(citations::check(&files));
    findings.extend(vocabulary::check(&sources));
    findings.extend(arrows::check(&packages()?));
    findings.extend(one_set_of_lints(&files));
    let imports = imports::imports(&sources, &source::crates(&files));
    findings.extend(circles::check(&imports));
    for finding in &findings {
        say("tidy", &finding.to_string());
    }
    for note in text::long_files(&files) {
        say("tidy", &format!("note: {note}"));
    }
    match findings.len() {
        0 => say("tidy", &format!("{} files, nothing to mend", files.len())),
        1 => bail!("1 thing to mend"),
        count => bail!("{count} things to mend"),
    }
    Ok(())
}

/// Prints the figures for a checkout, either this one or another one for comparison.
pub fn figures(root: &Path) -> Result<()> {
    print!("{}", figures::figures(&files::read(root)?)?);
    Ok(())
}

/// Checks that all deterministic crates forbid the same set of functions.
fn one_set_of_lints(files: &[File]) -> Vec<Finding> {
    const FIRST: &str = "sim/clippy.toml";
    let text = |path: &str| files.iter().find(|file| file.path == path)?.text.as_deref();
    let others = ["game/clippy.toml", "protocol/clippy.toml", "room/clippy.toml"];
    let differs =
        others.into_iter().filter(|path| text(FIRST).is_none() || text(path) != text(FIRST));
    let fault =
        format!("differs from {FIRST}; the deterministic crates refuse the same things; copy it");
    differs.map(|path| Finding::of(path, &*fault)).collect()
}

fn sizes(files: &[File]) -> Vec<Finding> {
    let large = files.iter().filter(|file| file.bytes > FILE_BYTES_MAX);
    let fault =
        |bytes| format!("{bytes} bytes; at most {FILE_BYTES_MAX}; remove it or make it smaller");
    large.map(|file| Finding::of(&file.path, fault(file.bytes))).collect()
}

#[cfg(test)]
mod tests {
    use super::{FILE_BYTES_MAX, File, sizes};

    #[test]
    fn a_large_file_is_found_and_one_at_the_limit_is_not() {
        let file = |bytes| File { path: "a.png".into(), text: None, bytes };
        assert_eq!(sizes(&[file(FILE_BYTES_MAX)]).len(), 0);
        assert_eq!(sizes(&[file(FILE_BYTES_MAX + 1)]).len(), 1);
    }
}
