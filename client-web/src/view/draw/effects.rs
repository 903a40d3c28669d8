//! Effects that flare up and fade: sparks from hard impacts, splashes from packs, puffs where bodies left the world.

use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::{Effect, EffectKind};
use crate::view::palette::{self, EMBER, PAPER, Rgb};
use jostle_sim::Vec2;

/// Closing speed at which a spark reaches full brightness, units/s.
const SPARK_SPEED: f32 = 60.0;

/// Adds all effects in view.
pub fn fill(stage: &mut DrawStage) {
    for effect in &stage.frame.room.effects {
        if !stage.quads.sees(effect.point, Vec2::splat(40.0)) || effect.age < 0.0 {
            continue;
        }
        match effect.kind {
            EffectKind::Spark if stage.frame.calm => {}
            EffectKind::Spark => spark(stage, effect),
            EffectKind::Splash => splash(stage, effect),
            EffectKind::Gone => gone(stage, effect),
        }
    }
}

/// Short bright streaks that point away from the contact, with a flash of light.
fn spark(stage: &mut DrawStage, effect: &Effect) {
    let force = (effect.strength / SPARK_SPEED).clamp(0.15, 1.0);
    let life_s = 0.16 + 0.16 * force;
    let left = 1.0 - effect.age / life_s;
    if left <= 0.0 {
        return;
    }
    let heat = palette::mix(EMBER[2], EMBER[1], left);
    let mut dice = Dice::of(effect.point);
    let count = 4 + (6.0 * force) as u32;
    for _ in 0..count {
        let way = dice.direction();
        let speed = (14.0 + 46.0 * force) * (0.45 + 0.55 * dice.unit());
        let out = 0.8 + speed * effect.age * (1.0 - 0.35 * effect.age / life_s);
        let length = (0.8 + speed * 0.05) * (0.3 + 0.7 * left);
        let quad = SolidVertex::new(
            SolidKind::Trail,
            effect.point + way * (out + 0.5 * length),
            Vec2::new(0.5 * length, 0.18 + 0.16 * force),
            rgba(heat, left),
        );
        stage.quads.push(quad.turned(way).edged([0, 0, 0, 0]));
    }
    glow(stage, effect.point, 2.5 + 4.0 * force, heat, 0.5 * left * left * force);
    stage.shine(effect.point, EMBER[1], 9.0 * force * left * left);
}

/// Droplets in the pack's colour, a widening ring, and a flash of light in that colour.
fn splash(stage: &mut DrawStage, effect: &Effect) {
    let life_s = 0.7;
    let done = effect.age / life_s;
    if done >= 1.0 {
        return;
    }
    let left = 1.0 - done;
    let color = effect.color.map_or(EMBER[1], palette::player);
    let mut dice = Dice::of(effect.point);
    for _ in 0..14 {
        let way = dice.direction();
        let speed = 16.0 + 34.0 * dice.unit();
        let size = (0.35 + 0.75 * dice.unit()) * left.sqrt();
        let flown = speed * (1.0 - (-3.2 * effect.age).exp()) / 3.2 * 2.0;
        let fallen = Vec2::new(0.0, -22.0 * effect.age * effect.age);
        let at = effect.point + way * flown + fallen;
        let drop = SolidVertex::new(SolidKind::MatteOval, at, Vec2::splat(size), rgba(color, 1.0));
        stage.quads.push(drop.edged(rgba(PAPER[0], 1.0)));
    }
    let reach = 3.0 + 15.0 * (1.0 - left * left * left);
    let wave = SolidVertex::new(
        SolidKind::RingOval,
        effect.point,
        Vec2::splat(reach),
        rgba(color, 0.6 * left * left),
    );
    let wave = SolidVertex { edge: [0, 0, 0, 40], ..wave };
    stage.quads.push(wave.soft(0.3 + 1.3 * left));
    if stage.frame.calm || effect.strength <= 0.0 {
        return;
    }
    let flash = (1.0 - effect.age / 0.35).max(0.0);
    let heat = palette::mix(color, PAPER[0], 0.3 * flash);
    glow(stage, effect.point, 26.0, heat, 0.55 * flash * flash);
    stage.shine(effect.point, heat, 60.0 * left * left);
}

/// A shrinking ring and a few rising motes.
fn gone(stage: &mut DrawStage, effect: &Effect) {
    let life_s = 0.6;
    let left = 1.0 - effect.age / life_s;
    if left <= 0.0 {
        return;
    }
    let color = effect.color.map_or(PAPER[1], palette::player);
    let ring = SolidVertex::new(
        SolidKind::RingOval,
        effect.point,
        Vec2::splat(0.5 + 7.0 * left * left),
        rgba(color, 0.6 * left),
    );
    let ring = SolidVertex { edge: [0, 0, 0, 60], ..ring };
    stage.quads.push(ring.soft(0.9));
    let mut dice = Dice::of(effect.point);
    for _ in 0..6 {
        let way = dice.direction();
        let at = effect.point + way * (7.0 * (1.0 - left)) + Vec2::new(0.0, 9.0 * effect.age);
        let mote =
            SolidVertex::new(SolidKind::Oval, at, Vec2::splat(0.6 * left), rgba(color, left));
        stage.quads.push(mote);
    }
}

fn glow(stage: &mut DrawStage, center: Vec2, radius: f32, color: Rgb, strength: f32) {
    let quad =
        SolidVertex::new(SolidKind::Glow, center, Vec2::splat(radius), rgba(color, strength));
    stage.quads.push(quad);
}

/// Pseudo-random numbers seeded by a position, so that an effect looks the same in every frame.
pub(super) struct Dice(u32);

impl Dice {
    pub fn of(point: Vec2) -> Dice {
        // The finaliser of MurmurHash3 (Appleby 2011) gives nearby positions very different seeds.
        let mut bits = point.x.to_bits().rotate_left(9) ^ point.y.to_bits();
        bits = (bits ^ bits >> 16).wrapping_mul(0x85eb_ca6b);
        bits = (bits ^ bits >> 13).wrapping_mul(0xc2b2_ae35);
        Dice((bits ^ bits >> 16).max(1))
    }

    /// The next number in 0..1 (xorshift, Marsaglia 2003).
    pub fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 8) as f32 / 16_777_216.0
    }

    fn direction(&mut self) -> Vec2 {
        Vec2::from_angle(self.unit() * std::f32::consts::TAU)
    }
}
