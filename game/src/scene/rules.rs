//! Rules in a scene file: rounds and teams, zones, signals, and the effects of their edges.

mod condition;
mod names;
mod round;
mod rule;
mod signal;
mod zone;

use super::recipes::Recipes;
use super::table::{Table, read_list};
pub use condition::{Condition, Levels};
pub use names::POINTS_MAX;
pub(super) use names::{Names, RuleNames};
pub(super) use round::lane;
pub use round::{AtTime, LaneAxis, RoundSpec, TeamSpec};
use rule::RuleSurroundings;
pub use rule::{Effects, Line, RuleSpec, To, Trigger, Whose};
pub use signal::{Each, OrderSpec, RelaySpec, SignalKind, SignalSpec, Stays, Step};
pub use zone::{Need, Take, ZoneArea, ZoneSpec};

/// Maximum number of teams in a scene.
pub const TEAMS_MAX: usize = 8;
/// Maximum number of zones in a scene. Each takes one bit of a word.
pub const ZONES_MAX: usize = 64;
/// Maximum number of signals in a scene. Each takes one bit of a word.
pub const SIGNALS_MAX: usize = 64;
/// Maximum number of rules in a scene.
const RULES_MAX: usize = 128;

/// The rules of a scene, in file order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RuleSet {
    /// Settings of a round; `None` in an endless playground.
    pub round: Option<RoundSpec>,
    /// Teams; if there are none, each player plays alone.
    pub teams: Vec<TeamSpec>,
    /// Zones, which are places that detect the bodies inside them.
    pub zones: Vec<ZoneSpec>,
    /// Signals: levels that are either on or off.
    pub signals: Vec<SignalSpec>,
    /// Rules, in file order.
    pub rules: Vec<RuleSpec>,
}

impl RuleSet {
    /// Reads the rules of a scene, whose bodies must already have been read.
    pub(super) fn read(root: &Table, known: &RuleNames, recipes: &mut Recipes) -> RuleSet {
        let team = |table: &Table| round::team(table, known.names);
        let zone = |table: &Table| zone::zone(table, known);
        let mut above = 0;
        let signal = |table: &Table| {
            above += 1;
            signal::signal(table, known.names, above - 1)
        };
        let rules = RuleSet {
            round: root.get("round").given(|field| field.table(round::round)),
            teams: read_list(root, "teams", TEAMS_MAX, team),
            zones: read_list(root, "zones", ZONES_MAX, zone),
            signals: read_list(root, "signals", SIGNALS_MAX, signal),
            rules: Vec::new(),
        };
        let around = RuleSurroundings {
            has_round: rules.round.is_some(),
            zones: &rules.zones,
            signals: &rules.signals,
        };
        let rule = |table: &Table| rule::rule(table, known, &around, recipes);
        RuleSet { rules: read_list(root, "rules", RULES_MAX, rule), ..rules }
    }

    /// Returns whether the scene has no rules at all.
    pub fn is_empty(&self) -> bool {
        self.round.is_none()
            && self.teams.is_empty()
            && self.zones.is_empty()
            && self.signals.is_empty()
            && self.rules.is_empty()
    }

    /// Number of lives that each side has at the start of a round, if lives count.
    pub fn lives(&self) -> Option<i32> {
        self.round.as_ref()?.lives
    }
}
