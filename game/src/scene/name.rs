//! Names in scene files and links.

use super::limits::SCENE_NAME_BYTES_MAX;

pub(super) const NAME_ALLOWED: &str = "1 to 32 lower-case letters, digits and dashes";

/// Returns whether a text may be the name of a scene or a recipe: 1 to 32 lower-case letters, digits
/// and dashes.
pub fn is_name(text: &str) -> bool {
    let known = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    (1..=SCENE_NAME_BYTES_MAX).contains(&text.len()) && text.bytes().all(known)
}
