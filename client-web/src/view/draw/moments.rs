//! Signs of what just happened: points that fly up, the leader's crown and the confetti after a round.

use super::effects::Dice;
use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::{FrameConfetti, FramePoints};
use crate::view::palette::{self, EMBER, INK, PAPER, Rgb};
use jostle_sim::Vec2;

/// Number of pieces of confetti.
const CONFETTI_MAX: u32 = 140;
/// Height of a digit, as a share of the view's height.
const DIGIT_SHARE: f32 = 0.03;
/// How long points are visible, seconds.
const POINTS_S: f32 = 1.1;
/// The lines of a digit that are drawn, one bit each: top, upper right, lower right, bottom, lower left, upper left,
/// middle.
const DIGITS: [u8; 10] = [0x3f, 0x06, 0x5b, 0x4f, 0x66, 0x6d, 0x7d, 0x07, 0x7f, 0x6f];
/// The ends of these lines, in units of half a digit's size.
const LINES: [[(f32, f32); 2]; 7] = [
    [(-1.0, 1.0), (1.0, 1.0)],
    [(1.0, 1.0), (1.0, 0.0)],
    [(1.0, 0.0), (1.0, -1.0)],
    [(1.0, -1.0), (-1.0, -1.0)],
    [(-1.0, -1.0), (-1.0, 0.0)],
    [(-1.0, 0.0), (-1.0, 1.0)],
    [(-1.0, 0.0), (1.0, 0.0)],
];

/// Adds points and confetti, above everything else in the world.
pub fn fill(stage: &mut DrawStage) {
    for points in &stage.frame.room.points {
        fly(stage, points);
    }
    if let Some(confetti) = stage.frame.room.confetti.filter(|_| !stage.frame.calm) {
        fall(stage, confetti);
    }
}

/// "+1" or another number, which rises and fades. In a calm picture it stays in place.
fn fly(stage: &mut DrawStage, points: &FramePoints) {
    let done = points.age / POINTS_S;
    if done >= 1.0 {
        return;
    }
    let high = stage.frame.view.height * DIGIT_SHARE;
    let half = Vec2::new(0.28, 0.5) * high;
    let rise = if stage.frame.calm { 0.0 } else { 4.0 * done * (2.0 - done) };
    let alpha = (3.0 * (1.0 - done)).min(1.0);
    let color = rgba(palette::mix(palette::player(points.color), PAPER[0], 0.35), alpha);
    let mut number = points.points.clamp(0, 9999) as usize;
    let digits = 1 + number.checked_ilog10().unwrap_or(0);
    let step = Vec2::new(high * 0.86, 0.0);
    let mut at = points.at + Vec2::new(0.0, high * (1.0 + rise)) + step * (0.5 * digits as f32);
    for (back, color) in [(0.12 * high, rgba(INK[0], 0.8 * alpha)), (0.0, color)] {
        let width = 0.075 * high + back * 0.5;
        let (end, whole) = (at, number);
        for _ in 0..digits {
            let digit = number % 10;
            let lines = (0..).zip(LINES).filter(|(line, _)| DIGITS[digit] >> line & 1 == 1);
            // The lines of a one are on the right.
            let middle = if digit == 1 { at - Vec2::new(half.x, 0.0) } else { at };
            for (_, [from, to]) in lines {
                let [from, to] = [from, to].map(|end| middle + half * Vec2::from(end));
                stage.line(from, to, width, color);
            }
            (at, number) = (at - step, number / 10);
        }
        for arm in [Vec2::X, Vec2::Y] {
            stage.line(at - arm * half.x, at + arm * half.x, width, color);
        }
        (at, number) = (end, whole);
    }
}

/// Paper that falls, sways and turns, most of it in the winner's colour.
fn fall(stage: &mut DrawStage, confetti: FrameConfetti) {
    let view = stage.frame.view;
    let half = view.half();
    let own = palette::player(confetti.color);
    let colors: [Rgb; 4] = [own, palette::mix(own, PAPER[0], 0.5), own, EMBER[1]];
    let mut dice = Dice::of(Vec2::new(3.0, f32::from(confetti.color)));
    let long = 0.011 * view.height;
    for piece in 0..CONFETTI_MAX {
        let [x, delay, speed, phase] = [(); 4].map(|()| dice.unit());
        let age = confetti.age - 1.2 * delay;
        let fallen = age * (0.45 + 0.35 * speed);
        if age < 0.0 || fallen > 1.1 {
            continue;
        }
        let sway = (age * 3.0 + phase * 6.3).sin();
        let at =
            Vec2::new((2.0 * x - 1.0) * half.x + sway * 2.0 * long, half.y * (1.05 - 2.0 * fallen));
        // It turns over as it falls.
        let flat = (age * (4.0 + 5.0 * speed) + phase * 6.3).cos().abs();
        let size = Vec2::new(long, long * (0.12 + 0.5 * flat));
        let fill = rgba(colors[piece as usize % colors.len()], 0.95);
        let quad = SolidVertex::new(SolidKind::Box, view.center + at, size, fill);
        stage.quads.push(quad.turned(Vec2::from_angle(sway + phase * 6.3)));
    }
}

/// A crown with three points on a hero's head.
pub fn crown(stage: &mut DrawStage, center: Vec2, half: Vec2) {
    let (gold, edge) = (stage.shade(EMBER[1], 1.0), stage.shade(INK[0], 0.8));
    let unit = half.x.min(half.y);
    let foot = center + Vec2::new(0.0, half.y + 0.12 * unit);
    for (grown, color) in [(0.08 * unit, edge), (0.0, gold)] {
        for side in [-1.0, 0.0, 1.0_f32] {
            let tall = unit * (0.26 + 0.1 * (1.0 - side.abs()));
            let at = foot + Vec2::new(side * 0.42 * unit, 0.14 * unit);
            let spike = Vec2::splat(tall * 0.62 + grown);
            let quad = SolidVertex::new(SolidKind::Box, at, spike, color);
            stage.quads.push(quad.turned(Vec2::splat(std::f32::consts::FRAC_1_SQRT_2)));
        }
        let band = Vec2::new(0.62 * unit + grown, 0.15 * unit + grown);
        stage.quads.push(SolidVertex::new(SolidKind::Box, foot, band, color));
    }
}
