//! Faces: heroes have eyes that look around, blink and widen; minions have a hint of a face, and marbles doze.

use super::motion::Pose;
use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex};
use crate::view::frame::{EffectKind, FrameBody};
use crate::view::palette::{INK, PAPER};
use jostle_game::Kind;
use jostle_sim::Vec2;

/// Minimum half size of bodies whose faces are drawn, pixels.
const PIXELS_MIN: f32 = 4.0;
/// How long a hit shows on a face, seconds.
const SHOCK_S: f32 = 0.9;

/// Adds the face of a body, if it has one and is large enough.
pub fn fill(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let least = pose.half.x.min(pose.half.y);
    if least < PIXELS_MIN * stage.quads.unit_per_pixel {
        return;
    }
    match body.kind {
        Kind::Hero => hero(stage, body, pose),
        Kind::Minion => minion(stage, body, pose),
        Kind::Marble => marble(stage, body, pose),
        _ => {}
    }
}

fn hero(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let shock = shock(stage, body);
    let look = gaze(body, 14.0);
    let open = 1.0 - blink(stage.frame.time, body.id.index, 4.3);
    let least = pose.half.x.min(pose.half.y);
    let face = pose.center + Vec2::new(0.0, 0.26 * pose.half.y) + look * (0.10 * least);
    let white = stage.shade(PAPER[0], 1.0);
    let dark = stage.shade(INK[0], 1.0);
    let wide = 1.0 + 0.22 * shock;
    let eye = Vec2::new(0.235, 0.29) * least * wide;
    let squint = Vec2::new(eye.x, (eye.y * open).max(0.035 * least));
    let pupil = Vec2::splat(0.145 * least * (1.0 - 0.35 * shock));
    for side in [-1.0, 1.0] {
        let at = face + Vec2::new(side * 0.40 * pose.half.x, 0.0);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, squint, white));
        if open > 0.45 {
            let at = at + look * (eye - pupil) * 0.72;
            stage.quads.push(SolidVertex::new(SolidKind::Oval, at, pupil, dark));
            let glint = at + Vec2::new(-0.3, 0.4) * pupil.x;
            let small = pupil * 0.36;
            stage.quads.push(SolidVertex::new(SolidKind::Oval, glint, small, white));
        }
    }
    let mouth = face + Vec2::new(look.x * 0.05 * least, -0.44 * least);
    let ink = stage.shade(INK[0], 0.66);
    let quad = if shock > 0.3 {
        SolidVertex::new(
            SolidKind::Oval,
            mouth - Vec2::Y * 0.1 * least,
            Vec2::new(0.10, 0.14) * least,
            ink,
        )
    } else {
        SolidVertex::new(SolidKind::Smile, mouth, Vec2::new(0.20, 0.09) * least, ink)
            .soft(0.075 * least)
    };
    stage.quads.push(quad);
}

fn minion(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let least = pose.half.x.min(pose.half.y);
    let look = gaze(body, 6.0);
    let open = 1.0 - blink(stage.frame.time, body.id.index, 3.1);
    let face = pose.center + Vec2::new(0.0, 0.12 * least) + look * (0.20 * least);
    let white = stage.shade(PAPER[0], 0.92);
    let dot = Vec2::new(0.125, (0.19 * open).max(0.03)) * least;
    for side in [-1.0, 1.0] {
        let at = face + Vec2::new(side * 0.30 * least, 0.0);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, dot, white));
    }
    let at = face - Vec2::new(0.0, 0.27 * least);
    let ink = stage.shade(INK[0], 0.5);
    let smile = SolidVertex::new(SolidKind::Smile, at, Vec2::new(0.15, 0.08) * least, ink);
    stage.quads.push(smile.soft(0.06 * least));
}

fn marble(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let least = pose.half.x.min(pose.half.y);
    let awake = (body.velocity.length() / 12.0).min(1.0);
    let look = gaze(body, 12.0);
    let face = pose.center + Vec2::new(0.0, 0.05 * least) + look * (0.14 * least);
    let dark = stage.shade(INK[1], 0.85);
    let closed = Vec2::new(0.15, 0.035) * least;
    let open = Vec2::new(0.09, 0.12) * least;
    let shape = closed.lerp(open, awake);
    for side in [-1.0, 1.0] {
        let at = face + Vec2::new(side * 0.30 * least, 0.0);
        let quad = SolidVertex::new(SolidKind::Box, at, shape, dark);
        stage.quads.push(quad.rounded(shape.x.min(shape.y)));
    }
}

/// The direction in which a face looks: towards its gaze point, otherwise along its velocity. The length is 0..=1 and
/// reaches 1 at `far` units or units/s.
fn gaze(body: &FrameBody, far: f32) -> Vec2 {
    let toward = body.gaze.map_or(body.velocity, |point| point - body.center);
    let length = toward.length();
    if length < 1e-3 { Vec2::ZERO } else { toward / length * (length / far).min(1.0) }
}

/// How far the eyelids are closed, 0..=1, at this time in seconds. Every body has a different rhythm.
fn blink(time: f32, index: u32, period_s: f32) -> f32 {
    let own = (index.wrapping_mul(2_654_435_761) >> 16) as f32 / 65_536.0;
    let period = period_s * (0.8 + 0.6 * own);
    let phase = (time + own * 31.0).rem_euclid(period);
    let half_s = 0.07;
    (1.0 - (phase - half_s).abs() / half_s).max(0.0)
}

/// How strongly a face shows a recent hit, 0..=1.
fn shock(stage: &DrawStage, body: &FrameBody) -> f32 {
    let hits = stage.frame.room.effects.iter().filter(|effect| {
        effect.kind == EffectKind::Splash && effect.body == Some(body.id) && effect.age < SHOCK_S
    });
    hits.map(|effect| 1.0 - (effect.age / SHOCK_S).powi(3)).fold(0.0, f32::max)
}
