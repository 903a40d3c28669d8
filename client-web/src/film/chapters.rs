//! What happens when in a replay, for marks on its timeline.

use jostle_protocol::replay::{Block, Change};
use jostle_sim::Event;

/// Marks kept; what comes later has none.
const CHAPTERS_MAX: usize = 4096;

/// Something that happens at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chapter {
    /// A player with this colour comes.
    Join(u8),
    /// A player goes.
    Leave,
    /// A pack bursts.
    Burst,
}

/// What is known to happen, in the order in which it was found.
#[derive(Clone, Debug, Default)]
pub struct Chapters {
    known: Vec<(u32, Chapter)>,
}

impl Chapters {
    /// Finds who comes and goes.
    pub(super) fn scan(&mut self, block: &Block) {
        for (tick, given) in (block.first..).zip(&block.ticks) {
            for change in &given.changes {
                match change {
                    Change::Join(_, look) => self.add(tick, Chapter::Join(look.color)),
                    Change::Leave(_) => self.add(tick, Chapter::Leave),
                    Change::Look(..) => {}
                }
            }
        }
    }

    /// Finds what bursts in a tick.
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

    /// What is known so far, with its ticks.
    pub fn known(&self) -> &[(u32, Chapter)] {
        &self.known
    }
}
