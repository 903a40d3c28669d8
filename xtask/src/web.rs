//! The web client: compiled to wasm, bound to JavaScript, gathered with the page's own files in
//! `client-web/dist` and compressed, ready to be embedded in the server.
//!
//! A file of `dist` is written only when its content changed, so that nothing that depends on it
//! is rebuilt for nothing.

use crate::shell::{self, cargo, root, run, say};
use crate::static_page;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The page's target, as Rust names it.
pub const TARGET: &str = "wasm32-unknown-unknown";
/// Every browser with WebGL2 that is still kept up has these instructions.
const FEATURES: &str = r#"target.wasm32-unknown-unknown.rustflags=["-Ctarget-feature=+simd128"]"#;
/// Compressed size at which a build for people fails: a phone on 2 Mbit/s waits 3 seconds for it.
const PROGRAM_BYTES_MAX: u64 = 955_000;
/// Smaller files are compressed as well as can be even in a hurry.
const LARGE_BYTES: usize = 256 << 10;

/// How the client is compiled.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// For people: small to download.
    Small,
    /// For development: quick to compile.
    Dev,
}

impl Profile {
    /// Cargo's name of the profile, and of the directory that it builds into.
    fn names(self) -> [&'static str; 2] {
        match self {
            Profile::Small => ["wasm", "wasm"],
            Profile::Dev => ["dev", "debug"],
        }
    }
}

/// Files of a page: path below `dist` -> content.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Builds everything into `client-web/dist`.
pub fn build(profile: Profile) -> Result<()> {
    build_files(profile).map(drop)
}

/// The same, and writes the page without a server into `target/static`.
pub fn build_static(profile: Profile) -> Result<()> {
    let files = build_files(profile)?;
    let out = shell::target_dir().join("static");
    static_page::write(&out, &files)?;
    let bytes: usize = files.values().map(Vec::len).sum();
    say("web", &format!("{} holds the page for any host of files, {bytes} bytes", out.display()));
    Ok(())
}

fn build_files(profile: Profile) -> Result<Files> {
    add_target()?;
    say("web", &format!("compile the client to wasm (profile {})", profile.names()[0]));
    let wasm = compile(profile)?;
    say("web", "bind it to JavaScript");
    let bound = bind(&wasm)?;
    say("web", "gather and compress client-web/dist");
    let dist = root().join("client-web/dist");
    let mut files = gather(&bound)?;
    stamp(&mut files)?;
    write_changed(&dist, &files, profile)?;
    remove_others(&dist, &files)?;
    let packed_bytes = report(&dist, &files)?;
    ensure!(
        profile == Profile::Dev || packed_bytes <= PROGRAM_BYTES_MAX,
        "the page's program is {packed_bytes} bytes as it travels; {PROGRAM_BYTES_MAX} are allowed"
    );
    Ok(files)
}

/// Adds the wasm target when the toolchain lacks it.
fn add_target() -> Result<()> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let libdir = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", TARGET])
        .current_dir(root())
        .output()
        .context("cannot start rustc")?;
    let libdir = String::from_utf8_lossy(&libdir.stdout).trim().to_owned();
    if Path::new(&libdir).is_dir() {
        return Ok(());
    }
    say("web", &format!("add the target {TARGET}"));
    run(Command::new("rustup").args(["target", "add", TARGET]).current_dir(root()))
}

/// Compiles the client; returns where it is.
fn compile(profile: Profile) -> Result<PathBuf> {
    run(cargo_for_page("build", profile).args(["--package", "jostle-client-web"]))?;
    Ok(target_dir().join(TARGET).join(profile.names()[1]).join("jostle_client_web.wasm"))
}

/// A cargo command on libraries for the page. It has a target directory of its own: other calls of
/// cargo may run meanwhile.
pub fn cargo_for_page(command: &str, profile: Profile) -> Command {
    let mut cargo = cargo(&[command, "--lib", "--target", TARGET, "--config", FEATURES]);
    cargo.args(["--profile", profile.names()[0], "--target-dir"]).arg(target_dir());
    cargo
}

