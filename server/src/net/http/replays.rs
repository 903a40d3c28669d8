//! Replays over HTTP: the list, the files, and the page that plays one. Names are only looked up in the list of
//! replays, so that no path can escape the replay directory.

use super::body::ResponseBody;
use super::page::is_around_link;
use super::response::{Answer, failed, json, not_found};
use crate::log::{Refused, ReplayStore};
use crate::state::ServerState;
use hyper::header::{self, HeaderValue};
use hyper::{Response, StatusCode};
use jostle_protocol::web::Replays;
use percent_encoding::percent_decode_str;
use std::net::IpAddr;

/// Lists the newest replays. The list is empty if nothing is recorded.
pub fn list(store: Option<&ReplayStore>) -> Answer {
    let (mut replays, mut errors, mut dropped) = (Vec::new(), 0, 0);
    if let Some(store) = store {
        (errors, dropped) = (store.policy().errors(), store.policy().dropped());
        replays = store.list();
    }
    json(StatusCode::OK, &Replays { replays, errors, dropped })
}

/// Status of the page that plays a replay, named with or without `.jostle`. The page itself says if the replay does not
/// exist.
pub fn page_status(name: &str, store: Option<&ReplayStore>) -> StatusCode {
    let name = name.strip_suffix(".jostle").unwrap_or(name);
    match store.is_some_and(|store| store.knows(name)) {
        true => StatusCode::OK,
        false => StatusCode::NOT_FOUND,
    }
}

/// The known replay that a link with more around its name refers to; `None` if the link is right or hopeless.
pub fn meant(name: &str, store: Option<&ReplayStore>) -> Option<String> {
    let text = percent_decode_str(name).decode_utf8().ok()?;
    let known = text.trim_matches(is_around_link);
    let is_other = known != name.trim_end_matches('/');
    (is_other && page_status(known, store) == StatusCode::OK).then(|| known.to_owned())
}

/// Serves a replay, or the part of it written so far.
pub async fn file(file: &str, address: IpAddr, state: &ServerState) -> Answer {
    let (Some(store), Some(name)) = (state.replays(), file.strip_suffix(".jostle")) else {
        return not_found();
    };
    let readable = match store.read(name, address) {
        Ok(readable) => readable,
        Err(Refused::Unknown) => return not_found(),
        Err(Refused::Busy) => {
            state.refused("replays_busy", address, name);
            let text =
                "too many replays are being downloaded, by your network or in all; try again later";
            return failed(StatusCode::SERVICE_UNAVAILABLE, text);
        }
    };
    match ResponseBody::open(readable).await {
        Ok(body) => {
            let mut answer = Response::new(body);
            let headers = answer.headers_mut();
            let bytes = HeaderValue::from_static("application/octet-stream");
            headers.insert(header::CONTENT_TYPE, bytes);
            headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
            answer
        }
        Err(error) => {
            state.refused("unreadable_replay", address, format_args!("{name}: {error}"));
            not_found()
        }
    }
}
