//! Writes what `assets/sprites` and `web/palette.css` hold from the code that defines it:
//! `cargo run -p jostle-client-web --example sprites`. Tests fail while the files differ.

use jostle_client_web::view::draw::{icon, sprite};
use jostle_client_web::view::palette;
use std::path::Path;

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = vec![
        ("assets/sprites/particle.pgm".to_owned(), sprite::particle_pgm()),
        ("client-web/web/palette.css".to_owned(), palette::css().into_bytes()),
    ];
    for (name, side) in icon::ICONS {
        files.push((format!("assets/sprites/{name}"), icon::icon_png(side)));
    }
    for (name, bytes) in files {
        std::fs::write(root.join("..").join(&name), bytes)?;
        println!("wrote {name}");
    }
    Ok(())
}
