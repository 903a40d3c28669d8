//! Rules in a scene file: rounds and teams, zones, signals, and what happens at their edges.

mod condition;
mod known;
mod names;
mod round;
mod rule;
mod rule_set;
mod say;
mod signal;
mod zone;

pub use condition::{Condition, Levels};
pub(super) use known::{Known, SECONDS, ticks};
pub use known::{POINTS_MAX, SIGNALS_MAX, TEAMS_MAX, ZONES_MAX};
pub(super) use names::Names;
pub(super) use round::lane;
pub use round::{AtTime, LaneAxis, RoundSpec, TeamSpec};
pub use rule::{Effects, Occasion, RuleSpec, To};
pub use rule_set::RuleSet;
pub use say::{Line, Whose};
pub use signal::{Each, OrderSpec, RelaySpec, SignalKind, SignalSpec, Stays, Step};
pub use zone::{Need, Take, ZoneArea, ZoneSpec};
