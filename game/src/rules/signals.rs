//! Signals are levels derived from zones and from signals listed above them.

use super::context::RuleContext;
use crate::input::Seat;
use crate::roster::Roster;
use crate::scene::{Each, Levels, OrderSpec, RelaySpec, SignalKind, SignalSpec, Stays, Step};
use crate::side::Side;
use jostle_sim::BodyId;

/// The signals of a scene, and the laps of this tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    pub(super) states: Vec<SignalState>,
    pub(super) laps: Vec<Lap>,
}

/// State of a signal.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SignalState {
    Relay(RelayState),
    /// An order of steps.
    Order(OrderState),
}

/// State of a signal that depends on levels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RelayState {
    /// Number of consecutive ticks for which its condition has held.
    pub held: u32,
    /// Remaining ticks for which it stays on after its condition has stopped holding.
    pub left: u32,
    /// Whether it is on, disregarding a toggle.
    pub base: bool,
    /// Whether a toggle is on.
    pub toggled: bool,
}

/// Progress in an order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct OrderState {
    /// Number of completed steps for everyone who has made progress, sorted.
    pub done: Vec<(Walker, u8)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Walker {
    All,
    Side(Side),
    Player(Seat),
}

/// A lap: the completion of an order by a side or player in this tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lap {
    pub signal: u8,
    pub walker: Walker,
    pub body: BodyId,
}

impl Signals {
    /// Creates signals, all of them off.
    pub fn new(states: Vec<SignalState>) -> Signals {
        Signals { states, laps: Vec::new() }
    }

    /// Begins a round, in which signals come on without an edge. Returns the levels with those of the signals added.
    pub fn settle(&mut self, specs: &[SignalSpec], mut levels: Levels) -> Levels {
        for (index, (spec, state)) in specs.iter().zip(&mut self.states).enumerate() {
            *state = SignalState::new(spec);
            if state.settle(spec, levels) {
                levels = levels.or(Levels::signal(index));
            }
        }
        levels
    }

    /// Updates signals in file order. Each one sees this tick's zones, with the bodies that `entered` them, and the
    /// signals above it. Returns the levels with those of the signals added.
    pub fn update(
        &mut self,
        mut levels: Levels,
        entered: &[(u8, BodyId)],
        table: &RuleContext,
    ) -> Levels {
        let before = std::mem::take(&mut levels.signals);
        self.laps.clear();
        let specs = &table.scene.rules.signals;
        for (index, (spec, state)) in (0u8..).zip(specs.iter().zip(&mut self.states)) {
            let on = match (&mut *state, &spec.kind) {
                _ if is_off(spec, levels) => {
                    *state = SignalState::new(spec);
                    false
                }
                (SignalState::Relay(state), SignalKind::Relay(relay)) => {
                    state.advance(relay, levels);
                    state.level(relay)
                }
                (SignalState::Order(state), SignalKind::Order(order)) => {
                    let signals = [before, levels.signals];
                    state.advance(order, index, signals, entered, &mut self.laps, table)
                }
                _ => unreachable!("a signal keeps its kind"),
            };
            if on {
                levels = levels.or(Levels::signal(index.into()));
            }
        }
        levels
    }

    /// The levels as they apply to a player: of this tick's laps, only those completed by the player or the
    /// player's side count. Without a player, all laps count.
    pub fn levels_of(&self, mut levels: Levels, player: Option<Seat>, roster: &Roster) -> Levels {
        let Some(seat) = player else { return levels };
        let own = [Walker::Player(seat), Walker::Side(roster.side_of(seat))];
        self.laps.iter().for_each(|lap| levels.signals &= !(1 << lap.signal));
        for lap in self.laps.iter().filter(|lap| own.contains(&lap.walker)) {
            levels = levels.or(Levels::signal(lap.signal.into()));
        }
        levels
    }

    /// Discards a side's progress.
    pub fn forget(&mut self, side: Side) {
        for signal in &mut self.states {
            if let SignalState::Order(order) = signal {
                order.done.retain(|(walker, _)| walker.side() != Some(side));
            }
        }
    }

    /// Steps completed in orders: the signal, who completed them, and how many.
    pub fn progress(&self) -> impl Iterator<Item = (u8, Option<Side>, u8)> {
        (0..).zip(&self.states).flat_map(|(signal, state)| {
            let done = match state {
                SignalState::Order(order) => &order.done[..],
                SignalState::Relay(_) => &[],
            };
            done.iter().map(move |&(walker, steps)| (signal, walker.side(), steps))
        })
    }
}

impl SignalState {
    /// Creates a signal that is off and remembers nothing.
    pub fn new(spec: &SignalSpec) -> SignalState {
        match spec.kind {
            SignalKind::Relay(_) => SignalState::Relay(RelayState::default()),
            SignalKind::Order(_) => SignalState::Order(OrderState::default()),
        }
    }

