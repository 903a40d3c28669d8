//! Checks the properties of a fleet.

use super::Simulation;
use super::settings::Violation;
use jostle_server::fleet::entry::{Entry, Key};

impl Simulation {
    pub(super) fn violation(&self, what: String) -> Violation {
        Violation { seed: self.settings.seed, at: self.now, what }
    }

    /// Checks that no room of this node is also played by another node.
    pub(super) fn check_rooms_of(&self, node: usize) -> Result<(), Violation> {
        let Some(node) = &self.nodes[node] else { return Ok(()) };
        node.rooms.keys().try_for_each(|code| self.check_room(code))
    }

    /// Checks that at most one node plays a room.
    pub(super) fn check_room(&self, code: &str) -> Result<(), Violation> {
        let players = self.players(code);
        if players.len() > 1 {
            return Err(self.violation(format!("{code} is played by {players:?}")));
        }
        Ok(())
    }

    fn players(&self, code: &str) -> Vec<usize> {
        let ignores = self.settings.flaws.ignores_lease;
        let opened = self.playing.get(code).into_iter().flatten().copied();
        let plays = |node: &usize| {
            self.nodes[*node].as_ref().is_some_and(|node| node.plays(code, self.now, ignores))
        };
        opened.filter(plays).collect()
    }

    /// Checks a write to a room's entry. It may create the room or advance it to the next epoch, or to a later one if
    /// the store has forgotten epochs of this room. Only rooms that have ended may be removed.
    pub(super) fn check_write(
        &mut self,
        key: &Key,
        entry: Option<&Entry>,
    ) -> Result<(), Violation> {
        let Key::Room(code) = key else { return Ok(()) };
        match entry {
            Some(Entry::Room(entry)) => {
                let before = self.epochs.insert(code.clone(), entry.epoch).unwrap_or(0);
                let may_jump = self.forgotten.contains(code);
                if entry.epoch != before + 1 && (entry.epoch <= before || !may_jump) {
                    let what = format!("{code} has epoch {} after {before}", entry.epoch);
                    return Err(self.violation(what));
                }
                if before == 0 {
                    // A late write may reopen a room that has ended; that counts as a new room.
                    for node in self.nodes.iter_mut().flatten() {
                        node.ended.remove(code);
                    }
                }
                Ok(())
            }
            None if !self.ended.contains(code) => {
                Err(self.violation(format!("{code} is removed, though it is not over")))
            }
            _ => {
                self.epochs.insert(code.clone(), 0);
                Ok(())
            }
        }
    }

    /// Checks that each room that has not ended is played by exactly one node, that draining nodes have no rooms, and
    /// that ended rooms have no entry.
    pub(super) fn check_order(&self) -> Result<(), Violation> {
        let mut entries = self.store.rooms().map(|(code, _)| code);
        if let Some(code) = entries.find(|code| self.ended.contains(*code)) {
            return Err(self.violation(format!("{code} is over and has an entry")));
        }
        for room in 0..self.settings.rooms {
            let code = format!("room-{room}");
            let players = self.players(&code);
            if players.len() != 1 && !self.ended.contains(&code) {
                return Err(self.violation(format!("{code} is played by {players:?}")));
            }
        }
        for node in self.nodes.iter().flatten() {
            let (name, holds) = (node.process.node, node.directory.holds());
            if node.draining && holds > 0 {
                return Err(self.violation(format!("node {name} drains and holds {holds} rooms")));
            }
            if node.rooms.len() > self.settings.rooms_max {
                let what = format!("node {name} has {} rooms", node.rooms.len());
                return Err(self.violation(what));
            }
        }
        Ok(())
    }
}
