//! Obstacles in the way of stiff springs.
//!
//! A spring that turns over within a few steps may take a body through a floor and back, or leave it with an
//! arbitrary velocity at the end of the step. If such a body would end up inside another one, or if an implicit
//! Euler step would run into one, the body takes that implicit step instead, with immovable obstacles as
//! constraints. The implicit step never leads past the point where the springs are at rest, and it loses energy no
//! matter what the contacts do.

use super::air::{Move, MoveKind};
use crate::bodies::Bodies;
use crate::broad_phase::pairs::{Pair, near};
use crate::math::max;
use crate::narrow_phase::separation::{self, placed};
use crate::solver::tolerances::OVERLAP;
use glam::{DVec2, Vec2};

const NONE: u32 = u32::MAX;

/// An obstacle in the path of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearbyObstacle {
    pub slot: u32,
    /// The body that is the obstacle.
    pub other: u32,
    /// Unit vector towards the body.
    pub normal: DVec2,
    /// Smallest velocity along the normal that does not lead into the obstacle, units/s. It is not finite for an
    /// obstacle that can be pushed away.
    pub speed_min: f64,
}

/// The obstacles of a step.
#[derive(Clone, Debug, Default)]
pub(super) struct Obstacles {
    all: Vec<NearbyObstacle>,
    /// Scratch for the obstacles in pair order, and the slot and index of each.
    found: Vec<NearbyObstacle>,
    order: Vec<u64>,
    /// By slot: index of the body's move, if a stiff spring moves it.
    move_of: Vec<u32>,
}

impl Obstacles {
    /// Finds the obstacles of these moves.
    pub fn find(&mut self, bodies: &Bodies, pairs: &[Pair], moves: &[Move], dt: f32) {
        self.move_of.clear();
        self.move_of.resize(bodies.alive.len(), NONE);
        for (index, found) in (0u32..).zip(moves) {
            if let MoveKind::Fast { .. } = found.kind {
                self.move_of[found.slot as usize] = index;
            }
        }
        self.all.clear();
        self.found.clear();
        self.order.clear();
        for pair in pairs {
            let of = [self.move_of(pair.a), self.move_of(pair.b)];
            if of == [None, None] || !near(bodies, pair.a, pair.b) {
                continue;
            }
            let path = |slot: u32, of: Option<usize>| match of.map(|index| moves[index]) {
                Some(Move { path, kind: MoveKind::Fast { implicit }, .. }) => [path, implicit],
                _ => [bodies.velocity[slot as usize] * dt; 2],
            };
            let (paths_a, paths_b) = (path(pair.a, of[0]), path(pair.b, of[1]));
            let paths = [paths_b[1] - paths_a[1], paths_b[0] - paths_a[0]];
            let Some((normal, separation)) = touch(bodies, pair, paths) else { continue };
            let room = max(separation, 0.0) / dt;
            for (own, other, normal) in [(pair.a, pair.b, -normal), (pair.b, pair.a, normal)] {
                if self.move_of(own).is_none() {
                    continue;
                }
                let other = other as usize;
                let is_immovable = bodies.inverse_mass[other] == 0.0;
                let speed_min = if is_immovable {
                    f64::from(normal.dot(bodies.velocity[other]) - room)
                } else {
                    f64::NEG_INFINITY
                };
                self.order.push(u64::from(own) << 32 | self.found.len() as u64);
                self.found.push(NearbyObstacle {
                    slot: own,
                    other: other as u32,
                    normal: normal.as_dvec2(),
                    speed_min,
                });
            }
        }
        self.order.sort_unstable();
        let found = self.order.iter().map(|&entry| self.found[entry as u32 as usize]);
        self.all.extend(found);
    }

    /// Obstacles of a body.
    pub fn of(&self, slot: u32) -> &[NearbyObstacle] {
        let start = self.all.partition_point(|obstacle| obstacle.slot < slot);
        let end = self.all.partition_point(|obstacle| obstacle.slot <= slot);
        &self.all[start..end]
    }

    /// Index of a body's move, if a stiff spring moves it.
    pub fn move_of(&self, slot: u32) -> Option<usize> {
        let index = self.move_of[slot as usize];
        (index != NONE).then_some(index as usize)
    }

    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }
}

/// Normal (from a to b) and separation of a pair that touches on one of these paths of b relative to a.
fn touch(bodies: &Bodies, pair: &Pair, paths: [Vec2; 2]) -> Option<(Vec2, f32)> {
    paths.into_iter().find_map(|path| {
        let (at_a, at_b) = (placed(bodies, pair.a), placed(bodies, pair.b));
        let found = separation::between(at_a, at_b, path, pair.axis)?;
        let touches = found.separation + found.normal.dot(path) < -OVERLAP;
        touches.then_some((found.normal, found.separation))
    })
}
