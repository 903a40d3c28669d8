//! Dye that stays: stains on heroes and platforms, and the colour of the particles of a burst. All of it is derived from
//! the bursts that a replica plays, and only drawn.

use super::room::RoomView;
use crate::net::timeline::Sample;
use crate::view::frame::{FrameRoom, FrameStain};
use jostle_game::Kind;
use jostle_sim::particles::Source;
use jostle_sim::{BodyId, EmitterDef, TICKS_PER_SECOND, Vec2};
use std::collections::VecDeque;

/// Maximum number of stains; the oldest are dropped first.
pub const STAINS_MAX: usize = 256;
/// Maximum number of bursts whose particles are dyed.
const BURSTS_MAX: usize = 64;
/// Maximum number of particles that are dyed in each burst.
const DYED_MAX: usize = 512;
/// How long a stain takes to fade, ticks.
const STAIN_TICKS: f64 = 30.0 * TICKS_PER_SECOND as f64;
/// How long the particles of a burst keep their colour, ticks.
const DYED_TICKS: f64 = 5.0 * TICKS_PER_SECOND as f64;
/// Distance from a burst within which a platform is stained, world units.
const REACH: f32 = 16.0;
/// Size of a stain on a hero, as a share of the hero's half extent.
const ON_HERO: f32 = 0.36;
/// Half the length of a stain on a platform, world units.
const ON_SLAB: f32 = 3.4;
/// Minimum time between bursts that flash, ticks: at most three a second.
const FLASHES_APART_TICKS: u32 = 20;

/// The dye of a room.
#[derive(Default)]
pub struct Dye {
    /// The stains and the ticks since which they are there, oldest first.
    stains: VecDeque<(f64, FrameStain)>,
    /// The ticks of bursts, the seeds of their particles and their colours, oldest first.
    bursts: VecDeque<(f64, Vec<u32>, u8)>,
    /// The position and colour of the newest burst, whose emitter comes next.
    newest: Option<(Vec2, u8)>,
    flashed: Option<u32>,
}

impl Dye {
    /// Stains a hero that was hit, and platforms near the burst.
    pub fn burst(&mut self, room: &RoomView, tick: u32, hero: BodyId, point: Vec2, color: u8) {
        self.newest = Some((point, color));
        for sample in &room.samples {
            let stain = match sample.kind {
                Kind::Hero if sample.id == hero => on_hero(sample, point),
                Kind::Wall | Kind::Platform => on_slab(sample, point),
                _ => None,
            };
            let Some((at, half)) = stain else { continue };
            if self.stains.len() == STAINS_MAX {
                self.stains.pop_front();
            }
            let stain = FrameStain { body: sample.id, at, half, color, left: 1.0 };
            self.stains.push_back((f64::from(tick), stain));
        }
    }

    /// Dyes the particles of an emitter if it belongs to the newest burst.
    pub fn emit(&mut self, tick: u32, emitter: EmitterDef) {
        let Source::Point(point) = emitter.source else { return };
        let Some((_, color)) = self.newest.take_if(|newest| newest.0.distance(point) < 0.1) else {
            return;
        };
        if self.bursts.len() == BURSTS_MAX {
            self.bursts.pop_front();
        }
        let mut seeds = emitter.seeds();
        seeds.truncate(DYED_MAX);
        self.bursts.push_back((f64::from(tick), seeds, color));
    }

    /// Whether a burst in this tick may flash, so that there are no more than three flashes a second.
    pub fn flashes(&mut self, tick: u32) -> bool {
        let flashes = self.flashed.is_none_or(|last| tick.abs_diff(last) >= FLASHES_APART_TICKS);
        if flashes {
            self.flashed = Some(tick);
        }
        flashes
    }

    /// Adds the dye at the displayed moment to the picture.
    pub fn lay_out(&mut self, room: &RoomView, drawn: &mut FrameRoom) {
        let age = |since: f64| room.display - since;
        while self.stains.front().is_some_and(|stain| age(stain.0) > STAIN_TICKS) {
            self.stains.pop_front();
        }
        while self.bursts.front().is_some_and(|burst| age(burst.0) > DYED_TICKS) {
            self.bursts.pop_front();
        }
        drawn.stains.clear();
        drawn.stains.extend(self.stains.iter().map(|&(since, stain)| {
            let left = (1.0 - age(since) / STAIN_TICKS).clamp(0.0, 1.0) as f32;
            FrameStain { left, ..stain }
        }));
        drawn.dyes.clear();
        for (_, seeds, color) in &self.bursts {
            drawn.dyes.extend(seeds.iter().map(|&seed| (seed, *color)));
        }
        drawn.dyes.sort_unstable();
    }
}

/// Position and size of a stain on a hero, inside its outline.
fn on_hero(hero: &Sample, point: Vec2) -> Option<(Vec2, Vec2)> {
    let extent = hero.shape.half_extent();
    let at = (point - hero.center) / extent;
    // Round heroes and rounded corners end before the box does.
    let at = at.clamp_length_max(1.0) * (0.92 - ON_HERO);
    Some((at, Vec2::splat(ON_HERO * extent.min_element())))
}

/// Position and size of a stain on the surface of a platform or a wall, if it is near the burst.
fn on_slab(slab: &Sample, point: Vec2) -> Option<(Vec2, Vec2)> {
    let extent = slab.shape.half_extent();
    let away = point - slab.center;
    let nearest = away.clamp(-extent, extent);
    let distance = nearest.distance(away);
    if distance > REACH || extent.min_element() <= 0.0 {
        return None;
    }
    let size = ON_SLAB * (1.0 - 0.5 * distance / REACH);
    let deep = (0.45 * size).min(0.8 * extent.min_element());
    // The stain lies along the side that faces the burst.
    let is_level = away.y.abs() - extent.y >= away.x.abs() - extent.x;
    let half = if is_level { Vec2::new(size, deep) } else { Vec2::new(deep, size) };
    let half = half.min(extent);
    let room = extent - half;
    Some((nearest.clamp(-room, room) / extent, half))
}

#[cfg(test)]
mod tests;
