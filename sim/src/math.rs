//! Deterministic arithmetic beyond + - * / sqrt: functions from the pinned `libm`, and comparisons
//! that never depend on the sign of zero.

use glam::Vec2;

/// The larger of two numbers by plain comparison, since `f32::max` may return either zero.
#[inline]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers by plain comparison, since `f32::min` may return either zero.
#[inline]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `value` limited to `[low, high]` (A1.13). A NaN is returned unchanged.
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

/// `vector` limited to the length `length_max` (at least 0), keeping its direction.
#[inline]
pub fn clamp_length(value: Vec2, length_max: f32) -> Vec2 {
    let squared = value.length_squared();
    if squared > length_max * length_max { value * (length_max / squared.sqrt()) } else { value }
}

/// The bits of a finite f32, as an unsigned key that sorts in the same order.
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

/// `vector` rotated counter-clockwise by `angle` radians.
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

/// e to the power of `x`, minus 1, in double precision, the same bits on every target.
#[inline]
pub fn exp_m1(x: f64) -> f64 {
    libm::expm1(x)
}

/// Natural logarithm of 1 + `x`, in double precision, the same bits on every target.
#[inline]
pub fn ln_1p(x: f64) -> f64 {
    libm::log1p(x)
}

/// Sine and cosine of an angle in radians, in double precision, the same bits on every target.
#[inline]
pub fn sin_cos(angle: f64) -> (f64, f64) {
    (libm::sin(angle), libm::cos(angle))
}

/// See [`without_dust`].
pub(crate) const DUST: f32 = 1e-12;

/// Rounds numbers below 1e-12 to a multiple of about 1e-19, and hardly changes others. In a tower, friction passes
/// on an ever smaller share of a speed from row to row, and once speeds become subnormal, a step takes five times
/// as long.
#[inline]
pub(crate) fn without_dust(number: f32) -> f32 {
    (number + DUST) - DUST
}
