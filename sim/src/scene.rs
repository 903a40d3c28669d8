//! Scenes: what a TOML file describes, checked and ready to be played.
//!
//! `docs/scenes.md` is the reference of the file format. A scene that parsed can be played: every
//! number is finite and in its range, every name is resolved, everything placed has room.

mod actors;
mod bodies;
mod compile;
mod document;
mod forces;
mod groups;
mod kind;
mod path;
mod plan;
mod recipes;
mod solver;
mod tools;

#[cfg(test)]
mod tests;

pub use actors::{HeroSpec, MinionSpec, PackSpec, Place, Repeater};
pub use bodies::{Layout, Placed};
pub use forces::PlacedSpring;
pub use kind::Kind;
pub use path::Path;
pub use plan::{Bodies, Part, Per, Plan, Verdict};
pub use recipes::{RECIPES_MAX, presets};
pub use tools::Tools;

use crate::forces::ForceSettings;
use crate::particle::{EmitterDef, Recipe};
use crate::shape::Aabb;
use crate::solver::Solver;
use crate::world::{BodyDef, GROUPS_MAX, WorldSettings};
use document::{Document, Table};
use glam::Vec2;

/// Longest scene file, bytes.
pub const SCENE_BYTES_MAX: usize = 64 << 10;
/// Longest name of a scene, bytes.
pub const SCENE_NAME_BYTES_MAX: usize = 32;
/// Players in one game.
pub const SEATS_MAX: usize = 512;
/// Players in one game whose camera follows them: each is sent something else, which costs a server more.
pub const FOLLOWERS_MAX: u32 = 64;
/// Width and height of a world or a body, world units.
pub const SIZE_MAX: f32 = 1.0e6;
/// Least width, height or radius of a body, world units.
pub const EXTENT_MIN: f32 = 1.0e-3;
/// Least and greatest mass of a body.
pub const MASS_MIN: f32 = 1.0e-6;
/// See [`MASS_MIN`].
pub const MASS_MAX: f32 = 1.0e6;
/// Speed of anything, units/s.
pub const SPEED_MAX: f32 = 1.0e4;
/// Each component of gravity, units/s^2, and of the wind, units/s.
pub const GRAVITY_MAX: f32 = 1000.0;
/// See [`GRAVITY_MAX`].
pub const WIND_MAX: f32 = 1000.0;
/// Least quantum of positions, world units.
pub const QUANTUM_MIN: f32 = 1.0 / 65_536.0;
/// Coordinates that clients see, quanta, either sign: as whole numbers of an f32 they are exact.
pub const QUANTA_MAX: i32 = 1 << 24;
/// Bodies that a scene may allow at a time.
pub const BODIES_MAX: u32 = 20_000;
/// Particles that a scene may allow at a time.
pub const PARTICLES_MAX: u32 = 20_000;
/// Dye packs of one player that a scene may allow at a time.
pub const PACKS_MAX: u32 = 64;
/// Bodies of one layout.
pub const LAYOUT_COUNT_MAX: u32 = 4096;
/// Entries of `springs`.
pub const SPRINGS_MAX: usize = 1024;
/// Entries of `emitters`.
pub const EMITTERS_MAX: usize = 256;

const NAME_ALLOWED: &str = "1 to 32 lower-case letters, digits and dashes";

/// How the camera frames the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Camera {
    /// The whole world fits the view.
    Fit,
    /// The view follows the own hero and is this many world units high.
    Follow {
        /// Height of the view, world units.
        height: f32,
    },
}

/// A checked scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name: the file's stem, the word in links; lower case, digits and dashes.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// One sentence for the lobby.
    pub about: String,
    /// The TOML text that it was made from.
    pub source: String,
    /// The world spans (0, 0) to this, world units.
    pub size: Vec2,
    /// Gravity, units/s^2.
    pub gravity: Vec2,
    /// Velocity of the air, units/s; only bodies with drag feel it.
    pub wind: Vec2,
    /// What solves the contacts; `None` where they are only detected.
    pub solver: Option<Solver>,
    /// Whether bodies at rest fall asleep.
    pub sleeping: bool,
    /// Names of the collision groups, at most [`GROUPS_MAX`].
    pub groups: Vec<String>,
    /// For each group the set of groups that it meets.
    pub meets: [u32; GROUPS_MAX],
    /// Groups that particles are pushed out of.
    pub meets_particles: u32,
    /// What players may do.
    pub tools: Tools,
    /// How the camera frames the world.
    pub camera: Camera,
    /// Bodies outside are removed.
    pub kill_zone: Aabb,
    /// World units a quantum of the positions that clients see; a power of two.
    pub quantum: f32,
    /// Speed cap of every body, units/s.
    pub speed_max: f32,
    /// Closing speed above which a contact is reported, units/s.
    pub impact_speed: f32,
    /// Players at a time.
    pub players_max: u16,
    /// Bodies at a time.
    pub bodies_max: usize,
    /// Particles at a time.
    pub particles_max: usize,
    /// Dumb minions at a time, beyond which Z makes no more.
    pub dumb_max: usize,
    /// Dye packs of one player at a time.
    pub packs_max: usize,
    /// Particle recipes.
    pub recipes: Vec<Recipe>,
    /// Recipe of the particles that Z sprays, with the spray tool.
    pub spray: Option<u8>,
    /// Bodies at fixed places.
    pub bodies: Vec<Placed>,
    /// Bodies at places that the seed decides.
    pub layouts: Vec<Layout>,
    /// Springs between bodies at fixed places.
    pub springs: Vec<PlacedSpring>,
    /// Emitters that run by themselves.
    pub emitters: Vec<Repeater>,
    /// The players' heroes; `None` where players have none.
    pub hero: Option<HeroSpec>,
    /// How minions wander.
    pub minion: MinionSpec,
    /// The body of a dumb minion that Z makes, with that tool.
    pub dumb: Option<BodyDef>,
    /// Speed at which dumb minions set off to either side, units/s.
    pub dumb_speed: f32,
    /// Dye packs, with the launch tool.
    pub pack: Option<PackSpec>,
}

