//! Emitters decide when, where and how many particles are made. An emitter is started from an [`EmitterDef`], which
//! is also sent to clients.

use crate::body::BodyId;
use crate::rng::Rng;
use crate::state::io::StateIo;
use glam::Vec2;

/// Position at which an emitter makes its particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// A fixed point, world units.
    Point(Vec2),
    /// The centre of a body, followed until the body is removed.
    Body(BodyId),
}

/// Definition of an emitter, which is also sent in events. Its particles depend on nothing else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterDef {
    /// Index into the scene's recipes.
    pub recipe: u8,
    /// Total number of particles. The emitter makes exactly this many (C24e).
    pub count: u16,
    /// Seed for all random properties of its particles.
    pub seed: u32,
    /// Position, or body to follow.
    pub source: Source,
}

impl EmitterDef {
    /// The seeds of all particles that the emitter will make, in order.
    pub fn seeds(self) -> Vec<u32> {
        let (mut emitter, mut seeds) = (Emitter::new(self), Vec::new());
        while !emitter.is_expired() {
            let amount = emitter.next_amount();
            seeds.extend((0..amount).map(|_| emitter.next_seed()));
        }
        seeds
    }
}

/// Minimum number of particles per tick while more than this many remain (A4.4, C24f).
const AMOUNT_MIN: u32 = 5;
/// Largest share of the remaining particles made in one update.
const SHARE_MAX: f32 = 0.2;

#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    def: EmitterDef,
    left: u16,
    position: Vec2,
    rng: Rng,
}

impl Emitter {
    pub fn new(def: EmitterDef) -> Emitter {
        let position = match def.source {
            Source::Point(point) => point,
            Source::Body(_) => Vec2::ZERO,
        };
        let rng = Rng::new(u64::from(def.seed), 0);
        Emitter { left: def.count, position, rng, def }
    }

    /// Moves to the followed body, or stays in place if the body was removed.
    pub fn follow(&mut self, locate: impl Fn(BodyId) -> Option<Vec2>) {
        if let Source::Body(id) = self.def.source
            && let Some(center) = locate(id)
        {
            self.position = center;
        }
    }

    /// Number of particles to make in this update. If few remain, this is all of them; otherwise it is a random
    /// share of up to 20 % of the rest, but at least 5.
    pub fn next_amount(&mut self) -> u16 {
        let left = u32::from(self.left);
        let share = (left as f32 * SHARE_MAX * self.rng.unit()) as u32;
        let amount = if left <= AMOUNT_MIN {
            left
        } else if share < AMOUNT_MIN {
            AMOUNT_MIN
        } else {
            share
        };
        self.left -= amount as u16;
        amount as u16
    }

    pub fn next_seed(&mut self) -> u32 {
        self.rng.next_u32()
    }

    pub fn recipe(&self) -> u8 {
        self.def.recipe
    }

    pub fn position(&self) -> Vec2 {
        self.position
    }

    pub fn is_expired(&self) -> bool {
        self.left == 0
    }

    /// An emitter to fill in when its state is read.
    pub fn blank() -> Emitter {
        Emitter::new(EmitterDef { recipe: 0, count: 0, seed: 0, source: Source::Point(Vec2::ZERO) })
    }

    /// Describes an emitter in a world with this many recipes.
    pub fn state(mut self, recipes: usize, io: &mut impl StateIo) -> Emitter {
        let def = &mut self.def;
        io.bits("recipe and particles left", u32::from(def.recipe) << 16 | u32::from(self.left));
        def.recipe = io.saved("recipe", [def.recipe])[0];
        io.check("recipe", || usize::from(def.recipe) < recipes);
        // The emitter's initial values no longer affect anything.
        def.count = io.saved_short("particles in all", def.count);
        def.seed = io.saved_word("seed", def.seed);
        self.left = io.saved_short("particles left", self.left);
        io.check("particles left", || (1..=def.count).contains(&self.left));
        let followed = match def.source {
            Source::Body(id) => Some(id),
            Source::Point(_) => None,
        };
        let followed = io.body("followed body", followed);
        self.position = io.vector(["position.x", "position.y"], self.position, f32::is_finite);
        def.source = followed.map_or(Source::Point(self.position), Source::Body);
        self.rng = io.generator("generator", &self.rng);
        self
    }
}
