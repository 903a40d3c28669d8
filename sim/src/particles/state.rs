//! Serialization of particles and emitters: 25 bytes per particle, 41 per emitter.

use super::emitter::Emitter;
use super::{EMITTERS_RUNNING_MAX, Particle, Particles};
use crate::state::Subject;
use crate::state::io::StateIo;

const EMITTER_BYTES: usize = 41;
const PARTICLE_BYTES: usize = 25;

impl Particles {
    /// Describes emitters and particles.
    pub(crate) fn state(&self, io: &mut impl StateIo) -> (Vec<Emitter>, Vec<Particle>) {
        let emitters = self.emitter_state(io);
        let (name, limits) = ("number of particles", [self.limit, PARTICLE_BYTES]);
        let particles =
            io.list(name, limits, self.rows(), Particle::default(), |io, index, mut it| {
                io.subject(Subject::Numbered("particle", index));
                it.position = io.vector(["position.x", "position.y"], it.position, f32::is_finite);
                it.velocity = io.vector(["velocity.x", "velocity.y"], it.velocity, f32::is_finite);
                io.bits("age and life", u32::from(it.age) << 16 | u32::from(it.life));
                it.age = io.saved_short("age", it.age);
                it.life = io.saved_short("life", it.life);
                it.seed = io.word("seed", it.seed);
                it.recipe = io.byte("recipe", it.recipe);
                io.check("recipe", || usize::from(it.recipe) < self.recipes.len());
                it
            });
        (emitters, particles)
    }

    /// Describes the running emitters.
    pub(super) fn emitter_state(&self, io: &mut impl StateIo) -> Vec<Emitter> {
        io.subject(Subject::WORLD);
        io.bits("emitters", self.emitters.len() as u32);
        let limits = [EMITTERS_RUNNING_MAX, EMITTER_BYTES];
        let (given, blank) = (self.emitters.iter().cloned(), Emitter::blank());
        io.list("number of emitters", limits, given, blank, |io, index, emitter| {
            io.subject(Subject::Numbered("emitter", index));
            emitter.state(self.recipes.len(), io)
        })
    }
}
