//! The rules of a scene while they are played: rounds, zones, signals, and what happens at their edges.
//!
//! At the start of a tick the levels of the last one act: bodies come and go, paths run or stand. After the
//! step one pass goes over zones, signals, rules and the verdict, in the order of the file. What a rule
//! changes, zones and signals see in the next tick, so nothing cascades. `docs/scenes.md` has the exact
//! semantics.

mod book;
mod breakage;
mod clock;
mod effects;
mod info;
mod notes;
mod signals;
mod sling;
mod state;
mod table;
mod verdict;
mod zones;

pub(crate) use book::Rules;
pub use clock::RoundPhase;
pub use info::{OrderProgress, RoundInfo, RoundPlayer, SideInfo, SlingInfo, Taking};
pub use sling::sling_path;
pub(crate) use table::Table;