fn target_dir() -> PathBuf {
    root().join("target/web")
}

/// Makes `client.js` and `client_bg.wasm`; returns their directory.
fn bind(wasm: &Path) -> Result<PathBuf> {
    let out = target_dir().join("bound");
    if out.exists() {
        fs::remove_dir_all(&out).with_context(|| format!("cannot clear {}", out.display()))?;
    }
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen.web(true)?;
    bindgen
        .input_path(wasm)
        .out_name("client")
        .typescript(false)
        .remove_name_section(true)
        .remove_producers_section(true)
        // Otherwise the script could not find its wasm file by itself.
        .omit_default_module_path(false);
    let mut output = bindgen.generate_output().context("wasm-bindgen")?;
    let imports = output.wasm_mut().imports.iter_mut();
    let imports = imports.filter(|import| import.module.ends_with("_bg.js"));
    let names = imports.enumerate().map(|(at, import)| {
        let short = format!("i{at}");
        (std::mem::replace(&mut import.name, short.clone()), short)
    });
    let names: BTreeMap<String, String> = names.collect();
    output.emit(&out).context("wasm-bindgen")?;
    let script = out.join("client.js");
    let text = fs::read_to_string(&script).context("client.js")?;
    fs::write(&script, renamed(&text, &names)?).context("client.js")?;
    Ok(out)
}

