//! Sets up a game: places the scene file's bodies, and the layouts at positions derived from the seed.

use crate::roster::{Roster, Rule};
use crate::scene::{Kind, Layout, Location, Path, Placed, Scene};
use glam::Vec2;
use jostle_sim::{Aabb, BodyDef, BodyId, Motion, Rng, Shape, Spring, SpringEnd, World, collide};

/// Number of positions tried for a body in its cell, and then in the whole area, before the body is left out.
const TRIES: u32 = 256;
/// Number of consecutive bodies for which there is no room, after which a layout counts as full.
const FAILURES_MAX: u32 = 8;

/// Fills the world, first with the bodies at fixed positions for whose index `there` returns true, then with the
/// layouts in file order.
pub(crate) fn fill(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    rng: &mut Rng,
    there: impl Fn(usize) -> bool,
) {
    let mut taken = Vec::new();
    for (index, body) in scene.bodies.iter().enumerate() {
        let id = if there(index) { place_body(world, roster, body, rng) } else { None };
        roster.placed.push(id);
        match &body.path {
            Some(path) => taken.extend(swept(path, body.def.shape)),
            None => taken.push(Aabb::around(body.def.position, body.def.shape.half_extent())),
        }
    }
    add_springs(world, &roster.placed, scene);
    let spawns = spawn_regions(scene);
    for layout in &scene.layouts {
        let mut failures = 0;
        for number in 0..layout.count {
            if failures == FAILURES_MAX {
                break;
            }
            let Some(def) = find_room(layout, number, &taken, &spawns, rng) else {
                failures += 1;
                continue;
            };
            failures = 0;
            taken.push(Aabb::around(def.position, def.shape.half_extent()));
            place(world, roster, layout.kind, def, layout.start_speed, rng);
        }
    }
}

/// Adds the springs, except those attached to bodies for which there was no room.
fn add_springs(world: &mut World, placed: &[Option<BodyId>], scene: &Scene) {
    for spring in &scene.springs {
        let end = match spring.to {
            Location::Point(point) => Some(SpringEnd::Point(point)),
            Location::Body(index) => placed[index].map(SpringEnd::Body),
        };
        if let (Some(body), Some(end)) = (placed[spring.body], end) {
            world.add_spring(Spring {
                body,
                end,
                rest_length: spring.length,
                stiffness: spring.stiffness,
                damping: spring.damping,
            });
        }
    }
}

/// Adds a body from the scene file.
pub(crate) fn place_body(
    world: &mut World,
    roster: &mut Roster,
    body: &Placed,
    rng: &mut Rng,
) -> Option<BodyId> {
    place(world, roster, body.kind, body.def, body.start_speed, rng)
}

/// Adds a body. If it has a `start_speed`, it sets off to the left or right at random.
fn place(
    world: &mut World,
    roster: &mut Roster,
    kind: Kind,
    mut def: BodyDef,
    start_speed: f32,
    rng: &mut Rng,
) -> Option<BodyId> {
    if start_speed > 0.0 {
        def.velocity = either_side(start_speed, rng);
    }
    let speed = def.velocity.length();
    let rule = match kind {
        Kind::Minion if speed > 0.0 && def.motion == Motion::Dynamic => {
            Rule::Wander { heading: def.velocity / speed, speed, is_pushed: false }
        }
        _ => Rule::Still,
    };
    roster.add(world, &def, kind, None, rule)
}

/// A velocity to the right or to the left, chosen at random.
pub(crate) fn either_side(speed: f32, rng: &mut Rng) -> Vec2 {
    if rng.below(2) == 0 { Vec2::new(speed, 0.0) } else { Vec2::new(-speed, 0.0) }
}

/// Whether a body at this position would touch none of the `others` with which it collides.
pub(crate) fn is_clear(
    world: &World,
    scene: &Scene,
    body: &BodyDef,
    position: Vec2,
    mut others: impl Iterator<Item = BodyId>,
) -> bool {
    others.all(|id| {
        let (shape, center) = (world.shape(id), world.position(id));
        !scene.groups_meet(body.group, world.group(id))
            || collide(body.shape, position, shape, center, (0, 1)).is_none()
    })
}

/// Regions around spawn points, which layouts keep clear (C37).
fn spawn_regions(scene: &Scene) -> Vec<Aabb> {
    let Some(hero) = &scene.hero else { return Vec::new() };
    let half = hero.body.shape.half_extent();
    hero.spawns.iter().map(|&spawn| Aabb::around(spawn, half)).collect()
}

/// The regions through which a body on a path passes.
fn swept(path: &Path, shape: Shape) -> impl Iterator<Item = Aabb> {
    let half = shape.half_extent();
    path.points()
        .windows(2)
        .map(move |leg| Aabb::around(leg[0], half).union(&Aabb::around(leg[1], half)))
}

/// Finds room for the layout's next body. In an exact layout, this is the centre of its cell. Otherwise it is a
/// random position with room around it, in its cell or, if that is full, anywhere in the area.
fn find_room(
    layout: &Layout,
    number: u32,
    taken: &[Aabb],
    spawns: &[Aabb],
    rng: &mut Rng,
) -> Option<BodyDef> {
    let shape = layout.shapes[rng.below(layout.shapes.len() as u32) as usize];
    if layout.exact {
        return Some(BodyDef { shape, position: layout.cell_center(number), ..layout.def });
    }
    let half = shape.half_extent();
    let is_free = |position: Vec2| {
        let roomy = Aabb::around(position, half + Vec2::splat(layout.gap));
        let tight = Aabb::around(position, half);
        taken.iter().all(|other| !other.overlaps(&roomy))
            && spawns.iter().all(|spawn| !spawn.overlaps(&tight))
    };
    for attempt in 0..2 * TRIES {
        let region = if attempt < TRIES { layout.cell(number) } else { layout.area };
        let (x, y) = (rng.unit(), rng.unit());
        let position = region.low + Vec2::new(x, y) * (region.high - region.low);
        if is_free(position) {
            return Some(BodyDef { shape, position, ..layout.def });
        }
    }
    None
}
