//! The Game: a World and the rules of its scene. Heroes, minions, packs, tools.
//!
//! The order of a tick is the chapter's (B6): what steers acts on velocities, then the World
//! steps, then what it reports is acted on, then tools make new bodies, then particles move.

mod actor;
mod hero;
mod minion;
mod pack;
mod placing;
mod report;
mod state;
mod tools;

#[cfg(test)]
mod tests;

pub use crate::scene::{Kind, SEATS_MAX};

use crate::Tools;
use crate::math::Rng;
use crate::particle::{EmitterDef, Source, dequantise, quantise};
use crate::scene::{Place, Scene};
use crate::shape::Shape;
use crate::world::{BodyId, Phase, World};
use actor::{Actor, Player, Rule};
use glam::Vec2;
use std::sync::Arc;

/// A place in a game, 0..[`SEATS_MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Seat(pub u16);

/// Keys and pointer buttons that are down, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Buttons(pub u16);

impl Buttons {
    /// W or arrow up.
    pub const UP: Buttons = Buttons(1 << 0);
    /// A or arrow left.
    pub const LEFT: Buttons = Buttons(1 << 1);
    /// S or arrow down.
    pub const DOWN: Buttons = Buttons(1 << 2);
    /// D or arrow right.
    pub const RIGHT: Buttons = Buttons(1 << 3);
    /// Left or right pointer button: launch, or drag the selected body.
    pub const FIRE: Buttons = Buttons(1 << 4);
    /// Z: dumb minion or particle.
    pub const MAKE: Buttons = Buttons(1 << 5);
    /// X: hold what is under the pointer.
    pub const HOLD: Buttons = Buttons(1 << 6);
    /// C: agitate.
    pub const AGITATE: Buttons = Buttons(1 << 7);
    /// V: clear.
    pub const CLEAR: Buttons = Buttons(1 << 8);
    /// H: select the hero.
    pub const PICK_HERO: Buttons = Buttons(1 << 9);
    /// M: select the minion.
    pub const PICK_MINION: Buttons = Buttons(1 << 10);
    /// P: select the platform.
    pub const PICK_PLATFORM: Buttons = Buttons(1 << 11);
    /// All bits with a meaning.
    pub const ALL: Buttons = Buttons((1 << 12) - 1);

    /// Whether all of `other` are down.
    pub fn contains(self, other: Buttons) -> bool {
        self.0 & other.0 == other.0
    }

    /// 1, 0 or -1 for a pair of opposite keys.
    pub fn axis(self, positive: Buttons, negative: Buttons) -> f32 {
        f32::from(u8::from(self.contains(positive))) - f32::from(u8::from(self.contains(negative)))
    }
}

/// A player's intent for one tick.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Input {
    /// What is down.
    pub buttons: Buttons,
    /// Pointer in world units, finite; `None` while it is outside the view. The game rounds it to
    /// multiples of [`POINTER_QUANTUM`].
    pub pointer: Option<Vec2>,
}

/// What pointers are rounded to, world units: finer than anybody points, and few bits to keep.
pub const POINTER_QUANTUM: f32 = 1.0 / 16.0;
/// Largest coordinate of a pointer, world units, either sign: 2^24 quanta.
pub const POINTER_MAX: f32 = 1_048_576.0;

impl Input {
    /// The input as the game takes it: known buttons, and the pointer rounded. A pointer that is
    /// not finite or past [`POINTER_MAX`] is none.
    pub fn rounded(self) -> Input {
        let usable =
            |pointer: &Vec2| pointer.x.abs() <= POINTER_MAX && pointer.y.abs() <= POINTER_MAX;
        let rounded = |pointer| dequantise(quantise(pointer, POINTER_QUANTUM), POINTER_QUANTUM);
        let buttons = Buttons(self.buttons.0 & Buttons::ALL.0);
        Input { buttons, pointer: self.pointer.filter(usable).map(rounded) }
    }
}

