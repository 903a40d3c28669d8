//! Events, which are facts that a tick reports.

use crate::input::Seat;
use crate::scene::Kind;
use glam::Vec2;
use jostle_sim::{BodyId, EmitterDef};

/// A fact reported by a tick. Events are listed in the order in which they happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Two bodies, at least one of them dynamic, began to touch while closing faster than the scene's report speed.
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
        /// The pack's owner; `None` if a launcher made it.
        owner: Option<Seat>,
        /// The hero's player, if it has one.
        victim: Option<Seat>,
        /// The hero that was hit.
        hero: BodyId,
        /// Contact point, world units.
        point: Vec2,
    },
    /// A body left the kill zone. A hero respawns.
    BodyLeft {
        /// Kind of the body.
        kind: Kind,
        /// Id of the body, which is no longer valid.
        body: BodyId,
        /// Last position of the body, world units.
        point: Vec2,
    },
    /// An emitter was started.
    EmitterStarted(EmitterDef),
    /// One of the scene's emitters, at a fixed position, was started; see [`Scene::emitter`](crate::Scene::emitter).
    ScheduledEmitterStarted {
        /// Index into the scene's emitters.
        index: u8,
        /// Seed for all random properties of this run's particles.
        seed: u32,
    },
    /// A rule says its line; see [`Effects::say`](crate::scene::Effects::say).
    Said {
        /// Index into the scene's rules.
        rule: u8,
        /// The player whose hero the line is about, or who last touched the body that it is about.
        it: Option<Seat>,
        /// The player who caused the line.
        by: Option<Seat>,
    },
    /// A player took a seat.
    Joined(Seat),
    /// A player left a seat, and their hero and packs are gone.
    Left(Seat),
}
