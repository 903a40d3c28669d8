//! Particles, their recipes and emitters. The server and every client, driven by emitter events, run the same code,
//! so individual particles cost nothing on the wire.
//!
//! A particle is a point with a lifetime. Its colour and size follow from its age and its own seed, and are never
//! stored. An emitter decides when, where and how many particles are made; a recipe decides how they look and move.

mod emitter;
mod obstacles;
pub mod wire;

pub use emitter::{EmitterDef, Source};
pub use obstacles::{Obstacle, dequantise, quantise};

use crate::body::BodyId;
use crate::hash::StateHasher;
use crate::math::min;
use crate::rng::Rng;
use crate::state::Subject;
use crate::state::io::StateIo;
use crate::time::DT;
use emitter::Emitter;
use glam::Vec2;
use obstacles::ObstacleGrid;

/// Properties of an emitter's particles (A3.18). For each particle, values are drawn from the ranges.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Name in the scene file.
    pub name: String,
    /// Lifetime in whole ticks, low..=high, at least 1 (C24c).
    pub life_ticks: [u16; 2],
    /// RGBA at birth; components may exceed 1.
    pub color_start: [f32; 4],
    /// RGBA at the end of life, low and high; components may exceed 1.
    pub color_end: [[f32; 4]; 2],
    /// Width at birth in world units, low and high.
    pub size: [f32; 2],
    /// Factor applied to the size every tick; 1 keeps the size (C24a).
    pub size_factor: f32,
    /// Velocity at birth, low and high corner, units/s.
    pub velocity: [Vec2; 2],
    /// Whether velocities come from the ellipse within the box instead of the box itself, for a round burst.
    pub round: bool,
    /// Acceleration, units/s^2; independent of the bodies' gravity (A3.14).
    pub acceleration: Vec2,
    /// Factor applied to the velocity every tick of 1/60 s (C24l).
    pub drag: f32,
}

impl Default for Recipe {
    /// The chapter's flame (A3.18).
    fn default() -> Recipe {
        Recipe {
            name: "fire".to_owned(),
            life_ticks: [30, 230],
            color_start: [1.0, 0.0, 0.0, 1.0],
            color_end: [[3.5, 0.4, 0.3, 0.6], [4.5, 0.5, 0.4, 0.6]],
            size: [5.5, 6.0],
            size_factor: 0.98,
            velocity: [Vec2::new(-10.0, 0.0), Vec2::new(10.0, 10.0)],
            round: false,
            acceleration: Vec2::new(0.0, -50.0),
            drag: 0.95,
        }
    }
}

/// Current appearance of a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleAppearance {
    /// RGBA tint; components may exceed 1.
    pub color: [f32; 4],
    /// Width and height in world units.
    pub size: f32,
}

/// Upper limit on the size regardless of the size factor, world units.
const SIZE_MAX: f32 = 256.0;

/// Maximum number of emitters running at any time. Beyond this, no more are started.
pub const EMITTERS_RUNNING_MAX: usize = 1024;

/// Size in bytes of a saved emitter, and of a saved particle.
const EMITTER_BYTES: usize = 41;
const PARTICLE_BYTES: usize = 25;

/// All live particles and emitters of a world, with particles as a structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    recipes: Vec<Recipe>,
    limit: usize,
    emitters: Vec<Emitter>,
    position: Vec<Vec2>,
    velocity: Vec<Vec2>,
    /// Ticks lived, and lifetime in ticks.
    age: Vec<u16>,
    life: Vec<u16>,
    recipe: Vec<u8>,
    /// Seed for the properties that are drawn for each particle.
    seed: Vec<u32>,
    grid: ObstacleGrid,
}

/// One particle.
#[derive(Clone, Copy, Default)]
pub(crate) struct Particle {
    pub position: Vec2,
    pub velocity: Vec2,
    pub age: u16,
    pub life: u16,
    pub seed: u32,
    pub recipe: u8,
}

impl Particles {
    /// Creates an empty set with at most `limit` particles at any time. Any that emitters make beyond that are
    /// lost.
    pub fn new(recipes: Vec<Recipe>, limit: usize) -> Particles {
        assert!(recipes.len() <= 256, "{} recipes, at most 256 fit an emitter", recipes.len());
        for recipe in &recipes {
            assert!(recipe.life_ticks[0] >= 1, "recipe {}: a life of 0 ticks", recipe.name);
            assert!(recipe.life_ticks[0] <= recipe.life_ticks[1], "recipe {}: life", recipe.name);
        }
        Particles { recipes, limit, ..Particles::default() }
    }

    /// Limits the memory for obstacles to this many grid entries, one for each cell that an obstacle touches, and
    /// their time to sixteen times as many comparisons with particles per tick. Beyond either limit,
    /// [`Particles::is_over`] is true and particles ignore further obstacles.
    pub fn limit_obstacle_cells(&mut self, most: usize) {
        self.grid = ObstacleGrid::limited(most);
    }