/// A fact that a tick reports, in the order in which it happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Two bodies began to touch, one of them dynamic, closing faster than the scene's report speed.
    Impact {
        /// Lower index.
        a: BodyId,
        /// Higher index.
        b: BodyId,
        /// Place of the contact, world units.
        point: Vec2,
        /// Closing speed, units/s.
        speed: f32,
    },
    /// A dye pack burst on a hero.
    PackHit {
        /// The pack's owner.
        owner: Seat,
        /// The hero's player, if it has one.
        victim: Option<Seat>,
        /// The hero.
        hero: BodyId,
        /// The touch point, world units.
        point: Vec2,
    },
    /// A body left the kill zone; a hero respawns.
    BodyLeft {
        /// What it was.
        kind: Kind,
        /// Its id, gone by now.
        body: BodyId,
        /// Where it left, world units.
        point: Vec2,
    },
    /// An emitter was started.
    EmitterStarted(EmitterDef),
    /// An emitter of the scene that stands at a place was started again: [`Scene::emitter`].
    RepeaterStarted {
        /// Index into the scene's emitters.
        index: u8,
        /// Seed of all that is random about its particles this time.
        seed: u32,
    },
    /// A player took a seat.
    Joined(Seat),
    /// A player left a seat; hero and packs are gone.
    Left(Seat),
}

/// Public facts of one body, for snapshots and traces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyInfo {
    /// Its name.
    pub id: BodyId,
    /// What it is.
    pub kind: Kind,
    /// Whose it is: heroes and packs of players.
    pub owner: Option<Seat>,
    /// Collision group, an index into the scene's.
    pub group: u8,
    /// Outline.
    pub shape: Shape,
    /// Centre in quanta.
    pub quanta: [i32; 2],
}

/// Public facts of one player, for snapshots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayerInfo {
    /// The seat.
    pub seat: Seat,
    /// The hero, unless the scene has none or it is about to respawn.
    pub hero: Option<BodyId>,
    /// The selected body (chapter project 9.1).
    pub selected: Option<BodyId>,
    /// The body that the player holds.
    pub held: Option<BodyId>,
    /// Hits scored with packs.
    pub score: u16,
    /// Where the player points, in quanta, so that eyes can follow.
    pub pointer: Option<[i32; 2]>,
}

/// A World and the rules of its scene.
#[derive(Clone, Debug)]
pub struct Game {
    scene: Arc<Scene>,
    world: World,
    ticks: u32,
    /// What the bodies are, by body index.
    actors: Vec<Option<Actor>>,
    /// In seat order.
    players: Vec<Player>,
    /// Bodies of [`Scene::bodies`], in that order, as long as they exist.
    placed: Vec<Option<BodyId>>,
    chance: Chance,
    events: Vec<Event>,
    /// Joins and leaves since the last tick.
    pending: Vec<Event>,
    /// Lists of a tick, kept for their memory alone: heroes that packs may chase, and places of hard
    /// touches in the world's list.
    heroes: Vec<Actor>,
    impacts: Vec<u32>,
}

/// A generator for each purpose, so that one rule's draws never shift another's.
#[derive(Clone, Debug)]
struct Chance {
    spawn: Rng,
    drop: Rng,
    agitate: Rng,
    emit: Rng,
}

impl Chance {
    const LAYOUT_STREAM: u64 = 1;

    fn new(seed: u64) -> Chance {
        Chance {
            spawn: Rng::new(seed, 2),
            drop: Rng::new(seed, 3),
            agitate: Rng::new(seed, 4),
            emit: Rng::new(seed, 5),
        }
    }
}