    /// Computes the signal's level at the start of a round.
    pub fn settle(&mut self, spec: &SignalSpec, levels: Levels) -> bool {
        match (self, &spec.kind) {
            (SignalState::Relay(state), SignalKind::Relay(relay)) if !is_off(spec, levels) => {
                state.advance(relay, levels);
                state.toggled = false;
                state.level(relay)
            }
            _ => false,
        }
    }
}

/// Whether the `until` condition of a signal holds.
fn is_off(spec: &SignalSpec, levels: Levels) -> bool {
    spec.until.is_some_and(|until| until.all(levels))
}

impl RelayState {
    pub fn advance(&mut self, spec: &RelaySpec, levels: Levels) {
        let holds = spec.when.all(levels) && spec.any.is_none_or(|any| any.any(levels));
        self.held = if holds { self.held.saturating_add(1) } else { 0 };
        let before = self.base;
        if self.held > spec.after {
            self.base = true;
            self.left = match spec.stays {
                Stays::Ticks(ticks) => ticks,
                Stays::Ever => u32::MAX,
            };
        } else if self.left > 0 {
            self.left -= u32::from(self.left != u32::MAX);
        } else {
            self.base = false;
        }
        self.toggled ^= self.base && !before;
    }

    pub fn level(&self, spec: &RelaySpec) -> bool {
        if spec.toggles { self.toggled } else { self.base }
    }
}

impl Walker {
    /// The side that represents it in a saved state.
    pub fn side(self) -> Option<Side> {
        match self {
            Walker::All => None,
            Walker::Side(side) => Some(side),
            Walker::Player(seat) => Some(Side::Player(seat)),
        }
    }

    /// The walker that a saved side represents.
    pub fn of(each: Each, side: Option<Side>) -> Option<Walker> {
        match (each, side) {
            (Each::All, None) => Some(Walker::All),
            (Each::Side, Some(side)) => Some(Walker::Side(side)),
            (Each::Player, Some(Side::Player(seat))) => Some(Walker::Player(seat)),
            _ => None,
        }
    }
}

impl OrderState {
    /// Takes a tick's steps, made by bodies that entered zones and by signals above that came on. Returns whether the
    /// order is complete.
    fn advance(
        &mut self,
        order: &OrderSpec,
        signal: u8,
        [before, now]: [u64; 2],
        entered: &[(u8, BodyId)],
        laps: &mut Vec<Lap>,
        table: &RuleContext,
    ) -> bool {
        if order.each == Each::All && self.steps(Walker::All) == order.steps.len() {
            return true;
        }
        let laps_before = laps.len();
        for &(zone, body) in entered {
            let Some(walker) = walker(order.each, body, table) else { continue };
            if self.step(order, walker, Step::Zone(zone)) && order.each != Each::All {
                self.set(walker, 0);
                laps.push(Lap { signal, walker, body });
            }
        }
        for index in (0..64).filter(|index| now >> index & 1 == 1) {
            let completed = laps.iter().filter(|lap| lap.signal == index).count();
            let came = usize::from(before >> index & 1 == 0);
            // Each lap counts as a step, even if several fall in one tick or in consecutive ticks.
            for _ in 0..completed.max(came) {
                self.step(order, Walker::All, Step::Signal(index));
            }
        }
        match order.each {
            Each::All => self.steps(Walker::All) == order.steps.len(),
            Each::Side | Each::Player => laps.len() > laps_before,
        }
    }

    fn steps(&self, walker: Walker) -> usize {
        let known = self.done.binary_search_by_key(&walker, |(walker, _)| *walker);
        known.map_or(0, |at| usize::from(self.done[at].1))
    }

    fn set(&mut self, walker: Walker, steps: usize) {
        let known = self.done.binary_search_by_key(&walker, |(walker, _)| *walker);
        match known {
            Ok(at) if steps == 0 => drop(self.done.remove(at)),
            Ok(at) => self.done[at].1 = steps as u8,
            Err(_) if steps == 0 => {}
            Err(at) => self.done.insert(at, (walker, steps as u8)),
        }
    }

    /// Takes one step, and returns whether that completes the order.
    fn step(&mut self, order: &OrderSpec, walker: Walker, step: Step) -> bool {
        let done = self.steps(walker);
        let steps = &order.steps;
        if steps.get(done) == Some(&step) {
            self.set(walker, done + 1);
            return done + 1 == steps.len();
        }
        if order.strict && done < steps.len() && steps.contains(&step) {
            self.set(walker, usize::from(steps[0] == step));
        }
        false
    }
}

/// Returns who makes progress when a body enters a zone.
fn walker(each: Each, body: BodyId, table: &RuleContext) -> Option<Walker> {
    let owner = table.roster.owner_of(body);
    match each {
        Each::All => Some(Walker::All),
        Each::Side => owner.map(|seat| Walker::Side(table.roster.side_of(seat))),
        Each::Player => owner.map(Walker::Player),
    }
}
