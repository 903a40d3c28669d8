//! The shared palette: ink for the stage, slate and wood for the objects on it, paper for text, eight player colours
//! and an ember ramp. The canvas reads these constants; the page uses the CSS that [`css`] generates as
//! `web/palette.css`, and a test keeps the two in sync.

use std::fmt::Write;

/// Red, green and blue values as displayed, 0..=255.
pub type Rgb = [u8; 3];

/// Background colours, from the dark outside the world to the lit stage.
pub const INK: [Rgb; 3] = [[0x09, 0x0c, 0x1a], [0x10, 0x16, 0x2b], [0x1c, 0x26, 0x46]];
/// Slabs and walls, from shaded side to lit edge.
pub const SLATE: [Rgb; 4] =
    [[0x2b, 0x35, 0x55], [0x3b, 0x48, 0x6d], [0x56, 0x66, 0x8f], [0x8b, 0x9c, 0xc4]];
/// Crates, from shaded plank to lit edge.
pub const WOOD: [Rgb; 3] = [[0x7a, 0x55, 0x3f], [0xa8, 0x7c, 0x58], [0xd9, 0xb1, 0x83]];
/// Painted balls, less vivid than any player.
pub const TOYS: [Rgb; 3] = [[0x3f, 0x7d, 0x86], [0x9c, 0x55, 0x4b], [0xa3, 0x8a, 0x4c]];
/// Wandering minions: body and lit edge.
pub const MINION: [Rgb; 2] = [[0x6f, 0x63, 0xa8], [0xa9, 0x9d, 0xe0]];
/// Text on ink: the first for normal text, the second for secondary text. Also eyes and marbles.
pub const PAPER: [Rgb; 2] = [[0xf4, 0xf1, 0xe8], [0xb4, 0xbb, 0xcf]];
/// Player colours, based on those of Okabe and Ito and adjusted until every pair is distinguishable under protanopia,
/// deuteranopia and tritanopia and each is readable on ink; `palette/tests.rs` verifies this.
pub const PLAYERS: [Rgb; 8] = [
    [0xff, 0x8a, 0x08],
    [0x40, 0xd5, 0xff],
    [0x15, 0xc2, 0x7b],
    [0xff, 0xd9, 0x74],
    [0x61, 0x86, 0xdf],
    [0xed, 0x52, 0x0d],
    [0xfc, 0xa2, 0xc1],
    [0xe8, 0xff, 0xef],
];
/// The names of the player colours, as in `index.html`.
pub const NAMES: [&str; 8] =
    ["orange", "sky", "green", "sand", "blue", "vermilion", "pink", "mint"];
/// The colour of a hero or pack without an owner.
pub const NOBODY: Rgb = [0xd8, 0x8f, 0x6c];
/// A cooling fire: white, yellow, orange, red, like a black body.
pub const EMBER: [Rgb; 4] =
    [[0xff, 0xf3, 0xd6], [0xff, 0xc2, 0x5c], [0xff, 0x7a, 0x1f], [0xc4, 0x2a, 0x0e]];

/// The colour of a player; the index wraps around.
pub fn player(index: u8) -> Rgb {
    PLAYERS[usize::from(index) % PLAYERS.len()]
}

/// Interpolates from `a` at `share` 0 to `b` at 1.
pub fn mix(a: Rgb, b: Rgb, share: f32) -> Rgb {
    let part = |i: usize| {
        let (from, to) = (f32::from(a[i]), f32::from(b[i]));
        (from + (to - from) * share).round().clamp(0.0, 255.0) as u8
    };
    [part(0), part(1), part(2)]
}

/// The palette as CSS custom properties: `--ink-0` .. `--ember-3`.
pub fn css() -> String {
    let mut text = String::from(
        "/* Written from client-web/src/view/palette.rs; edit it there. */\n:root {\n",
    );
    let groups: [(&str, &[Rgb]); 8] = [
        ("ink", &INK),
        ("slate", &SLATE),
        ("wood", &WOOD),
        ("toy", &TOYS),
        ("minion", &MINION),
        ("paper", &PAPER),
        ("player", &PLAYERS),
        ("ember", &EMBER),
    ];
    for (name, colors) in groups {
        for (step, [r, g, b]) in colors.iter().enumerate() {
            writeln!(text, "  --{name}-{step}: #{r:02x}{g:02x}{b:02x};")
                .expect("writing to a string cannot fail");
        }
    }
    text.push_str("}\n");
    text
}

#[cfg(test)]
pub(super) mod tests;
