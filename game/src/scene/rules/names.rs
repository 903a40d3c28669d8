//! The names that rules use. Teams, zones, signals and bodies share one namespace.

use super::condition::{Condition, Levels};
use crate::scene::groups::Groups;
use crate::scene::limits::{NAME_ALLOWED, is_name};
use crate::scene::table::{Field, Table, one_of};

/// Maximum length of a sentence shown by a scene, characters.
pub(super) const SENTENCE_CHARS_MAX: usize = 80;
/// Number of colours in the players' palette.
pub(super) const COLORS: u32 = 8;
/// Greatest absolute value of a side's points.
pub const POINTS_MAX: i32 = 1_000_000;
/// Words that are reserved in rules.
const RESERVED: [&str; 4] = ["it", "by", "others", "all"];
/// Names of the sling's levels.
const SLING_LEVELS: [(&str, Levels); 2] =
    [("sling.spent", Levels::SPENT), ("sling.flying", Levels::FLYING)];
/// Maximum number of names in a condition.
const CONDITION_NAMES_MAX: usize = 8;

/// Everything that rules may name.
pub(in crate::scene) struct RuleNames<'a> {
    pub names: &'a Names,
    pub groups: &'a Groups,
}

/// Names in file order. The names of signals are known before the signals themselves are read.
pub(in crate::scene) struct Names {
    pub teams: Vec<String>,
    pub zones: Vec<String>,
    pub signals: Vec<String>,
    bodies: Vec<Option<String>>,
    has_sling: bool,
}

impl Names {
    /// Reads only the names, refusing duplicates.
    pub fn read(root: &Table) -> Names {
        let mut known: Vec<String> = RESERVED.map(str::to_owned).to_vec();
        let mut names_of = |list: &'static str| -> Vec<String> {
            let field = root.get(list);
            let entries = if field.is_given() { field.items() } else { Vec::new() };
            let names = entries.iter().map(|entry| {
                let field = entry.inner("name");
                let name = field.word().unwrap_or_default().to_owned();
                if !is_name(&name) {
                    field.refuse(NAME_ALLOWED);
                } else if known.contains(&name) {
                    field.refuse("a name that nothing else has");
                }
                known.push(name.clone());
                name
            });
            names.collect()
        };
        let (teams, zones, signals) = (names_of("teams"), names_of("zones"), names_of("signals"));
        let field = root.get("bodies");
        let fields = if field.is_given() { field.items() } else { Vec::new() };
        let has_any = !(teams.is_empty() && zones.is_empty() && signals.is_empty());
        let bodies = fields.iter().map(|body| {
            let field = body.inner("name");
            let name = field.word().map(str::to_owned).filter(|_| body.has("name"));
            if has_any && name.as_ref().is_some_and(|name| known.contains(name)) {
                field.refuse("a name that nothing else has");
            }
            name
        });
        let bodies = bodies.collect();
        Names { teams, zones, signals, bodies, has_sling: root.get("sling").is_given() }
    }

    /// Reads a condition: a name, "!name", or a list of these. Only signals before index `above` are known.
    pub fn condition(&self, field: &Field, above: usize) -> Condition {
        field.describe("a condition");
        let mut condition = Condition::default();
        for word in field.one_or_more(CONDITION_NAMES_MAX) {
            let Some(text) = word.word() else {
                word.refuse(self.allowed(above));
                continue;
            };
            let (name, wanted) = match text.strip_prefix('!') {
                Some(name) => (name, &mut condition.off),
                None => (text, &mut condition.on),
            };
            match self.level(name, above) {
                Some(level) => *wanted = wanted.or(level),
                None => word.refuse(self.allowed(above)),
            }
        }
        condition
    }

    /// Reads a condition like [`Names::condition`], with every signal known.
    pub fn any_condition(&self, field: &Field) -> Condition {
        self.condition(field, self.signals.len())
    }

    fn level(&self, name: &str, above: usize) -> Option<Levels> {
        let place = |names: &[String]| names.iter().position(|known| known == name);
        if let Some(team) = name.strip_suffix(".in") {
            return self.teams.iter().position(|known| known == team).map(Levels::team);
        }
        let of_sling = SLING_LEVELS.iter().find(|(known, _)| *known == name);
        if let Some((_, level)) = of_sling.filter(|_| self.has_sling) {
            return Some(*level);
        }
        let signal = || place(self.signals_above(above)).map(Levels::signal);
        place(&self.zones).map(Levels::zone).or_else(signal)
    }

    /// The names of the first `above` signals.
    pub fn signals_above(&self, above: usize) -> &[String] {
        &self.signals[..above.min(self.signals.len())]
    }

    /// The names that a condition may use, for an error message.
    pub fn allowed(&self, above: usize) -> String {
        let mut names: Vec<String> = self.zones.clone();
        names.extend_from_slice(self.signals_above(above));
        names.extend(self.teams.iter().map(|team| format!("{team}.in")));
        if self.has_sling {
            names.extend(SLING_LEVELS.map(|(name, _)| name.to_owned()));
        }
        let which =
            if above < self.signals.len() { "zones, and signals above it" } else { "levels" };
        format!("{which}: {}; ! before a name for not", names.join(", "))
    }

    /// Index of the body named by a field.
    pub fn body(&self, field: &Field) -> Option<usize> {
        field.describe("the `name` of a body");
        let is_it = |name: &Option<String>| name.is_some() && name.as_deref() == field.word();
        let index = self.bodies.iter().position(is_it);
        if index.is_none() {
            field.refuse(one_of(self.bodies.iter().flatten()));
        }
        index
    }

    /// The zones named by a field, one bit each.
    pub fn zones(&self, field: &Field) -> u64 {
        field.describe("a zone, or a list of 1 to 8");
        let words = field.one_or_more(CONDITION_NAMES_MAX);
        let bits = words.iter().filter_map(|word| word.index_in(&self.zones));
        bits.fold(0, |all, index| all | 1 << index)
    }
}

/// The name of a team, a zone or a signal, which [`Names::read`] has checked.
pub(super) fn name(table: &Table) -> String {
    let field = table.need("name", NAME_ALLOWED);
    field.word().unwrap_or_default().to_owned()
}
