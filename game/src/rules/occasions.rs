//! Occasions: what happened in a tick that rules wait for.

use super::book::{Rules, Table};
use super::memory::Lap;
use crate::event::Event;
use crate::input::Seat;
use crate::scene::{Condition, Levels, Occasion};
use jostle_sim::BodyId;

/// One time that a rule applies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Occurrence {
    /// The body that it is about, which may be gone.
    pub it: Option<BodyId>,
    /// The other body of a touch.
    pub other: Option<BodyId>,
    /// The player whose body it is, or who touched it last.
    pub player: Option<Seat>,
    /// The player who caused it.
    pub by: Option<Seat>,
}

impl Rules {
    /// Lists the occurrences of an occasion in this tick, in the order in which they were found.
    pub(super) fn list_occurrences(
        &self,
        occasion: Occasion,
        before: Levels,
        table: &Table,
        found: &mut Vec<Occurrence>,
    ) {
        let changes = &self.scratch.zones;
        let of = |zones: u64| move |&&(zone, _): &&(u8, BodyId)| zones >> zone & 1 == 1;
        match occasion {
            Occasion::Enter(zones) => {
                let entered = changes.entered.iter().filter(of(zones));
                found.extend(entered.map(|&(_, id)| self.about(id, table)));
            }
            Occasion::Leave(zones) => {
                let left = changes.left.iter().filter(of(zones));
                found.extend(left.map(|&(_, id)| self.about(id, table)));
            }
            Occasion::On(condition) => self.list_edge(condition, before, table, found),
            Occasion::Every(ticks) => {
                if self.round.ticks.is_multiple_of(ticks) {
                    found.push(Occurrence::default());
                }
            }
            Occasion::Touch(first, second) => self.list_touches(first, second, table, found),
            Occasion::Burst => {
                for event in table.events.iter() {
                    if let Event::PackHit { owner, victim, hero, .. } = *event
                        && !table.roster.is_away(victim)
                    {
                        found.push(Occurrence { by: owner, ..self.about(hero, table) });
                    }
                }
            }
            Occasion::Lost(group) => {
                for event in table.events.iter() {
                    if let Event::BodyLeft { body, .. } = *event
                        && let Some(note) = self.notes.get(body)
                        && note.group == group
                    {
                        found.push(self.about_gone(body, table));
                    }
                }
            }
            Occasion::Breaks(group) => {
                for broken in self.scratch.broken.iter().filter(|broken| broken.group == group) {
                    let (it, by) = (Some(broken.body), broken.by);
                    found.push(Occurrence { it, other: None, player: by, by });
                }
            }
        }
    }

    /// A condition came to hold. One that names a lap does so for each who completes it, whatever held for
    /// others in the tick before; of several laps that it names, the last one counts.
    fn list_edge(
        &self,
        condition: Condition,
        before: Levels,
        table: &Table,
        found: &mut Vec<Occurrence>,
    ) {
        let named = |lap: &&Lap| condition.on.signals >> lap.signal & 1 == 1;
        let laps = self.scratch.laps.iter().filter(named);
        let Some(last) = laps.clone().map(|lap| lap.signal).max() else {
            if !condition.all(before) && condition.all(self.levels) {
                found.push(Occurrence::default());
            }
            return;
        };
        let completed =
            laps.filter(|lap| lap.signal == last).map(|lap| self.about(lap.body, table));
        let holds = |of: &Occurrence| condition.all(self.levels_of(of.player, table.roster));
        found.extend(completed.filter(holds));
    }

    fn list_touches(&self, first: u8, second: u8, table: &Table, found: &mut Vec<Occurrence>) {
        let world = &*table.world;
        for touch in world.touches().iter().filter(|touch| touch.began) {
            let groups = [touch.a, touch.b].map(|id| world.contains(id).then(|| world.group(id)));
            let [Some(group_a), Some(group_b)] = groups else { continue };
            let (it, other) = if (group_a, group_b) == (first, second) {
                (touch.a, touch.b)
            } else if (group_b, group_a) == (first, second) {
                (touch.b, touch.a)
            } else {
                continue;
            };
            found.push(Occurrence { other: Some(other), ..self.about(it, table) });
        }
    }

    /// Something about a body: it is by its own player, or by who touched it last.
    fn about(&self, id: BodyId, table: &Table) -> Occurrence {
        let owner = table.roster.owner_of(id);
        let touched_by = self.notes.get(id).and_then(|note| note.touched_by);
        let player = owner.or(touched_by);
        Occurrence { it: Some(id), other: None, player, by: player }
    }

    /// Something about a body that left the world: by who touched it last.
    fn about_gone(&self, id: BodyId, table: &Table) -> Occurrence {
        let touched_by = self.notes.get(id).and_then(|note| note.touched_by);
        let owner = table.roster.players.iter().find(|player| player.lost == Some(id));
        let player = owner.map(|player| player.seat).or(touched_by);
        Occurrence { it: Some(id), other: None, player, by: touched_by }
    }
}
