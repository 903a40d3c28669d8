//! Scenes, which are described by TOML files, checked, and ready to be played.
//!
//! `docs/scenes.md` is the reference for the file format. A scene that was parsed successfully can be played:
//! every number is finite and within its range, every name is resolved, and there is room for everything that it
//! places.

mod actors;
mod bodies;
mod budget;
mod checks;
mod cost;
mod decimal;
mod error;
mod field;
mod groups;
mod kind;
mod limits;
mod marks;
mod path;
mod plan;
mod recipes;
mod rules;
mod sling;
mod solver;
mod sources;
mod spec;
mod springs;
mod table;
mod theme;
mod tools;
mod traits;

#[cfg(test)]
mod tests;

pub use actors::{HeroSpec, MarbleSpec, PackSpec, WalkSpec};
pub use bodies::{Breakable, Layout, Placed};
pub use budget::{Budget, SolverBudget};
pub use cost::{WorstTick, made_max};
pub use decimal::parse_decimal;
pub use error::{SceneError, line_at};
pub use field::{FieldForm, FieldInfo};
pub use kind::Kind;
pub use limits::*;
pub use marks::{MARKS_MAX, Mark};
pub use path::Path;
pub use plan::{Bodies, Part, Per, Plan};
pub use recipes::presets;
pub use rules::{
    AtTime, Condition, Each, Effects, LaneAxis, Levels, Line, Need, OrderSpec, POINTS_MAX,
    RelaySpec, RoundSpec, RuleSet, RuleSpec, SIGNALS_MAX, SignalKind, SignalSpec, Stays, Step,
    TEAMS_MAX, Take, TeamSpec, To, Trigger, Whose, ZONES_MAX, ZoneArea, ZoneSpec,
};
pub use sling::SlingSpec;
pub use sources::{LAUNCHERS_MAX, Launcher, Location, ScheduledEmitter};
pub use spec::{Camera, Category, Scene};
pub use springs::PlacedSpring;
use table::Document;
pub use theme::Theme;
pub use tools::Tools;

/// Name and text of every built-in scene file.
pub(crate) const BUILT_IN: [(&str, &str); 24] = [
    ("arena.toml", include_str!("../../assets/scenes/arena.toml")),
    ("splash.toml", include_str!("../../assets/scenes/splash.toml")),
    ("hockey.toml", include_str!("../../assets/scenes/hockey.toml")),
    ("hill.toml", include_str!("../../assets/scenes/hill.toml")),
    ("race.toml", include_str!("../../assets/scenes/race.toml")),
    ("pong.toml", include_str!("../../assets/scenes/pong.toml")),
    ("flags.toml", include_str!("../../assets/scenes/flags.toml")),
    ("herd.toml", include_str!("../../assets/scenes/herd.toml")),
    ("roundup.toml", include_str!("../../assets/scenes/roundup.toml")),
    ("lock.toml", include_str!("../../assets/scenes/lock.toml")),
    ("lamp.toml", include_str!("../../assets/scenes/lamp.toml")),
    ("slingshot.toml", include_str!("../../assets/scenes/slingshot.toml")),
    ("tower.toml", include_str!("../../assets/scenes/tower.toml")),
    ("bridge.toml", include_str!("../../assets/scenes/bridge.toml")),
    ("hall.toml", include_str!("../../assets/scenes/hall.toml")),
    ("bounds.toml", include_str!("../../assets/scenes/bounds.toml")),
    ("bounce.toml", include_str!("../../assets/scenes/bounce.toml")),
    ("planets.toml", include_str!("../../assets/scenes/planets.toml")),
    ("euler.toml", include_str!("../../assets/scenes/euler.toml")),
    ("listing.toml", include_str!("../../assets/scenes/listing.toml")),
    ("impulse.toml", include_str!("../../assets/scenes/impulse.toml")),
    ("particles.toml", include_str!("../../assets/scenes/particles.toml")),
    ("emitters.toml", include_str!("../../assets/scenes/emitters.toml")),
    ("pile.toml", include_str!("../../assets/scenes/pile.toml")),
];

impl Scene {
    /// Parses and checks a scene. `file` appears in errors, and its stem becomes the scene's name.
    pub fn parse(file: &str, source: &str) -> Result<Scene, SceneError> {
        let document = Document::new(file, source);
        let name = name_of(&document)?;
        if source.len() > SCENE_BYTES_MAX {
            let found = format!("{} bytes", source.len());
            return Err(document.error(0, "file", found, format!("at most {SCENE_BYTES_MAX}")));
        }
        let entries = toml::de::DeTable::parse(source).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            let found = error.message().lines().next().unwrap_or("an error").to_owned();
            let found = format!("a line that is not TOML ({found})");
            document.error(at, "file", found, "TOML".to_owned())
        })?;
        let root = document.root(entries.get_ref());
        let scene = document.checked(root.read(|root| spec::read(name, source, root)))?;
        checks::check(&root, &scene);
        document.checked(scene)
    }

    /// The fields that a file has or may have, insofar as it can be read. Errors in the scene are ignored, except
    /// for invalid TOML.
    pub fn fields(source: &str) -> Vec<FieldInfo> {
        let document = Document::noting("fields.toml", source);
        if let Ok(entries) = toml::de::DeTable::parse(source) {
            let root = document.root(entries.get_ref());
            root.read(|root| spec::read(String::new(), source, root));
        }
        document.into_asked()
    }

    /// The scenes shipped with Jostle, embedded from `assets/scenes`; `arena` comes first.
    pub fn built_in() -> Vec<Scene> {
        let parse = |(file, source)| Scene::parse(file, source).expect("a test parses every one");
        BUILT_IN.into_iter().map(parse).collect()
    }
}

fn name_of(document: &Document) -> Result<String, SceneError> {
    let stem = std::path::Path::new(document.file).file_stem().and_then(|stem| stem.to_str());
    let stem = stem.unwrap_or_default();
    if is_name(stem) {
        return Ok(stem.to_owned());
    }
    Err(document.error(0, "file name", format!("{stem:?}"), NAME_ALLOWED.to_owned()))
}