/// Why a scene was refused. Displays as `file:line: field: found ..., allowed ...`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {field}: found {found}; allowed: {allowed}")]
pub struct SceneError {
    /// File, or the name given by the caller.
    pub file: String,
    /// Line of the field, from 1.
    pub line: usize,
    /// Path of the field, like `bodies[3].radius`.
    pub field: String,
    /// What the file says.
    pub found: String,
    /// What it may say.
    pub allowed: String,
}

impl Scene {
    /// Parses and checks a scene. `file` is used in errors, and its stem is the scene's name.
    pub fn parse(file: &str, source: &str) -> Result<Scene, SceneError> {
        let document = Document { file, source };
        let name = name_of(&document)?;
        if source.len() > SCENE_BYTES_MAX {
            let found = format!("{} bytes", source.len());
            return Err(document.error(0, "file", found, format!("at most {SCENE_BYTES_MAX}")));
        }
        let entries = toml::de::DeTable::parse(source).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            let found = error.message().lines().next().unwrap_or("an error").to_owned();
            document.error(at, "file", found, "TOML".to_owned())
        })?;
        let root = Table::root(document, entries.get_ref(), compile::FIELDS)?;
        compile::scene(name, source, &root)
    }

    /// The emitter that one of the scene's starts with the seed of this time; `None` if there is none of
    /// this number, or if it follows a body.
    pub fn emitter(&self, index: u8, seed: u32) -> Option<EmitterDef> {
        let repeater = self.emitters.get(usize::from(index))?;
        match repeater.place {
            Place::Point(point) => Some(repeater.at(point, seed)),
            Place::Body(_) => None,
        }
    }

    /// The scenes that Jostle ships, embedded from `assets/scenes`, `arena` first.
    pub fn built_in() -> Vec<Scene> {
        let files = BUILT_IN.iter();
        files
            .map(|(file, source)| Scene::parse(file, source).expect("a test parses every one"))
            .collect()
    }

    /// The settings of a World for this scene.
    pub fn world_settings(&self) -> WorldSettings {
        WorldSettings {
            dt: crate::DT,
            gravity: self.gravity,
            forces: self.forces(),
            solver: self.solver,
            sleeping: self.sleeping,
            meets: self.meets,
            meets_particles: self.meets_particles,
            kill_zone: self.kill_zone,
            quantum: self.quantum,
            speed_max: self.speed_max,
            bodies_max: self.bodies_max,
            particles_max: self.particles_max,
            recipes: self.recipes.clone(),
            features: Plan::of(self).features,
        }
    }

    /// Drag, wind and springs, where a body of the scene feels any.
    pub fn forces(&self) -> Option<ForceSettings> {
        let settings = ForceSettings { wind: self.wind, springs_max: self.springs.len() };
        let any = !self.springs.is_empty() || forces::defs_with_drag(self);
        any.then_some(settings)
    }

    /// Whether bodies of the two groups collide.
    pub fn groups_meet(&self, a: u8, b: u8) -> bool {
        self.meets[usize::from(a)] >> b & 1 == 1
    }
}

/// File and text of every shipped scene.
const BUILT_IN: [(&str, &str); 6] = [
    ("arena.toml", include_str!("../../assets/scenes/arena.toml")),
    ("bounds.toml", include_str!("../../assets/scenes/bounds.toml")),
    ("impulse.toml", include_str!("../../assets/scenes/impulse.toml")),
    ("particles.toml", include_str!("../../assets/scenes/particles.toml")),
    ("emitters.toml", include_str!("../../assets/scenes/emitters.toml")),
    ("pile.toml", include_str!("../../assets/scenes/pile.toml")),
];

fn name_of(document: &Document) -> Result<String, SceneError> {
    let stem = std::path::Path::new(document.file).file_stem().and_then(|stem| stem.to_str());
    let stem = stem.unwrap_or_default();
    if is_name(stem) {
        return Ok(stem.to_owned());
    }
    Err(document.error(0, "file name", format!("{stem:?}"), NAME_ALLOWED.to_owned()))
}

fn is_name(text: &str) -> bool {
    let known = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    (1..=SCENE_NAME_BYTES_MAX).contains(&text.len()) && text.bytes().all(known)
}
