//! Events: facts that a tick reports.

use crate::input::Seat;
use crate::scene::Kind;
use glam::Vec2;
use jostle_sim::{BodyId, EmitterDef};

/// A fact that a tick reports, in the order in which it happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Two bodies began to touch, one of them dynamic, closing faster than the scene's report speed.
    Impact {
        /// The body with the lower index.
        a: BodyId,
        /// The body with the higher index.
        b: BodyId,
        /// Contact point, world units.
        point: Vec2,
        /// Closing speed, units/s.
        speed: f32,
    },
    /// A dye pack burst on a hero.
    PackHit {
        /// The pack's owner; nobody if a launcher made it.
        owner: Option<Seat>,
        /// The hero's player, if it has one.
        victim: Option<Seat>,
        /// The hero that is concerned.
        hero: BodyId,
        /// Contact point, world units.
        point: Vec2,
    },
    /// A body left the kill zone; a hero respawns.
    BodyLeft {
        /// Kind of the body.
        kind: Kind,
        /// Its id, no longer valid.
        body: BodyId,
        /// Its last position, world units.
        point: Vec2,
    },
    /// An emitter was started.
    EmitterStarted(EmitterDef),
    /// An emitter of the scene at a fixed position was started again:
    /// [`Scene::emitter`](crate::Scene::emitter).
    ScheduledEmitterStarted {
        /// Index into the scene's emitters.
        index: u8,
        /// Seed of everything random about its particles this time.
        seed: u32,
    },
    /// A rule says its line, [`Effects::say`](crate::scene::Effects::say).
    Said {
        /// Index into the scene's rules.
        rule: u8,
        /// The player whose hero it is about, or who touched that body last.
        it: Option<Seat>,
        /// The player who caused it.
        by: Option<Seat>,
    },
    /// A player took a seat.
    Joined(Seat),
    /// A player left a seat; hero and packs are gone.
    Left(Seat),
}
