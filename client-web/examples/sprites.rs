//! Writes what `assets/sprites` and `web/palette.css` hold from the code that defines it:
//! `cargo run -p jostle-client-web --example sprites`. Tests fail while the files differ.

use jostle_client_web::{draw::sprite, palette};
use std::path::Path;

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = [
        ("../assets/sprites/particle.pgm", sprite::particle_pgm()),
        ("web/palette.css", palette::css().into_bytes()),
    ];
    for (name, bytes) in files {
        let path = root.join(name);
        std::fs::write(&path, bytes)?;
        println!("wrote {}", path.display());
    }
    Ok(())
}
