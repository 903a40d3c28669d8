//! Saved particles and emitters: 25 bytes per particle, 41 per emitter.

use super::emitter::Emitter;
use super::{EMITTERS_RUNNING_MAX, Particles, Recipe};
use crate::state::bytes::{StateError, StateReader, StateWriter};

const EMITTER_BYTES: usize = 41;
const PARTICLE_BYTES: usize = 25;

impl Particles {
    pub(crate) fn save(&self, out: &mut StateWriter) {
        out.word(self.emitters.len() as u32);
        self.emitters.iter().for_each(|emitter| emitter.save(out));
        out.word(self.len() as u32);
        for index in 0..self.len() {
            out.vector(self.position[index]);
            out.vector(self.velocity[index]);
            out.short(self.age[index]);
            out.short(self.life[index]);
            out.word(self.seed[index]);
            out.byte(self.recipe[index]);
        }
    }

    pub(crate) fn restore(
        recipes: Vec<Recipe>,
        limit: usize,
        bytes: &mut StateReader,
    ) -> Result<Particles, StateError> {
        let mut particles = Particles::new(recipes, limit);
        let recipes = particles.recipes.len();
        for _ in 0..bytes.count(EMITTERS_RUNNING_MAX, EMITTER_BYTES, "number of emitters")? {
            particles.emitters.push(Emitter::restore(recipes, bytes)?);
        }
        for _ in 0..bytes.count(limit, PARTICLE_BYTES, "number of particles")? {
            particles.position.push(bytes.vector("position of a particle")?);
            particles.velocity.push(bytes.vector("velocity of a particle")?);
            particles.age.push(bytes.short("age")?);
            particles.life.push(bytes.short("life")?);
            particles.seed.push(bytes.word("seed")?);
            let recipe = bytes.byte("recipe of a particle")?;
            bytes.check(usize::from(recipe) < recipes, "recipe of a particle")?;
            particles.recipe.push(recipe);
        }
        Ok(particles)
    }
}
