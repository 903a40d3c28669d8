//! Deterministic arithmetic beyond + - * / sqrt: the seeded generator, angles through the pinned
//! `libm`, and comparisons that never depend on the sign of zero.

use glam::Vec2;

/// The larger of two numbers by a plain comparison: `f32::max` may return either zero.
#[inline]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers by a plain comparison: `f32::min` may return either zero.
#[inline]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `value` limited to `[low, high]`; chapter row A1.13. NaN comes back as `value`.
#[inline]
pub fn clamp(value: f32, low: f32, high: f32) -> f32 {
    debug_assert!(low <= high, "clamp: low {low} exceeds high {high}");
    if value < low {
        low
    } else if value > high {
        high
    } else {
        value
    }
}

/// `value` with its length limited to `length_max` (at least 0), direction kept.
#[inline]
pub fn clamp_length(value: Vec2, length_max: f32) -> Vec2 {
    let squared = value.length_squared();
    if squared > length_max * length_max { value * (length_max / squared.sqrt()) } else { value }
}

/// The bits of a finite f32 as an unsigned key that sorts like the number.
#[inline]
pub fn ordered_bits(value: f32) -> u32 {
    let bits = (value + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Sine of an angle in radians, the same bits on every target.
#[inline]
pub fn sin(angle: f32) -> f32 {
    libm::sinf(angle)
}

/// Cosine of an angle in radians, the same bits on every target.
#[inline]
pub fn cos(angle: f32) -> f32 {
    libm::cosf(angle)
}

/// Angle of the vector (x, y) in radians, in [-pi, pi], the same bits on every target.
#[inline]
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// `vector` turned counter-clockwise by `angle` radians.
#[inline]
pub fn rotate(vector: Vec2, angle: f32) -> Vec2 {
    let (s, c) = (sin(angle), cos(angle));
    Vec2::new(vector.x * c - vector.y * s, vector.x * s + vector.y * c)
}

/// e to the power of `x`, in double precision, the same bits on every target.
#[inline]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// e to the power of `x`, less 1, in double precision, the same bits on every target.
#[inline]
pub fn exp_m1(x: f64) -> f64 {
    libm::expm1(x)
}

/// Natural logarithm of 1 + `x`, in double precision, the same bits on every target.
#[inline]
pub fn ln_1p(x: f64) -> f64 {
    libm::log1p(x)
}

/// Sine and cosine of radians, in double precision, the same bits on every target.
#[inline]
pub fn sin_cos(angle: f64) -> (f64, f64) {
    (libm::sin(angle), libm::cos(angle))
}

/// A seeded generator: PCG-XSH-RR 64/32 (O'Neill 2014). Its state is part of the state hash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rng {
    state: u64,
    increment: u64,
}

impl Rng {
    /// A generator for `seed`; each `stream` gives an independent sequence of the same seed.
    pub fn new(seed: u64, stream: u64) -> Rng {
        let mut rng = Rng { state: 0, increment: stream << 1 | 1 };
        rng.next_u32();
        rng.state = rng.state.wrapping_add(seed);
        rng.next_u32();
        rng
    }

    /// The next 32 uniform bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let shifted = ((old >> 18 ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// A uniform number in [0, 1) with 24 random bits, exact in f32.
    pub fn unit(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// A uniform number in [low, high).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A uniform whole number in [0, count); `count` must be positive. Bias is below count / 2^32.
    pub fn below(&mut self, count: u32) -> u32 {
        assert!(count > 0, "Rng::below needs a positive count");
        ((u64::from(self.next_u32()) * u64::from(count)) >> 32) as u32
    }

    /// The raw state, for the state hash.
    pub fn state(&self) -> [u64; 2] {
        [self.state, self.increment]
    }

    /// The generator that had this [`Rng::state`].
    pub fn from_state([state, increment]: [u64; 2]) -> Rng {
        Rng { state, increment }
    }
}
