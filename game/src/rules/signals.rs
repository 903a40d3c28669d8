//! Signals: levels made of zones and of signals above them.

use super::book::{Rules, Table};
use super::memory::{Lap, OrderState, RelayState, SignalState, Walker, is_off};
use crate::input::Seat;
use crate::roster::Roster;
use crate::scene::{Each, Levels, OrderSpec, SignalKind, Step};
use jostle_sim::BodyId;

impl Rules {
    /// Updates signals in file order: each sees zones and signals above it, of this tick.
    pub(super) fn update_signals(&mut self, table: &Table) {
        let before = self.levels.signals;
        self.levels.signals = 0;
        self.scratch.laps.clear();
        for (index, spec) in table.scene.rules.signals.iter().enumerate() {
            let mut state = std::mem::replace(
                &mut self.signals[index],
                SignalState::Relay(RelayState::default()),
            );
            let on = match (&mut state, &spec.kind) {
                _ if is_off(spec, self.levels) => {
                    state = SignalState::new(spec);
                    false
                }
                (SignalState::Relay(state), SignalKind::Relay(relay)) => {
                    state.advance(relay, self.levels);
                    state.level(relay)
                }
                (SignalState::Order(state), SignalKind::Order(order)) => {
                    self.advance_order(state, order, index as u8, before, table)
                }
                _ => unreachable!("a signal keeps its kind"),
            };
            self.signals[index] = state;
            if on {
                self.levels = self.levels.or(Levels::signal(index));
            }
        }
    }

    /// Takes the steps of this tick, and returns whether the order is complete.
    fn advance_order(
        &mut self,
        state: &mut OrderState,
        order: &OrderSpec,
        signal: u8,
        before: u64,
        table: &Table,
    ) -> bool {
        if order.each == Each::All && state.steps(Walker::All) == order.steps.len() {
            return true;
        }
        let laps_before = self.scratch.laps.len();
        for &(zone, body) in &self.scratch.zones.entered {
            let Some(walker) = walker(order.each, body, table) else { continue };
            if state.step(order, walker, Step::Zone(zone)) && order.each != Each::All {
                state.set(walker, 0);
                self.scratch.laps.push(Lap { signal, walker, body });
            }
        }
        for index in (0..64).filter(|index| self.levels.signals >> index & 1 == 1) {
            let laps = self.scratch.laps.iter().filter(|lap| lap.signal == index).count();
            let came = usize::from(before >> index & 1 == 0);
            // Each lap is a step, also of those in one tick or in consecutive ones.
            for _ in 0..laps.max(came) {
                state.step(order, Walker::All, Step::Signal(index));
            }
        }
        match order.each {
            Each::All => state.steps(Walker::All) == order.steps.len(),
            Each::Side | Each::Player => self.scratch.laps.len() > laps_before,
        }
    }
}

impl Rules {
    /// The levels as a player sees them: of the laps of this tick, the player's own and those of the
    /// player's side. Where it is about no player, anyone's.
    pub(super) fn levels_of(&self, player: Option<Seat>, roster: &Roster) -> Levels {
        let mut levels = self.levels;
        let Some(seat) = player else { return levels };
        let own = [Walker::Player(seat), Walker::Side(roster.side_of(seat))];
        let laps = &self.scratch.laps;
        laps.iter().for_each(|lap| levels.signals &= !(1 << lap.signal));
        for lap in laps.iter().filter(|lap| own.contains(&lap.walker)) {
            levels = levels.or(Levels::signal(lap.signal.into()));
        }
        levels
    }
}

impl OrderState {
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

    /// Takes one step; returns whether that completes the order.
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

/// Who makes progress when a body enters a zone.
fn walker(each: Each, body: BodyId, table: &Table) -> Option<Walker> {
    let owner = table.roster.owner_of(body);
    match each {
        Each::All => Some(Walker::All),
        Each::Side => owner.map(|seat| Walker::Side(table.roster.side_of(seat))),
        Each::Player => owner.map(Walker::Player),
    }
}
