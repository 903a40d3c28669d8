//! Linear and logarithmic scales that map values to pixels, and the positions of their ticks.

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// The tick's value in the data's unit.
    pub value: f64,
    /// The label; empty for a minor tick.
    pub label: String,
}

/// The scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    Linear {
        /// Value at the origin of the axis.
        low: f64,
        /// Value at the end of the axis.
        high: f64,
        /// Distance between adjacent ticks.
        step: f64,
    },
    /// Logarithmic, in whole decades between two exponents. If `zero` is set, the lowest decade represents 0, which has
    /// no logarithm.
    Log {
        /// Exponent at the origin of the axis.
        low: i32,
        /// Exponent at the end of the axis.
        high: i32,
        /// Whether the origin represents 0.
        zero: bool,
    },
}

/// Maximum number of labels on an axis.
const LABELS_MAX: i32 = 8;

impl Scale {
    /// A logarithmic scale of whole decades that covers all values. If 0 is among them, the scale gets an extra decade
    /// at the origin.
    pub fn log(values: impl Iterator<Item = f64>) -> Scale {
        let (mut low, mut high, mut zero) = (f64::INFINITY, 0f64, false);
        for value in values.filter(|value| value.is_finite()) {
            zero |= value <= 0.0;
            if value > 0.0 {
                low = low.min(value);
                high = high.max(value);
            }
        }
        if high == 0.0 {
            return Scale::Log { low: -1, high: 0, zero };
        }
        let (first, mut last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
        if last == first {
            last += 1;
        }
        Scale::Log { low: first - i32::from(zero), high: last, zero }
    }

    /// A linear scale with rounded ends that covers all values.
    pub fn linear(values: impl Iterator<Item = f64>) -> Scale {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| value.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if low == high {
            let room = if low == 0.0 { 1.0 } else { low.abs() / 2.0 };
            (low, high) = (low - room, high + room);
        }
        let step = nice_step(high - low);
        Scale::Linear { low: (low / step).floor() * step, high: (high / step).ceil() * step, step }
    }

    /// Position on the axis: 0 at the origin, 1 at the end; values outside are clamped.
    pub fn fraction(self, value: f64) -> f64 {
        let share = match self {
            Scale::Linear { low, high, .. } => (value - low) / (high - low),
            Scale::Log { low, high, .. } if value > 0.0 => {
                (value.log10() - f64::from(low)) / f64::from(high - low)
            }
            Scale::Log { .. } => 0.0,
        };
        share.clamp(0.0, 1.0)
    }

    /// Labelled and minor ticks in ascending order.
    pub fn ticks(self) -> Vec<Tick> {
        match self {
            Scale::Linear { low, high, step } => {
                let count = ((high - low) / step).round() as i32;
                let value = |i: i32| low + f64::from(i) * step;
                (0..=count)
                    .map(|i| Tick { value: value(i), label: plain(value(i), step) })
                    .collect()
            }
            Scale::Log { low, high, zero } => log_ticks(low, high, zero),
        }
    }
}

fn log_ticks(low: i32, high: i32, zero: bool) -> Vec<Tick> {
    let every = (high - low + LABELS_MAX - 1) / LABELS_MAX;
    let mut ticks = Vec::new();
    for exponent in low..=high {
        let value = 10f64.powi(exponent);
        let label = match () {
            () if zero && exponent == low => "0".to_owned(),
            () if exponent.rem_euclid(every) == 0 => format!("10{}", superscript(exponent)),
            () => String::new(),
        };
        ticks.push(Tick { value, label });
        let inside = exponent < high && !(zero && exponent == low);
        if every == 1 && inside {
            ticks.extend(
                (2..10).map(|i| Tick { value: value * f64::from(i), label: String::new() }),
            );
        }
    }
    ticks
}

/// Chooses 1, 2 or 5 times a power of ten so that about five steps cover the length.
fn nice_step(length: f64) -> f64 {
    let rough = length / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * power >= rough * 0.999);
    power * factor.unwrap_or(10.0)
}

/// Formats a number with as many decimals as the step needs.
fn plain(value: f64, step: f64) -> String {
    let value = if value.abs() < step * 1e-6 { 0.0 } else { value };
    if value != 0.0 && (value.abs() >= 1e5 || step < 1e-4) {
        return format!("{value:.1e}");
    }
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// Formats a whole number in superscript digits.
pub fn superscript(number: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        _ => char::from_u32('⁰' as u32 + c.to_digit(10).unwrap_or(0)).unwrap_or(c),
    };
    number.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::{Scale, superscript};

    #[test]
    fn decades_enclose_the_values_and_place_them() {
        let scale = Scale::log([3e-3, 0.5, 70.0].into_iter());
        assert_eq!(scale, Scale::Log { low: -3, high: 2, zero: false });
        assert!((scale.fraction(1e-3) - 0.0).abs() < 1e-12);
        assert!((scale.fraction(10.0) - 0.8).abs() < 1e-12);
        let labels: Vec<String> = scale.ticks().into_iter().map(|tick| tick.label).collect();
        assert_eq!(labels.iter().filter(|label| !label.is_empty()).count(), 6);
        assert_eq!(labels[0], "10⁻³");
    }

    #[test]
    fn zeros_have_a_decade_of_their_own() {
        let scale = Scale::log([0.0, 1e-2, 1.0].into_iter());
        assert_eq!(scale, Scale::Log { low: -3, high: 0, zero: true });
        assert_eq!(scale.ticks()[0].label, "0");
        assert_eq!(scale.fraction(0.0), 0.0);
        assert!(scale.fraction(1e-2) > 0.3);
    }

    #[test]
    fn many_decades_are_labelled_sparsely() {
        let ticks = Scale::log([1e-16, 1e4].into_iter()).ticks();
        let labelled = ticks.iter().filter(|tick| !tick.label.is_empty()).count();
        assert!((4..=9).contains(&labelled), "{labelled}");
    }

    #[test]
    fn linear_ends_are_round() {
        let scale = Scale::linear([0.13, 9.2].into_iter());
        assert_eq!(scale, Scale::Linear { low: 0.0, high: 10.0, step: 2.0 });
        let labels: Vec<String> = scale.ticks().into_iter().map(|tick| tick.label).collect();
        assert_eq!(labels, ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(Scale::linear([5.0].into_iter()).fraction(5.0), 0.5);
        let labels = |values: [f64; 2]| -> Vec<String> {
            Scale::linear(values.into_iter()).ticks().into_iter().map(|tick| tick.label).collect()
        };
        assert_eq!(labels([-0.41, 0.08]), ["-0.5", "-0.4", "-0.3", "-0.2", "-0.1", "0.0", "0.1"]);
        assert_eq!(Scale::linear(std::iter::empty()).fraction(1.0), 1.0);
    }

    #[test]
    fn raised_digits() {
        assert_eq!(superscript(-14), "⁻¹⁴");
        assert_eq!(superscript(230), "²³⁰");
    }
}
