//! The players' tools: Z, X, C, V, clicking, and H, M and P with dragging.

use crate::event::Event;
use crate::input::Buttons;
use crate::placing::{either_side, is_clear};
use crate::player::{HeldBody, Player};
use crate::rngs::Rngs;
use crate::roster::{Roster, Rule};
use crate::scene::{Kind, Scene, Tools};
use crate::{emitters, packs};
use glam::Vec2;
use jostle_sim::math::{clamp_length, min};
use jostle_sim::{Aabb, BodyDef, BodyId, DT, EmitterDef, Motion, Rng, Shape, Source, World};

/// Largest change that C makes to each velocity component in a tick, units/s.
const AGITATE_SPEED: f32 = 5.0;
/// Maximum speed at which a held body follows the pointer, units/s; fast, but too slow to tunnel.
const HOLD_SPEED_MAX: f32 = 120.0;
/// Number of positions at which Z tries to drop a marble in a tick, each in a larger square around the pointer.
const DROP_TRIES: u32 = 16;
/// Half the side of the first square (C45), and its growth with each try, relative to the marble's half extent. The
/// last square has room for 36 marbles.
const DROP_SPREAD: f32 = 0.5;
const DROP_GROWTH: f32 = 0.4;

/// Runs the tools that act on bodies, before the step: V, C, selecting and dragging, and X.
pub(crate) fn act_on_bodies(world: &mut World, roster: &mut Roster, scene: &Scene, rng: &mut Rng) {
    let allows = |tool| scene.tools.contains(tool);
    let any = |button| roster.players.iter().any(|player| player.controls.holds(button));
    if allows(Tools::CLEAR) && any(Buttons::CLEAR) {
        roster.remove_matching(world, &|actor| actor.kind == Kind::Marble);
    } else if allows(Tools::AGITATE) && any(Buttons::AGITATE) {
        agitate_marbles(world, roster, rng);
    }
    for slot in 0..roster.players.len() {
        if allows(Tools::SELECT) {
            select(world, roster, scene, slot);
            drag(world, &roster.players[slot]);
        }
        if allows(Tools::HOLD) {
            hold(world, roster, slot, min(HOLD_SPEED_MAX, scene.world.speed_max));
        }
    }
}

/// Runs the tools that make something, after the step, so that it appears at the pointer. `nearby` is scratch memory.
pub(crate) fn make(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    rngs: &mut Rngs,
    events: &mut Vec<Event>,
    nearby: &mut Vec<BodyId>,
) {
    let allows = |tool| scene.tools.contains(tool);
    for slot in 0..roster.players.len() {
        let player = &roster.players[slot];
        let Some(aim) = player.controls.aim else { continue };
        let makes = player.controls.holds(Buttons::MAKE);
        let fires = match scene.throws_packs() {
            true => player.controls.holds(Buttons::FIRE),
            false => player.controls.pressed(Buttons::FIRE),
        };
        if fires && allows(Tools::LAUNCH) {
            packs::launch(world, roster, scene, slot, aim);
        }
        if makes && allows(Tools::MARBLE) {
            drop_marble(world, roster, scene, aim, &mut rngs.drop, nearby);
        }
        if let Some(recipe) = scene.spray.filter(|_| makes && allows(Tools::SPRAY)) {
            let (seed, source) = (rngs.emit.next_u32(), Source::Point(aim));
            emitters::start(world, EmitterDef { recipe, count: 1, seed, source }, events);
        }
    }
}

fn agitate_marbles(world: &mut World, roster: &Roster, rng: &mut Rng) {
    let marbles = roster.actors().filter(|actor| actor.kind == Kind::Marble);
    let moved = marbles.map(|actor| actor.id).filter(|&id| world.motion(id) != Motion::Static);
    let moved: Vec<BodyId> = moved.collect();
    world.wake(&moved);
    for id in moved {
        let x = rng.range(-AGITATE_SPEED, AGITATE_SPEED);
        let y = rng.range(-AGITATE_SPEED, AGITATE_SPEED);
        world.set_velocity(id, world.velocity(id) + Vec2::new(x, y));
    }
}

fn drop_marble(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    aim: Vec2,
    rng: &mut Rng,
    nearby: &mut Vec<BodyId>,
) {
    let Some(marble) = &scene.marble else { return };
    let marbles = roster.actors().filter(|actor| actor.kind == Kind::Marble).count();
    if marbles >= marble.count_max as usize || !roster.has_room(world, scene) {
        return;
    }
    if let Some(position) = free_place(world, scene, &marble.body, aim, rng, nearby) {
        let def = BodyDef { position, velocity: either_side(marble.speed, rng), ..marble.body };
        roster.add(world, &def, Kind::Marble, None, Rule::Still);
    }
}

