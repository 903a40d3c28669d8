//! Embeds everything in `client-web/dist` into optimised builds of the server, with an ETag for each file. If `dist` is
//! missing, the table is empty, and the server serves instructions for building the client.
//!
//! Debug builds read the files at startup, so that a new page requires no compilation, and the page and the server can
//! be compiled at the same time.

#[path = "src/net/dist.rs"]
mod dist;

use std::fmt::Write;
use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/net/dist.rs");
    println!("cargo::rustc-check-cfg=cfg(page_on_disk)");
    if env::var_os("PROFILE").is_some_and(|profile| profile == "debug") {
        println!("cargo::rustc-cfg=page_on_disk");
        return Ok(());
    }
    let manifest = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let client = manifest.join("../client-web");
    let dir = client.join("dist");
    // If the path did not exist, cargo would run this script in every build, so its parent is watched instead.
    let watched = if dir.is_dir() { &dir } else { &client };
    println!("cargo::rerun-if-changed={}", watched.display());

    let mut table = String::from("static EMBEDDED: &[AssetFile] = &[\n");
    for (name, path) in &dist::files(&dir)? {
        println!("cargo::rerun-if-changed={}", path.display());
        let etag = dist::etag(&fs::read(path)?);
        let path = path.canonicalize()?;
        writeln!(
            table,
            "AssetFile {{ name: {name:?}, etag: {etag:?}, bytes: include_bytes!({path:?}) }},"
        )
        .expect("a String takes any text");
    }
    table.push_str("];\n");
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
    fs::write(out.join("files.rs"), table)
}
