//! Paths of bodies within a step, and whether they are long compared with the bodies. A path is a straight line, which
//! starts at the point of impact if there was one.

use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::math::{max, min};
use crate::narrow_phase::Manifold;
use crate::narrow_phase::separation::{self, placed};
use crate::solver::tolerances::TOLERATED_SHARE;
use glam::Vec2;

/// Each body's last impact in the step, by slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Paths {
    /// Time of the impact, seconds into the step; 0 without an impact.
    pub impact_time: Vec<f32>,
    /// Position at the impact; empty in a world that has never had one.
    pub impact_position: Vec<Vec2>,
    /// Acceleration on the parabola that ends where springs take a body in the step, units/s^2. Empty in a world
    /// without springs.
    pub sprung: Vec<Option<Vec2>>,
}

impl Paths {
    /// Time from which both paths of a pair are valid.
    #[inline]
    pub fn start_time(&self, pair: &Pair) -> f32 {
        max(self.impact_time[pair.a as usize], self.impact_time[pair.b as usize])
    }

    /// Acceleration of a body on springs, units/s^2.
    #[inline]
    pub fn sprung_acceleration(&self, slot: u32) -> Option<Vec2> {
        self.sprung.get(slot as usize).copied().flatten()
    }

    /// Position of a body at a time after its impact, on the straight line to where its current velocity takes it by
    /// the end of the step.
    pub fn position_at(&self, bodies: &Bodies, slot: u32, time: f32, dt: f32) -> Vec2 {
        let slot = slot as usize;
        let (center, velocity, since) =
            (bodies.center[slot], bodies.velocity[slot], self.impact_time[slot]);
        if since == 0.0 {
            return center + velocity * time;
        }
        let impact_position = self.impact_position[slot];
        if since >= time {
            return impact_position;
        }
        impact_position
            + (center + velocity * dt - impact_position) * ((time - since) / (dt - since))
    }
}

/// Predicts the manifold of a pair whose body b moves by `path` relative to a in the step. After an impact within the
/// step, the bodies are swept only from there on, but the separation is measured from the start of their paths, where
/// they may overlap.
#[inline(never)]
pub(crate) fn predict_manifold(
    bodies: &Bodies,
    paths: &Paths,
    pair: &Pair,
    path: Vec2,
    dt: f32,
) -> Option<Manifold> {
    let (mut at_a, mut at_b) = (placed(bodies, pair.a), placed(bodies, pair.b));
    let start = paths.start_time(pair);
    if start == 0.0 {
        return separation::between(at_a, at_b, path, pair.axis);
    }
    let begin = at_b.center - at_a.center;
    at_a.center = paths.position_at(bodies, pair.a, start, dt);
    at_b.center = paths.position_at(bodies, pair.b, start, dt);
    let ahead = at_b.center - at_a.center - begin;
    let manifold = separation::between(at_a, at_b, path - ahead, pair.axis)?;
    Some(Manifold { separation: manifold.separation - manifold.normal.dot(ahead), ..manifold })
}

/// Whether either body of a pair moves in a step by more than `times` the smaller one's half-size.
#[inline]
pub(crate) fn is_fast(bodies: &Bodies, pair: &Pair, dt: f32, times: f32) -> bool {
    let speed = |slot: u32| {
        let speed = bodies.velocity[slot as usize].abs();
        max(speed.x, speed.y)
    };
    max(speed(pair.a), speed(pair.b)) * dt > times * thickness(bodies, pair)
}

/// The smaller of a pair's half-sizes, world units.
#[inline]
pub(crate) fn thickness(bodies: &Bodies, pair: &Pair) -> f32 {
    let of = |slot: u32| bodies.thickness(slot as usize);
    min(of(pair.a), of(pair.b))
}

/// Limits the tolerated overlap for bodies of this size.
#[inline]
pub(crate) fn overlap_limit(thickness: f32, overlap: f32) -> f32 {
    min(overlap, TOLERATED_SHARE * thickness)
}
