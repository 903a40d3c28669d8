//! Responses of the players' port.

use super::file_body::FileBody;
use super::memory_body::MemoryBody;
use http_body_util::Either;
use hyper::body::Bytes;
use hyper::header::{self, HeaderValue};
use hyper::{Request, Response, StatusCode};
use serde::Serialize;
use tokio_tungstenite::tungstenite;
use tokio_tungstenite::tungstenite::handshake::server::create_response_with_body;

/// A response of the players' port.
pub type Answer = Response<Body>;

/// Bytes in memory, or a file that is read as it is sent.
pub type Body = Either<MemoryBody, FileBody>;

#[derive(Serialize)]
struct Failed {
    error: String,
}

/// The response that accepts a WebSocket upgrade.
pub fn upgrading<T>(request: &Request<T>) -> tungstenite::Result<Answer> {
    create_response_with_body(request, || Body::Left(MemoryBody::default()))
}

/// Builds a response from its parts.
pub fn respond(status: StatusCode, content_type: &'static str, body: Bytes) -> Answer {
    let mut answer = Response::new(Body::Left(MemoryBody::new(body)));
    *answer.status_mut() = status;
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
    answer
}

/// A response of plain text.
pub fn text(status: StatusCode, body: &'static str) -> Answer {
    respond(status, "text/plain; charset=utf-8", Bytes::from_static(body.as_bytes()))
}

/// A JSON response that no cache keeps.
pub fn json(status: StatusCode, value: &impl Serialize) -> Answer {
    let body = serde_json::to_vec(value).expect("these structs hold strings and numbers only");
    let mut answer = respond(status, "application/json", body.into());
    answer.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}

/// A JSON response with an error for people.
pub fn failed(status: StatusCode, error: &str) -> Answer {
    json(status, &Failed { error: error.to_owned() })
}

/// The response for a path that leads nowhere.
pub fn not_found() -> Answer {
    text(StatusCode::NOT_FOUND, "Nothing here. The playground is at /\n")
}
