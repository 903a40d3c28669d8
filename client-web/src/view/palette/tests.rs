//! Tests that colours are distinguishable: distances in OKLab (Ottosson 2020) under the colour-blindness matrices of
//! Machado, Oliveira and Fernandes 2009, and contrast as defined by WCAG 2.

use super::*;

pub type Matrix = [[f32; 3]; 3];

/// Each kind of colour vision with its matrix, on linear colours.
pub const VISIONS: [(&str, Matrix); 4] = [
    ("full", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    (
        "protanopia",
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ],
    ),
    (
        "deuteranopia",
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ],
    ),
    (
        "tritanopia",
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ],
    ),
];

fn linear(color: Rgb) -> [f32; 3] {
    color.map(|c| {
        let c = f32::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
}

fn apply(matrix: &Matrix, [r, g, b]: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| (row[0] * r + row[1] * g + row[2] * b).clamp(0.0, 1.0))
}

fn oklab(color: [f32; 3]) -> [f32; 3] {
    let to_cone = [
        [0.412_221_47, 0.536_332_55, 0.051_445_995],
        [0.211_903_5, 0.680_699_5, 0.107_396_96],
        [0.088_302_46, 0.281_718_85, 0.629_978_7],
    ];
    let [l, m, s] = apply(&to_cone, color).map(f32::cbrt);
    [
        0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s,
        1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
        0.025_904_037 * l + 0.782_771_77 * m - 0.808_675_77 * s,
    ]
}

/// A colour as displayed, as someone with this vision sees it.
pub fn seen_as(matrix: &Matrix, color: Rgb) -> Rgb {
    let encode = |c: f32| {
        if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
    };
    apply(matrix, linear(color)).map(|c| (encode(c) * 255.0).round() as u8)
}

/// How far two colours are apart in OKLab.
pub fn distance(matrix: &Matrix, a: Rgb, b: Rgb) -> f32 {
    let [a, b] = [a, b].map(|color| oklab(apply(matrix, linear(color))));
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
}

/// Contrast as defined by WCAG 2, 1 to 21.
pub fn contrast(a: Rgb, b: Rgb) -> f32 {
    let luminance = |color| {
        let [r, g, b] = linear(color);
        0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05
    };
    let (x, y) = (luminance(a), luminance(b));
    if x > y { x / y } else { y / x }
}

#[test]
fn player_colours_differ_for_every_kind_of_colour_vision() {
    for (vision, matrix) in &VISIONS {
        let seen: Vec<_> = PLAYERS.iter().map(|&c| oklab(apply(matrix, linear(c)))).collect();
        for i in 0..seen.len() {
            for j in 0..i {
                let distance: f32 =
                    (0..3).map(|k| (seen[i][k] - seen[j][k]).powi(2)).sum::<f32>().sqrt();
                let (a, b) = (NAMES[i], NAMES[j]);
                assert!(distance > 0.1, "{a} and {b} are {distance} apart under {vision}");
            }
        }
    }
}

#[test]
fn text_and_players_are_readable_on_every_ink() {
    for ink in INK {
        for (i, color) in PAPER.iter().chain(&PLAYERS).enumerate() {
            let found = contrast(*color, ink);
            // The lit stage is the lightest background.
            let least = if ink == INK[2] && i >= PAPER.len() { 4.0 } else { 4.5 };
            assert!(found >= least, "colour {i} {color:?} on {ink:?}: {found}");
        }
    }
}

#[test]
fn the_page_has_the_same_palette() {
    let file = include_str!("../../../web/palette.css");
    assert_eq!(file, css(), "run `cargo run -p jostle-client-web --example palette` to rewrite it");
}
