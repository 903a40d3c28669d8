//! Parses decimal numbers, as in `-1.5e3`.
//!
//! The standard library's parser rounds correctly for any number of digits, for which it carries a table of 10 kB that no
//! compression shrinks. This one needs none, so that the page stays small, and the server uses it too, so that both
//! read the same scene.

/// Significant digits that are read; what follows them is below the precision of an `f64`.
const DIGITS_VALUE: u64 = 1_000_000_000_000_000_000;
/// The largest power of ten that an `f64` represents exactly.
const EXACT_POWER: i64 = 22;

/// Parses a decimal number with an optional sign, point and exponent, or `inf` or `nan`; `None` for any other text.
///
/// The result is correctly rounded for up to 15 digits and powers of ten up to 22 (W. D. Clinger, "How to read floating
/// point numbers accurately", 1990), and otherwise off by a few units in the last place of an `f64`.
pub fn parse_decimal(text: &str) -> Option<f64> {
    let (is_negative, rest) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let size = match rest {
        "inf" => f64::INFINITY,
        "nan" => f64::NAN,
        digits => parse_unsigned(digits)?,
    };
    Some(if is_negative { -size } else { size })
}

fn parse_unsigned(text: &str) -> Option<f64> {
    let (digits, mut power) = match text.split_once(['e', 'E']) {
        Some((digits, power)) => (digits, power.parse::<i64>().ok()?),
        None => (text, 0),
    };
    let (mut value, mut is_empty, mut has_point) = (0_u64, true, false);
    for byte in digits.bytes() {
        match byte {
            b'0'..=b'9' => {
                let is_read = value < DIGITS_VALUE;
                if is_read {
                    value = value * 10 + u64::from(byte - b'0');
                }
                power = power.saturating_add(i64::from(!is_read) - i64::from(has_point));
                is_empty = false;
            }
            b'.' if !has_point => has_point = true,
            _ => return None,
        }
    }
    if is_empty {
        return None;
    }
    let mut value = value as f64;
    while power > EXACT_POWER && value != 0.0 && value.is_finite() {
        value *= power_of_ten(EXACT_POWER);
        power -= EXACT_POWER;
    }
    while power < -EXACT_POWER && value != 0.0 {
        value /= power_of_ten(EXACT_POWER);
        power += EXACT_POWER;
    }
    let scale = power_of_ten(power.clamp(-EXACT_POWER, EXACT_POWER).abs());
    Some(if power < 0 { value / scale } else { value * scale })
}

/// Every product on the way is exact.
fn power_of_ten(power: i64) -> f64 {
    (0..power).fold(1.0, |product, _| product * 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Distance in units in the last place.
    fn distance(text: &str) -> u64 {
        let right: f64 = text.parse().expect("a number");
        let read = parse_decimal(text).expect("a number");
        assert_eq!(read.is_sign_negative(), right.is_sign_negative(), "{text}");
        read.abs().to_bits().abs_diff(right.abs().to_bits())
    }

    #[test]
    fn all_forms_are_read() {
        for text in [
            "0",
            "-0",
            "0.0",
            "1",
            "+1.5",
            "-1.5e3",
            "1E-3",
            "1e+2",
            ".5",
            "5.",
            "0.1",
            "1e400",
            "1e-400",
            "0e999999999",
            "1e22",
            "123456789012345",
            "1e2147483647",
            "9e-2147483648",
        ] {
            assert_eq!(distance(text), 0, "{text}");
        }
        assert_eq!(parse_decimal("inf"), Some(f64::INFINITY));
        assert_eq!(parse_decimal("-inf"), Some(f64::NEG_INFINITY));
        assert!(parse_decimal("nan").is_some_and(f64::is_nan));
        for text in ["", "-", ".", "e5", "1e", "1.2.3", "1_0", "0x1", "1 ", "--1", "infinity"] {
            assert_eq!(parse_decimal(text), None, "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn few_digits_are_read_exactly(digits in 0_u64..1_000_000_000_000_000, power in -22..=22) {
            prop_assert_eq!(distance(&format!("{digits}e{power}")), 0);
        }

        #[test]
        fn any_digits_are_read_closely(text in "-?[0-9]{1,30}(\\.[0-9]{1,30})?(e-?[0-9]{1,2})?") {
            let distance = distance(&text);
            prop_assert!(distance <= 16, "{} is off by {}", text, distance);
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[-+0-9.eE]{0,12}") {
            prop_assert_eq!(parse_decimal(&text).is_some(), text.parse::<f64>().is_ok());
        }
    }
}
