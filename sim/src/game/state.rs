//! The Game's state: digested, compared, kept as bytes and made again from them.
//!
//! A kept state is the World's and what the rules know beyond it. It goes with its scene, and is
//! kept between two ticks: what the last tick reported is not part of it.

use super::actor::{Actor, Held, Player, Rule};
use super::{Buttons, Chance, Event, Game, Kind, SEATS_MAX, Seat};
use crate::body::{BodyId, Motion};
use crate::hash::StateHasher;
use crate::math::Rng;
use crate::scene::Scene;
use crate::state::bytes::{StateError, StateReader, StateWriter};
use crate::state::{Difference, Listing, Subject, Words};
use crate::world::World;
use std::sync::Arc;

/// In place of a seat: nobody's.
const NOBODY: u8 = u8::MAX;
/// Seats from here on take two bytes.
const LONG_SEATS: u16 = 128;
const PLAYER_BYTES_MIN: usize = 42;
const PENDING_BYTES: usize = 2;

impl Game {
    /// Digest of the raw bits of the whole state.
    pub fn hash(&self) -> u64 {
        let mut hasher = StateHasher::default();
        hasher.push_u64(self.world.hash());
        self.words_of_rules(&mut hasher);
        hasher.finish()
    }

    /// The first difference between two games, in the order of the state hash.
    pub fn first_difference(&self, other: &Game) -> Option<Difference> {
        let (mut one, mut two) = (Listing::default(), Listing::default());
        for (game, words) in [(self, &mut one), (other, &mut two)] {
            game.world.words(words);
            game.words_of_rules(words);
        }
        one.first_difference(&two)
    }

    fn words_of_rules(&self, words: &mut impl Words) {
        words.bits(Subject::Rules, "tick", self.ticks);
        for (field, rng) in self.chance.named() {
            let [state, increment] = rng.state();
            words.long(Subject::Rules, field, state);
            words.long(Subject::Rules, field, increment);
        }
        self.actors.iter().flatten().for_each(|actor| actor.words(words));
        self.players.iter().for_each(|player| player.words(words));
    }

    /// The whole state as bytes, between two ticks: at most 64 a body and 8 a contact, particles,
    /// emitters and players aside.
    pub fn save(&self) -> Vec<u8> {
        let mut out = StateWriter::default();
        self.world.save(&mut out);
        out.word(self.ticks);
        for (_, rng) in self.chance.named() {
            rng.state().into_iter().for_each(|half| out.long(half));
        }
        self.actors.iter().flatten().for_each(|actor| save_actor(actor, &mut out));
        self.placed.iter().for_each(|&place| out.body(place));
        out.word(self.players.len() as u32);
        self.players.iter().for_each(|player| save_player(player, &mut out));
        out.word(self.pending.len() as u32);
        self.pending.iter().for_each(|event| save_pending(event, &mut out));
        out.0
    }

    /// The game that was saved: it plays on exactly as the one that was not. Any bytes may come
    /// in; what is no state of a game of this scene is refused.
    pub fn restore(scene: Arc<Scene>, bytes: &[u8]) -> Result<Game, StateError> {
        let bytes = &mut StateReader::new(bytes);
        let world = World::restore(scene.world_settings(), bytes)?;
        let ticks = bytes.word("tick")?;
        let chance = Chance {
            spawn: read_rng(bytes)?,
            drop: read_rng(bytes)?,
            agitate: read_rng(bytes)?,
            emit: read_rng(bytes)?,
        };
        let actors = read_actors(&scene, &world, bytes)?;
        let placed = read_placed(&scene, &world, bytes)?;
        let mut game = Game {
            scene,
            world,
            ticks,
            actors,
            players: Vec::new(),
            placed,
            chance,
            events: Vec::new(),
            pending: Vec::new(),
            heroes: Vec::new(),
            impacts: Vec::new(),
        };
        game.read_players(bytes)?;
        game.read_pending(bytes)?;
        bytes.end()?;
        Ok(game)
    }

    fn read_players(&mut self, bytes: &mut StateReader) -> Result<(), StateError> {
        let count_max = usize::from(self.scene.players_max);
        for _ in 0..bytes.count(count_max, PLAYER_BYTES_MIN, "number of players")? {
            let seat_before = self.players.last().map(|player: &Player| player.seat);
            let seat = read_seat("seat", bytes)?.filter(|&seat| seat_before < Some(seat));
            let player = self.read_player(seat.ok_or_else(|| bytes.wrong("seat"))?, bytes)?;
            self.players.push(player);
        }
        Ok(())
    }

