//! Events of a replay by tick, for marks on its timeline.

use jostle_game::Event;
use jostle_protocol::replay::{Block, Change};

/// Marks kept; what comes later has none.
const CHAPTERS_MAX: usize = 4096;

/// Something that happens at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chapter {
    /// A player comes.
    Join,
    /// A player goes.
    Leave,
    /// A pack bursts.
    Burst,
}

/// Chapters found so far, in the order in which they were found.
#[derive(Clone, Debug, Default)]
pub struct Chapters {
    /// With their ticks.
    pub known: Vec<(u32, Chapter)>,
}

impl Chapters {
    /// Finds joins and leaves.
    pub(super) fn scan(&mut self, block: &Block) {
        for (tick, given) in (block.first..).zip(&block.ticks) {
            for change in &given.changes {
                match change {
                    Change::Join(..) => self.add(tick, Chapter::Join),
                    Change::Leave(_) => self.add(tick, Chapter::Leave),
                    Change::Look(..) => {}
                }
            }
        }
    }

    /// Finds bursts in a tick.
    pub(super) fn note(&mut self, tick: u32, events: &[Event]) {
        if events.iter().any(|event| matches!(event, Event::PackHit { .. })) {
            self.add(tick, Chapter::Burst);
        }
    }

    fn add(&mut self, tick: u32, chapter: Chapter) {
        if self.known.len() < CHAPTERS_MAX {
            self.known.push((tick, chapter));
        }
    }
}
