//! Emitters: when, where and how many. They are started from an [`EmitterDef`], which is also sent
//! to clients.

use crate::body::BodyId;
use crate::rng::Rng;
use crate::state::bytes::{StateError, StateReader, StateWriter};
use crate::state::{StateVisitor, Subject};
use glam::Vec2;

/// Position at which an emitter makes its particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// A fixed point, world units.
    Point(Vec2),
    /// The centre of a body, followed until the body is removed.
    Body(BodyId),
}

/// Definition of an emitter, also sent in events: everything that its particles depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterDef {
    /// Index into the scene's recipes.
    pub recipe: u8,
    /// Number of particles in all; the emitter makes exactly this many (C24e).
    pub count: u16,
    /// Seed of everything random about them.
    pub seed: u32,
    /// Position, or body to follow.
    pub source: Source,
}

/// Fewest particles per tick while more than that remain (A4.4, C24f).
const AMOUNT_MIN: u32 = 5;
/// Largest share of the remaining particles made in one update.
const SHARE_MAX: f32 = 0.2;

#[derive(Clone, Debug)]
pub(super) struct Emitter {
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

    /// Moves to the followed body; stays where it was if the body is removed.
    pub fn follow(&mut self, locate: impl Fn(BodyId) -> Option<Vec2>) {
        if let Source::Body(id) = self.def.source
            && let Some(center) = locate(id)
        {
            self.position = center;
        }
    }

    /// Number of particles to make in this update: all if few remain, else a random share of up to
    /// 20 % of the rest, and at least 5.
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

    pub fn visit(&self, subject: Subject, visitor: &mut impl StateVisitor) {
        let (recipe, left) = (u32::from(self.def.recipe), u32::from(self.left));
        visitor.bits(subject, "recipe and particles left", recipe << 16 | left);
        let body = match self.def.source {
            Source::Point(_) => BodyId { index: u32::MAX, generation: 0 },
            Source::Body(id) => id,
        };
        visitor.name(subject, "followed body", body);
        visitor.vector(subject, ["position.x", "position.y"], self.position);
        for half in self.rng.state() {
            visitor.long(subject, "generator", half);
        }
    }

    pub fn save(&self, out: &mut StateWriter) {
        out.byte(self.def.recipe);
        out.short(self.def.count);
        out.word(self.def.seed);
        out.short(self.left);
        match self.def.source {
            Source::Body(id) => out.body(Some(id)),
            Source::Point(_) => out.body(None),
        }
        out.vector(self.position);
        self.rng.state().into_iter().for_each(|half| out.long(half));
    }

    pub fn restore(recipes: usize, bytes: &mut StateReader) -> Result<Emitter, StateError> {
        let recipe = bytes.byte("recipe of an emitter")?;
        bytes.check(usize::from(recipe) < recipes, "recipe of an emitter")?;
        let (count, seed) = (bytes.short("particles of an emitter")?, bytes.word("seed")?);
        let left = bytes.short("particles left")?;
        bytes.check((1..=count).contains(&left), "particles left")?;
        let body = bytes.body("followed body")?;
        let position = bytes.vector("position of an emitter")?;
        let source = body.map_or(Source::Point(position), Source::Body);
        let rng = Rng::from_state([bytes.long("generator")?, bytes.long("generator")?]);
        Ok(Emitter { def: EmitterDef { recipe, count, seed, source }, left, position, rng })
    }
}
