//! Bodies that may collide with the hero, for the small world. Their state comes from the snapshot; everything else
//! about them comes from the scene.

use jostle_game::scene::Placed;
use jostle_game::{Kind, Scene};
use jostle_protocol::{Snapshot, SnapshotBody};
use jostle_sim::particles::dequantise;
use jostle_sim::{Aabb, BodyDef, BodyId, DT, Motion, Vec2};

/// Margin around the hero's path in which approaching bodies are included, in hero sizes.
const ROOM_SIDES: f32 = 2.0;
/// Margin within which a body may be pushed by the hero, in hero sizes.
const TOUCH_SIDES: f32 = 0.25;
/// Length of the part of the hero's path that is considered, ticks.
const WAY_TICKS: f32 = 12.0;
/// Maximum number of bodies considered; those with the lowest indices are used.
pub(super) const NEAR_MAX: usize = 96;

/// A body to be added to the small world.
pub(super) struct Near {
    /// The body's id in the room.
    pub id: BodyId,
    pub def: BodyDef,
    /// The index of the scene entry whose path it follows.
    pub path: Option<usize>,
}

/// All bodies with which the hero may collide, in index order.
pub(super) fn find(
    scene: &Scene,
    hero: &SnapshotBody,
    velocity: Vec2,
    newest: &Snapshot,
    before: Option<&Snapshot>,
) -> Vec<Near> {
    let quantum = scene.world.quantum;
    let center = dequantise(hero.quanta, quantum);
    let half = hero.shape.half_extent();
    let side = 2.0 * half.max_element();
    let way = Aabb::around(center + velocity * (WAY_TICKS * DT), half);
    let swept = Aabb::around(center, half).union(&way);
    let (region, touched) = (grown(swept, side * ROOM_SIDES), grown(swept, side * TOUCH_SIDES));
    let others = newest.bodies.iter().filter(|body| body.id != hero.id);
    let meets = others.filter(|body| scene.groups_meet(hero.group, body.group));
    let near = meets.filter_map(|body| {
        let place = dequantise(body.quanta, quantum);
        let around = Aabb::around(place, body.shape.half_extent());
        region.overlaps(&around).then(|| {
            let mut near = as_near(scene, body, touched.overlaps(&around));
            near.def.position = place;
            if near.def.motion != Motion::Static {
                near.def.velocity = step_between(before, newest, body.id, quantum);
            }
            near
        })
    });
    near.take(NEAR_MAX).collect()
}

/// Converts a body. Bodies that the hero can push stay dynamic. All other dynamic bodies become kinematic and keep
/// their velocity, because whatever makes them move is outside the small world.
fn as_near(scene: &Scene, body: &SnapshotBody, touched: bool) -> Near {
    let mut def = traits(scene, body);
    def.velocity = Vec2::ZERO;
    let steered = matches!(body.kind, Kind::Hero | Kind::Minion | Kind::Pack);
    if def.motion == Motion::Dynamic && !touched {
        def.motion = Motion::Kinematic;
    } else if steered {
        // Steered bodies hover and walk by themselves, so gravity does not apply to them here.
        def.gravity_scale = 0.0;
    }
    let path = placed(scene, body.id).is_some_and(|placed| placed.path.is_some());
    Near { id: body.id, def, path: path.then_some(body.id.index as usize) }
}

/// The definition of a body in the room, to the extent that it can be derived from the scene.
pub(super) fn traits(scene: &Scene, body: &SnapshotBody) -> BodyDef {
    let mut layouts = scene.layouts.iter();
    let layout = layouts.find(|layout| {
        let alike = layout.kind == body.kind && layout.def.group == body.group;
        alike && layout.shapes.contains(&body.shape)
    });
    let of_kind = match body.kind {
        Kind::Hero => scene.hero.as_ref().map(|hero| hero.body),
        Kind::Marble => scene.marble.as_ref().map(|marble| marble.body),
        Kind::Pack => scene.pack.as_ref().map(|pack| pack.body),
        _ => None,
    };
    let placed = placed(scene, body.id).filter(|placed| placed.kind == body.kind);
    let placed = placed.or_else(|| alike(scene, body));
    let placed = placed.map(|placed| placed.def);
    let known = placed.or(layout.map(|layout| layout.def)).or(of_kind);
    let (shape, group) = (body.shape, body.group);
    BodyDef { shape, group, ..known.unwrap_or_default() }
}

/// The scene entry of a body. Bodies that the scene places individually occupy the first slots, in the scene's order.
/// In a game bodies come and go, so slots do not identify entries.
pub(crate) fn placed(scene: &Scene, id: BodyId) -> Option<&Placed> {
    scene.bodies.get(id.index as usize).filter(|_| id.generation == 0 && !scene.is_game())
}

/// In a game, the first scene entry that looks like the body.
fn alike<'a>(scene: &'a Scene, body: &SnapshotBody) -> Option<&'a Placed> {
    let is_alike = |placed: &&Placed| {
        let def = &placed.def;
        placed.kind == body.kind && def.group == body.group && def.shape == body.shape
    };
    scene.bodies.iter().filter(|_| scene.is_game()).find(is_alike)
}

fn grown(region: Aabb, by: f32) -> Aabb {
    Aabb { low: region.low - Vec2::splat(by), high: region.high + Vec2::splat(by) }
}

pub(super) fn body_of(snapshot: &Snapshot, id: BodyId) -> Option<&SnapshotBody> {
    let place = snapshot.bodies.binary_search_by_key(&id.index, |body| body.id.index).ok()?;
    Some(&snapshot.bodies[place]).filter(|body| body.id == id)
}

/// The position of a body in a snapshot, world units.
pub(super) fn place_of(snapshot: &Snapshot, id: BodyId, quantum: f32) -> Option<Vec2> {
    body_of(snapshot, id).map(|body| dequantise(body.quanta, quantum))
}

/// The velocity of a body between two snapshots, units/s; zero if only one contains it.
pub(super) fn step_between(
    before: Option<&Snapshot>,
    newest: &Snapshot,
    id: BodyId,
    quantum: f32,
) -> Vec2 {
    let from = before.and_then(|before| place_of(before, id, quantum));
    let (Some(before), Some(from), Some(to)) = (before, from, place_of(newest, id, quantum)) else {
        return Vec2::ZERO;
    };
    (to - from) / (newest.tick.saturating_sub(before.tick).max(1) as f32 * DT)
}