/// Finds a position near the pointer, on the same side of every wall, where a marble touches nothing; `None` if all
/// tries fail. Bodies made inside each other would burst apart, even through walls. `nearby` is scratch memory.
fn free_place(
    world: &World,
    scene: &Scene,
    marble: &BodyDef,
    aim: Vec2,
    rng: &mut Rng,
    nearby: &mut Vec<BodyId>,
) -> Option<Vec2> {
    let half = marble.shape.half_extent();
    let area = Aabb::around(aim, half * (2.0 + DROP_SPREAD + DROP_GROWTH * DROP_TRIES as f32));
    nearby.clear();
    nearby.extend(world.ids().filter(|&id| {
        area.overlaps(&Aabb::around(world.position(id), world.shape(id).half_extent()))
    }));
    (0..DROP_TRIES).find_map(|attempt| {
        let spread = half * (DROP_SPREAD + DROP_GROWTH * attempt as f32);
        let position = aim + Vec2::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)) * spread;
        // Immovable bodies must not reach into the rectangle between pointer and position. A rectangle without
        // area would touch nothing.
        let between = (position - aim).abs() * 0.5 + Vec2::splat(1e-3);
        let way = BodyDef { shape: Shape::Box { half: between }, ..*marble };
        let is_fixed = |id: &BodyId| world.motion(*id) != Motion::Dynamic;
        let fixed = nearby.iter().copied().filter(is_fixed);
        let is_free = is_clear(world, scene, marble, position, nearby.iter().copied())
            && is_clear(world, scene, &way, (aim + position) * 0.5, fixed);
        is_free.then_some(position)
    })
}

/// Selects a body by its key or by pressing the pointer on it.
fn select(world: &World, roster: &mut Roster, scene: &Scene, slot: usize) {
    let keys = [
        (Buttons::PICK_HERO, Kind::Hero),
        (Buttons::PICK_MINION, Kind::Minion),
        (Buttons::PICK_PLATFORM, Kind::Platform),
    ];
    for (button, kind) in keys {
        if roster.players[slot].controls.pressed(button)
            && let Some(body) = roster.first_of(scene, kind)
        {
            roster.players[slot].selected = Some(body);
        }
    }
    let player = &roster.players[slot];
    if let Some(aim) = player.controls.aim.filter(|_| player.controls.pressed(Buttons::FIRE)) {
        let bodies = roster
            .actors()
            .map(|actor| (actor.id, actor.kind, world.shape(actor.id), world.position(actor.id)));
        let hit = selectable_at(bodies, player.selected, aim);
        roster.players[slot].selected = hit.or(player.selected);
    }
}

/// Returns the body that a press at a point selects, given bodies with their kinds, shapes and centres. It is
/// the one that is already selected, otherwise the one drawn on top.
pub fn selectable_at(
    bodies: impl Iterator<Item = (BodyId, Kind, Shape, Vec2)>,
    selected: Option<BodyId>,
    point: Vec2,
) -> Option<BodyId> {
    let layer = |kind| [Kind::Platform, Kind::Minion, Kind::Hero].iter().position(|&k| k == kind);
    let hits = bodies.filter(|(.., shape, center)| shape.contains(point - *center));
    let hits = hits.filter_map(|(id, kind, ..)| Some((selected == Some(id), layer(kind)?, id)));
    hits.max().map(|(.., id)| id)
}

/// Moves the selected body with the pointer. If the pointer is outside the body, its centre moves to the pointer
/// (B2).
fn drag(world: &mut World, player: &Player) {
    let (Some(body), Some(aim)) = (player.selected, player.controls.aim) else { return };
    if !player.controls.holds(Buttons::FIRE) {
        return;
    }
    let is_new = player.controls.pressed(Buttons::FIRE);
    let before = if is_new { Some(aim) } else { player.controls.pointer_before };
    let center = world.position(body);
    let grip = before.filter(|&before| world.shape(body).contains(before - center));
    world.set_position(body, grip.map_or(aim, |before| center + (aim - before)));
    world.set_velocity(body, Vec2::ZERO);
}

/// Holds the first body that comes under the pointer while X is down, until X is released (C44). Meanwhile the body
/// is driven towards the pointer, and gravity does not act on it.
fn hold(world: &mut World, roster: &mut Roster, slot: usize, speed_max: f32) {
    let player = &mut roster.players[slot];
    if !player.controls.holds(Buttons::HOLD) {
        release(world, player);
        return;
    }
    if player.held.is_none() {
        let grabbed = player.controls.aim.and_then(|aim| grab(world, roster, aim));
        roster.players[slot].held = grabbed;
    }
    let player = &roster.players[slot];
    let (Some(held), Some(pointer)) = (player.held, player.controls.pointer) else { return };
    let way = pointer - world.position(held.body);
    world.set_velocity(held.body, clamp_length(way / DT, speed_max));
}

/// Grabs the body under the pointer, if players may hold it and no one holds it yet.
fn grab(world: &mut World, roster: &Roster, aim: Vec2) -> Option<HeldBody> {
    let is_loose = |id: BodyId| {
        let actor = roster.actors[id.index as usize];
        let kind = actor.is_some_and(|actor| matches!(actor.kind, Kind::Marble | Kind::Block));
        let mut held = roster.players.iter().filter_map(|player| player.held);
        kind && held.all(|held| held.body != id) && world.motion(id) == Motion::Dynamic
    };
    let body = world.body_at(aim, is_loose)?;
    let gravity_scale = world.gravity_scale(body);
    world.set_gravity_scale(body, 0.0);
    Some(HeldBody { body, gravity_scale })
}

/// Releases the body held by a player.
pub(crate) fn release(world: &mut World, player: &mut Player) {
    if let Some(held) = player.held.take() {
        world.set_gravity_scale(held.body, held.gravity_scale);
    }
}
