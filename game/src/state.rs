//! The Game's state, which can be hashed, compared, saved as bytes and restored from them.
//!
//! A saved state contains the states of the World and of the rules. It is valid only for its scene, and is saved
//! between two ticks, so the events of the previous tick are not included.

use crate::event::Event;
use crate::game::Game;
use crate::input::{Buttons, Seat};
use crate::player::{HeldBody, Player};
use crate::rngs::Rngs;
use crate::roster::{Actor, Roster, Rule};
use crate::rules::Rules;
use crate::scene::{Kind, SEATS_MAX, Scene};
use glam::Vec2;
use jostle_sim::state::bytes::{ByteHasher, StateReader, StateWriter};
use jostle_sim::state::io::{Field, StateIo, plausible};
use jostle_sim::state::{StateDump, Subject};
use jostle_sim::{BodyId, Difference, Motion, Rng, StateError, StateHasher, World};
use std::sync::Arc;

/// Represents the absence of a seat.
const NO_SEAT: u8 = u8::MAX;
/// Seats from this number on take two bytes.
const LONG_SEATS: u16 = 128;
const PLAYER_BYTES_MIN: usize = 42;
const PENDING_BYTES: usize = 2;

impl Game {
    /// Hash of the raw bits of the whole state.
    pub fn hash(&self) -> u64 {
        let mut hasher = StateHasher::default();
        hasher.push_u64(self.world.hash());
        self.state(&mut hasher);
        self.rules_state(&mut ByteHasher(&mut hasher));
        hasher.finish()
    }

    /// The first difference between two games, in state hash order.
    pub fn first_difference(&self, other: &Game) -> Option<Difference> {
        let (mut one, mut two) = (StateDump::default(), StateDump::default());
        for (game, dump) in [(self, &mut one), (other, &mut two)] {
            game.world.visit(dump);
            game.state(dump);
            game.rules_state(dump);
        }
        one.first_difference(&two)
    }

    /// The whole state between two ticks as bytes, at most 64 per body and 8 per contact, not counting particles,
    /// emitters and players.
    pub fn save(&self) -> Vec<u8> {
        let mut out = StateWriter::default();
        self.world.save(&mut out);
        self.state(&mut out);
        self.rules_state(&mut out);
        out.0
    }

    /// Restores a saved game, which then continues exactly like the original. Any bytes are safe to pass: anything
    /// but the state of a game of this scene is refused.
    pub fn restore(scene: Arc<Scene>, bytes: &[u8]) -> Result<Game, StateError> {
        let bytes = &mut StateReader::new(bytes);
        let world = World::restore(scene.world_settings(), bytes)?;
        let mut roster = Roster { placed: vec![None; scene.bodies.len()], ..Roster::default() };
        for id in world.ids() {
            roster.actors.resize(id.index as usize, None);
            roster.actors.push(Some(Actor {
                id,
                kind: Kind::Hero,
                owner: None,
                rule: Rule::Still,
            }));
        }
        let rules = Rules::new(&scene, Rng::new(0, 0));
        let mut game = Game::of_parts(scene, world, roster, Rngs::new(0), rules);
        (game.ticks, game.rngs, game.roster, game.pending) = game.state(bytes);
        bytes.ok()?;
        if let Some((rules, players)) = game.rules_state(bytes) {
            game.rules = Some(rules);
            game.roster.players = players;
        }
        bytes.end()?;
        Ok(game)
    }

