//! HTTP on the players' port: the page and its files, the lists of scenes and rooms, and the upgrade that starts a
//! session. It is deliberately small; everything not listed in [`route`] is refused.

mod api;
mod body;
pub mod gallery;
mod guests;
pub mod headers;
pub mod host;
mod origin;
mod page;
pub mod posts;
mod read;
mod records;
mod replays;
pub mod response;
mod upgrade;

pub use origin::is_proxy;
pub use page::meant_code;
pub use upgrade::{Opening, Upgrade};

use crate::fleet::handle::Fleet;
use crate::limits::{self, Timeouts};
use crate::net::assets;
use crate::ops::refusal_log::Foreign;
use crate::state::ServerState;
use hyper::body::Incoming;
use hyper::header::{self, HeaderMap, HeaderValue};
use hyper::server::conn::http1;
use hyper::{Method, Request, StatusCode};
use hyper_util::rt::TokioTimer;
use page::{asset, page, redirect, room_page};
use response::{Answer, TEXT, failed, packed, respond};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Instant;

/// Maximum number of headers in a request.
const HTTP_HEADERS_MAX: usize = 64;

/// Error for a client on a banned network.
const BANNED: &str = "the operators of this server have banned your network for a while";

/// Error for a request from another site's page.
const FOREIGN: &str = "this page belongs to another site, or a proxy changed the header Host; \
    another site can be allowed with --allow-origin";

/// Creates an HTTP/1 builder with the limits that apply to both ports.
pub fn builder(waits: &Timeouts) -> http1::Builder {
    let mut builder = http1::Builder::new();
    builder
        .timer(TokioTimer::new())
        .header_read_timeout(waits.http_head)
        .max_headers(HTTP_HEADERS_MAX)
        .max_buf_size(limits::HTTP_BUFFER_BYTES_MAX);
    builder
}

/// Answers a request from `peer`. An accepted upgrade is returned so that the connection can carry it out.
pub async fn answer(
    request: Request<Incoming>,
    peer: IpAddr,
    state: &ServerState,
) -> (Answer, Option<Upgrade>) {
    let client = origin::client_address(request.headers(), peer, &state.config.trusted_proxies);
    if let Some(text) = &client.unreadable {
        // Otherwise, a proxy that uses a different format would make all of its clients look like one.
        state.refused("unreadable_forwarded_for", peer, Foreign(text.as_bytes()));
    }
    let address = client.ip;
    // A session limits its posts itself.
    let admitted = match posts::queue(&request, state) {
        Some(posts) => posts.admit(Instant::now()).then_some(None).ok_or("requests_too_fast"),
        None => state.shares.admit_request(address).map(Some),
    };
    let (mut answer, upgrade) = match admitted {
        _ if state.bans.is_banned(address) => {
            state.refused("banned", address, "a request");
            (failed(StatusCode::FORBIDDEN, BANNED), None)
        }
        Ok(permit) => {
            let (mut answer, upgrade) = route(request, address, state).await;
            permit.into_iter().for_each(|permit| answer.body_mut().holds(permit));
            (answer, upgrade)
        }
        Err(reason) => {
            state.refused(reason, address, "a request");
            (too_many(), None)
        }
    };
    // The answer to a post contains nothing to protect, and comes up to 60 times a second.
    if answer.status() != StatusCode::NO_CONTENT {
        state.protection.add_to(answer.headers_mut());
    }
    (answer, upgrade)
}