    fn read_player(&self, seat: Seat, bytes: &mut StateReader) -> Result<Player, StateError> {
        let mut player = Player::new(seat, None);
        player.hero = self.read_body("hero", bytes)?;
        let steered = |id: BodyId| {
            let actor = self.actors[id.index as usize];
            actor.is_some_and(|actor| actor.owner == Some(seat))
                && self.world.motion(id) == Motion::Dynamic
        };
        bytes.check(player.hero.is_none_or(steered), "hero")?;
        player.hero_wait = bytes.word("wait for a hero")?;
        player.selected = self.read_body("selected body", bytes)?;
        let held = self.read_body("held body", bytes)?;
        let loose = held.is_none_or(|id| self.world.motion(id) == Motion::Dynamic);
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

    /// A body that exists, or none.
    fn read_body(
        &self,
        field: &'static str,
        bytes: &mut StateReader,
    ) -> Result<Option<BodyId>, StateError> {
        let body = bytes.body(field)?;
        bytes.check(body.is_none_or(|id| self.world.contains(id)), field)?;
        Ok(body)
    }

    fn read_pending(&mut self, bytes: &mut StateReader) -> Result<(), StateError> {
        for _ in 0..bytes.count(2 * SEATS_MAX, PENDING_BYTES, "number of changes")? {
            let kind = bytes.byte("change")?;
            self.pending.push(match (kind, read_seat("seat", bytes)?) {
                (0, Some(seat)) => Event::Joined(seat),
                (1, Some(seat)) => Event::Left(seat),
                _ => return Err(bytes.wrong("change")),
            });
        }
        Ok(())
    }
}

impl Chance {
    fn named(&self) -> [(&'static str, &Rng); 4] {
        let Chance { spawn, drop, agitate, emit } = self;
        [
            ("chance of spawns", spawn),
            ("chance of drops", drop),
            ("chance of shakes", agitate),
            ("chance of emitters", emit),
        ]
    }
}

fn read_rng(bytes: &mut StateReader) -> Result<Rng, StateError> {
    let halves = [bytes.long("chance")?, bytes.long("chance")?];
    bytes.check(halves[1] & 1 == 1, "chance")?;
    Ok(Rng::from_state(halves))
}

/// Kind and rule share a byte; the body's name follows from its slot.
fn save_actor(actor: &Actor, out: &mut StateWriter) {
    let rule = match actor.rule {
        Rule::Still => 0,
        Rule::Wander { .. } => 1,
        Rule::Chase { .. } => 2,
    };
    out.byte(rule << 4 | actor.kind as u8);
    save_seat(actor.owner, out);
    match actor.rule {
        Rule::Still => {}
        Rule::Wander { heading, speed } => {
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

/// One actor a body, by slot.
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
        1 => Rule::Wander {
            heading: bytes.plausible("heading")?,
            speed: bytes.plausible_number("speed")?,
        },
        2 if scene.pack.is_some() => Rule::Chase {
            front: bytes.plausible("front")?,
            drift: bytes.plausible("drift")?,
            driven: bytes.plausible("driven")?,
            life: bytes.word("ticks left")?,
        },
        _ => return Err(bytes.wrong("rule")),
    };
    Ok(Actor { id, kind, owner, rule })
}

/// Where the bodies of the scene file are; those on a path must be able to follow it.
fn read_placed(
    scene: &Scene,
    world: &World,
    bytes: &mut StateReader,
) -> Result<Vec<Option<BodyId>>, StateError> {
    let mut placed = Vec::new();
    for body in &scene.bodies {
        let place = bytes.body("body of the scene")?;
        let fits = place.is_none_or(|id| {
            world.contains(id) && (body.path.is_none() || world.motion(id) != Motion::Static)
        });
        bytes.check(fits, "body of the scene")?;
        placed.push(place);
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

/// One byte below 128, as most are; above it two, high bits first; nobody is one byte too.
fn save_seat(seat: Option<Seat>, out: &mut StateWriter) {
    match seat {
        None => out.byte(NOBODY),
        Some(Seat(low @ 0..LONG_SEATS)) => out.byte(low as u8),
        Some(Seat(seat)) => {
            out.byte(LONG_SEATS as u8 | (seat >> 8) as u8);
            out.byte(seat as u8);
        }
    }
}

fn read_seat(field: &'static str, bytes: &mut StateReader) -> Result<Option<Seat>, StateError> {
    let first = bytes.byte(field)?;
    let seat = match u16::from(first) {
        _ if first == NOBODY => return Ok(None),
        low @ 0..LONG_SEATS => low,
        high => (high - LONG_SEATS) << 8 | u16::from(bytes.byte(field)?),
    };
    let shortest = u16::from(first) < LONG_SEATS || seat >= LONG_SEATS;
    bytes.check(shortest && usize::from(seat) < SEATS_MAX, field)?;
    Ok(Some(Seat(seat)))
}
