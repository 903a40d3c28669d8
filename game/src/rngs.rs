//! Random number generators of a game.

use jostle_sim::Rng;

/// Stream of the generator that places the layouts; it is used only once, when a game starts.
pub(crate) const LAYOUT_STREAM: u64 = 1;

/// A generator for each purpose, so that the draws of one rule never shift those of another.
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

    /// All of them with their names in differences, in the order of the state hash.
    pub fn named(&self) -> [(&'static str, &Rng); 4] {
        let Rngs { spawn, drop, agitate, emit } = self;
        [
            ("chance of spawns", spawn),
            ("chance of drops", drop),
            ("chance of shakes", agitate),
            ("chance of emitters", emit),
        ]
    }
}
