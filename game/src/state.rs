//! The Game's state: hashed, compared, saved as bytes and restored from them.
//!
//! A saved state is the World's and the rules' own. It goes with its scene, and is saved between two
//! ticks: the reports of the last tick are not part of it.

use crate::actor::{Actor, Rule};
use crate::event::Event;
use crate::game::Game;
use crate::input::{Buttons, Seat};
use crate::player::{Held, Player};
use crate::rngs::Rngs;
use crate::roster::Roster;
use crate::rules::Rules;
use crate::scene::{Kind, SEATS_MAX, Scene};
use glam::Vec2;
use jostle_sim::Rng;
use jostle_sim::state::bytes::{StateReader, StateWriter};
use jostle_sim::state::{StateDump, StateVisitor};
use jostle_sim::{BodyId, Difference, Motion, StateError, StateHasher, Subject, World};
use std::sync::Arc;

/// Stands for no seat.
const NO_SEAT: u8 = u8::MAX;
/// Seats from here on take two bytes.
const LONG_SEATS: u16 = 128;
/// The rules as a whole.
const RULES: Subject = Subject::One("rules");
const PLAYER_BYTES_MIN: usize = 42;
const PENDING_BYTES: usize = 2;

impl Game {
    /// Hash of the raw bits of the whole state.
    pub fn hash(&self) -> u64 {
        let mut hasher = StateHasher::default();
        hasher.push_u64(self.world.hash());
        self.visit_rules(&mut hasher);
        hasher.finish()
    }

    /// The first difference between two games, in the order of the state hash.
    pub fn first_difference(&self, other: &Game) -> Option<Difference> {
        let (mut one, mut two) = (StateDump::default(), StateDump::default());
        for (game, visitor) in [(self, &mut one), (other, &mut two)] {
            game.world.visit(visitor);
            game.visit_rules(visitor);
        }
        one.first_difference(&two)
    }

    fn visit_rules(&self, visitor: &mut impl StateVisitor) {
        visitor.bits(RULES, "tick", self.ticks);
        for (field, rng) in self.rngs.named() {
            let [state, increment] = rng.state();
            visitor.long(RULES, field, state);
            visitor.long(RULES, field, increment);
        }
        self.roster.actors().for_each(|actor| actor.visit(visitor));
        self.roster.players.iter().for_each(|player| player.visit(visitor));
        if self.scene.throws_packs() {
            for player in &self.roster.players {
                let subject = Subject::Numbered("player", u32::from(player.seat.0));
                visitor.bits(subject, "wait for a throw", player.throw_wait);
            }
        }
        if let Some(rules) = &self.rules {
            rules.visit(&self.world, &self.roster, visitor);
        }
    }

    /// The whole state as bytes, between two ticks: at most 64 a body and 8 a contact, particles,
    /// emitters and players aside.
    pub fn save(&self) -> Vec<u8> {
        let mut out = StateWriter::default();
        self.world.save(&mut out);
        out.word(self.ticks);
        for (_, rng) in self.rngs.named() {
            rng.state().into_iter().for_each(|half| out.long(half));
        }
        self.roster.actors().for_each(|actor| save_actor(actor, &mut out));
        self.roster.placed.iter().for_each(|&body| out.body(body));
        out.word(self.roster.players.len() as u32);
        self.roster.players.iter().for_each(|player| save_player(player, &mut out));
        if self.scene.throws_packs() {
            self.roster.players.iter().for_each(|player| out.word(player.throw_wait));
        }
        out.word(self.pending.len() as u32);
        self.pending.iter().for_each(|event| save_pending(event, &mut out));
        if let Some(rules) = &self.rules {
            rules.save(&self.world, &self.roster, &mut out);
        }
        out.0
    }

    /// Restores a saved game: it plays on exactly as the original. Any bytes may come in; those that
    /// are no state of a game of this scene are refused.
    pub fn restore(scene: Arc<Scene>, bytes: &[u8]) -> Result<Game, StateError> {
        let bytes = &mut StateReader::new(bytes);
        let world = World::restore(scene.world_settings(), bytes)?;
        let ticks = bytes.word("tick")?;
        let rngs = Rngs {
            spawn: read_rng(bytes)?,
            drop: read_rng(bytes)?,
            agitate: read_rng(bytes)?,
            emit: read_rng(bytes)?,
        };
        let actors = read_actors(&scene, &world, bytes)?;
        let placed = read_placed(&scene, &world, bytes)?;
        let mut roster = Roster { actors, placed, ..Roster::default() };
        read_players(&scene, &world, &mut roster, bytes)?;
        if scene.throws_packs() {
            for player in &mut roster.players {
                player.throw_wait = bytes.word("wait for a throw")?;
            }
        }
        let pending = read_pending(bytes)?;
        let rules = Rules::new(&scene, Rng::new(0, 0));
        let rules = rules.map(|rules| rules.restore(&scene, &world, &mut roster, bytes));
        let mut game = Game::of_parts(scene, world, roster, rngs, rules.transpose()?);
        game.ticks = ticks;
        game.pending = pending;
        bytes.end()?;
        Ok(game)
    }
}

