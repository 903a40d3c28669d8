//! Signals in a scene file.

use super::condition::Condition;
use super::known::{SECONDS, ticks};
use super::names::Names;
use crate::scene::table::{Field, Table, one_of};

const STEPS: std::ops::RangeInclusive<usize> = 2..=16;

/// A yes or no made of zones and of signals above it.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalSpec {
    /// Name, unique among the signals.
    pub name: String,
    /// Source of its level: other levels, or steps in an order.
    pub kind: SignalKind,
    /// It is off while this holds, and forgets what it counted. A condition that asks for nothing never
    /// holds here.
    pub until: Option<Condition>,
}

impl SignalSpec {
    /// The order, if it is one.
    pub fn order(&self) -> Option<&OrderSpec> {
        match &self.kind {
            SignalKind::Order(order) => Some(order),
            SignalKind::Relay(_) => None,
        }
    }
}

/// What makes a signal.
#[derive(Clone, Debug, PartialEq)]
pub enum SignalKind {
    /// A function of the levels of others.
    Relay(RelaySpec),
    /// Steps in an order.
    Order(OrderSpec),
}

/// A signal that levels make.
#[derive(Clone, Debug, PartialEq)]
pub struct RelaySpec {
    /// All of these hold.
    pub when: Condition,
    /// And any of these, if it is given.
    pub any: Option<Condition>,
    /// Ticks for which they must have held.
    pub after: u32,
    /// How long it stays on once they no longer do.
    pub stays: Stays,
    /// Whether it changes over each time it would come on.
    pub toggles: bool,
}

/// How long a signal stays on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stays {
    /// For a number of ticks.
    Ticks(u32),
    /// To the end of the round.
    Ever,
}

/// A signal that steps in an order make.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderSpec {
    /// 2 to 16 of them.
    pub steps: Vec<Step>,
    /// The sides that make progress, each its own or all together.
    pub each: Each,
    /// Whether another step of the list throws back to the start.
    pub strict: bool,
}

/// One step of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Somebody enters the zone with this number.
    Zone(u8),
    /// The signal with this number comes on.
    Signal(u8),
}

/// Who makes progress in an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Each {
    /// All together; complete, it stays on.
    All,
    /// Each side; complete, it is on for a tick and starts over.
    Side,
    /// Each player, likewise.
    Player,
}

/// Reads one entry of `signals`, which has `above` others above it.
pub(super) fn signal(table: &Table, names: &Names, above: usize) -> SignalSpec {
    let name = table.get("name").word().unwrap_or_default().to_owned();
    let order = table.get("order");
    let until = table.get("until");
    let kind = match order.is_given() {
        true => SignalKind::Order(read_order(table, names, above)),
        false => SignalKind::Relay(read_relay(table, names, above)),
    };
    let until = until.is_given().then(|| names.condition(&until, above));
    SignalSpec { name, kind, until }
}

fn read_relay(table: &Table, names: &Names, above: usize) -> RelaySpec {
    let [when, any, stays] = ["when", "any", "stays"].map(|field| table.get(field));
    if !when.is_given() && !any.is_given() {
        when.refuse("when, any or order");
    }
    for field in ["each", "strict"].map(|field| table.get(field)) {
        refuse_given(&field, "nothing: only an order has it");
    }
    RelaySpec {
        when: names.condition(&when, above),
        any: any.is_given().then(|| names.condition(&any, above)),
        after: ticks(table.get("after").number(0.0, SECONDS)),
        stays: match stays.word() {
            Some("ever") => Stays::Ever,
            _ => Stays::Ticks(ticks(stays.number(0.0, SECONDS))),
        },
        toggles: table.get("toggles").truth(false),
    }
}

fn read_order(table: &Table, names: &Names, above: usize) -> OrderSpec {
    for field in ["when", "any", "after", "stays", "toggles"].map(|field| table.get(field)) {
        refuse_given(&field, "nothing beside an order; another signal can build on this one");
    }
    let signals = &names.signals[..above.min(names.signals.len())];
    let known: Vec<&String> = names.zones.iter().chain(signals).collect();
    let allowed = format!("a list of 2 to 16 names, each {}", one_of(&known));
    let items = table.get("order").some_items(STEPS, &allowed);
    let steps = items.iter().filter_map(|item| {
        let index = item.index_in(&known)?;
        let zones = names.zones.len();
        let signal = || Step::Signal((index - zones) as u8);
        Some(if index < zones { Step::Zone(index as u8) } else { signal() })
    });
    let steps: Vec<Step> = steps.collect();
    let each = table.get("each");
    let choices = [("all", Each::All), ("side", Each::Side), ("player", Each::Player)];
    let who = each.choice(&choices).unwrap_or(Each::All);
    if who != Each::All && steps.iter().any(|step| matches!(step, Step::Signal(_))) {
        each.refuse("\"all\": a signal among the steps is nobody's");
    }
    OrderSpec { steps, each: who, strict: table.get("strict").truth(false) }
}

fn refuse_given(field: &Field, allowed: &str) {
    if field.is_given() {
        field.refuse(allowed);
    }
}