    /// Whether obstacles touched more cells than allowed, or too many were compared with particles.
    pub fn is_over(&self) -> bool {
        self.grid.is_over()
    }

    /// Adds an emitter, which makes its first particles in the next `step`. Returns `false` if
    /// [`EMITTERS_RUNNING_MAX`] emitters are running. Panics if its recipe does not exist.
    pub fn start(&mut self, emitter: EmitterDef) -> bool {
        let recipe = usize::from(emitter.recipe);
        assert!(recipe < self.recipes.len(), "recipe {recipe} does not exist");
        let fits = self.emitters.len() < EMITTERS_RUNNING_MAX;
        if fits {
            self.emitters.push(Emitter::new(emitter));
        }
        fits
    }

    /// Advances by a tick: removes expired particles (A3.13), moves the others and pushes them out
    /// of obstacles, then lets emitters emit (A4.7).
    ///
    /// A particle with a lifetime of L ticks moves exactly L times, reaches its final colour and size exactly,
    /// stays visible in that state for one tick, and is removed in the next (C24b). `locate` returns the quantised
    /// centre of a followed body, or `None` once it is removed; the emitter then stays at its last position.
    pub fn step(&mut self, obstacles: &[Obstacle], locate: impl Fn(BodyId) -> Option<Vec2>) {
        self.remove_expired();
        self.integrate();
        self.push_out(obstacles);
        self.emit(locate);
    }

    /// Removes expired particles by stable compaction, so that no particle is skipped (C24d).
    fn remove_expired(&mut self) {
        let mut kept = 0;
        for index in 0..self.len() {
            if self.age[index] < self.life[index] {
                self.position[kept] = self.position[index];
                self.velocity[kept] = self.velocity[index];
                self.age[kept] = self.age[index];
                self.life[kept] = self.life[index];
                self.recipe[kept] = self.recipe[index];
                self.seed[kept] = self.seed[index];
                kept += 1;
            }
        }
        self.position.truncate(kept);
        self.velocity.truncate(kept);
        self.age.truncate(kept);
        self.life.truncate(kept);
        self.recipe.truncate(kept);
        self.seed.truncate(kept);
    }

    /// Integrates over a tick: v += a dt, v *= drag, x += v dt (A3.7).
    fn integrate(&mut self) {
        let bodies = self.position.iter_mut().zip(&mut self.velocity);
        for (((position, velocity), age), &recipe) in bodies.zip(&mut self.age).zip(&self.recipe) {
            let recipe = &self.recipes[usize::from(recipe)];
            *velocity = (*velocity + recipe.acceleration * DT) * recipe.drag;
            *position += *velocity * DT;
            *age += 1;
        }
    }

    /// Moves particles out of shapes by the shortest way (A3.15, A3.16). They lose the inward part of their velocity
    /// (C24k).
    fn push_out(&mut self, obstacles: &[Obstacle]) {
        if obstacles.is_empty() || self.is_empty() {
            return;
        }
        self.grid.fill(obstacles);
        let (mut looks, looks_max) = (0, self.grid.looks_max());
        for (position, velocity) in self.position.iter_mut().zip(&mut self.velocity) {
            let candidates = self.grid.candidates(*position);
            looks += candidates.len();
            if looks > looks_max {
                self.grid.exceed();
                return;
            }
            for &index in candidates {
                obstacles[index as usize].push_out(position, velocity);
            }
        }
    }

    fn emit(&mut self, locate: impl Fn(BodyId) -> Option<Vec2>) {
        let mut emitters = std::mem::take(&mut self.emitters);
        for emitter in &mut emitters {
            emitter.follow(&locate);
            for _ in 0..emitter.next_amount() {
                let seed = emitter.next_seed();
                self.spawn(emitter.recipe(), emitter.position(), seed);
            }
        }
        emitters.retain(|emitter| !emitter.is_expired());
        self.emitters = emitters;
    }

    /// Adds a particle at a position, unless the limit is reached.
    fn spawn(&mut self, recipe: u8, position: Vec2, seed: u32) {
        if self.len() >= self.limit {
            return;
        }
        let Birth { velocity, life, .. } = Birth::draw(&self.recipes[usize::from(recipe)], seed);
        self.push(&Particle { position, velocity, age: 0, life, seed, recipe });
    }

    /// Number of live particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are no particles.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Whether a particle is alive or an emitter is running, so that the next tick changes something.
    pub fn is_active(&self) -> bool {
        !self.is_empty() || !self.emitters.is_empty()
    }

    /// Number of running emitters.
    pub fn emitter_count(&self) -> usize {
        self.emitters.len()
    }

    /// The positions of all live particles, world units.
    pub fn positions(&self) -> &[Vec2] {
        &self.position
    }

