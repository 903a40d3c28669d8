//! Scene links: the whole text of a scene file in the fragment of an address, which browsers do not send to servers.
//! The text is deflated (RFC 1951) and encoded in base64url (RFC 4648) without padding.

use base64ct::{Base64UrlUnpadded, Encoding};
use jostle_protocol::limits::SCENE_BYTES_MAX;
use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_with_limit};

/// The prefix of a fragment that holds a scene.
pub const HASH: &str = "#scene=";
/// Maximum length of a link in characters: enough for an incompressible scene of the maximum size.
pub const SCENE_LINK_CHARS_MAX: usize = (SCENE_BYTES_MAX + 64) / 3 * 4;
/// Deflate level. Higher ones shorten a scene by less than one percent.
const LEVEL: u8 = 6;

/// Why a link cannot be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SceneLinkError {
    /// The link has this many characters.
    #[error("found {0} characters; allowed: at most {SCENE_LINK_CHARS_MAX}")]
    TooLong(usize),
    /// The link decompresses to more text than a scene may have.
    #[error("found more than {SCENE_BYTES_MAX} bytes of text; allowed: at most that many")]
    TooMuchText,
    /// The link was truncated or altered.
    #[error("found a link that is cut or changed; allowed: deflated text in base64url")]
    Damaged,
}

/// Decodes the text of a link; trailing padding is allowed.
pub fn decode(link: &str) -> Result<String, SceneLinkError> {
    if link.len() > SCENE_LINK_CHARS_MAX {
        return Err(SceneLinkError::TooLong(link.len()));
    }
    let packed = Base64UrlUnpadded::decode_vec(link.trim_end_matches('='));
    let packed = packed.map_err(|_| SceneLinkError::Damaged)?;
    let text =
        decompress_to_vec_with_limit(&packed, SCENE_BYTES_MAX).map_err(|error| {
            match error.status {
                TINFLStatus::HasMoreOutput => SceneLinkError::TooMuchText,
                _ => SceneLinkError::Damaged,
            }
        })?;
    String::from_utf8(text).map_err(|_| SceneLinkError::Damaged)
}

/// Splits a fragment into the encoded scene and the options for playing it.
pub fn in_hash(hash: &str) -> Option<(&str, &str)> {
    let rest = hash.strip_prefix(HASH)?;
    Some(rest.split_once('&').unwrap_or((rest, "")))
}

/// Encodes a scene's text as a link.
pub fn encode(text: &str) -> String {
    Base64UrlUnpadded::encode_string(&compress_to_vec(text.as_bytes(), LEVEL))
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_game::Scene;
    use proptest::prelude::*;

    #[test]
    fn every_shipped_scene_fits_into_a_link() {
        for scene in Scene::built_in() {
            let link = encode(&scene.source);
            assert!(link.len() < scene.source.len(), "{}: {}", scene.name, link.len());
            assert_eq!(decode(&link), Ok(scene.source));
        }
    }

    /// This link was made with Python: `zlib.compressobj(9, zlib.DEFLATED, -15)` and `base64.urlsafe_b64encode`.
    #[test]
    fn a_link_of_another_program_is_read() {
        let link = "K8ksyUlVsFVQCskvSMxT4ipOBfGiDQ0MDHQUgGQsFwA=";
        assert_eq!(decode(link).as_deref(), Ok("title = \"Topan\"\nsee = [1000, 100]\n"));
    }

    /// Random text cannot be compressed.
    #[test]
    fn the_longest_text_fits_and_a_longer_one_is_refused() {
        let mut rng = jostle_sim::Rng::new(1, 0);
        let mut noise = |bytes| (0..bytes).map(|_| (33 + rng.below(94)) as u8 as char).collect();
        let longest: String = noise(SCENE_BYTES_MAX);
        assert_eq!(decode(&encode(&longest)), Ok(longest));
        let longer: String = noise(SCENE_BYTES_MAX + 1);
        assert_eq!(decode(&encode(&longer)), Err(SceneLinkError::TooMuchText));
        let chars = SCENE_LINK_CHARS_MAX + 1;
        assert_eq!(decode(&"A".repeat(chars)), Err(SceneLinkError::TooLong(chars)));
    }

    #[test]
    fn a_link_that_unfolds_a_thousandfold_is_refused() {
        let bomb = encode(&"a".repeat(60 << 20));
        assert!(bomb.len() < SCENE_LINK_CHARS_MAX, "{} characters", bomb.len());
        assert_eq!(decode(&bomb), Err(SceneLinkError::TooMuchText));
    }

    #[test]
    fn a_damaged_link_is_refused() {
        let link = encode("title = \"Yard\"");
        let not_text = Base64UrlUnpadded::encode_string(&compress_to_vec(&[0xff, 0xfe], LEVEL));
        for damaged in ["", "!", "\u{1f600}", "A", &link[..link.len() - 2], &not_text] {
            assert_eq!(decode(damaged), Err(SceneLinkError::Damaged), "{damaged}");
        }
    }

    /// The deflated texts of all built-in scenes.
    fn packed() -> Vec<Vec<u8>> {
        let scenes = Scene::built_in().into_iter();
        scenes.map(|scene| compress_to_vec(scene.source.as_bytes(), LEVEL)).collect()
    }

    proptest! {
        #[test]
        fn any_bytes_are_text_within_the_limit_or_refused(
            mut packed in prop::sample::select(packed()),
            noise in prop::collection::vec(any::<u8>(), 0..4),
            at in any::<prop::sample::Index>(),
        ) {
            let at = at.index(packed.len());
            packed.splice(at..(at + noise.len()).min(packed.len()), noise.iter().rev().copied());
            if let Ok(text) = decode(&Base64UrlUnpadded::encode_string(&packed)) {
                prop_assert!(text.len() <= SCENE_BYTES_MAX);
            }
        }
    }
}
