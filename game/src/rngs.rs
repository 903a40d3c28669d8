//! A game's random number generators.

use jostle_sim::Rng;
use jostle_sim::state::io::StateIo;

/// Stream of the generator that places the layouts. It is used only at the start of a game.
pub(crate) const LAYOUT_STREAM: u64 = 1;

/// One generator for each purpose, so that one rule's random draws never shift another's.
#[derive(Clone, Debug)]
pub(crate) struct Rngs {
    pub spawn: Rng,
    pub drop: Rng,
    pub agitate: Rng,
    pub emit: Rng,
}

impl Rngs {
    pub fn new(seed: u64) -> Rngs {
        Rngs {
            spawn: Rng::new(seed, 2),
            drop: Rng::new(seed, 3),
            agitate: Rng::new(seed, 4),
            emit: Rng::new(seed, 5),
        }
    }

    /// Describes the state of the generators.
    pub fn state(&self, io: &mut impl StateIo) -> Rngs {
        Rngs {
            spawn: io.generator("chance of spawns", &self.spawn),
            drop: io.generator("chance of drops", &self.drop),
            agitate: io.generator("chance of shakes", &self.agitate),
            emit: io.generator("chance of emitters", &self.emit),
        }
    }
}
