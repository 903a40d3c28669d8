//! The requests that make their connection the socket of a session.

use super::response::{Answer, failed, upgrading};
use crate::host::rooms::is_code;
use crate::net::posts::Posts;
use crate::state::ServerState;
use hyper::body::Incoming;
use hyper::{Request, StatusCode};
use std::net::IpAddr;

/// A request that makes its connection the socket of a session.
pub struct Upgrade {
    /// The path without its leading slash.
    pub code: String,
    /// Address to which the session counts.
    pub address: IpAddr,
    pub opening: Opening,
}

/// The transport of a session.
pub enum Opening {
    /// A WebSocket; the response accepts the upgrade.
    WebSocket,
    /// A streamed response, whose head the socket sends, and these posts.
    Stream(Posts),
}

/// Advice for the operator of a proxy that breaks upgrades.
const PROXY_HEADERS: &str =
    "a proxy must speak HTTP/1.1 and pass on the headers Upgrade and Connection";

/// Accepts an upgrade for any room, because the page can learn about errors only through the socket. A path that cannot
/// be a code becomes the empty code, which does not name a room either.
pub fn upgrade(
    request: &Request<Incoming>,
    word: &str,
    address: IpAddr,
    state: &ServerState,
) -> (Answer, Option<Upgrade>) {
    let code = if is_code(word) { word } else { "" };
    match upgrading(request) {
        Ok(answer) => {
            let opening = Opening::WebSocket;
            (answer, Some(Upgrade { code: code.to_owned(), address, opening }))
        }
        Err(error) => {
            state.refused("no_upgrade", address, format_args!("{error}; {PROXY_HEADERS}"));
            let error = format!("no WebSocket upgrade: {error}; {PROXY_HEADERS}");
            (failed(StatusCode::BAD_REQUEST, &error), None)
        }
    }
}
