//! A scene's rules during play: rounds, zones, signals, and the effects of their edges.
//!
//! At the start of a tick, the levels of the previous tick take effect: bodies come and go, and paths run or stop.
//! After the step, a single pass evaluates zones, signals, rules and the verdict, in file order. Zones and signals
//! do not see the changes made by a rule until the next tick, so nothing cascades. The exact semantics are in
//! `docs/scenes.md`.

mod body_notes;
mod breakage;
mod clock;
mod context;
mod core;
mod effects;
mod info;
mod signals;
mod sling;
mod state;
mod verdict;
mod zones;

pub use clock::RoundPhase;
pub(crate) use context::RuleContext;
pub(crate) use core::Rules;
pub use info::{OrderProgress, RoundInfo, RoundPlayer, SideInfo, SlingInfo, Taking};
pub use sling::sling_path;
