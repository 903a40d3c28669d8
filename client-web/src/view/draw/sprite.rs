//! The particle's picture: a soft disc of alpha, in `assets/sprites/particle.pgm`. PGM is a header
//! and raw bytes, so that the page carries no picture decoder for it. [`particle_pgm`] makes the file.

/// Width and height in texels.
pub const SIDE: usize = 64;

const FILE: &[u8] = include_bytes!("../../../../assets/sprites/particle.pgm");
const HEADER: &str = "P5\n64 64\n255\n";

/// RGBA texels of the particle: white, with the file's alpha.
pub fn particle_texels() -> Vec<u8> {
    let alpha = &FILE[HEADER.len()..];
    debug_assert_eq!(alpha.len(), SIDE * SIDE, "particle.pgm must hold {SIDE} x {SIDE} bytes");
    alpha.iter().flat_map(|&a| [255, 255, 255, a]).collect()
}

/// The file: full in the middle, so that a single particle shows its true tint, then falling off
/// smoothly to nothing at the rim. Only + - * / and sqrt, so every machine writes the same bytes.
pub fn particle_pgm() -> Vec<u8> {
    let mut file = HEADER.as_bytes().to_vec();
    let half = SIDE as f32 * 0.5;
    for row in 0..SIDE {
        for column in 0..SIDE {
            let x = (column as f32 + 0.5 - half) / half;
            let y = (row as f32 + 0.5 - half) / half;
            let from_core = ((x * x + y * y).sqrt() - 0.10) / 0.90;
            let left = 1.0 - from_core.clamp(0.0, 1.0);
            let alpha = left * left * left * (1.9 - 0.9 * left);
            file.push((alpha * 255.0 + 0.5) as u8);
        }
    }
    file
}
