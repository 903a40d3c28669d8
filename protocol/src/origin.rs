//! Server origins, such as `https://b.play.example.org`, at which a fleet's client finds a room.

use crate::error::{DecodeError, check};
use crate::limits::ORIGIN_BYTES_MAX;
use crate::wire::{Reader, Writer};

/// Returns whether a text is a server origin as used in messages: `http://` or `https://`, then a host and port, with
/// at most [`ORIGIN_BYTES_MAX`] bytes in total. The host and port are printable ASCII without quotes, slashes, or other
/// characters that would end them in a URL.
pub fn is_origin(text: &str) -> bool {
    let host = text.strip_prefix("https://").or(text.strip_prefix("http://"));
    let allowed = |byte: u8| byte.is_ascii_graphic() && !b"\"'`/\\?#@".contains(&byte);
    text.len() <= ORIGIN_BYTES_MAX
        && host.is_some_and(|host| !host.is_empty() && host.bytes().all(allowed))
}

/// Writes an origin. Panics on any other text, because the reader would refuse it.
pub(crate) fn write_origin(writer: &mut Writer, origin: &str) {
    assert!(is_origin(origin), "{origin:?} is no origin");
    writer.text(origin, ORIGIN_BYTES_MAX);
}

pub(crate) fn read_origin(reader: &mut Reader) -> Result<String, DecodeError> {
    let origin = reader.text(ORIGIN_BYTES_MAX, "origin")?;
    check(is_origin(origin), "origin")?;
    Ok(origin.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_is_a_scheme_a_host_and_a_port() {
        for origin in ["https://b.play.example.org", "http://127.0.0.1:8081", "http://[::1]:80"] {
            assert!(is_origin(origin), "{origin}");
        }
        let longest = format!("http://{}", "a".repeat(ORIGIN_BYTES_MAX - 7));
        assert!(is_origin(&longest) && !is_origin(&format!("{longest}a")));
        for wrong in [
            "",
            "http://",
            "https://",
            "ws://a",
            "HTTP://a",
            "a:80",
            "javascript:alert(1)",
            "http://a/",
            "http:///a",
            "http://a\\b",
            "http://a b",
            "http://a\"",
            "http://a'",
            "http://a?b",
            "http://a#b",
            "http://a@b",
            "http://a\n",
            "http://\u{e9}",
        ] {
            assert!(!is_origin(wrong), "{wrong:?}");
        }
    }
}
