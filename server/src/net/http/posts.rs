//! The requests of game sessions over HTTP: one that opens the stream, and the posts. See [`crate::net::posts`].

use super::read;
use super::response::{Answer, busy, failed, uncached};
use super::upgrade::{Opening, Upgrade};
use crate::host::random;
use crate::host::rooms::is_code;
use crate::net::posts::{PostError, PostQueue, PostStreams};
use crate::state::ServerState;
use hyper::body::{Body, Bytes, Incoming};
use hyper::header::{self, HeaderMap, HeaderName, HeaderValue};
use hyper::{Method, Request, StatusCode};
use jostle_protocol::limits::POST_BYTES_MAX;
use std::net::IpAddr;
use std::sync::Arc;

/// Number of hexadecimal digits of a session's id.
const ID_DIGITS: usize = 32;
/// The content type of a stream, which no proxy compresses.
const FRAMES: &str = "application/octet-stream";

/// The part of a path after these words, which differ by what it names.
enum Target<'a> {
    /// The code of a room.
    Room(&'a str),
    /// A session's id and the number of a post.
    Post(&'a str),
}

fn target<'a>(method: &Method, path: &'a str) -> Option<Target<'a>> {
    let path = path.strip_prefix("/api/").filter(|_| *method == Method::POST)?;
    let room = path.strip_prefix("stream/").map(Target::Room);
    room.or_else(|| path.strip_prefix("send/").map(Target::Post))
}

/// The queue for a post, if the request is one and its session exists.
pub fn queue(request: &Request<Incoming>, state: &ServerState) -> Option<Arc<PostQueue>> {
    match target(request.method(), request.uri().path()) {
        Some(Target::Post(post)) => Some(find(post, &state.streams)?.0),
        _ => None,
    }
}

/// Whether a request is a post, to whichever session.
pub fn is_post(request: &Request<Incoming>) -> bool {
    matches!(target(request.method(), request.uri().path()), Some(Target::Post(_)))
}

/// The queue and the number of a post.
fn find(post: &str, streams: &PostStreams) -> Option<(Arc<PostQueue>, u32)> {
    let (id, number) = post.split_once('/')?;
    let is_id = id.len() == ID_DIGITS && id.bytes().all(|byte| byte.is_ascii_hexdigit());
    let id = u128::from_str_radix(id, 16).ok().filter(|_| is_id)?;
    Some((streams.find(id)?, number.parse().ok()?))
}

/// Answers a request of a session over HTTP; `None` for other requests.
pub async fn answer(
    request: Request<Incoming>,
    address: IpAddr,
    state: &ServerState,
) -> Result<(Answer, Option<Upgrade>), Request<Incoming>> {
    let origin = request.headers().get(header::ORIGIN).cloned();
    let path = request.uri().path().to_owned();
    let (mut answer, upgrade) = match target(request.method(), &path) {
        Some(Target::Room(code)) => open(&request, code, address, state),
        Some(Target::Post(post)) => (send(request, post, state).await, None),
        None => return Err(request),
    };
    // A page of another node follows its room here. Its origin was checked.
    if let Some(origin) = origin {
        answer.headers_mut().insert(header::ACCESS_CONTROL_ALLOW_ORIGIN, origin);
        answer.headers_mut().insert(header::VARY, HeaderValue::from_static("origin"));
    }
    Ok((answer, upgrade))
}

/// Begins a stream, for any room, because the session says what is wrong.
fn open(
    request: &Request<Incoming>,
    code: &str,
    address: IpAddr,
    state: &ServerState,
) -> (Answer, Option<Upgrade>) {
    if !request.body().is_end_stream() {
        let text = "a stream is opened by a request without a body";
        return (failed(StatusCode::BAD_REQUEST, text), None);
    }
    let id = u128::from(random()) << 64 | u128::from(random());
    let opening = Opening::Stream(state.streams.open(id));
    let code = if is_code(code) { code.to_owned() } else { String::new() };
    let mut answer = uncached(StatusCode::OK, FRAMES, Bytes::new());
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store, no-transform"),
        (header::CONNECTION, "close"),
        // Without this, nginx would collect the response before passing it on.
        (HeaderName::from_static("x-accel-buffering"), "no"),
    ] {
        answer.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    (answer, Some(Upgrade { code, address, opening }))
}

/// Passes the body of a post on to its session.
async fn send(request: Request<Incoming>, post: &str, state: &ServerState) -> Answer {
    let ended = || failed(StatusCode::NOT_FOUND, "this session has ended, or there was none");
    let Some((queue, number)) = find(post, &state.streams) else { return ended() };
    let body = match read::body(request, POST_BYTES_MAX, &state.host).await {
        Ok(body) => body,
        Err(error) => return error.answer(POST_BYTES_MAX),
    };
    match queue.push(number, body) {
        Ok(()) => uncached(StatusCode::NO_CONTENT, FRAMES, Bytes::new()),
        Err(PostError::Gap) => failed(StatusCode::CONFLICT, "posts before this one are missing"),
        Err(PostError::Full) => busy("the session has not read the last posts yet"),
        Err(PostError::Ended) => ended(),
    }
}

/// The beginning of a streamed response on the wire: the head, and the session's id as the first part of the body. The
/// body ends with the connection, and has no chunks, which a proxy that speaks HTTP/1.0 would not understand.
pub fn head(headers: &HeaderMap, id: &str) -> Vec<u8> {
    let mut head = b"HTTP/1.1 200 OK\r\n".to_vec();
    for (name, value) in headers {
        head.extend([name.as_str().as_bytes(), b": ", value.as_bytes(), b"\r\n"].concat());
    }
    head.extend([b"\r\n", id.as_bytes()].concat());
    head
}