fn read_players(
    scene: &Scene,
    world: &World,
    roster: &mut Roster,
    bytes: &mut StateReader,
) -> Result<(), StateError> {
    let count_max = usize::from(scene.players_max);
    for _ in 0..bytes.count(count_max, PLAYER_BYTES_MIN, "number of players")? {
        let seat_before = roster.players.last().map(|player| player.seat);
        let seat = read_seat("seat", bytes)?.filter(|&seat| seat_before < Some(seat));
        let seat = seat.ok_or_else(|| bytes.wrong("seat"))?;
        let player = read_player(world, &roster.actors, seat, bytes)?;
        roster.players.push(player);
    }
    Ok(())
}

fn read_player(
    world: &World,
    actors: &[Option<Actor>],
    seat: Seat,
    bytes: &mut StateReader,
) -> Result<Player, StateError> {
    let mut player = Player::new(seat, None);
    player.hero = read_body(world, "hero", bytes)?;
    let steered = |id: BodyId| {
        let owner = actors[id.index as usize].and_then(|actor| actor.owner);
        owner == Some(seat) && world.motion(id) == Motion::Dynamic
    };
    bytes.check(player.hero.is_none_or(steered), "hero")?;
    player.hero_wait = bytes.word("wait for a hero")?;
    player.selected = read_body(world, "selected body", bytes)?;
    let held = read_body(world, "held body", bytes)?;
    let loose = held.is_none_or(|id| world.motion(id) == Motion::Dynamic);
    bytes.check(loose, "held body")?;
    let gravity_scale = bytes.plausible_number("gravity scale")?;
    player.held = held.map(|body| Held { body, gravity_scale });
    player.score = bytes.short("score")?;
    let pointed = bytes.byte("has pointed")?;
    bytes.check(pointed <= 1, "has pointed")?;
    let pointer = bytes.vector("pointer")?;
    player.pointer = (pointed == 1).then_some(pointer);
    let down = bytes.short("buttons")?;
    bytes.check(down & !Buttons::ALL.0 == 0, "buttons")?;
    player.down = Buttons(down);
    Ok(player)
}

/// Reads a body that exists, or none.
fn read_body(
    world: &World,
    field: &'static str,
    bytes: &mut StateReader,
) -> Result<Option<BodyId>, StateError> {
    let body = bytes.body(field)?;
    bytes.check(body.is_none_or(|id| world.contains(id)), field)?;
    Ok(body)
}

fn read_pending(bytes: &mut StateReader) -> Result<Vec<Event>, StateError> {
    let count = bytes.count(2 * SEATS_MAX, PENDING_BYTES, "number of changes")?;
    let mut pending = Vec::new();
    for _ in 0..count {
        let kind = bytes.byte("change")?;
        pending.push(match (kind, read_seat("seat", bytes)?) {
            (0, Some(seat)) => Event::Joined(seat),
            (1, Some(seat)) => Event::Left(seat),
            _ => return Err(bytes.wrong("change")),
        });
    }
    Ok(pending)
}

pub(crate) fn read_rng(bytes: &mut StateReader) -> Result<Rng, StateError> {
    let halves = [bytes.long("chance")?, bytes.long("chance")?];
    bytes.check(halves[1] & 1 == 1, "chance")?;
    Ok(Rng::from_state(halves))
}

/// Kind and rule share a byte; the body's id follows from its slot.
fn save_actor(actor: &Actor, out: &mut StateWriter) {
    let rule = match actor.rule {
        Rule::Still => 0,
        Rule::Wander { is_pushed: false, .. } => 1,
        Rule::Chase { .. } => 2,
        Rule::Wander { is_pushed: true, .. } => 3,
    };
    out.byte(rule << 4 | actor.kind as u8);
    save_seat(actor.owner, out);
    match actor.rule {
        Rule::Still => {}
        Rule::Wander { heading, speed, .. } => {
            out.vector(heading);
            out.number(speed);
        }
        Rule::Chase { front, drift, driven, life } => {
            out.vector(front);
            out.vector(drift);
            out.vector(driven);
            out.word(life);
        }
    }
}

