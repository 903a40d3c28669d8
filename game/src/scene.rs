//! Scenes: described by TOML files, checked and ready to be played.
//!
//! `docs/scenes.md` is the reference of the file format. A scene that parsed can be played: every
//! number is finite and in its range, every name is resolved, everything placed has room.

mod actors;
mod bodies;
mod budget;
mod checks;
mod cost;
mod drag;
mod error;
mod field;
mod groups;
mod kind;
mod launchers;
mod limits;
mod locate;
mod marks;
mod name;
mod parse;
mod path;
mod plan;
mod recipes;
mod rules;
mod sling;
mod solver;
mod spec;
mod springs;
mod table;
mod texts;
mod tools;
mod traits;

#[cfg(test)]
mod tests;

pub use budget::{Budget, SolverBudget};
pub use cost::{WorstTick, made_max};
pub use error::{SceneError, line_at};
pub use field::{FieldForm, FieldInfo};
pub use kind::Kind;
pub use launchers::LAUNCHERS_MAX;
pub use limits::*;
pub use marks::MARKS_MAX;
pub use name::is_name;
#[cfg(test)]
pub(crate) use parse::BUILT_IN;
pub use path::Path;
pub use plan::{Bodies, Part, Per, Plan};
pub use recipes::presets;
pub use rules::{
    AtTime, Condition, Each, Effects, LaneAxis, Levels, Line, Need, Occasion, OrderSpec,
    POINTS_MAX, RelaySpec, RoundSpec, RuleSet, RuleSpec, SIGNALS_MAX, SignalKind, SignalSpec,
    Stays, Step, TEAMS_MAX, Take, TeamSpec, To, Whose, ZONES_MAX, ZoneArea, ZoneSpec,
};
pub use spec::{
    Breakable, Camera, Category, HeroSpec, Launcher, Layout, Location, MarbleSpec, Mark, PackSpec,
    Placed, PlacedSpring, Scene, ScheduledEmitter, SlingSpec, WalkSpec,
};
pub use tools::Tools;
