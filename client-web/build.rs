//! Compiles the shaders to naga's intermediate representation, so that the page ships without a WGSL parser and a
//! broken shader fails the build.

#[path = "src/view/render/packed_shader.rs"]
mod packed_shader;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/view/render/packed_shader.rs");
    let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    let globals = read(&shaders.join("globals.wgsl"))?;
    for name in ["ground", "particle", "solid"] {
        let file = shaders.join(name).with_extension("wgsl");
        let source = globals.clone() + &read(&file)?;
        let module = naga::front::wgsl::parse_str(&source)
            .map_err(|error| error.emit_to_string_with_path(&source, &file.to_string_lossy()))?;
        fs::write(out.join(name).with_extension("naga"), packed_shader::pack(module))?;
    }
    Ok(())
}

fn read(file: &Path) -> Result<String, String> {
    println!("cargo::rerun-if-changed={}", file.display());
    fs::read_to_string(file).map_err(|error| format!("cannot read {}: {error}", file.display()))
}