async fn route(
    request: Request<Incoming>,
    address: IpAddr,
    state: &ServerState,
) -> (Answer, Option<Upgrade>) {
    if let Err(error) = host::check_once(request.headers()) {
        state.refused("doubled_header", address, &error);
        return (failed(StatusCode::BAD_REQUEST, &error), None);
    }
    if let Err(error) = host::check(&request, &state.config.hosts) {
        let host = request.headers().get(header::HOST).map_or(&[][..], HeaderValue::as_bytes);
        state.refused("bad_host", address, Foreign(host));
        return (failed(StatusCode::BAD_REQUEST, &error), None);
    }
    let path = request.uri().path().to_owned();
    // A CONNECT request has no path, and the path of `OPTIONS *` has no slash.
    let word = path.strip_prefix('/').unwrap_or_default();
    let upgrades = request.headers().contains_key(header::UPGRADE);
    let reads = matches!(*request.method(), Method::GET | Method::HEAD);
    if (upgrades || !reads) && !is_allowed_page(request.headers(), state) {
        let [origin, host] = [header::ORIGIN, header::HOST].map(|name| {
            Foreign(request.headers().get(name).map_or(&[][..], HeaderValue::as_bytes))
        });
        // A proxy that replaces the host makes the site's own pages look foreign.
        state.refused("foreign_page", address, format_args!("{origin} at the host {host}"));
        return (failed(StatusCode::FORBIDDEN, FOREIGN), None);
    }
    // A proxy that does not pass on upgrades removes two headers, but none of these.
    if upgrades || request.headers().contains_key(header::SEC_WEBSOCKET_KEY) {
        return upgrade::upgrade(&request, word, address, state);
    }
    let request = match posts::answer(request, address, state).await {
        Ok(answered) => return answered,
        Err(other) => other,
    };
    let answer = match path.as_str() {
        "/api/rooms" if *request.method() == Method::POST => {
            api::create_room(request, address, state).await
        }
        "/api/guest-rooms" if *request.method() == Method::POST => {
            guests::create_room(request, address, state).await
        }
        "/api/guest-rooms" => not_allowed(&path),
        "/api/next" if *request.method() == Method::POST => api::next_room(request, state).await,
        "/api/next" => not_allowed(&path),
        "/api/records" if *request.method() == Method::POST => {
            records::submit(request, address, state).await
        }
        _ if !reads => not_allowed(&path),
        "/" => page(state.config.files, request.headers(), StatusCode::OK),
        "/api/scenes" => packed(request.headers(), &api::scenes(state)),
        "/api/rooms" => packed(request.headers(), &api::rooms(request.uri().query(), state)),
        "/api/replays" => replays::list(state.replays()),
        "/api/records" => records::list(request.uri().query(), state.records.as_deref()),
        _ => other_path(request.headers(), word, address, state).await,
    };
    (answer, None)
}

/// Returns whether a request came from one of this site's pages, or from a page of an allowed site or another node.
fn is_allowed_page(headers: &HeaderMap, state: &ServerState) -> bool {
    let of_node = |fleet: &Arc<Fleet>| {
        let origin = headers.get(header::ORIGIN).and_then(|origin| origin.to_str().ok());
        origin.is_some_and(|origin| fleet.is_site(origin))
    };
    origin::is_allowed(headers, &state.config.origins) || state.fleet.as_ref().is_some_and(of_node)
}

/// Answers requests for paths that contain a name.
async fn other_path(
    headers: &HeaderMap,
    word: &str,
    address: IpAddr,
    state: &ServerState,
) -> Answer {
    match word.split_once('/') {
        Some(("assets", name)) => {
            own_scene(name, state).unwrap_or_else(|| asset(state.config.files, headers, name))
        }
        Some(("gallery", file)) => state.config.gallery.picture(file),
        Some(("records", file)) => records::file(file, address, state).await,
        Some(("replays", file)) => replays::file(file, address, state).await,
        Some(("replay", name)) => match replays::meant(name, state.replays()) {
            Some(known) => redirect(&format!("replay/{known}")),
            None => page(state.config.files, headers, replays::page_status(name, state.replays())),
        },
        Some(("api", _)) => failed(StatusCode::NOT_FOUND, "there is nothing at this address"),
        _ => room_page(headers, word, state),
    }
}

/// The file of a scene that is not built in or that differs from the built-in one. Pages use it to play alone.
fn own_scene(name: &str, state: &ServerState) -> Option<Answer> {
    let scene = name.strip_prefix("scenes/")?.strip_suffix(".toml")?;
    let scene = state.rooms.scene(scene)?;
    let shipped = assets::find(state.config.files, name);
    let is_shipped = shipped.is_some_and(|file| file.bytes == scene.source.as_bytes());
    (!is_shipped).then(|| respond(StatusCode::OK, TEXT, scene.source.clone()))
}

/// The response to an address that has sent too many requests.
fn too_many() -> Answer {
    let text = "your network sends too many requests; try again in a second";
    let mut answer = failed(StatusCode::TOO_MANY_REQUESTS, text);
    answer.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
    answer
}

fn not_allowed(path: &str) -> Answer {
    let allowed = match path {
        "/api/rooms" | "/api/records" => "GET, HEAD, POST",
        "/api/guest-rooms" | "/api/next" => "POST",
        _ if path.starts_with("/api/stream/") || path.starts_with("/api/send/") => "POST",
        _ => "GET, HEAD",
    };
    let mut answer =
        respond(StatusCode::METHOD_NOT_ALLOWED, TEXT, "This method is not allowed here.\n");
    answer.headers_mut().insert(header::ALLOW, HeaderValue::from_static(allowed));
    answer
}
