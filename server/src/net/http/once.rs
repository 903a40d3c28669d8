//! Headers that decide something, of which a request has one at most. Of two, a proxy may have looked at one, and this
//! server at the other.

use hyper::header::{self, HeaderMap, HeaderName};

/// Headers that are no lists (RFC 9110, section 5.3), but `Host`, which has rules of its own, and `Content-Length`, which
/// hyper sees to. `X-Forwarded-For` is a list, read as one.
const ONCE: [HeaderName; 5] = [
    header::ORIGIN,
    header::AUTHORIZATION,
    header::UPGRADE,
    header::SEC_WEBSOCKET_KEY,
    header::SEC_WEBSOCKET_VERSION,
];

/// Checks that none of them is doubled. An error is a sentence for the client.
pub fn check(headers: &HeaderMap) -> Result<(), String> {
    for name in ONCE {
        let count = headers.get_all(&name).iter().count();
        if count > 1 {
            return Err(format!("this request has {count} headers {name}; allowed: one"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyper::header::HeaderValue;

    #[test]
    fn a_doubled_header_that_decides_something_is_named() {
        for name in ONCE {
            let mut headers = HeaderMap::new();
            headers.append(&name, HeaderValue::from_static("http://here"));
            assert_eq!(check(&headers), Ok(()));
            // The same value too: whether it is the same is not for this to decide.
            headers.append(&name, HeaderValue::from_static("http://here"));
            let error = check(&headers).expect_err("two of them");
            assert!(error.contains(&format!("2 headers {name};")), "{error}");
        }
    }

    #[test]
    fn lists_may_be_sent_in_several_headers() {
        let mut headers = HeaderMap::new();
        for name in ["x-forwarded-for", "accept-encoding", "connection"] {
            for _ in 0..3 {
                headers.append(HeaderName::from_static(name), HeaderValue::from_static("a"));
            }
        }
        assert_eq!(check(&headers), Ok(()));
    }
}
