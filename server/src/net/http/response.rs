//! Responses of both ports.

use super::body::Body;
use hyper::body::Bytes;
use hyper::header::{self, HeaderValue};
use hyper::{Request, Response, StatusCode};
use serde::Serialize;
use serde_json::json;
use tungstenite::handshake::server::create_response_with_body;

/// Content type of plain text.
pub const TEXT: &str = "text/plain; charset=utf-8";

/// A response of either port.
pub type Answer = Response<Body>;

/// The response that accepts a WebSocket upgrade.
pub fn upgrading<T>(request: &Request<T>) -> tungstenite::Result<Answer> {
    create_response_with_body(request, || Body::new(Bytes::new()))
}

/// Builds a response from its parts.
pub fn respond(status: StatusCode, content_type: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = Response::new(Body::new(body.into()));
    *answer.status_mut() = status;
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
    answer
}

/// A response that no cache keeps.
pub fn uncached(status: StatusCode, content_type: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = respond(status, content_type, body);
    answer.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}

/// A JSON response that no cache keeps.
pub fn json(status: StatusCode, value: &impl Serialize) -> Answer {
    let body = serde_json::to_vec(value).expect("it holds strings and numbers only");
    uncached(status, "application/json", body)
}

/// A JSON response with an error for people.
pub fn failed(status: StatusCode, error: &str) -> Answer {
    json(status, &json!({ "error": error }))
}

/// The response for a path that leads nowhere.
pub fn not_found() -> Answer {
    respond(StatusCode::NOT_FOUND, TEXT, "Nothing here. The playground is at /\n")
}