    /// Describes the state, except for that of the world and the rules.
    fn state<Io: StateIo>(&self, io: &mut Io) -> (u32, Rngs, Roster, Vec<Event>) {
        let Game { scene, world, roster, .. } = self;
        io.subject(Subject::One("rules"));
        let ticks = io.word("tick", self.ticks);
        let rngs = self.rngs.state(io);
        let actors = io.each(&roster.actors, |io, _, slot| {
            slot.map(|actor| actor_state(actor, scene, world, io))
        });
        // Not hashed, since it is set only once, when the bodies are placed.
        let placed = io.each(scene.bodies.iter().zip(&roster.placed), |io, _, (body, &id)| {
            let id = io.saved_body("body of the scene", id);
            let moves = |id| body.path.is_none() || world.motion(id) != Motion::Static;
            io.check("body of the scene", || id.is_none_or(|id| world.contains(id) && moves(id)));
            id
        });
        let mut read = Roster { actors, placed, ..Roster::default() };
        let limits = [usize::from(scene.players_max), PLAYER_BYTES_MIN];
        let (given, blank) = (roster.players.iter().cloned(), Player::default());
        let mut last = None;
        read.players = io.list("number of players", limits, given, blank, |io, _, player| {
            let player = player_state(player, &read, world, io);
            io.check("seat", || last < Some(player.seat));
            last = Some(player.seat);
            player
        });
        if scene.throws_packs() {
            let players = if Io::READS { &read.players } else { &roster.players };
            read.players = io.each(players, |io, _, player| {
                io.subject(Subject::Numbered("player", u32::from(player.seat.0)));
                let mut player = player.clone();
                player.throw_wait = io.word("wait for a throw", player.throw_wait);
                player
            });
        }
        // Joins and leaves are recorded like inputs, and need no hash either.
        let (limits, given) = ([2 * SEATS_MAX, PENDING_BYTES], self.pending.iter().cloned());
        let blank = Event::Joined(Seat(0));
        let pending = io.list("number of changes", limits, given, blank, |io, _, event| {
            pending_state(event, io)
        });
        (ticks, rngs, read, pending)
    }

    fn rules_state(&self, io: &mut impl StateIo) -> Option<(Rules, Vec<Player>)> {
        let rules = self.rules.as_ref()?;
        Some(rules.state(&self.scene, &self.world, &self.roster, io))
    }
}

/// Describes an actor. Kind and rule share a byte; the body's id follows from its slot.
#[inline]
fn actor_state(mut it: Actor, scene: &Scene, world: &World, io: &mut impl StateIo) -> Actor {
    io.subject(Subject::Body(it.id));
    io.bits("name", it.id.index);
    io.bits("name", it.id.generation);
    io.bits("kind", it.kind as u32);
    let rule = match it.rule {
        Rule::Still => 0,
        Rule::Wander { is_pushed: false, .. } => 1,
        Rule::Chase { .. } => 2,
        Rule::Wander { is_pushed: true, .. } => 3,
    };
    let [tag] = io.saved("kind", [rule << 4 | it.kind as u8]);
    it.kind = io.checked("kind", it.kind, || Kind::ALL.get(usize::from(tag & 15)).copied());
    it.owner = seat_state("owner", it.owner, io);
    let (heading, drift, driven) = (Vec2::ZERO, Vec2::ZERO, Vec2::ZERO);
    it.rule = io.checked("rule", it.rule, || match tag >> 4 {
        0 => Some(Rule::Still),
        tag @ (1 | 3) => Some(Rule::Wander { heading, speed: 0.0, is_pushed: tag == 3 }),
        2 if scene.pack.is_some() => Some(Rule::Chase { front: heading, drift, driven, life: 0 }),
        _ => None,
    });
    match &mut it.rule {
        Rule::Still => {}
        Rule::Wander { heading, speed, is_pushed } => {
            *heading = direction_state(["heading.x", "heading.y"], *heading, io);
            *speed = io.number("wander speed", *speed, plausible);
            if *is_pushed {
                io.bits("is pushed", 1);
            }
        }
        Rule::Chase { front, drift, driven, life } => {
            *front = direction_state(["front.x", "front.y"], *front, io);
            *drift = io.vector(["drift.x", "drift.y"], *drift, plausible);
            *driven = io.vector(["driven.x", "driven.y"], *driven, plausible);
            *life = io.word("ticks left", *life);
        }
    }
    io.check("rule", || it.rule == Rule::Still || world.motion(it.id) == Motion::Dynamic);
    it
}

#[inline]
fn direction_state(fields: [Field; 2], direction: Vec2, io: &mut impl StateIo) -> Vec2 {
    let direction = io.vector(fields, direction, plausible);
    io.check(fields[0], || (direction.length_squared() - 1.0).abs() < 0.01);
    direction
}

