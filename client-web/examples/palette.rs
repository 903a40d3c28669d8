//! Writes `web/palette.css` from the palette: `cargo run -p jostle-client-web --example palette`. A test fails if the
//! file differs from the palette.

fn main() -> std::io::Result<()> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/web/palette.css");
    std::fs::write(file, jostle_client_web::view::palette::css())
}
