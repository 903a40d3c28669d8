//! Running emitters and live particles as they are sent to a client that joins: exact to the last
//! bit, without anything that follows from the rest. Particles are in the order of their birth, so
//! that consecutive ones of the same recipe and age share both.

use super::emitter::Emitter;
use super::{Birth, EMITTERS_RUNNING_MAX, Particles, Recipe};
use crate::state::bytes::{StateError, StateReader, StateWriter};

const EMITTER_BYTES: usize = 41;
/// Recipe, age, and number of consecutive particles that share them.
const RUN_BYTES: usize = 4;
/// Position, velocity and seed.
const PARTICLE_BYTES: usize = 20;

/// Largest encoding of this many particles, bytes.
pub const fn encoded_bytes_max(particles: usize) -> usize {
    4 + EMITTERS_RUNNING_MAX * EMITTER_BYTES + 4 + particles * (RUN_BYTES + PARTICLE_BYTES)
}

impl Particles {
    /// Encodes everything that the coming ticks depend on, for [`Particles::decode`].
    pub fn encode(&self) -> Vec<u8> {
        let mut out = StateWriter::default();
        out.word(self.emitters.len() as u32);
        self.emitters.iter().for_each(|emitter| emitter.save(&mut out));
        out.word(self.len() as u32);
        let mut index = 0;
        while index < self.len() {
            let run = self.run_at(index);
            out.byte(self.recipe[index]);
            out.short(self.age[index]);
            out.byte(run as u8);
            for member in index..index + run {
                out.vector(self.position[member]);
                out.vector(self.velocity[member]);
                out.word(self.seed[member]);
            }
            index += run;
        }
        out.0
    }

    /// Number of consecutive particles from `index` with its recipe and its age, at most 255.
    fn run_at(&self, index: usize) -> usize {
        let end = self.len().min(index + usize::from(u8::MAX));
        let kind = |other: usize| (self.recipe[other], self.age[other]);
        (index..end).take_while(|&other| kind(other) == kind(index)).count()
    }

    /// Decodes particles that were encoded by [`Particles::encode`], bit for bit, with the recipes
    /// and the limit of the scene. Any bytes are safe; the result can be stepped.
    pub fn decode(
        recipes: Vec<Recipe>,
        limit: usize,
        bytes: &[u8],
    ) -> Result<Particles, StateError> {
        let mut bytes = StateReader::new(bytes);
        let mut particles = Particles::new(recipes, limit);
        let recipes = particles.recipes.len();
        for _ in 0..bytes.count(EMITTERS_RUNNING_MAX, EMITTER_BYTES, "number of emitters")? {
            particles.emitters.push(Emitter::restore(recipes, &mut bytes)?);
        }
        let count = bytes.count(limit, PARTICLE_BYTES, "number of particles")?;
        let mut before = None;
        while particles.len() < count {
            before = Some(particles.read_run(count - particles.len(), before, &mut bytes)?);
        }
        bytes.end()?;
        Ok(particles)
    }

    /// Reads a run; returns its recipe, age and length. A run that could have been longer is
    /// refused: equal particles always have equal bytes.
    fn read_run(
        &mut self,
        left: usize,
        before: Option<(u8, u16, u8)>,
        bytes: &mut StateReader,
    ) -> Result<(u8, u16, u8), StateError> {
        let recipe = bytes.byte("recipe of particles")?;
        bytes.check(usize::from(recipe) < self.recipes.len(), "recipe of particles")?;
        let (age, run) = (bytes.short("age")?, bytes.byte("particles alike")?);
        let goes_on =
            before.is_some_and(|(of, aged, run)| (of, aged) == (recipe, age) && run < u8::MAX);
        bytes.check((1..=left).contains(&usize::from(run)) && !goes_on, "particles alike")?;
        for _ in 0..run {
            self.position.push(bytes.plausible("position of a particle")?);
            self.velocity.push(bytes.plausible("velocity of a particle")?);
            let seed = bytes.word("seed")?;
            let life = Birth::draw(&self.recipes[usize::from(recipe)], seed).life;
            bytes.check(age <= life, "age")?;
            self.age.push(age);
            self.life.push(life);
            self.recipe.push(recipe);
            self.seed.push(seed);
        }
        Ok((recipe, age, run))
    }
}

#[cfg(test)]
mod tests;
