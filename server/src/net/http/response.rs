//! Responses on both ports.

use super::body::ResponseBody;
use hyper::body::Bytes;
use hyper::header::{self, HeaderMap, HeaderValue};
use hyper::{Request, Response, StatusCode};
use jostle_protocol::web::Posted;
use miniz_oxide::deflate::compress_to_vec_zlib;
use serde::Serialize;
use tungstenite::handshake::server::create_response_with_body;

/// Content type of plain text.
pub const TEXT: &str = "text/plain; charset=utf-8";

/// Compression level. Higher levels do not make 6 kB of scenes any smaller.
const PACKING_LEVEL: u8 = 6;

/// Seconds after which a refused client may try again. By then, most trials are over.
const BUSY_RETRY: HeaderValue = HeaderValue::from_static("3");

/// A response on either port.
pub type Answer = Response<ResponseBody>;

/// The response that accepts a WebSocket upgrade.
pub fn upgrading<T>(request: &Request<T>) -> tungstenite::Result<Answer> {
    create_response_with_body(request, || ResponseBody::new(Bytes::new()))
}

/// Builds a response from its parts.
pub fn respond(status: StatusCode, content_type: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = Response::new(ResponseBody::new(body.into()));
    *answer.status_mut() = status;
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
    answer
}

/// Builds a response that must not be cached.
pub fn uncached(status: StatusCode, content_type: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = respond(status, content_type, body);
    answer.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}

/// Builds a JSON response that must not be cached.
pub fn json(status: StatusCode, value: &impl Serialize) -> Answer {
    let body = serde_json::to_vec(value).expect("it holds strings and numbers only");
    uncached(status, "application/json", body)
}

/// Like [`json`], for lists, which every visitor polls. The response is deflated if the browser accepts that.
pub fn packed(headers: &HeaderMap, value: &impl Serialize) -> Answer {
    let plain = serde_json::to_vec(value).expect("it holds strings and numbers only");
    let packs = accepts(headers, "deflate");
    // HTTP calls the zlib format by this name (RFC 9110, 8.4.1.2).
    let body = if packs { compress_to_vec_zlib(&plain, PACKING_LEVEL) } else { plain };
    let mut answer = uncached(StatusCode::OK, "application/json", body);
    answer.headers_mut().insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    if packs {
        answer.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static("deflate"));
    }
    answer
}

/// Returns whether a browser accepts this content coding.
pub fn accepts(headers: &HeaderMap, coding: &str) -> bool {
    let values = headers.get_all(header::ACCEPT_ENCODING).iter();
    let mut offers =
        values.filter_map(|value| value.to_str().ok()).flat_map(|value| value.split(','));
    offers.any(|offer| {
        let (name, quality) = offer.split_once(';').unwrap_or((offer, "q=1"));
        let refused = quality.trim().strip_prefix("q=").is_some_and(|q| q.parse() == Ok(0.0));
        name.trim().eq_ignore_ascii_case(coding) && !refused
    })
}

/// A JSON response with an error message for people.
pub fn failed(status: StatusCode, error: &str) -> Answer {
    json(status, &Posted { error: Some(error.to_owned()), ..Posted::default() })
}

/// The response to a client when the server is too busy for its request.
pub fn busy(error: &str) -> Answer {
    let mut answer = failed(StatusCode::SERVICE_UNAVAILABLE, error);
    answer.headers_mut().insert(header::RETRY_AFTER, BUSY_RETRY);
    answer
}

/// The response to an unknown path.
pub fn not_found() -> Answer {
    respond(StatusCode::NOT_FOUND, TEXT, "Nothing here. The playground is at /\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use http_body_util::BodyExt;
    use miniz_oxide::inflate::decompress_to_vec_zlib;
    use serde_json::json;

    #[tokio::test]
    async fn a_list_is_packed_for_browsers_that_take_it() {
        let list = json!({ "scenes": vec!["arena"; 99] });
        for (offers, packs) in [("gzip, deflate, br", true), ("deflate;q=0", false), ("", false)] {
            let headers = [(header::ACCEPT_ENCODING, HeaderValue::from_static(offers))];
            let answer = packed(&HeaderMap::from_iter(headers), &list);
            let coding = answer.headers().get(header::CONTENT_ENCODING).cloned();
            assert_eq!(coding, packs.then(|| HeaderValue::from_static("deflate")), "{offers}");
            let mut body =
                answer.into_body().collect().await.expect("a whole body").to_bytes().to_vec();
            if packs {
                assert!(body.len() < 100, "{} bytes", body.len());
                body = decompress_to_vec_zlib(&body).expect("a zlib stream");
            }
            assert_eq!(serde_json::from_slice::<serde_json::Value>(&body).ok(), Some(list.clone()));
        }
    }
}
