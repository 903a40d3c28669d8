//! Scenes: what a TOML file describes, checked and ready to be played.

use crate::particle::Recipe;
use crate::relaxation::Relaxation;
use crate::shape::{Aabb, Shape};
use crate::world::GROUPS_MAX;
use glam::Vec2;

/// What players may do in a scene, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Tools(pub u16);

impl Tools {
    /// WASD steers an own hero.
    pub const STEER: Tools = Tools(1 << 0);
    /// A click launches a dye pack at the pointer.
    pub const LAUNCH: Tools = Tools(1 << 1);
    /// Z drops a dumb minion at the pointer, one a tick.
    pub const DUMB: Tools = Tools(1 << 2);
    /// Z sprays one particle a tick at the pointer.
    pub const SPRAY: Tools = Tools(1 << 3);
    /// X holds the dumb minion or block under the pointer.
    pub const HOLD: Tools = Tools(1 << 4);
    /// C throws all dumb minions about.
    pub const AGITATE: Tools = Tools(1 << 5);
    /// V removes all dumb minions.
    pub const CLEAR: Tools = Tools(1 << 6);
    /// H, M and P select the hero, minion and platform; the left button drags the selected one.
    pub const SELECT: Tools = Tools(1 << 7);

    /// Whether all of `other` are allowed.
    pub fn contains(self, other: Tools) -> bool {
        self.0 & other.0 == other.0
    }
}

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
    /// Solver settings; `None` where contacts are only detected.
    pub relaxation: Option<Relaxation>,
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
    /// Players at a time.
    pub players_max: u8,
    /// Bodies at a time.
    pub bodies_max: usize,
    /// Particles at a time.
    pub particles_max: usize,
    /// Particle recipes.
    pub recipes: Vec<Recipe>,
    /// The owner of this module adds bodies, layouts, emitters and actors.
    pub placeholder: Option<Shape>,
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
        let _ = (file, source);
        todo!()
    }

    /// The scenes that Jostle ships, embedded from `assets/scenes`, `arena` first.
    pub fn built_in() -> Vec<Scene> {
        todo!()
    }
}