/// The script with the short names of imports. Their own end with digests of 16 digits, which no compression
/// makes smaller: 5 kB of the program, and as many of the script.
fn renamed(script: &str, names: &BTreeMap<String, String>) -> Result<String> {
    let mut found = 0;
    let lines = script.lines().map(|line| {
        let entry = line.trim_start().split_once(':');
        let Some((short, rest)) = entry.and_then(|(name, rest)| Some((names.get(name)?, rest)))
        else {
            return line.to_owned();
        };
        found += 1;
        format!("{short}:{rest}")
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    ensure!(found == names.len(), "client.js has {found} of the program's {} imports", names.len());
    Ok(text)
}

/// Everything the page is made of.
fn gather(bound: &Path) -> Result<Files> {
    let root = root();
    let mut files = BTreeMap::new();
    add_tree(&mut files, bound, Path::new(""))?;
    add_tree(&mut files, &root.join("client-web/web"), Path::new(""))?;
    for name in ["client.js", "index.html", "style.css"] {
        let content = files.get_mut(Path::new(name)).with_context(|| format!("no {name}"))?;
        *content = without_comments(std::str::from_utf8(content).context("a text")?).into_bytes();
    }
    let style = files.get_mut(Path::new("style.css")).context("no style.css")?;
    *style = squeezed(std::str::from_utf8(style).context("a text")?).into_bytes();
    add_tree(&mut files, &root.join("assets/sprites"), Path::new("sprites"))?;
    add_tree(&mut files, &root.join("assets/pictures"), Path::new("pictures"))?;
    add_tree(&mut files, &root.join("assets/scenes"), Path::new("scenes"))?;
    Ok(files)
}

/// A script, a style sheet or a document without its comments (but for those of HTML) and indents. Comments begin lines, and
/// strings and preformatted text hold no newline.
fn without_comments(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut in_comment = false;
    for mut line in text.lines().map(str::trim) {
        in_comment |= line.starts_with("/*");
        if in_comment {
            let after = line.split_once("*/").map(|(_, after)| after.trim_start());
            in_comment = after.is_none();
            line = after.unwrap_or_default();
        }
        if !line.is_empty() && !line.starts_with("//") {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

/// A style sheet without the spaces and line ends that it does not need. Its strings hold neither a colon nor a brace
/// beside a space.
fn squeezed(style: &str) -> String {
    let mut squeezed = style.replace(": ", ":").replace(" {", "{");
    for end in ["{", "}", ";"] {
        squeezed = squeezed.replace(&format!("{end}\n"), end);
    }
    squeezed
}

/// Puts a digest of everything into the addresses that the document names, and beside it for the server:
/// browsers keep what has such an address for good.
fn stamp(files: &mut Files) -> Result<()> {
    let mut digest = DefaultHasher::new();
    files.hash(&mut digest);
    let version = format!("v-{:016x}", digest.finish());
    let document = files.get_mut(Path::new("index.html")).context("no index.html")?;
    let text = std::str::from_utf8(document).context("index.html")?;
    *document = text.replace("=\"/assets/", &format!("=\"/assets/{version}/")).into_bytes();
    files.insert("version.txt".into(), version.into_bytes());
    Ok(())
}

/// Adds all files below `dir`, if it exists, under `prefix`.
fn add_tree(files: &mut Files, dir: &Path, prefix: &Path) -> Result<()> {
    if !dir.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(dir).with_context(|| format!("cannot list {}", dir.display()))? {
        let path = entry?.path();
        let name = prefix.join(path.file_name().expect("a listed entry has a name"));
        if path.is_dir() {
            add_tree(files, &path, &name)?;
        } else {
            let content =
                fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            files.insert(name, content);
        }
    }
    Ok(())
}

fn write_changed(dist: &Path, files: &Files, profile: Profile) -> Result<()> {
    for (name, content) in files {
        let path = dist.join(name);
        let packed = packed_name(&path);
        let same = fs::read(&path).is_ok_and(|old| old == *content);
        if same && (packed.exists() || !compressible(name)) {
            continue;
        }
        write(&path, content)?;
        if compressible(name) {
            let is_hurried = profile == Profile::Dev && content.len() > LARGE_BYTES;
            write(&packed, &compress(content, if is_hurried { 2 } else { 11 })?)?;
        }
    }
    Ok(())
}

fn write(path: &Path, content: &[u8]) -> Result<()> {
    if let Some(dir) = path.parent() {
        fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
    }
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}

/// Pictures are compressed already.
fn compressible(name: &Path) -> bool {
    let extension = name.extension().and_then(|extension| extension.to_str());
    matches!(
        extension,
        Some("css" | "html" | "js" | "json" | "svg" | "toml" | "txt" | "wasm" | "webmanifest")
    )
}

fn packed_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".br");
    name.into()
}

/// Packs with several settings: they differ by 0.2 %, and another one is best after each change of the program.
fn compress(content: &[u8], quality: i32) -> Result<Vec<u8>> {
    let mut packed = Vec::new();
    for (lgblock, use_dictionary) in [(17, false), (17, true), (18, false), (18, true)] {
        let parameters = brotli::enc::BrotliEncoderParams {
            quality,
            lgwin: 22,
            lgblock,
            use_dictionary,
            ..Default::default()
        };
        let mut one = Vec::new();
        brotli::BrotliCompress(&mut &content[..], &mut one, &parameters).context("brotli")?;
        packed.push(one);
    }
    Ok(packed.into_iter().min_by_key(Vec::len).expect("several settings"))
}

/// Removes what an earlier build left and this one did not make.
fn remove_others(dist: &Path, files: &Files) -> Result<()> {
    let mut present = BTreeMap::new();
    add_tree(&mut present, dist, Path::new(""))?;
    for name in present.keys() {
        let made = files.contains_key(name)
            || name.extension().is_some_and(|extension| extension == "br")
                && files.contains_key(&name.with_extension(""));
        if !made {
            let path = dist.join(name);
            fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
    }
    Ok(())
}

/// Prints the size of the page's program; returns how many of its bytes travel.
fn report(dist: &Path, files: &Files) -> Result<u64> {
    let wasm = files.get(Path::new("client_bg.wasm")).map_or(0, Vec::len);
    let packed = fs::metadata(dist.join("client_bg.wasm.br")).context("the program")?.len();
    let count = files.len();
    say("web", &format!("{count} files; the program is {wasm} bytes, {packed} as it travels"));
    Ok(packed)
}
