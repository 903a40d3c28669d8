//! Embeds everything in `client-web/dist` into the server, with an ETag of each file's content. A
//! missing `dist` gives an empty table: the server then says how to build the client.

use std::collections::BTreeMap;
use std::collections::hash_map::DefaultHasher;
use std::fmt::Write;
use std::hash::Hasher;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let manifest = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let client = manifest.join("../client-web");
    let dist = client.join("dist");
    // A path that does not exist would make cargo run this script at every build; its parent does.
    println!("cargo::rerun-if-changed=build.rs");
    let watched = if dist.is_dir() { &dist } else { &client };
    println!("cargo::rerun-if-changed={}", watched.display());

    let mut files = BTreeMap::new();
    if dist.is_dir() {
        collect(&dist, "", &mut files)?;
    }
    let mut table = String::from(
        "/// Every file of `client-web/dist`, sorted by name.\npub static FILES: &[File] = &[\n",
    );
    for (name, path) in &files {
        println!("cargo::rerun-if-changed={}", path.display());
        let etag = etag(&fs::read(path)?);
        let path = path.canonicalize()?;
        writeln!(
            table,
            "File {{ name: {name:?}, etag: {etag:?}, bytes: include_bytes!({path:?}) }},"
        )
        .expect("a String takes any text");
    }
    table.push_str("];\n");
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
    fs::write(out.join("files.rs"), table)
}

/// Adds all files below `dir` by their names, which begin with `prefix` and have `/` on every system.
fn collect(dir: &Path, prefix: &str, files: &mut BTreeMap<String, PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(dir)? {
        let entry = entry?;
        let (path, name) = (entry.path(), entry.file_name());
        let name = format!("{prefix}{}", name.to_string_lossy());
        if path.is_dir() {
            collect(&path, &format!("{name}/"), files)?;
        } else {
            files.insert(name, path);
        }
    }
    Ok(())
}

/// Not cryptographic: it only has to differ when the file was rebuilt.
fn etag(bytes: &[u8]) -> String {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    format!("\"{:016x}\"", hasher.finish())
}
