//! Signals in a scene file.

use super::condition::Condition;
use super::names::{self, Names};
use crate::scene::field::SECONDS;
use crate::scene::table::{Table, one_of};

const STEPS: std::ops::RangeInclusive<usize> = 2..=16;

/// A level that depends on zones and on signals listed above it.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalSpec {
    /// Name, which nothing else may have.
    pub name: String,
    /// What the level depends on: other levels, or steps in an order.
    pub kind: SignalKind,
    /// While this holds, it is off and forgets its progress. Default: never.
    pub until: Option<Condition>,
}

impl SignalSpec {
    /// The order of the signal, if it has one.
    pub fn order(&self) -> Option<&OrderSpec> {
        match &self.kind {
            SignalKind::Order(order) => Some(order),
            SignalKind::Relay(_) => None,
        }
    }
}

/// The inputs of a signal.
#[derive(Clone, Debug, PartialEq)]
pub enum SignalKind {
    /// Other levels.
    Relay(RelaySpec),
    /// Steps in an order.
    Order(OrderSpec),
}

/// A signal that depends on other levels. Times are in ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct RelaySpec {
    /// It is on while all of this holds. Default: this, `any` or `order`.
    pub when: Condition,
    /// At least one of these must also hold. Default: all of `when` suffices.
    pub any: Option<Condition>,
    /// It comes on once they have held for longer than this.
    pub after: u32,
    /// It stays on for this long after they stop holding; `"ever"` means until the end of the round. Default: `0`.
    pub stays: Stays,
    /// It switches between on and off each time it would come on.
    pub toggles: bool,
}

/// How long a signal stays on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stays {
    /// For a number of ticks.
    Ticks(u32),
    /// Until the end of the round.
    Ever,
}

/// A signal that comes on after steps in an order.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderSpec {
    /// Used instead of all these: it comes on once these have come in this order. Default: none.
    #[doc(alias = "order")]
    pub steps: Vec<Step>,
    /// Who makes progress in the order. If all do so together, it stays on once complete. If each side or player does
    /// so separately, it comes on for one tick and starts over, which makes a lap. A player who joins later starts from
    /// the beginning, even in the seat of someone who left.
    pub each: Each,
    /// A wrong step from the list resets the progress to the start.
    pub strict: bool,
}

/// One step of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A body enters the zone with this index.
    Zone(u8),
    /// The signal with this index comes on.
    Signal(u8),
}

/// Whose progress an order counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Each {
    /// All players together. Once the order is complete, the signal stays on.
    All,
    /// Each side. Once the order is complete, the signal is on for one tick and the order starts over.
    Side,
    /// Each player; otherwise as for sides.
    Player,
}

/// Reads one entry of `signals`; `above` is the number of signals listed above it.
pub(super) fn signal(table: &Table, names: &Names, above: usize) -> SignalSpec {
    let name = names::name(table);
    let order = table.get("order");
    let until = table.get("until");
    let kind = match order.is_given() {
        true => SignalKind::Order(read_order(table, names, above)),
        false => SignalKind::Relay(read_relay(table, names, above)),
    };
    let until = until.given(|until| names.condition(until, above));
    SignalSpec { name, kind, until }
}

fn read_relay(table: &Table, names: &Names, above: usize) -> RelaySpec {
    let [when, any, stays] = ["when", "any", "stays"].map(|field| table.get(field));
    if !when.is_given() && !any.is_given() {
        when.refuse("when, any or order");
    }
    for field in ["each", "strict"] {
        table.get(field).refuse_if_given("nothing: only an order has it");
    }
    stays.describe(format_args!("{SECONDS} s, or `\"ever\"`"));
    RelaySpec {
        when: names.condition(&when, above),
        any: any.given(|any| names.condition(any, above)),
        after: table.get("after").ticks(0.0, SECONDS),
        stays: match stays.word() {
            Some("ever") => Stays::Ever,
            _ => Stays::Ticks(stays.ticks(0.0, SECONDS)),
        },
        toggles: table.get("toggles").truth(false),
    }
}

fn read_order(table: &Table, names: &Names, above: usize) -> OrderSpec {
    for field in ["when", "any", "after", "stays", "toggles"] {
        let allowed = "nothing beside an order; another signal can build on this one";
        table.get(field).refuse_if_given(allowed);
    }
    let known: Vec<&String> = names.zones.iter().chain(names.signals_above(above)).collect();
    let allowed = format!("a list of 2 to 16 names, each {}", one_of(&known));
    let order = table.get("order");
    order.describe("2 to 16 zones or signals");
    let items = order.some_items(STEPS, &allowed);
    let steps = items.iter().filter_map(|item| {
        let index = item.index_in(&known)?;
        let zones = names.zones.len();
        let signal = || Step::Signal((index - zones) as u8);
        Some(if index < zones { Step::Zone(index as u8) } else { signal() })
    });
    let steps: Vec<Step> = steps.collect();
    let each = table.get("each");
    let choices = [("all", Each::All), ("side", Each::Side), ("player", Each::Player)];
    let who = each.choice_or_first(&choices);
    if who != Each::All && steps.iter().any(|step| matches!(step, Step::Signal(_))) {
        each.refuse("\"all\": a signal among the steps is nobody's");
    }
    OrderSpec { steps, each: who, strict: table.get("strict").truth(false) }
}
