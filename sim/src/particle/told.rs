//! Running emitters and flying particles as they are told to a client that joins: to the last bit,
//! and nothing that follows from the rest. Particles stand in the order of their birth, so that those
//! of one recipe and age share these.

use super::emitter::Emitter;
use super::{Birth, EMITTERS_RUNNING_MAX, Particles, Recipe};
use crate::state::bytes::{StateError, StateReader, StateWriter};

const EMITTER_BYTES: usize = 41;
/// Recipe, age, and how many particles in a row share them.
const RUN_BYTES: usize = 4;
/// Place, velocity and seed.
const PARTICLE_BYTES: usize = 20;

/// What is told of so many particles at most, bytes.
pub const fn told_bytes_max(particles: usize) -> usize {
    4 + EMITTERS_RUNNING_MAX * EMITTER_BYTES + 4 + particles * (RUN_BYTES + PARTICLE_BYTES)
}

impl Particles {
    /// Everything that the coming ticks depend on, for [`Particles::told`].
    pub fn tell(&self) -> Vec<u8> {
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

    /// Particles in a row, from this one on, of its recipe and its age; at most a byte's worth.
    fn run_at(&self, index: usize) -> usize {
        let end = self.len().min(index + usize::from(u8::MAX));
        let kind = |other: usize| (self.recipe[other], self.age[other]);
        (index..end).take_while(|&other| kind(other) == kind(index)).count()
    }

    /// The particles that [`Particles::tell`] told of, bit for bit, with the recipes and the limit of
    /// the scene. Any bytes are safe; what is accepted can be stepped.
    pub fn told(recipes: Vec<Recipe>, limit: usize, told: &[u8]) -> Result<Particles, StateError> {
        let mut bytes = StateReader::new(told);
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

    /// Recipe, age and length of the run that was read. One that could have been longer is refused:
    /// the same particles are always told in the same bytes.
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
