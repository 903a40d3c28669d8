//! The rules of a scene file.

use super::known::{Known, RULES_MAX, SIGNALS_MAX, TEAMS_MAX, ZONES_MAX};
use super::round::{self, RoundSpec, TeamSpec};
use super::rule::{self, RuleSpec, RuleSurroundings};
use super::signal::{self, SignalSpec};
use super::zone::{self, ZoneSpec};
use crate::scene::recipes::Recipes;
use crate::scene::table::{Table, read_list};

/// The rules of a scene, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RuleSet {
    /// How a round is played; `None` in a playground without end.
    pub round: Option<RoundSpec>,
    /// Teams; without any each player plays alone.
    pub teams: Vec<TeamSpec>,
    /// Places that know who is in them.
    pub zones: Vec<ZoneSpec>,
    /// Levels, yes or no.
    pub signals: Vec<SignalSpec>,
    /// Rules, in the order of the file.
    pub rules: Vec<RuleSpec>,
}

impl RuleSet {
    /// Reads the rules of a scene whose bodies have been read.
    pub(in crate::scene) fn read(root: &Table, known: &Known, recipes: &mut Recipes) -> RuleSet {
        let field = root.get("round");
        let team = |table: &Table| round::team(table, known.names);
        let zone = |table: &Table| zone::zone(table, known);
        let mut above = 0;
        let signal = |table: &Table| {
            above += 1;
            signal::signal(table, known.names, above - 1)
        };
        let rules = RuleSet {
            round: field.is_given().then(|| field.table(round::round)),
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

    /// Returns whether the scene has none at all.
    pub fn is_empty(&self) -> bool {
        self.round.is_none()
            && self.teams.is_empty()
            && self.zones.is_empty()
            && self.signals.is_empty()
            && self.rules.is_empty()
    }

    /// Lives of each side at the start of a round, if lives count.
    pub fn lives(&self) -> Option<i32> {
        self.round.as_ref()?.lives
    }
}
