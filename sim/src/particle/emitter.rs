//! Emitters: when, where and how many. They are started by an [`EmitterDef`], which is also what
//! travels to clients.

use crate::body::BodyId;
use crate::math::Rng;
use crate::state::bytes::{StateError, StateReader, StateWriter};
use crate::state::{Subject, Words};
use glam::Vec2;

/// Where an emitter makes its particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// A fixed place.
    Point(Vec2),
    /// The centre of a body, followed until the body is gone.
    Body(BodyId),
}

/// An emitter as it is started and as it travels in an event: everything that its particles
/// depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterDef {
    /// Index into the scene's recipes.
    pub recipe: u8,
    /// Particles to make in all; the emitter makes exactly so many (C24e).
    pub count: u16,
    /// Seed of all that is random about them.
    pub seed: u32,
    /// Place, or body to follow.
    pub source: Source,
}

/// Fewest particles an update while more than that are left (row A4.4, C24f).
const AMOUNT_MIN: u32 = 5;
/// Largest share of what is left that one update makes.
const SHARE_MAX: f32 = 0.2;

/// A running emitter.
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

    /// Takes the place of the followed body; a body that is gone leaves it where it was.
    pub fn follow(&mut self, locate: impl Fn(BodyId) -> Option<Vec2>) {
        if let Source::Body(id) = self.def.source
            && let Some(center) = locate(id)
        {
            self.position = center;
        }
    }

    /// Particles to make in this update: all if few are left, else a random share of up to 20 %
    /// of what is left, and at least 5.
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

    pub fn words(&self, subject: Subject, words: &mut impl Words) {
        let (recipe, left) = (u32::from(self.def.recipe), u32::from(self.left));
        words.bits(subject, "recipe and particles left", recipe << 16 | left);
        let body = match self.def.source {
            Source::Point(_) => BodyId { index: u32::MAX, generation: 0 },
            Source::Body(id) => id,
        };
        words.name(subject, "followed body", body);
        words.vector(subject, ["position.x", "position.y"], self.position);
        for half in self.rng.state() {
            words.long(subject, "generator", half);
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