    /// Velocities of all live particles, units/s.
    pub fn velocities(&self) -> &[Vec2] {
        &self.velocity
    }

    /// The seeds of all live particles.
    pub fn seeds(&self) -> &[u32] {
        &self.seed
    }

    /// The age of particle `index` and its lifetime, in ticks.
    pub fn age(&self, index: usize) -> (u16, u16) {
        (self.age[index], self.life[index])
    }

    /// Current colour and size of particle `index`, derived from its age and its own seed.
    pub fn appearance(&self, index: usize) -> ParticleAppearance {
        let recipe = &self.recipes[usize::from(self.recipe[index])];
        let birth = Birth::draw(recipe, self.seed[index]);
        let (age, life) = (self.age[index], self.life[index]);
        let lived = if age >= life { 1.0 } else { f32::from(age) / f32::from(life) };
        let mut color = recipe.color_start;
        for (channel, end) in color.iter_mut().zip(birth.color_end) {
            *channel = if age >= life { end } else { *channel + (end - *channel) * lived };
        }
        let grown = birth.size * power(recipe.size_factor, age);
        ParticleAppearance { color, size: min(grown, SIZE_MAX) }
    }

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
    fn emitter_state(&self, io: &mut impl StateIo) -> Vec<Emitter> {
        io.subject(Subject::WORLD);
        io.bits("emitters", self.emitters.len() as u32);
        let limits = [EMITTERS_RUNNING_MAX, EMITTER_BYTES];
        let (given, blank) = (self.emitters.iter().cloned(), Emitter::blank());
        io.list("number of emitters", limits, given, blank, |io, index, emitter| {
            io.subject(Subject::Numbered("emitter", index));
            emitter.state(self.recipes.len(), io)
        })
    }

    /// All particles, one by one.
    fn rows(&self) -> impl ExactSizeIterator<Item = Particle> {
        let moves = self.position.iter().zip(&self.velocity);
        let ages = self.age.iter().zip(&self.life);
        let kinds = self.seed.iter().zip(&self.recipe);
        moves.zip(ages).zip(kinds).map(
            |(((&position, &velocity), (&age, &life)), (&seed, &recipe))| Particle {
                position,
                velocity,
                age,
                life,
                seed,
                recipe,
            },
        )
    }

    /// Fills an empty set with emitters and particles.
    pub(crate) fn fill(&mut self, emitters: Vec<Emitter>, particles: &[Particle]) {
        self.emitters = emitters;
        particles.iter().for_each(|particle| self.push(particle));
    }

    fn push(&mut self, particle: &Particle) {
        self.position.push(particle.position);
        self.velocity.push(particle.velocity);
        self.age.push(particle.age);
        self.life.push(particle.life);
        self.seed.push(particle.seed);
        self.recipe.push(particle.recipe);
    }

    /// Digest of the raw bits of all particles and emitters, used to compare both ends of a stream.
    pub fn digest(&self) -> u64 {
        let mut hasher = StateHasher::default();
        self.state(&mut hasher);
        hasher.finish()
    }
}

/// Properties of one particle, drawn from a recipe and a seed.
struct Birth {
    life: u16,
    velocity: Vec2,
    size: f32,
    color_end: [f32; 4],
}

impl Birth {
    fn draw(recipe: &Recipe, seed: u32) -> Birth {
        let mut rng = Rng::new(u64::from(seed), 1);
        let [life_low, life_high] = recipe.life_ticks;
        let [slow, fast] = recipe.velocity;
        let [dim, bright] = recipe.color_end;
        let life = life_low + rng.below(u32::from(life_high - life_low) + 1) as u16;
        let share = Vec2::new(rng.unit(), rng.unit());
        let share = if recipe.round { into_disc(share) } else { share };
        let velocity = slow + (fast - slow) * share;
        let size = rng.range(recipe.size[0], recipe.size[1]);
        let color_end = std::array::from_fn(|channel| rng.range(dim[channel], bright[channel]));
        Birth { life, velocity, size, color_end }
    }
}

/// Maps a point in the unit square into the inscribed disc. Each line of the square becomes an arc
/// of an ellipse.
fn into_disc(point: Vec2) -> Vec2 {
    let from_middle = point * 2.0 - Vec2::ONE;
    let (x, y) = (from_middle.x, from_middle.y);
    let bent = Vec2::new(x * (1.0 - y * y * 0.5).sqrt(), y * (1.0 - x * x * 0.5).sqrt());
    bent * 0.5 + Vec2::splat(0.5)
}

/// `base` raised to an integer power by repeated squaring, the same bits on every target.
fn power(base: f32, mut exponent: u16) -> f32 {
    let (mut result, mut square) = (1.0, base);
    while exponent > 0 {
        if exponent & 1 == 1 {
            result *= square;
        }
        square *= square;
        exponent >>= 1;
    }
    result
}

#[cfg(test)]
mod tests;
