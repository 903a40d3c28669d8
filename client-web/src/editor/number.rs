//! Formats numbers in the style of scene files, without unnecessary digits.

use jostle_game::scene::parse_decimal;

/// The maximum number of digits after the point for any number.
pub const DECIMALS_MAX: u32 = 4;

/// Formats a number with at most `decimals` digits after the point, in the style of the text that it replaces. If the
/// value is unchanged, that text is kept. Whole numbers keep a decimal point if the old text has one.
pub fn written(value: f32, decimals: u32, before: &str) -> String {
    let new = rounded(value, decimals);
    if parse_decimal(&before.replace('_', ""))
        .is_some_and(|old| rounded(old as f32, decimals) == new)
    {
        return before.to_owned();
    }
    if before.ends_with(".0") && !new.contains('.') { format!("{new}.0") } else { new }
}

/// Formats a number with at most `decimals` digits after the point.
pub fn rounded(value: f32, decimals: u32) -> String {
    let text = format!("{value:.*}", decimals.min(DECIMALS_MAX) as usize);
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => &text,
    };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The number of digits after the point needed to distinguish steps of this size.
pub fn decimals_of(step: f32) -> u32 {
    (0..DECIMALS_MAX)
        .find(|digits| step >= 0.999 * 0.1_f32.powi(*digits as i32))
        .unwrap_or(DECIMALS_MAX)
}
