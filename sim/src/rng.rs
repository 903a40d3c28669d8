//! Seeded random numbers, the simulation's only source of randomness.

/// A seeded PCG-XSH-RR 64/32 generator (O'Neill 2014). Its state is part of the state hash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rng {
    state: u64,
    increment: u64,
}

impl Rng {
    /// Creates a generator for `seed`. Each `stream` gives an independent sequence for the same seed.
    pub fn new(seed: u64, stream: u64) -> Rng {
        let mut rng = Rng { state: 0, increment: stream << 1 | 1 };
        rng.next_u32();
        rng.state = rng.state.wrapping_add(seed);
        rng.next_u32();
        rng
    }

    /// Returns the next 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let shifted = ((old >> 18 ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// Returns a uniform number in [0, 1) with 24 random bits, exact in f32.
    pub fn unit(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Returns a uniform number in [low, high).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Returns a uniform integer in [0, count). `count` must be positive. The bias is below count / 2^32.
    pub fn below(&mut self, count: u32) -> u32 {
        assert!(count > 0, "Rng::below needs a positive count");
        ((u64::from(self.next_u32()) * u64::from(count)) >> 32) as u32
    }

    /// Returns the raw state, for the state hash.
    pub fn state(&self) -> [u64; 2] {
        [self.state, self.increment]
    }

    /// Recreates the generator that had this [`Rng::state`].
    pub fn from_state([state, increment]: [u64; 2]) -> Rng {
        Rng { state, increment }
    }
}
