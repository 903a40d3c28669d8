//! Dye packs are launched or thrown by players, or made by launchers. They chase a hero and burst on it.
//!
//! A pack's velocity is its own motion plus its drift. Contacts act on its own motion (C21), so a pack pushes like
//! any other body. The change in velocity that they cause becomes drift, which decays. A pack in front of a
//! platform therefore slides along it, and a hero behind a platform has cover (C39).

use crate::emitters;
use crate::event::Event;
use crate::input::Seat;
use crate::placing::is_clear;
use crate::roster::{Actor, Roster, Rule};
use crate::scene::{Kind, PackSpec, Scene};
use glam::Vec2;
use jostle_sim::math::{atan2, clamp, clamp_length, min, rotate};
use jostle_sim::{BodyDef, BodyId, EmitterDef, Motion, Rng, Shape, Source, World, collide};

/// Direction of a new pack (B3).
const FRONT_AT_START: Vec2 = Vec2::X;

/// The heroes that packs may chase, listed once in every phase in which packs act. The list is kept between ticks to
/// reuse its memory. Rules may have removed some of the heroes in the meantime, so each is looked up.
#[derive(Clone, Debug, Default)]
pub(crate) struct PackTargets {
    heroes: Vec<BodyId>,
    hits_owner: bool,
}

impl PackTargets {
    /// Lists all heroes, owned or not, in index order.
    fn list(&mut self, roster: &Roster, spec: &PackSpec) {
        self.heroes.clear();
        let heroes = roster.actors().filter(|actor| actor.kind == Kind::Hero);
        self.heroes.extend(heroes.map(|actor| actor.id));
        self.hits_owner = roster.players.len() == 1 && spec.throw_every.is_none();
    }

    /// The heroes on which a player's packs may burst: all except the player's own, which counts only if the
    /// player is alone and packs cannot be thrown.
    fn of<'a>(
        &'a self,
        owner: Option<Seat>,
        roster: &'a Roster,
    ) -> impl Iterator<Item = &'a Actor> {
        let heroes = self.heroes.iter().filter_map(|&id| roster.actor(id));
        heroes.filter(move |hero| hero.owner != owner || self.hits_owner)
    }

    /// The centre of the hero nearest to a position, among those on which this player's packs may burst.
    pub fn nearest_to(
        &self,
        position: Vec2,
        owner: Option<Seat>,
        world: &World,
        roster: &Roster,
    ) -> Option<Vec2> {
        let mut nearest: Option<(f32, Vec2)> = None;
        for hero in self.of(owner, roster) {
            let center = world.position(hero.id);
            let distance = (center - position).length_squared();
            if nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, center));
            }
        }
        nearest.map(|(_, center)| center)
    }

    /// The first hero touched by the pack, and the contact point.
    fn touched(&self, pack: Actor, world: &World, roster: &Roster) -> Option<(Actor, Vec2)> {
        let (shape, center) = (world.shape(pack.id), world.position(pack.id));
        let touched = |hero: &&Actor| {
            let (other, position) = (world.shape(hero.id), world.position(hero.id));
            collide(shape, center, other, position, (pack.id.index, hero.id.index)).is_some()
        };
        let hero = *self.of(pack.owner, roster).find(touched)?;
        Some((hero, nearest_point(world.shape(hero.id), world.position(hero.id), center)))
    }
}

/// Turns packs towards their targets, moves them, and removes packs that have worn out.
pub(crate) fn steer(world: &mut World, roster: &mut Roster, scene: &Scene, prey: &mut PackTargets) {
    let Some(spec) = &scene.pack else { return };
    prey.list(roster, spec);
    for index in 0..roster.actors.len() {
        let Some(actor) = roster.actors[index] else { continue };
        let Rule::Chase { front, drift, life, .. } = actor.rule else { continue };
        if life <= 1 {
            roster.remove(world, actor.id);
            continue;
        }
        let position = world.position(actor.id);
        let front = match prey.nearest_to(position, actor.owner, world, roster) {
            Some(target) => turned(front, target - position, spec.turn),
            None => front,
        };
        let drift = drift * spec.drift;
        let driven = front * spec.speed + drift;
        world.set_velocity(actor.id, driven);
        let rule = Rule::Chase { front, drift, driven, life: life - 1 };
        roster.actors[index] = Some(Actor { rule, ..actor });
    }
}

/// After a step, turns the change in a pack's velocity caused by contacts into drift.
pub(crate) fn take_drift(world: &World, actors: &mut [Option<Actor>], scene: &Scene) {
    if scene.pack.is_none() {
        return;
    }
    for actor in actors.iter_mut().flatten() {
        if let Rule::Chase { drift, driven, .. } = &mut actor.rule {
            *drift += world.velocity(actor.id) - *driven;
        }
    }
}

