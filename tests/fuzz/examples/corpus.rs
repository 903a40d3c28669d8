//! Writes the corpus for the fuzzer, a directory a property:
//!
//!     cargo run --package jostle-fuzz --example corpus -- DIR

use jostle_fuzz::{PROPERTIES, corpus};
use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let dir = PathBuf::from(env::args_os().nth(1).expect("a directory for the corpus"));
    for (property, _) in PROPERTIES {
        let dir = dir.join(property);
        fs::create_dir_all(&dir)?;
        for (number, input) in corpus(property).iter().enumerate() {
            fs::write(dir.join(format!("{number:02}")), input)?;
        }
    }
    Ok(())
}
