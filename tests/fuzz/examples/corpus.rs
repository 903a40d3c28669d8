//! Writes the corpus for the fuzzer, with one directory per property. Inputs for the smaller program are in `rooms`:
//!
//!     cargo run --package jostle-fuzz --example corpus -- DIR

use jostle_fuzz::{OF_ROOMS, OF_SERVERS, corpus};
use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let dir = PathBuf::from(env::args_os().nth(1).expect("a directory for the corpus"));
    let rooms = OF_ROOMS.iter().map(|(name, _)| ("rooms", *name));
    let servers = OF_SERVERS.iter().map(|(name, _)| ("servers", *name));
    for (program, property) in rooms.chain(servers) {
        let dir = dir.join(program).join(property);
        fs::create_dir_all(&dir)?;
        for (number, input) in corpus(property).iter().enumerate() {
            fs::write(dir.join(format!("{number:02}")), input)?;
        }
    }
    Ok(())
}
