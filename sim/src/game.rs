//! The Game: a World and the rules of its scene. Heroes, minions, packs, tools.

use crate::particle::EmitterDef;
use crate::scene::Scene;
pub use crate::scene::{Kind, SEATS_MAX};
use crate::shape::Shape;
use crate::world::{BodyId, World};
use glam::Vec2;
use std::sync::Arc;

/// A place in a game, 0..[`SEATS_MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Seat(pub u8);

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
}

/// A player's intent for one tick.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Input {
    /// What is down.
    pub buttons: Buttons,
    /// Pointer in world units, finite; `None` while it is outside the view.
    pub pointer: Option<Vec2>,
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
}

impl Game {
    /// A game at tick 0 with nobody in it. The same scene and seed give the same game.
    pub fn new(scene: Arc<Scene>, seed: u64) -> Game {
        let _ = (scene, seed);
        todo!()
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
        todo!()
    }

    /// Seats a player; a hero appears where the scene has heroes. Panics if the seat is taken.
    pub fn join(&mut self, seat: Seat) {
        let _ = seat;
        todo!()
    }

    /// Removes a player with hero and packs. Panics if the seat is empty.
    pub fn leave(&mut self, seat: Seat) {
        let _ = seat;
        todo!()
    }

    /// Plays one tick. `inputs` holds at most one entry a seat, in seat order; a seat without an
    /// entry is at rest: nothing is down.
    pub fn tick(&mut self, inputs: &[(Seat, Input)]) {
        let _ = inputs;
        todo!()
    }

    /// What the last tick (and joins and leaves since the one before) reported, in order.
    pub fn events(&self) -> &[Event] {
        todo!()
    }

    /// Bodies in index order.
    pub fn bodies(&self) -> impl Iterator<Item = BodyInfo> + '_ {
        std::iter::empty()
    }

    /// Players in seat order.
    pub fn players(&self) -> impl Iterator<Item = PlayerInfo> + '_ {
        std::iter::empty()
    }

    /// Digest of the raw bits of the whole state.
    pub fn hash(&self) -> u64 {
        todo!()
    }
}
