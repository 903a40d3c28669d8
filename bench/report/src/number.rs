//! Formats numbers for readers: three digits, with a power of ten instead of many zeros.

use crate::plot::superscript;

/// Formats with three digits: 0, 0.0123, 12.3, 4.56·10⁻⁷.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "not finite".into();
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-3..5).contains(&exponent) {
        let decimals = (2 - exponent).max(0) as usize;
        return trimmed(&format!("{value:.decimals$}"));
    }
    let mantissa = value / 10f64.powi(exponent);
    format!("{}·10{}", trimmed(&format!("{mantissa:.2}")), superscript(exponent))
}

fn trimmed(text: &str) -> String {
    if !text.contains('.') {
        return text.to_owned();
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn three_digits_are_enough() {
        let texts = [0.0, 0.005, 1.0, 12.345, 1234.5, 4.1667e-7, 1e6, -0.25].map(short);
        let expected = ["0", "0.005", "1", "12.3", "1234", "4.17·10⁻⁷", "1·10⁶", "-0.25"];
        assert_eq!(texts, expected);
    }
}
