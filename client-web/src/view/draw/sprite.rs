//! The texture of particles: a disc with soft alpha.

/// Width and height in texels.
pub const SIDE: usize = 64;

/// RGBA texels of the particle texture: white, opaque in the centre, so that a single particle shows its true tint, and
/// fading smoothly to transparent at the rim.
pub fn particle_texels() -> Vec<u8> {
    let half = SIDE as f32 * 0.5;
    let mut texels = Vec::with_capacity(SIDE * SIDE * 4);
    for (row, column) in (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (row, column))) {
        let x = (column as f32 + 0.5 - half) / half;
        let y = (row as f32 + 0.5 - half) / half;
        let from_core = ((x * x + y * y).sqrt() - 0.10) / 0.90;
        let left = 1.0 - from_core.clamp(0.0, 1.0);
        let alpha = left * left * left * (1.9 - 0.9 * left);
        texels.extend([255, 255, 255, (alpha * 255.0 + 0.5) as u8]);
    }
    texels
}