/// Describes a player; `roster` must already contain the actors.
fn player_state(mut it: Player, roster: &Roster, world: &World, io: &mut impl StateIo) -> Player {
    io.subject(Subject::Numbered("player", u32::from(it.seat.0)));
    let seat = seat_state("seat", Some(it.seat), io);
    it.seat = io.checked("seat", it.seat, || seat);
    it.hero = io.body("hero", it.hero);
    let is_own = |id| is_loose(id, world) && roster.owner_of(id) == seat;
    io.check("hero", || it.hero.is_none_or(is_own));
    it.hero_wait = io.saved_word("wait for a hero", it.hero_wait);
    it.selected = io.body("selected", it.selected);
    io.check("selected", || it.selected.is_none_or(|id| world.contains(id)));
    it.held = held_state(["held", "gravity scale"], it.held, plausible, world, io);
    io.bits("wait for a hero", it.hero_wait);
    it.score = io.short("score", it.score);
    let [has_pointed] = io.flags("has pointed", [it.controls.pointer.is_some()]);
    let pointer = it.controls.pointer.unwrap_or_default();
    let pointer = io.vector(["pointer.x", "pointer.y"], pointer, f32::is_finite);
    it.controls.pointer = has_pointed.then_some(pointer);
    it.controls.down = Buttons(io.short("buttons", it.controls.down.0));
    io.check("buttons", || it.controls.down.0 & !Buttons::ALL.0 == 0);
    it
}

fn is_loose(id: BodyId, world: &World) -> bool {
    world.contains(id) && world.motion(id) == Motion::Dynamic
}

/// Describes a held body and the gravity scale to restore.
pub(crate) fn held_state(
    [name, scale]: [Field; 2],
    held: Option<HeldBody>,
    fits: impl Fn(f32) -> bool,
    world: &World,
    io: &mut impl StateIo,
) -> Option<HeldBody> {
    let body = io.body(name, held.map(|held| held.body));
    io.check(name, || body.is_none_or(|id| is_loose(id, world)));
    let gravity_scale = io.number(scale, held.map_or(0.0, |held| held.gravity_scale), fits);
    body.map(|body| HeldBody { body, gravity_scale })
}

fn pending_state(event: Event, io: &mut impl StateIo) -> Event {
    let (kind, seat) = match event {
        Event::Joined(seat) => (0, seat),
        Event::Left(seat) => (1, seat),
        _ => unreachable!("only joins and leaves wait for a tick"),
    };
    let [kind] = io.saved("change", [kind]);
    let seat = saved_seat("seat", Some(seat), io);
    io.checked("change", event, || match kind {
        0 => seat.map(Event::Joined),
        1 => seat.map(Event::Left),
        _ => None,
    })
}

/// Describes a seat, or `None`.
#[inline]
pub(crate) fn seat_state(field: Field, seat: Option<Seat>, io: &mut impl StateIo) -> Option<Seat> {
    io.bits(field, seat.map_or(u32::MAX, |seat| u32::from(seat.0)));
    saved_seat(field, seat, io)
}

/// Saves a seat in one byte if it is below 128, the usual case, and otherwise in two, high bits first. No seat takes
/// one byte.
#[inline]
fn saved_seat(field: Field, seat: Option<Seat>, io: &mut impl StateIo) -> Option<Seat> {
    let [first, second] = match seat {
        None => [NO_SEAT, 0],
        Some(Seat(low @ 0..LONG_SEATS)) => [low as u8, 0],
        Some(Seat(seat)) => [LONG_SEATS as u8 | (seat >> 8) as u8, seat as u8],
    };
    let [first] = io.saved(field, [first]);
    let mut number = u16::from(first);
    let is_long = first != NO_SEAT && number >= LONG_SEATS;
    if is_long {
        number = (number - LONG_SEATS) << 8 | u16::from(io.saved(field, [second])[0]);
    }
    let fits = usize::from(number) < SEATS_MAX && (!is_long || number >= LONG_SEATS);
    io.checked(field, seat, || match first {
        NO_SEAT => Some(None),
        _ => fits.then_some(Some(Seat(number))),
    })
}

#[cfg(test)]
mod tests;
