//! The page, its files, and room links.

use super::response::{Answer, TEXT, accepts, not_found, respond};
use crate::host::rooms::is_code;
use crate::net::assets::{self, AssetFile};
use crate::state::ServerState;
use hyper::StatusCode;
use hyper::body::Bytes;
use hyper::header::{self, HeaderMap, HeaderValue};
use percent_encoding::percent_decode_str;

/// A year, the longest time that browsers cache anything.
const FOR_GOOD: &str = "public, max-age=31536000, immutable";

/// Serves the page for a room link, even a mistyped one. The page itself says if a room does not exist; other clients
/// can tell from the status.
pub fn room_page(headers: &HeaderMap, word: &str, state: &ServerState) -> Answer {
    match meant_code(word) {
        _ if state.knows_room(word) => page(state.config.files, headers, StatusCode::OK),
        Some(code) if code != word => redirect(&code),
        _ => page(state.config.files, headers, StatusCode::NOT_FOUND),
    }
}

/// The room code that a link refers to, even if the link was typed by hand, capitalised by a phone, or copied along with
/// the punctuation around it in a sentence.
pub fn meant_code(word: &str) -> Option<String> {
    let text = percent_decode_str(word).decode_utf8().ok()?;
    let code = text.trim_matches(is_around_link).to_ascii_lowercase();
    is_code(&code).then_some(code)
}

/// Whether a character next to a link belongs to the sentence: a space, a slash, or punctuation of any script. A
/// percent sign would be half of an encoded character.
pub fn is_around_link(c: char) -> bool {
    match c {
        '%' | '+' | '-' => false,
        _ if c.is_ascii() => c.is_ascii_punctuation() || c.is_whitespace(),
        _ => !c.is_alphanumeric(),
    }
}

/// Redirects a browser to the canonical link of a room or a replay. The path has no leading slash.
pub fn redirect(path: &str) -> Answer {
    let mut answer = respond(StatusCode::FOUND, TEXT, "This has another link.\n");
    let link = HeaderValue::try_from(format!("/{path}")).expect("codes and names are plain ASCII");
    answer.headers_mut().insert(header::LOCATION, link);
    answer
}

/// Serves the page with this status, or instructions for building it.
pub fn page(files: &'static [AssetFile], headers: &HeaderMap, status: StatusCode) -> Answer {
    match assets::find(files, "index.html") {
        Some(file) => served(files, headers, file, status),
        None => respond(status, assets::content_type("index.html"), assets::NOT_BUILT),
    }
}

/// Serves one of the page's files. Under an address that contains this build's version, browsers may cache the file
/// permanently. A page from another build gets this build's file, as if the address had no version.
pub fn asset(files: &'static [AssetFile], headers: &HeaderMap, name: &str) -> Answer {
    let versioned = name.split_once('/').filter(|(word, _)| word.starts_with("v-"));
    let (version, name) = versioned.map_or((None, name), |(word, name)| (Some(word), name));
    let Some(file) = assets::find(files, name) else { return not_found() };
    let mut answer = served(files, headers, file, StatusCode::OK);
    if version.is_some() && version == assets::version(files) {
        answer.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static(FOR_GOOD));
    }
    answer
}

/// Serves a file that browsers must revalidate each time. The ETag makes that cheap.
fn served(
    files: &'static [AssetFile],
    headers: &HeaderMap,
    file: &'static AssetFile,
    status: StatusCode,
) -> Answer {
    served_from(headers, file, assets::find_brotli(files, file.name), status)
}

fn served_from(
    headers: &HeaderMap,
    file: &'static AssetFile,
    packed: Option<&'static AssetFile>,
    status: StatusCode,
) -> Answer {
    let chosen = packed.filter(|_| accepts(headers, "br")).unwrap_or(file);
    let fresh = status == StatusCode::OK && has_etag(headers, chosen.etag);
    let (status, bytes) =
        if fresh { (StatusCode::NOT_MODIFIED, &[][..]) } else { (status, chosen.bytes) };
    let mut answer = respond(status, assets::content_type(file.name), Bytes::from_static(bytes));
    let answered = answer.headers_mut();
    answered.insert(header::ETAG, HeaderValue::from_static(chosen.etag));
    answered.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if packed.is_some() {
        answered.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    }
    if !std::ptr::eq(chosen, file) {
        answered.insert(header::CONTENT_ENCODING, HeaderValue::from_static("br"));
    }
    answer
}