impl Game {
    /// A game at tick 0 with nobody in it. The same scene and seed give the same game.
    pub fn new(scene: Arc<Scene>, seed: u64) -> Game {
        let mut game = Game {
            world: World::new(scene.world_settings()),
            scene,
            ticks: 0,
            actors: Vec::new(),
            players: Vec::new(),
            placed: Vec::new(),
            chance: Chance::new(seed),
            events: Vec::new(),
            pending: Vec::new(),
            heroes: Vec::new(),
            impacts: Vec::new(),
        };
        game.place_everything(&mut Rng::new(seed, Chance::LAYOUT_STREAM));
        game
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Ticks played.
    pub fn tick_count(&self) -> u32 {
        self.ticks
    }

    /// Seats a player; a hero appears where the scene has heroes, at once if a place is clear.
    /// Panics if the seat is taken or not below [`SEATS_MAX`].
    pub fn join(&mut self, seat: Seat) {
        assert!(usize::from(seat.0) < SEATS_MAX, "seat {} is past the last one", seat.0);
        let at = match self.players.binary_search_by_key(&seat, |player| player.seat) {
            Ok(_) => panic!("seat {} is taken", seat.0),
            Err(at) => at,
        };
        self.players.insert(at, Player::new(seat, self.first_of(Kind::Hero)));
        self.pending.push(Event::Joined(seat));
        self.spawn_hero(at);
    }

    /// Removes a player with hero and packs. Panics if the seat is empty.
    pub fn leave(&mut self, seat: Seat) {
        let at = match self.players.binary_search_by_key(&seat, |player| player.seat) {
            Ok(at) => at,
            Err(_) => panic!("seat {} is empty", seat.0),
        };
        self.let_go(at);
        self.players.remove(at);
        self.pending.push(Event::Left(seat));
        for index in 0..self.actors.len() {
            if let Some(actor) = self.actors[index].filter(|actor| actor.owner == Some(seat)) {
                self.remove(actor.id);
            }
        }
    }

    /// Plays one tick. `inputs` holds at most one entry a seat, in seat order; a seat without an
    /// entry is at rest: nothing is down.
    pub fn tick(&mut self, inputs: &[(Seat, Input)]) {
        self.tick_watched(inputs, &mut |_, _| {});
    }

    /// [`Game::tick`], shown to `watch` after each phase. What it changes is part of the tick.
    pub fn tick_watched(
        &mut self,
        inputs: &[(Seat, Input)],
        watch: &mut impl FnMut(Phase, &mut World),
    ) {
        let ordered = inputs.windows(2).all(|pair| pair[0].0 < pair[1].0);
        debug_assert!(ordered, "inputs must be in seat order, one a seat");
        self.events.clear();
        self.events.append(&mut self.pending);
        self.take_inputs(inputs);
        self.drive_platforms();
        self.steer_minions();
        self.spawn_heroes();
        self.thrust_heroes();
        self.steer_packs();
        self.use_tools_on_bodies();
        watch(Phase::Inputs, &mut self.world);

        self.world.step_watched(watch);

        self.report_impacts();
        self.report_departed();
        self.turn_minions();
        self.feel_contacts_of_packs();
        self.burst_packs();
        self.make_with_tools();
        self.start_emitters();
        watch(Phase::Events, &mut self.world);
        self.world.step_particles();
        watch(Phase::Particles, &mut self.world);
        self.ticks += 1;
    }

    /// What the last tick (and joins and leaves since the one before) reported, in order.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Bodies in index order.
    pub fn bodies(&self) -> impl Iterator<Item = BodyInfo> + '_ {
        self.actors.iter().flatten().map(|actor| BodyInfo {
            id: actor.id,
            kind: actor.kind,
            owner: actor.owner,
            group: self.world.group(actor.id),
            shape: self.world.shape(actor.id),
            quanta: self.world.position_quanta(actor.id),
        })
    }

