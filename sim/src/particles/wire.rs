//! Running emitters and live particles as sent to a joining client. They are exact to the last bit, and omit anything
//! that can be derived. Particles are in order of birth, so that consecutive ones with the same recipe and age share
//! both.

use super::emitter::Emitter;
use super::{Birth, EMITTER_BYTES, EMITTERS_RUNNING_MAX, Particle, Particles, Recipe};
use crate::state::bytes::{StateError, StateReader, StateWriter};
use crate::state::io::{StateIo, plausible};

/// Recipe, age, and number of consecutive particles that share them.
const RUN_BYTES: usize = 4;
/// Position, velocity and seed of a particle.
const PARTICLE_BYTES: usize = 20;

/// Largest encoding of this many particles, bytes.
pub const fn encoded_bytes_max(particles: usize) -> usize {
    4 + EMITTERS_RUNNING_MAX * EMITTER_BYTES + 4 + particles * (RUN_BYTES + PARTICLE_BYTES)
}

/// A run of consecutive particles with the same recipe and age.
#[derive(Clone, Copy)]
struct ParticleRun {
    recipe: u8,
    age: u16,
    length: u8,
}

impl Particles {
    /// Encodes everything that future ticks depend on, for [`Particles::decode`].
    pub fn encode(&self) -> Vec<u8> {
        let mut out = StateWriter::default();
        self.wire(&mut out);
        out.0
    }

    /// Decodes particles encoded by [`Particles::encode`], bit for bit, using the scene's recipes and limit. Any
    /// bytes are safe to decode, and the result can be stepped.
    pub fn decode(
        recipes: Vec<Recipe>,
        limit: usize,
        bytes: &[u8],
    ) -> Result<Particles, StateError> {
        let mut bytes = StateReader::new(bytes);
        let mut particles = Particles::new(recipes, limit);
        let (emitters, read) = particles.wire(&mut bytes);
        bytes.end()?;
        particles.fill(emitters, &read);
        Ok(particles)
    }

    /// Describes the encoding. A run that could have been longer is refused, so that equal particles always have
    /// equal encodings.
    fn wire<Io: StateIo>(&self, io: &mut Io) -> (Vec<Emitter>, Vec<Particle>) {
        let emitters = self.emitter_state(io);
        let limits = [self.limit, PARTICLE_BYTES];
        let mut left = io.count("number of particles", self.len(), limits);
        let (mut rows, mut read, mut before) = (self.rows(), Vec::new(), None);
        while left > 0 {
            let run = self.run_at(self.len().saturating_sub(left)).state(self.recipes.len(), io);
            let length = usize::from(run.length);
            let goes_on = || before.is_some_and(|before: ParticleRun| before.goes_on_in(run));
            let fits = (1..=left).contains(&length);
            io.check("particles alike", || fits && !goes_on());
            // A run that does not fit has been refused, and its particles are not used.
            let length = if fits { length } else { left };
            for _ in 0..length {
                let particle = self.wire_particle(run, rows.next().unwrap_or_default(), io);
                if Io::READS {
                    read.push(particle);
                }
            }
            left -= length;
            before = Some(run);
        }
        (emitters, read)
    }

    fn wire_particle(&self, run: ParticleRun, mut it: Particle, io: &mut impl StateIo) -> Particle {
        let ParticleRun { recipe, age, .. } = run;
        it.position = io.vector(["position of a particle"; 2], it.position, plausible);
        it.velocity = io.vector(["velocity of a particle"; 2], it.velocity, plausible);
        it.seed = io.word("seed", it.seed);
        let life = || Birth::draw(&self.recipes[usize::from(recipe)], it.seed).life;
        it.life = io.checked("age", it.life, || Some(life()).filter(|&life| age <= life));
        Particle { recipe, age, ..it }
    }

    /// Returns the run that begins at `index`.
    fn run_at(&self, index: usize) -> ParticleRun {
        let kind = |index: usize| Some((*self.recipe.get(index)?, *self.age.get(index)?));
        let (recipe, age) = kind(index).unwrap_or_default();
        let end = self.len().min(index + usize::from(u8::MAX));
        let alike = (index..end).take_while(|&other| kind(other) == kind(index));
        ParticleRun { recipe, age, length: alike.count() as u8 }
    }
}

impl ParticleRun {
    fn state(mut self, recipes: usize, io: &mut impl StateIo) -> ParticleRun {
        self.recipe = io.byte("recipe of particles", self.recipe);
        io.check("recipe of particles", || usize::from(self.recipe) < recipes);
        self.age = io.short("age", self.age);
        self.length = io.byte("particles alike", self.length);
        self
    }

    /// Whether another run's particles could have been part of this one.
    fn goes_on_in(self, next: ParticleRun) -> bool {
        (self.recipe, self.age) == (next.recipe, next.age) && self.length < u8::MAX
    }
}

#[cfg(test)]
mod tests;
