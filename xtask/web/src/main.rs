//! Turns the compiled client into the files of the page: binds it to JavaScript, adds the page's other files and
//! compresses everything, ready to be served or embedded. `cargo xtask web` compiles the client and runs this program.

mod bind;
mod dist;
mod files;
mod guide;
mod static_page;
mod text;

use anyhow::{Result, ensure};
use clap::Parser;
use dist::Effort;
use std::path::PathBuf;

/// Builds the page from its compiled program
#[derive(Parser)]
struct WebArguments {
    /// The workspace's root
    #[arg(long, value_name = "DIR")]
    root: PathBuf,
    /// The client, as compiled by cargo
    #[arg(long, value_name = "FILE")]
    wasm: PathBuf,
    /// Directory for the output of wasm-bindgen
    #[arg(long, value_name = "DIR")]
    bound: PathBuf,
    /// Directory for a version of the page that needs no server, for any file host
    #[arg(long, value_name = "DIR")]
    static_page: Option<PathBuf>,
    /// How much effort to put into compression
    #[arg(long, value_enum)]
    effort: Effort,
    /// Fail if the compressed program is larger than this
    #[arg(long, value_name = "BYTES")]
    program_bytes_max: Option<u64>,
}

fn main() -> Result<()> {
    let arguments = WebArguments::parse();
    println!("web: bind it to JavaScript");
    bind::bind(&arguments.wasm, &arguments.bound)?;
    println!("web: gather and compress client-web/dist");
    let out = arguments.root.join("client-web/dist");
    let mut files = files::gather(&arguments.root, &arguments.bound)?;
    files::stamp(&mut files)?;
    dist::write_changed(&out, &files, arguments.effort)?;
    dist::remove_others(&out, &files)?;
    let packed_bytes = dist::report(&out, &files)?;
    if let Some(max) = arguments.program_bytes_max {
        ensure!(
            packed_bytes <= max,
            "the page's program is {packed_bytes} bytes as it travels; {max} are allowed"
        );
    }
    if let Some(out) = arguments.static_page {
        static_page::write(&out, &files)?;
        let bytes: usize = files.values().map(Vec::len).sum();
        println!("web: {} holds the page for any host of files, {bytes} bytes", out.display());
    }
    Ok(())
}
