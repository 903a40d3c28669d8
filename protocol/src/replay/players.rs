//! Counts the players in a replay.

use super::block::Change;
use super::record::Record;

/// Counts a game's players, including bots, from its records in order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlayerCount {
    now: u32,
    /// The largest number of simultaneous players so far.
    pub most: u32,
}

impl PlayerCount {
    /// Updates the count with the next record.
    pub fn note(&mut self, record: &Record) {
        match record {
            Record::Keyframe(keyframe) => self.now = keyframe.members.len() as u32,
            Record::Ticks(block) => {
                for change in block.ticks.iter().flat_map(|tick| &tick.changes) {
                    match change {
                        Change::Join(..) => self.now += 1,
                        Change::Leave(_) => self.now = self.now.saturating_sub(1),
                        Change::Look(..) => {}
                    }
                    self.most = self.most.max(self.now);
                }
            }
            Record::Start(_) | Record::End { .. } | Record::Host(_) => {}
        }
        self.most = self.most.max(self.now);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Block, Keyframe, Tick};
    use super::*;
    use crate::Appearance;
    use jostle_game::Seat;

    #[test]
    fn the_most_at_a_time_count() {
        let look = || Appearance::new("Ann", 1).expect("a name");
        let tick = |changes| Tick { changes, inputs: Vec::new(), hash: 0 };
        let join = |seat| Change::Join(Seat(seat), look());
        let mut count = PlayerCount::default();
        let members = vec![(Seat(0), look())];
        count.note(&Record::Keyframe(Keyframe { tick: 5, hash: 0, members, state: Vec::new() }));
        assert_eq!(count.most, 1);
        let ticks = vec![
            tick(vec![join(1), join(2)]),
            tick(vec![Change::Leave(Seat(0)), Change::Leave(Seat(1)), join(4)]),
        ];
        count.note(&Record::Ticks(Block { first: 6, ticks }));
        assert_eq!(count.most, 3);
        count.note(&Record::End { tick: 8, hash: 0 });
        assert_eq!(count.most, 3);
    }
}
