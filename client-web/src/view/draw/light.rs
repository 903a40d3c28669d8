//! The light that particles, packs and bursts cast on matte surfaces: a coarse field over the view, filled by splatting
//! and spread by a blur. It costs one small texture per frame, regardless of the number of lights.

use jostle_sim::Vec2;

/// Number of cells along each axis of the field.
pub const LIGHT_CELLS: usize = 64;
/// Reach of light, world units.
const REACH: f32 = 6.5;
/// Number of successive blurs; more make the light rounder.
const PASSES: usize = 3;
/// Cells beyond each edge of the view, so that light from outside spills in.
const MARGIN_CELLS: f32 = 4.0;

/// Light on a grid of [`LIGHT_CELLS`] squared cells, row 0 at the bottom.
#[derive(Clone, Debug)]
pub struct LightField {
    /// Lower left corner, world units.
    pub low: Vec2,
    cell: f32,
    cells: Vec<[f32; 3]>,
    /// RGBA texels that hold square roots of the light, row 0 at the bottom of the world.
    pub texels: Vec<u8>,
    /// Whether there is any light.
    pub lit: bool,
}

impl Default for LightField {
    fn default() -> LightField {
        LightField {
            low: Vec2::ZERO,
            cell: 1.0,
            cells: vec![[0.0; 3]; LIGHT_CELLS * LIGHT_CELLS],
            texels: vec![0; LIGHT_CELLS * LIGHT_CELLS * 4],
            lit: false,
        }
    }
}

impl LightField {
    /// Empties the field and moves it over a view. Cells stay aligned to the world while the view moves, so that light
    /// does not shimmer.
    pub fn begin(&mut self, center: Vec2, half: Vec2) {
        let longest = 2.0 * half.x.max(half.y);
        self.cell = longest / (LIGHT_CELLS as f32 - 2.0 * MARGIN_CELLS);
        let low = center - Vec2::splat(0.5 * LIGHT_CELLS as f32 * self.cell);
        self.low = (low / self.cell).floor() * self.cell;
        if self.lit {
            self.cells.fill([0.0; 3]);
        }
        self.lit = false;
    }

    /// Adds light at a point, distributed over the four nearest cells. `strength` is about 1 for one particle.
    pub fn add(&mut self, point: Vec2, color: [f32; 3], strength: f32) {
        let at = (point - self.low) / self.cell - Vec2::splat(0.5);
        let limit = (LIGHT_CELLS - 1) as f32;
        if !(at.x >= 0.0 && at.y >= 0.0 && at.x < limit && at.y < limit) {
            return;
        }
        let (x, y) = (at.x as usize, at.y as usize);
        let (u, v) = (at.x - x as f32, at.y - y as f32);
        let index = y * LIGHT_CELLS + x;
        let corners = [
            (index, (1.0 - u) * (1.0 - v)),
            (index + 1, u * (1.0 - v)),
            (index + LIGHT_CELLS, (1.0 - u) * v),
            (index + LIGHT_CELLS + 1, u * v),
        ];
        for (cell, share) in corners {
            for (sum, part) in self.cells[cell].iter_mut().zip(color) {
                *sum += part * strength * share;
            }
        }
        self.lit = true;
    }

    /// Blurs the added light and computes the texels.
    pub fn finish(&mut self) {
        if !self.lit {
            return;
        }
        // The squares of the widths of successive blurs add up.
        let keep = (-self.cell / (REACH * (2.0 / PASSES as f32).sqrt())).exp();
        for _ in 0..PASSES {
            for row in self.cells.chunks_exact_mut(LIGHT_CELLS) {
                blur_row(row, keep);
            }
            blur_columns(&mut self.cells, keep);
        }
        // The blur distributes a sum over cells; this makes the result independent of the cell size.
        let gain = 0.55 * (REACH / self.cell).powi(2);
        for (cell, texel) in self.cells.iter().zip(self.texels.as_chunks_mut::<4>().0) {
            *texel = encode(*cell, gain);
        }
    }

    /// Width and height, world units.
    pub fn size(&self) -> f32 {
        self.cell * LIGHT_CELLS as f32
    }
}

/// A two-sided exponential blur along a row. Light spreads to both sides, attenuated by the factor `keep` per cell.
fn blur_row(row: &mut [[f32; 3]], keep: f32) {
    let mut carried = [0.0; 3];
    for cell in row.iter_mut() {
        carried = flow(*cell, carried, keep);
        *cell = carried;
    }
    carried = [0.0; 3];
    for cell in row.iter_mut().rev() {
        carried = flow(*cell, carried, keep);
        *cell = carried;
    }
}

/// Blurs all columns at once, row by row, so that memory is read sequentially.
fn blur_columns(cells: &mut [[f32; 3]], keep: f32) {
    for at in 0..LIGHT_CELLS {
        let (before, from) = cells.split_at_mut(at * LIGHT_CELLS);
        flow_row(&mut from[..LIGHT_CELLS], before.rchunks_exact(LIGHT_CELLS).next(), keep);
    }
    for at in (0..LIGHT_CELLS).rev() {
        let (until, after) = cells.split_at_mut((at + 1) * LIGHT_CELLS);
        let row = &mut until[at * LIGHT_CELLS..];
        flow_row(row, after.chunks_exact(LIGHT_CELLS).next(), keep);
    }
}

fn flow_row(row: &mut [[f32; 3]], neighbour: Option<&[[f32; 3]]>, keep: f32) {
    match neighbour {
        Some(neighbour) => {
            for (cell, &carried) in row.iter_mut().zip(neighbour) {
                *cell = flow(*cell, carried, keep);
            }
        }
        None => row.iter_mut().for_each(|cell| *cell = flow(*cell, [0.0; 3], keep)),
    }
}

#[inline]
fn flow([r, g, b]: [f32; 3], carried: [f32; 3], keep: f32) -> [f32; 3] {
    let share = 1.0 - keep;
    [r * share + carried[0] * keep, g * share + carried[1] * keep, b * share + carried[2] * keep]
}

/// Compresses light to 0..1 according to its brightest channel, which preserves the hue, and stores square roots.
fn encode(light: [f32; 3], gain: f32) -> [u8; 4] {
    let brightest = light[0].max(light[1]).max(light[2]) * gain;
    if brightest < 1e-5 {
        return [0, 0, 0, 255];
    }
    let scale = gain * (1.0 - (-brightest).exp()) / brightest;
    let [r, g, b] = light.map(|c| ((c * scale).clamp(0.0, 1.0).sqrt() * 255.0 + 0.5) as u8);
    [r, g, b, 255]
}