fn has_etag(headers: &HeaderMap, etag: &str) -> bool {
    let values = headers.get_all(header::IF_NONE_MATCH).iter();
    values
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .any(|held| held.trim().trim_start_matches("W/") == etag)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: header::HeaderName, value: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_static(value))])
    }

    #[test]
    fn brotli_is_used_only_where_it_is_accepted() {
        for yes in ["br", "gzip, deflate, br", "gzip;q=1.0, BR ; q=0.5"] {
            assert!(accepts(&headers(header::ACCEPT_ENCODING, yes), "br"), "{yes}");
        }
        for no in ["gzip", "brotli", "br;q=0", "br; q=0.000", ""] {
            assert!(!accepts(&headers(header::ACCEPT_ENCODING, no), "br"), "{no}");
        }
    }

    static PLAIN: AssetFile =
        AssetFile { name: "client.js", etag: "\"plain\"", bytes: b"let answer = 42;" };
    static PACKED: AssetFile =
        AssetFile { name: "client.js.br", etag: "\"packed\"", bytes: b"packed" };

    /// Status, ETag and whether brotli is used, for a browser that sends these two headers.
    fn asked(accepts: &'static str, holds: &'static str) -> (u16, String, bool) {
        let mut sent = headers(header::ACCEPT_ENCODING, accepts);
        sent.insert(header::IF_NONE_MATCH, HeaderValue::from_static(holds));
        let answer = served_from(&sent, &PLAIN, Some(&PACKED), StatusCode::OK);
        let got = answer.headers();
        assert_eq!(got[header::VARY], "accept-encoding");
        assert_eq!(got[header::CACHE_CONTROL], "no-cache");
        assert_eq!(got[header::CONTENT_TYPE], "text/javascript; charset=utf-8");
        let etag = got[header::ETAG].to_str().expect("text").to_owned();
        (answer.status().as_u16(), etag, got.contains_key(header::CONTENT_ENCODING))
    }

    #[test]
    fn the_variant_that_a_browser_holds_is_not_sent_again() {
        assert_eq!(asked("br", ""), (200, PACKED.etag.into(), true));
        assert_eq!(asked("gzip", ""), (200, PLAIN.etag.into(), false));
        assert_eq!(asked("br", "\"packed\""), (304, PACKED.etag.into(), true));
        assert_eq!(asked("br", "\"plain\""), (200, PACKED.etag.into(), true));
        assert_eq!(asked("gzip", "W/\"plain\""), (304, PLAIN.etag.into(), false));
    }

    #[test]
    fn odd_links_mean_a_room() {
        for word in ["ABC", "abc/", "/abc", "%20abc", "Abc%20/", "abc%C2%A0", "%41bc"] {
            assert_eq!(meant_code(word).as_deref(), Some("abc"), "{word}");
        }
        for around in "./,;:!?)]}>\"'*_|~`\u{201d}\u{2026}\u{3002}\u{200b}".chars() {
            let word = format!("abc{around}");
            assert_eq!(meant_code(&word).as_deref(), Some("abc"), "{word}");
        }
        for word in ["(ABC).", "%3Cabc%3E", "abc%22,", "abc%E2%80%9D"] {
            assert_eq!(meant_code(word).as_deref(), Some("abc"), "{word}");
        }
        for word in
            ["", "/", "...", "r/abc", "a%20c", "abc%00", "abc%2", "%zz", "%+1", "%ff", "\u{e4}bc"]
        {
            assert_eq!(meant_code(word), None, "{word}");
        }
    }

    #[test]
    fn a_held_etag_is_found_in_a_list() {
        let held = headers(header::IF_NONE_MATCH, "\"a\", W/\"b\"");
        assert!(has_etag(&held, "\"a\"") && has_etag(&held, "\"b\""));
        assert!(!has_etag(&held, "\"c\""));
    }
}