/// Removes packs that touch a hero (A4.8), and scores and reports the hits. The burst starts in the same tick (B7).
pub(crate) fn burst(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    prey: &mut PackTargets,
    rng: &mut Rng,
    events: &mut Vec<Event>,
) {
    let Some(spec) = &scene.pack else { return };
    prey.list(roster, spec);
    for index in 0..roster.actors.len() {
        let pack = roster.actors[index].filter(|actor| actor.kind == Kind::Pack);
        let Some(pack) = pack else { continue };
        let Some((hero, point)) = prey.touched(pack, world, roster) else { continue };
        let victim = hero.owner;
        // A static hero cannot be pushed.
        if let Rule::Chase { front, .. } = pack.rule
            && world.motion(hero.id) != Motion::Static
        {
            world.set_velocity(hero.id, world.velocity(hero.id) + front * spec.push);
        }
        roster.remove(world, pack.id);
        let owner = pack.owner;
        let counts = victim != owner && !roster.is_away(victim);
        let scorer = roster.players.iter_mut().find(|player| Some(player.seat) == owner);
        if let Some(player) = scorer.filter(|_| counts) {
            player.score = player.score.saturating_add(1);
        }
        events.push(Event::PackHit { owner, victim, hero: hero.id, point });
        if spec.burst > 0 {
            let (recipe, count) = (spec.recipe, spec.burst);
            let (seed, source) = (rng.next_u32(), Source::Point(point));
            emitters::start(world, EmitterDef { recipe, count, seed, source }, events);
        }
    }
}

/// Launches one of a player's packs towards `aim`, unless the player already has the maximum number of packs. It
/// appears at the pointer or is thrown from the hero.
pub(crate) fn launch(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    slot: usize,
    aim: Vec2,
) {
    let Some(spec) = &scene.pack else { return };
    let player = &roster.players[slot];
    let seat = player.seat;
    let own = |actor: &&Actor| actor.kind == Kind::Pack && actor.owner == Some(seat);
    if roster.actors().filter(own).count() >= spec.count_max as usize
        || !roster.has_room(world, scene)
    {
        return;
    }
    let Some(ticks) = spec.throw_every else {
        add(world, roster, scene, Some(seat), aim, FRONT_AT_START);
        return;
    };
    let Some(hero) = player.hero.filter(|_| player.throw_wait == 0) else { return };
    let center = world.position(hero);
    let Some(towards) = (aim - center).try_normalize() else { return };
    let outside = edge(world.shape(hero), towards) + spec.body.shape.half_extent().x;
    let position = center + towards * outside;
    // The pack must not appear behind a wall next to the hero.
    let is_clear = is_clear(world, scene, &spec.body, position, world.ids());
    let position = if is_clear { position } else { center };
    add(world, roster, scene, Some(seat), position, towards);
    roster.players[slot].throw_wait = ticks;
}

/// Distance from the centre of a shape to its outline, in the direction of a unit vector.
fn edge(shape: Shape, towards: Vec2) -> f32 {
    match shape {
        Shape::Circle { radius } => radius,
        Shape::Box { half } => {
            let [x, y] = [half.x / towards.x.abs(), half.y / towards.y.abs()];
            min(x, y)
        }
    }
}

/// Adds a pack that sets off in the direction `towards`, or to the right if that vector has no direction.
pub(crate) fn add(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    owner: Option<Seat>,
    position: Vec2,
    towards: Vec2,
) {
    let Some(spec) = &scene.pack else { return };
    let front = towards.try_normalize().unwrap_or(FRONT_AT_START);
    let velocity = front * spec.speed;
    let (drift, life) = (Vec2::ZERO, spec.life_ticks);
    let rule = Rule::Chase { front, drift, driven: velocity, life };
    let def = BodyDef { position, velocity, ..spec.body };
    roster.add(world, &def, Kind::Pack, owner, rule);
}

/// Returns `front` rotated by a share of the signed angle to `way` (A4.9).
fn turned(front: Vec2, way: Vec2, share: f32) -> Vec2 {
    let angle = atan2(front.perp_dot(way), front.dot(way));
    let turned = rotate(front, angle * share);
    turned / turned.length()
}

/// The point nearest to `from` in a shape at this position: `from` itself if it lies inside.
fn nearest_point(shape: Shape, center: Vec2, from: Vec2) -> Vec2 {
    let away = from - center;
    match shape {
        Shape::Circle { radius } => center + clamp_length(away, radius),
        Shape::Box { half } => {
            center + Vec2::new(clamp(away.x, -half.x, half.x), clamp(away.y, -half.y, half.y))
        }
    }
}
