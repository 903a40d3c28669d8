//! The start of a game: bodies of the scene file, and layouts at places that the seed decides.

use super::actor::Rule;
use super::{Game, Kind};
use crate::forces::{Spring, SpringEnd};
use crate::math::Rng;
use crate::scene::{Layout, Path, Place, Scene};
use crate::shape::{Aabb, Shape};
use crate::world::{BodyDef, BodyId, Motion};
use glam::Vec2;
use std::sync::Arc;

/// Places tried for a body in its cell, and again in the whole area; then it is left out.
const TRIES: u32 = 256;
/// Bodies of a layout that find no room one after the other; then the layout is full.
const FAILURES_MAX: u32 = 8;

impl Game {
    /// Fills the world: first what has a place, then the layouts in file order.
    pub(super) fn place_everything(&mut self, rng: &mut Rng) {
        let scene = Arc::clone(&self.scene);
        let spawns = spawn_regions(&scene);
        let mut taken = Vec::new();
        for body in &scene.bodies {
            let id = self.place(body.kind, body.def, body.velocity_given, rng);
            self.placed.push(id);
            match &body.path {
                Some(path) => taken.extend(swept(path, body.def.shape)),
                None => taken.push(Aabb::around(body.def.position, body.def.shape.half_extent())),
            }
        }
        self.tie(&scene);
        for layout in &scene.layouts {
            let mut failures = 0;
            for place in 0..layout.count {
                let Some(def) = find_room(layout, place, &taken, &spawns, rng) else {
                    failures += 1;
                    if failures == FAILURES_MAX {
                        break;
                    }
                    continue;
                };
                failures = 0;
                taken.push(Aabb::around(def.position, def.shape.half_extent()));
                self.place(layout.kind, def, layout.velocity_given, rng);
            }
        }
    }

    /// Adds the springs; bodies that found no place have none.
    fn tie(&mut self, scene: &Scene) {
        for spring in &scene.springs {
            let end = match spring.to {
                Place::Point(point) => Some(SpringEnd::Point(point)),
                Place::Body(index) => self.placed[index].map(SpringEnd::Body),
            };
            if let (Some(body), Some(end)) = (self.placed[spring.body], end) {
                self.world.add_spring(Spring {
                    body,
                    end,
                    rest_length: spring.length,
                    stiffness: spring.stiffness,
                    damping: spring.damping,
                });
            }
        }
    }

    /// Adds a body; a minion or dumb minion without a velocity sets off to either side.
    fn place(
        &mut self,
        kind: Kind,
        mut def: BodyDef,
        velocity_given: bool,
        rng: &mut Rng,
    ) -> Option<BodyId> {
        let speed = match kind {
            Kind::Minion => self.scene.minion.speed,
            Kind::Dumb => self.scene.dumb_speed,
            _ => 0.0,
        };
        if speed > 0.0 && !velocity_given && def.motion == Motion::Dynamic {
            def.velocity = either_side(speed, rng);
        }
        let speed = def.velocity.length();
        let rule = match kind {
            Kind::Minion if speed > 0.0 && def.motion == Motion::Dynamic => {
                Rule::Wander { heading: def.velocity / speed, speed }
            }
            _ => Rule::Still,
        };
        self.add(&def, kind, None, rule)
    }
}

/// A velocity to the right or to the left.
pub(super) fn either_side(speed: f32, rng: &mut Rng) -> Vec2 {
    if rng.below(2) == 0 { Vec2::new(speed, 0.0) } else { Vec2::new(-speed, 0.0) }
}

/// Spawn points stay clear of layouts (C37).
fn spawn_regions(scene: &Scene) -> Vec<Aabb> {
    let Some(hero) = &scene.hero else { return Vec::new() };
    let half = hero.body.shape.half_extent();
    hero.spawns.iter().map(|&spawn| Aabb::around(spawn, half)).collect()
}

/// The regions that a body on a path passes through.
fn swept(path: &Path, shape: Shape) -> impl Iterator<Item = Aabb> {
    let half = shape.half_extent();
    path.points()
        .windows(2)
        .map(move |leg| Aabb::around(leg[0], half).union(&Aabb::around(leg[1], half)))
}

/// The layout's next body at a random place with room around it: in its cell of the grid, or
/// where that is full, anywhere in the area.
fn find_room(
    layout: &Layout,
    place: u32,
    taken: &[Aabb],
    spawns: &[Aabb],
    rng: &mut Rng,
) -> Option<BodyDef> {
    let shape = layout.shapes[rng.below(layout.shapes.len() as u32) as usize];
    let half = shape.half_extent();
    let is_free = |position: Vec2| {
        let roomy = Aabb::around(position, half + Vec2::splat(layout.gap));
        let tight = Aabb::around(position, half);
        taken.iter().all(|other| !other.overlaps(&roomy))
            && spawns.iter().all(|spawn| !spawn.overlaps(&tight))
    };
    for attempt in 0..2 * TRIES {
        let region = if attempt < TRIES { cell(layout, place) } else { layout.area };
        let (x, y) = (rng.unit(), rng.unit());
        let position = region.low + Vec2::new(x, y) * (region.high - region.low);
        if is_free(position) {
            return Some(BodyDef { shape, position, ..layout.def });
        }
    }
    None
}

/// The cell of the layout's grid that its body number `place` belongs to.
fn cell(layout: &Layout, place: u32) -> Aabb {
    let [columns, rows] = layout.grid;
    let place = place % (columns * rows);
    let size = (layout.area.high - layout.area.low) / Vec2::new(columns as f32, rows as f32);
    let corner = Vec2::new((place % columns) as f32, (place / columns) as f32) * size;
    let low = layout.area.low + corner;
    Aabb { low, high: low + size }
}
