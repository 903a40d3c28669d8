//! The looks of the themes: colours, ground, light and pattern. The shaders draw all of them with one formula, so that
//! a theme costs no pass and no branch.

use super::palette::{INK, PAPER, Rgb, SLATE, TOYS, WOOD};
use jostle_game::scene::Theme;

/// How a theme is drawn.
#[derive(Debug)]
pub struct Style {
    /// Outside the world, shaded stage, lit stage, and the hills in front of it.
    pub ground: [Rgb; 4],
    /// Slabs and walls, from shaded side to lit edge.
    pub slate: [Rgb; 4],
    /// Crates, from shaded plank to lit edge.
    pub wood: [Rgb; 3],
    /// Painted balls.
    pub toys: [Rgb; 3],
    /// Texts and pictures on the stage.
    pub pen: Rgb,
    /// Light that the lines of the grid add, red, green and blue; negative on light ground.
    pub lines: [f32; 3],
    /// The share of light that is left at the edges of the stage.
    pub dusk: f32,
    /// How far light covers instead of adding, 0..=1: additive light is invisible on light ground.
    pub cover: f32,
    /// The outline of toys: dark up to 1, bright down to -1.
    pub rim: f32,
    /// Height of the hills and of their crests, shares of the world's height; crests per unit; opacity.
    pub hills: [f32; 4],
    /// Stripes per unit along x and y, their bend in stripes, and their strength.
    pub stripes: [f32; 4],
}

const DARK: Style = Style {
    ground: [INK[0], INK[1], INK[2], INK[2]],
    slate: SLATE,
    wood: WOOD,
    toys: TOYS,
    pen: PAPER[0],
    lines: [0.075, 0.095, 0.160],
    dusk: 0.72,
    cover: 0.0,
    rim: 0.0,
    hills: [0.0; 4],
    stripes: [0.0; 4],
};

const LIGHT: Style =
    Style { pen: INK[1], lines: [0.0; 3], dusk: 0.92, cover: 1.0, rim: 1.0, ..DARK };

/// In the order of [`Theme`].
static LOOKS: [Style; 6] = [
    DARK,
    Style {
        ground: [[0x43, 0x22, 0x16], [0xf2, 0xc9, 0x8c], [0xff, 0xe4, 0xb4], [0xe0, 0xa4, 0x60]],
        slate: [[0x6d, 0x3a, 0x24], [0x9c, 0x58, 0x36], [0xc9, 0x80, 0x4e], [0xf0, 0xb8, 0x7c]],
        wood: [[0x8a, 0x4a, 0x2c], [0xb0, 0x6c, 0x40], [0xe8, 0xb4, 0x80]],
        hills: [0.26, 0.11, 0.011, 1.0],
        stripes: [0.012, 0.14, 0.9, 0.035],
        ..LIGHT
    },
    Style {
        ground: [[0x10, 0x2c, 0x4a], [0xc4, 0xdd, 0xec], [0xe6, 0xf3, 0xf8], [0xff, 0xff, 0xff]],
        slate: [[0x1d, 0x4a, 0x70], [0x3a, 0x76, 0xa2], [0x7a, 0xb4, 0xd4], [0xea, 0xf8, 0xff]],
        wood: [[0x5d, 0x7f, 0x9c], [0x86, 0xa8, 0xc0], [0xd8, 0xec, 0xf6]],
        toys: [[0x22, 0x2c, 0x44], [0x38, 0x4a, 0x66], [0x2c, 0x5a, 0x78]],
        stripes: [0.016, 0.022, 0.0, 0.025],
        ..LIGHT
    },
    Style {
        ground: [[0x10, 0x2a, 0x22], [0xa6, 0xd8, 0xe4], [0xc8, 0xe8, 0xf0], [0x6c, 0xb2, 0x56]],
        slate: [[0x4a, 0x34, 0x22], [0x5e, 0x78, 0x32], [0x86, 0xa8, 0x44], [0xb8, 0xdc, 0x68]],
        hills: [0.34, 0.16, 0.0085, 1.0],
        stripes: [0.05, 0.0, 0.0, 0.06],
        ..LIGHT
    },
    Style {
        ground: [[0x05, 0x02, 0x0e], [0x0e, 0x06, 0x22], [0x1e, 0x0a, 0x3a], INK[2]],
        slate: [[0x3c, 0x18, 0x70], [0x34, 0x12, 0x60], [0xff, 0x3c, 0xc8], [0x46, 0xf0, 0xff]],
        wood: [[0x3a, 0x12, 0x58], [0x56, 0x1c, 0x7c], [0xff, 0x5c, 0xd8]],
        toys: [[0x12, 0x5c, 0x78], [0x7c, 0x1c, 0x6a], [0x4c, 0x30, 0xa0]],
        lines: [0.9, 0.15, 1.1],
        rim: -0.8,
        ..DARK
    },
    Style {
        ground: [[0x2a, 0x2c, 0x36], [0xf4, 0xee, 0xdc], [0xf2, 0xec, 0xda], [0xff, 0xff, 0xff]],
        slate: [[0x46, 0x48, 0x54], [0x62, 0x66, 0x76], [0x86, 0x8a, 0x9a], [0xc4, 0xc8, 0xd4]],
        wood: [[0xc8, 0x9c, 0x64], [0xe0, 0xbc, 0x86], [0xf8, 0xe2, 0xb8]],
        lines: [-0.75, -0.45, -0.12],
        dusk: 0.97,
        ..LIGHT
    },
];

impl Style {
    /// The look of a theme.
    pub fn of(theme: Theme) -> &'static Style {
        &LOOKS[theme as usize]
    }
}

#[cfg(test)]
mod tests;