    /// Players in seat order.
    pub fn players(&self) -> impl Iterator<Item = PlayerInfo> + '_ {
        self.players.iter().map(|player| PlayerInfo {
            seat: player.seat,
            hero: player.hero,
            selected: player.selected,
            held: player.held.map(|held| held.body),
            score: player.score,
            pointer: player.pointer.map(|pointer| quantise(pointer, self.scene.quantum)),
        })
    }

    /// Buttons, edges and pointers of this tick. A pointer that is not finite or lies outside the
    /// world is ignored; the last one is kept, as the chapter does (B1).
    fn take_inputs(&mut self, inputs: &[(Seat, Input)]) {
        let size = self.scene.size;
        for player in &mut self.players {
            let input = match inputs.binary_search_by_key(&player.seat, |&(seat, _)| seat) {
                Ok(at) => inputs[at].1.rounded(),
                Err(_) => Input::default(),
            };
            let inside = |pointer: &Vec2| {
                (0.0..=size.x).contains(&pointer.x) && (0.0..=size.y).contains(&pointer.y)
            };
            player.aim = input.pointer.filter(inside);
            player.pointer = player.aim.or(player.pointer);
            player.press(input.buttons);
        }
    }

    /// Gives kinematic bodies the velocity that takes them to their place at the end of this tick.
    fn drive_platforms(&mut self) {
        for (body, id) in self.scene.bodies.iter().zip(&self.placed) {
            if let (Some(path), Some(id)) = (&body.path, id) {
                let place = self.world.position(*id);
                let velocity = path.velocity_to(self.ticks + 1, place, self.scene.speed_max);
                self.world.set_velocity(*id, velocity);
            }
        }
    }

    /// Emitters of the scene that start in this tick.
    fn start_emitters(&mut self) {
        let scene = Arc::clone(&self.scene);
        let tick = self.ticks;
        let numbered = (0..=u8::MAX).zip(&scene.emitters);
        for (index, repeater) in numbered.filter(|(_, repeater)| repeater.starts_at(tick)) {
            match repeater.place {
                Place::Point(point) => {
                    let seed = self.chance.emit.next_u32();
                    if self.world.start_emitter(repeater.at(point, seed)) {
                        self.events.push(Event::RepeaterStarted { index, seed });
                    }
                }
                Place::Body(placed) => {
                    if let Some(id) = self.placed[placed] {
                        self.emit(repeater.recipe, repeater.count, Source::Body(id));
                    }
                }
            }
        }
    }

    fn emit(&mut self, recipe: u8, count: u16, source: Source) {
        let seed = self.chance.emit.next_u32();
        let emitter = EmitterDef { recipe, count, seed, source };
        if self.world.start_emitter(emitter) {
            self.events.push(Event::EmitterStarted(emitter));
        }
    }

    /// Adds a body with its rule; `None` when the world is full.
    fn add(
        &mut self,
        def: &crate::BodyDef,
        kind: Kind,
        owner: Option<Seat>,
        rule: Rule,
    ) -> Option<BodyId> {
        let id = self.world.add(def)?;
        let index = id.index as usize;
        if index >= self.actors.len() {
            self.actors.resize(index + 1, None);
        }
        self.actors[index] = Some(Actor { id, kind, owner, rule });
        Some(id)
    }

    /// Removes a body from world and rules.
    fn remove(&mut self, id: BodyId) {
        self.world.remove(id);
        self.forget(id);
    }

    /// Removes a body that the world has removed already from the rules.
    fn forget(&mut self, id: BodyId) -> Option<Actor> {
        for player in &mut self.players {
            player.forget(id);
        }
        if let Some(place) = self.placed.iter_mut().find(|place| **place == Some(id)) {
            *place = None;
        }
        self.actors[id.index as usize].take_if(|actor| actor.id == id)
    }

    fn allows(&self, tool: Tools) -> bool {
        self.scene.tools.contains(tool)
    }

    /// The first body of a kind in the scene file: the one that H, M or P selects.
    fn first_of(&self, kind: Kind) -> Option<BodyId> {
        if !self.allows(Tools::SELECT) {
            return None;
        }
        let at = self.scene.bodies.iter().position(|body| body.kind == kind)?;
        self.placed[at]
    }

    /// Bodies that tools may still make; places of heroes that may yet come stay free.
    fn room(&self) -> usize {
        let heroes = self.players.iter().filter(|player| player.hero.is_some()).count();
        let reserved = match self.scene.hero {
            Some(_) => usize::from(self.scene.players_max).saturating_sub(heroes),
            None => 0,
        };
        self.scene.bodies_max.saturating_sub(self.world.body_count() + reserved)
    }
}
