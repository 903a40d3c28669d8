//! The players' heroes: where they appear and how they are steered.

use crate::event::Event;
use crate::input::Buttons;
use crate::placing::is_clear;
use crate::player::Player;
use crate::roster::{Roster, Rule};
use crate::scene::{HeroSpec, Kind, LaneAxis, Scene, Tools};
use crate::side::SideState;
use glam::Vec2;
use jostle_sim::math::{clamp_length, max};
use jostle_sim::{BodyDef, DT, Rng, World};

/// Ticks between the loss of a hero and its respawn.
pub(crate) const RESPAWN_TICKS: u32 = 30;
/// Ticks between two attempts to find a clear position.
const RETRY_TICKS: u32 = 10;
/// Number of random positions tried when no spawn point is clear.
const POSITIONS_TRIED: u32 = 16;

/// Spawns the heroes of players who have none and have waited long enough.
pub(crate) fn spawn_due(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    teams: &[SideState],
    rng: &mut Rng,
) {
    for slot in 0..roster.players.len() {
        let player = &mut roster.players[slot];
        if player.hero.is_none() && player.hero_wait > 0 {
            player.hero_wait -= 1;
        } else if player.hero.is_none() && !is_out(player, teams) {
            spawn(world, roster, scene, slot, rng);
        }
    }
}

/// Spawns a player's hero, or makes the player wait if no position is clear.
pub(crate) fn spawn(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    slot: usize,
    rng: &mut Rng,
) {
    let Some(spec) = &scene.hero else { return };
    let seat = roster.players[slot].seat;
    let mut tried = 0;
    let position = clear_position(world, roster, scene, (spec, slot), rng, &mut tried);
    roster.positions_tried += tried;
    let hero = position.and_then(|position| {
        let def = BodyDef { position, ..spec.body };
        roster.players[slot].home = position;
        roster.add(world, &def, Kind::Hero, Some(seat), Rule::Still)
    });
    let player = &mut roster.players[slot];
    player.hero = hero;
    player.hero_wait = RETRY_TICKS;
}

/// Whether a player's side has lost its last life.
fn is_out(player: &Player, teams: &[SideState]) -> bool {
    let team = player.team.and_then(|team| teams.get(usize::from(team)));
    team.map_or(player.standing.out, |team| team.out)
}

/// Finds a position where a hero touches nothing that it collides with: the checkpoint, otherwise a spawn point,
/// starting with the player's own, otherwise a random position in the world. Adds the number of positions tried to
/// `tried`.
fn clear_position(
    world: &World,
    roster: &Roster,
    scene: &Scene,
    (spec, slot): (&HeroSpec, usize),
    rng: &mut Rng,
    tried: &mut u32,
) -> Option<Vec2> {
    let mut is_clear = |position| {
        *tried += 1;
        is_clear(world, scene, &spec.body, position, world.ids())
    };
    let player = &roster.players[slot];
    let team = player.team.map(|team| &scene.rules.teams[usize::from(team)].spawns);
    let (spawns, first) = match team.filter(|spawns| !spawns.is_empty()) {
        Some(spawns) => (spawns, roster.place_in_team(slot)),
        None => (&spec.spawns, usize::from(player.seat.0)),
    };
    let count = spawns.len();
    let own = (0..count).map(|step| spawns[(first + step) % count]);
    let mut points = player.checkpoint.into_iter().chain(own);
    if let Some(point) = points.find(|&point| is_clear(point)) {
        return Some(point);
    }
    for _ in 0..POSITIONS_TRIED {
        let (x, y) = (rng.unit(), rng.unit());
        let point = Vec2::new(x, y) * scene.size;
        if is_clear(point) {
            return Some(point);
        }
    }
    None
}

/// Changes the heroes' velocities according to WASD. Above the scene's speed limit, thrust changes only their
/// direction.
pub(crate) fn thrust(world: &mut World, players: &[Player], scene: &Scene) {
    let Some(spec) = &scene.hero else { return };
    if !scene.tools.contains(Tools::STEER) {
        return;
    }
    for player in players {
        let Some(hero) = player.hero else { continue };
        let velocity = spec.steered_in(world, scene, hero, player.controls.down);
        world.set_velocity(hero, velocity);
    }
}

/// Keeps heroes on their lanes, and the bodies they carry above them.
pub(crate) fn keep_lanes(world: &mut World, players: &[Player], scene: &Scene) {
    for player in players {
        let Some(hero) = player.hero else { continue };
        if let Some(lane) = scene.lane(player.team) {
            let off = (player.home - world.position(hero)) / DT;
            let velocity = world.velocity(hero);
            let kept = match lane {
                LaneAxis::X => Vec2::new(velocity.x, off.y),
                LaneAxis::Y => Vec2::new(off.x, velocity.y),
            };
            world.set_velocity(hero, clamp_length(kept, scene.world.speed_max));
        }
        if let Some(carried) = player.carried {
            let rise =
                world.shape(hero).half_extent().y + world.shape(carried.body).half_extent().y;
            let place = world.position(hero) + Vec2::new(0.0, rise);
            // The position is set directly: if a velocity drove the body there, it would lift a hero that it ended up
            // under.
            world.set_position(carried.body, place);
            world.set_velocity(carried.body, world.velocity(hero));
        }
    }
}

/// Reports bodies that left the kill zone. Players who lost their hero this way wait for a new one.
pub(crate) fn report_departed(world: &mut World, roster: &mut Roster, events: &mut Vec<Event>) {
    if world.departed().bodies.is_empty() {
        return;
    }
    for &(body, point) in &world.departed().bodies {
        let player = roster.players.iter_mut().find(|player| player.hero == Some(body));
        if let Some(player) = player {
            player.hero_wait = RESPAWN_TICKS;
            player.lost = Some(body);
        }
        let kind = roster.forget(body).map_or(Kind::Block, |actor| actor.kind);
        events.push(Event::BodyLeft { kind, body, point });
    }
    for player in roster.players.iter_mut().filter(|player| player.lost.is_some()) {
        player.drop_carried(world);
    }
}

impl HeroSpec {
    /// The velocity of a flying hero after a tick with these buttons down, before the world steps.
    pub(crate) fn thrusted(&self, velocity: Vec2, down: Buttons) -> Vec2 {
        let push = Vec2::new(
            down.axis(Buttons::RIGHT, Buttons::LEFT),
            down.axis(Buttons::UP, Buttons::DOWN),
        );
        if push == Vec2::ZERO {
            return velocity;
        }
        let speed_max = max(self.speed_max, velocity.length());
        clamp_length(velocity + push * self.thrust * DT, speed_max)
    }
}