/// Reads one actor a body, by slot.
fn read_actors(
    scene: &Scene,
    world: &World,
    bytes: &mut StateReader,
) -> Result<Vec<Option<Actor>>, StateError> {
    let mut actors = Vec::new();
    for id in world.ids() {
        actors.resize(id.index as usize, None);
        let actor = read_actor(scene, id, bytes)?;
        let moves = actor.rule == Rule::Still || world.motion(id) == Motion::Dynamic;
        bytes.check(moves, "rule")?;
        actors.push(Some(actor));
    }
    Ok(actors)
}

fn read_actor(scene: &Scene, id: BodyId, bytes: &mut StateReader) -> Result<Actor, StateError> {
    let tag = bytes.byte("kind")?;
    let kind = *Kind::ALL.get(usize::from(tag & 15)).ok_or_else(|| bytes.wrong("kind"))?;
    let owner = read_seat("owner", bytes)?;
    let rule = match tag >> 4 {
        0 => Rule::Still,
        tag @ (1 | 3) => Rule::Wander {
            heading: read_direction("heading", bytes)?,
            speed: bytes.plausible_number("speed")?,
            is_pushed: tag == 3,
        },
        2 if scene.pack.is_some() => Rule::Chase {
            front: read_direction("front", bytes)?,
            drift: bytes.plausible("drift")?,
            driven: bytes.plausible("driven")?,
            life: bytes.word("ticks left")?,
        },
        _ => return Err(bytes.wrong("rule")),
    };
    Ok(Actor { id, kind, owner, rule })
}

/// Reads a unit vector.
fn read_direction(field: &'static str, bytes: &mut StateReader) -> Result<Vec2, StateError> {
    let direction = bytes.plausible(field)?;
    bytes.check((direction.length_squared() - 1.0).abs() < 0.01, field)?;
    Ok(direction)
}

/// Reads the ids of the scene file's bodies; those on a path must be able to follow it.
fn read_placed(
    scene: &Scene,
    world: &World,
    bytes: &mut StateReader,
) -> Result<Vec<Option<BodyId>>, StateError> {
    let mut placed = Vec::new();
    for body in &scene.bodies {
        let id = bytes.body("body of the scene")?;
        let fits = id.is_none_or(|id| {
            world.contains(id) && (body.path.is_none() || world.motion(id) != Motion::Static)
        });
        bytes.check(fits, "body of the scene")?;
        placed.push(id);
    }
    Ok(placed)
}

fn save_player(player: &Player, out: &mut StateWriter) {
    save_seat(Some(player.seat), out);
    out.body(player.hero);
    out.word(player.hero_wait);
    out.body(player.selected);
    out.body(player.held.map(|held| held.body));
    out.number(player.held.map_or(0.0, |held| held.gravity_scale));
    out.short(player.score);
    out.byte(u8::from(player.pointer.is_some()));
    out.vector(player.pointer.unwrap_or_default());
    out.short(player.down.0);
}

fn save_pending(event: &Event, out: &mut StateWriter) {
    let (kind, seat) = match event {
        Event::Joined(seat) => (0, seat),
        Event::Left(seat) => (1, seat),
        _ => unreachable!("only joins and leaves wait for a tick"),
    };
    out.byte(kind);
    save_seat(Some(*seat), out);
}

/// One byte below 128, the usual case; above it two, high bits first; one byte for no seat.
pub(crate) fn save_seat(seat: Option<Seat>, out: &mut StateWriter) {
    match seat {
        None => out.byte(NO_SEAT),
        Some(Seat(low @ 0..LONG_SEATS)) => out.byte(low as u8),
        Some(Seat(seat)) => {
            out.byte(LONG_SEATS as u8 | (seat >> 8) as u8);
            out.byte(seat as u8);
        }
    }
}

pub(crate) fn read_seat(
    field: &'static str,
    bytes: &mut StateReader,
) -> Result<Option<Seat>, StateError> {
    let first = bytes.byte(field)?;
    let seat = match u16::from(first) {
        _ if first == NO_SEAT => return Ok(None),
        low @ 0..LONG_SEATS => low,
        high => (high - LONG_SEATS) << 8 | u16::from(bytes.byte(field)?),
    };
    let shortest = u16::from(first) < LONG_SEATS || seat >= LONG_SEATS;
    bytes.check(shortest && usize::from(seat) < SEATS_MAX, field)?;
    Ok(Some(Seat(seat)))
}

#[cfg(test)]
mod tests;
