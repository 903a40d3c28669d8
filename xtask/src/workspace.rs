//! The workspace's own crates, as cargo lists them.

use crate::shell::{cargo, output_of};
use anyhow::{Context, Result};
use serde::Deserialize;
use std::path::PathBuf;

/// Selects all crates except those that other steps compile: the page builder, and native drawing, which takes long.
/// The same selection is used everywhere, since a different one would enable other features of shared dependencies and
/// recompile them.
pub const USUAL_CRATES: [&str; 5] =
    ["--workspace", "--exclude", "xtask-web", "--exclude", "jostle-picture"];

/// A crate of the workspace.
#[derive(Deserialize)]
pub struct Package {
    /// The name given in the manifest.
    pub name: String,
    /// Path of its manifest.
    pub manifest_path: PathBuf,
    /// Dependencies of all kinds: normal, development and build.
    pub dependencies: Vec<Dependency>,
}

/// A dependency, as declared in a manifest.
#[derive(Deserialize)]
pub struct Dependency {
    /// Name of the crate that is depended on.
    pub name: String,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

/// Lists the workspace's crates, without external dependencies.
pub fn packages() -> Result<Vec<Package>> {
    let text = output_of(&mut cargo(&["metadata", "--no-deps", "--format-version", "1"]))?;
    let metadata: Metadata = serde_json::from_str(&text).context("cargo metadata")?;
    Ok(metadata.packages)
}
