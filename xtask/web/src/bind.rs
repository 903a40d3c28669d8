//! Generates the program and its script with wasm-bindgen.

use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Writes `client.js` and `client_bg.wasm` into `out`, which is cleared first.
pub fn bind(wasm: &Path, out: &Path) -> Result<()> {
    if out.exists() {
        fs::remove_dir_all(out).with_context(|| format!("cannot clear {}", out.display()))?;
    }
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen.web(true)?;
    bindgen
        .input_path(wasm)
        .out_name("client")
        .typescript(false)
        .remove_name_section(true)
        .remove_producers_section(true)
        // Otherwise the script could not locate its wasm file.
        .omit_default_module_path(false);
    let mut output = bindgen.generate_output().context("wasm-bindgen")?;
    let imports = output.wasm_mut().imports.iter_mut();
    let imports = imports.filter(|import| import.module.ends_with("_bg.js"));
    let names = imports.enumerate().map(|(at, import)| {
        let short = format!("i{at}");
        (std::mem::replace(&mut import.name, short.clone()), short)
    });
    let names: BTreeMap<String, String> = names.collect();
    output.emit(out).context("wasm-bindgen")?;
    let script = out.join("client.js");
    let text = fs::read_to_string(&script).context("client.js")?;
    fs::write(&script, renamed(&text, &names)?).context("client.js")?;
    Ok(())
}

/// Replaces the imports' names in the script with short ones. The original names end with incompressible 16-digit
/// hashes, which take 5 kB in the program and as much again in the script.
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
