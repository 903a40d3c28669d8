//! The admin paths on the operators' port: list rooms, players and networks, kick a player, close a room, remove a best
//! run, ban a network, and drain the server. They require the operators' token; on a server without a token, they do
//! not exist.

use crate::host::room_handle::{AdminCommand, RoomInfo};
use crate::host::rooms::Rooms;
use crate::limits::networks::prefix;
use crate::net::http::response::{Answer, TEXT, json, uncached};
use crate::ops::bans::Bans;
use crate::runs::Records;
use crate::state::ServerState;
use hyper::body::Incoming;
use hyper::header::{self, HeaderMap, HeaderValue};
use hyper::{Method, Request, StatusCode};
use ipnet::IpNet;
use jostle_game::Seat;
use jostle_protocol::PlayerState;
use serde_json::{Value, json};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::io;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::sync::{Notify, oneshot};
use tokio::task::spawn_blocking;
use tokio::time::{Instant, timeout, timeout_at};
use tracing::{error, info};

/// Maximum number of networks shown to operators. Those with the most connections are shown.
const NETWORKS_SHOWN_MAX: usize = 100;
/// Default duration of a ban, in minutes.
const BAN_MINUTES: u32 = 60;
/// Maximum duration of a ban, in minutes: a year.
const BAN_MINUTES_MAX: u32 = 366 * 24 * 60;

const PATHS: &str = "GET /admin/rooms, POST /admin/rooms/CODE/close, \
    POST /admin/rooms/CODE/kick/SEAT, POST /admin/records/NAME/remove, GET /admin/networks, POST /admin/ban/ADDRESS[/BITS][?minutes=60], \
    DELETE /admin/ban/ADDRESS[/BITS] or POST /admin/drain\n";

const GIVEN_UP: &str = "the room did not answer, and was closed without its thread: its players are free, and so is its \
    link. The thread may run on until the server is restarted\n";

/// Answers a request whose path begins with `/admin/`; `rest` is the rest of the path.
pub async fn answer(request: &Request<Incoming>, rest: &str, state: &ServerState) -> Answer {
    let Some(token) = &state.config.ops_token else {
        let text = "this server was started without --ops-token-file\n";
        return uncached(StatusCode::NOT_FOUND, TEXT, text);
    };
    if !bearer(request.headers())
        .is_some_and(|given| state.host.signer.same(given, token.as_bytes()))
    {
        // This is counted but not logged, since otherwise anyone who can reach the port could fill the log.
        state.host.metrics.refused("ops_unauthorized");
        return unauthorized();
    }
    let (words, wait) = (rest.split('/').collect::<Vec<&str>>(), state.config.waits.command);
    match (request.method(), words.as_slice()) {
        (&Method::GET, ["rooms"]) => rooms(&state.rooms, wait).await,
        (&Method::POST, ["rooms", code, "close"]) => close(code, &state.rooms, wait).await,
        (&Method::POST, ["rooms", code, "kick", seat]) => {
            kick(code, seat, &state.rooms, wait).await
        }
        (&Method::POST, ["records", name, "remove"]) => {
            remove_record(name, state.records.clone()).await
        }
        (&Method::GET, ["networks"]) => networks(state),
        (&Method::POST, ["ban", network @ ..]) => ban(network, request.uri().query(), state),
        (&Method::DELETE, ["ban", network @ ..]) => lift(network, &state.bans),
        (&Method::POST, ["drain"]) => drain(&state.drain),
        _ => uncached(StatusCode::NOT_FOUND, TEXT, PATHS),
    }
}

/// A request's bearer token, if any.
fn bearer(headers: &HeaderMap) -> Option<&[u8]> {
    headers.get(header::AUTHORIZATION)?.as_bytes().strip_prefix(b"Bearer ")
}

fn unauthorized() -> Answer {
    let text = "the header Authorization: Bearer TOKEN is missing or wrong\n";
    let mut answer = uncached(StatusCode::UNAUTHORIZED, TEXT, text);
    let scheme = HeaderValue::from_static("Bearer");
    answer.headers_mut().insert(header::WWW_AUTHENTICATE, scheme);
    answer
}

async fn rooms(open: &Rooms, wait: Duration) -> Answer {
    // All rooms are asked before the first answer is awaited.
    let deadline = Instant::now() + wait;
    let asked: Vec<_> = open.list().into_iter().map(|info| (ask(&info, open), info)).collect();
    let mut rooms = Vec::new();
    for (players, info) in asked {
        // A room that is closing or whose command queue is full drops the request.
        let players = timeout_at(deadline, players).await.ok().and_then(Result::ok);
        rooms.push(entry(&info, players));
    }
    json(StatusCode::OK, &json!({ "rooms": rooms }))
}

/// Asks a room for its players.
fn ask(info: &RoomInfo, rooms: &Rooms) -> oneshot::Receiver<Vec<PlayerState>> {
    let (answer, players) = oneshot::channel();
    rooms.command(&info.code, AdminCommand::Players(answer));
    players
}

/// A room with its players, which are `null` if the room did not answer in time.
fn entry(info: &RoomInfo, players: Option<Vec<PlayerState>>) -> Value {
    let shown = |player: PlayerState| {
        json!({
            "seat": player.seat.0,
            "name": player.appearance.name.to_string(),
            "connected": player.connected,
            "score": player.score,
        })
    };
    let players = players.map(|players| players.into_iter().map(shown).collect::<Vec<_>>());
    json!({
        "code": info.code,
        "scene": info.scene.name,
        "private": info.private,
        "players": players,
        "spectators": info.spectators.load(Ordering::Relaxed),
        "tick": info.tick.load(Ordering::Relaxed),
        "tick_age_seconds": info.last_tick.age(std::time::Instant::now()).as_secs_f64(),
    })
}

/// Asks a room to close. If it does not answer, it is closed without its thread.
async fn close(code: &str, rooms: &Arc<Rooms>, wait: Duration) -> Answer {
    let Some(info) = rooms.get(code) else { return no_room() };
    info!(room = %code, "an operator closed a room");
    let (answer, closing) = oneshot::channel();
    let asked = async {
        rooms.insist(code, AdminCommand::Close(answer)).await;
        // An error means that the room has already ended.
        let _ = closing.await;
    };
    if timeout(wait, asked).await.is_ok() {
        return uncached(StatusCode::OK, TEXT, "closing\n");
    }
    error!(room = %code, "a room did not answer, and was closed without its thread, which may run on");
    let rooms = Arc::clone(rooms);
    let given_up = spawn_blocking(move || rooms.give_up(&info)).await;
    given_up.expect("giving a room up does not panic");
    uncached(StatusCode::OK, TEXT, GIVEN_UP)
}

async fn kick(code: &str, seat: &str, rooms: &Rooms, wait: Duration) -> Answer {
    let Ok(seat) = seat.parse() else {
        let text = format!("the seat is a number, found {seat:?}\n");
        return uncached(StatusCode::BAD_REQUEST, TEXT, text);
    };
    let (answer, kicked) = oneshot::channel();
    if !rooms.command(code, AdminCommand::Kick(Seat(seat), answer)) {
        return no_room();
    }
    match timeout(wait, kicked).await {
        Ok(Ok(true)) => uncached(StatusCode::OK, TEXT, "kicked\n"),
        Ok(Ok(false)) => uncached(StatusCode::NOT_FOUND, TEXT, "no player in this seat\n"),
        _ => uncached(StatusCode::SERVICE_UNAVAILABLE, TEXT, "the room did not answer\n"),
    }
}

/// Removes one of the best runs, and names the runs that return in its place.
async fn remove_record(name: &str, records: Option<Arc<Records>>) -> Answer {
    let removed = match records {
        Some(records) => {
            let name = name.to_owned();
            spawn_blocking(move || records.remove(&name)).await.map_err(io::Error::other)
        }
        None => Ok(Ok(None)),
    };
    match removed.and_then(|removed| removed) {
        Ok(None) => uncached(StatusCode::NOT_FOUND, TEXT, "no such record\n"),
        Ok(Some(back)) => {
            info!(record = %name, ?back, "an operator removed a record");
            let back = back.into_iter().map(|name| format!("{name} is among the best again\n"));
            uncached(StatusCode::OK, TEXT, "removed\n".to_owned() + &back.collect::<String>())
        }
        Err(error) => {
            let text = format!("the record cannot be removed: {error}\n");
            uncached(StatusCode::INTERNAL_SERVER_ERROR, TEXT, text)
        }
    }
}

/// The networks with the connections they hold, largest first, and the bans.
fn networks(state: &ServerState) -> Answer {
    let mut held: BTreeMap<IpAddr, [usize; 3]> = BTreeMap::new();
    let rooms = state.rooms.list();
    let creators = rooms.iter().filter_map(|info| Some((info.creator?, 1)));
    for (kind, holders) in
        [state.shares.connections.holders(), state.shares.sessions.holders(), creators.collect()]
            .into_iter()
            .enumerate()
    {
        for (network, count) in holders {
            held.entry(network).or_default()[kind] += count;
        }
    }
    let mut held: Vec<_> = held.into_iter().collect();
    held.sort_by_key(|&(network, counts)| (Reverse(counts), network));
    let shown = held.iter().take(NETWORKS_SHOWN_MAX);
    let shown = shown.map(|(network, [connections, players, rooms])| {
        json!({ "network": prefix(*network), "connections": connections, "players": players, "rooms": rooms })
    });
    json(
        StatusCode::OK,
        &json!({ "networks": shown.collect::<Vec<_>>(), "in_all": held.len(), "bans": state.bans.list() }),
    )
}

/// Bans a network for some minutes, and removes its players.
fn ban(words: &[&str], query: Option<&str>, state: &ServerState) -> Answer {
    let network = match network(words) {
        Ok(network) => network,
        Err(answer) => return *answer,
    };
    let minutes = match query.map(|query| query.strip_prefix("minutes=").map(str::parse)) {
        None => BAN_MINUTES,
        Some(Some(Ok(minutes))) if (1..=BAN_MINUTES_MAX).contains(&minutes) => minutes,
        Some(_) => {
            let max = BAN_MINUTES_MAX;
            let text =
                format!("found ?{}; allowed: ?minutes=1 to {max}\n", query.unwrap_or_default());
            return uncached(StatusCode::BAD_REQUEST, TEXT, text);
        }
    };
    let banned = state.bans.ban(network, Duration::from_secs(u64::from(minutes) * 60));
    for info in state.rooms.list() {
        state.rooms.command(&info.code, AdminCommand::Evict(network));
    }
    info!(%network, minutes, "an operator banned a network");
    kept(banned.map(|_| "banned\n"))
}

fn lift(words: &[&str], bans: &Bans) -> Answer {
    match network(words) {
        Ok(network) => match bans.lift(network) {
            Ok(false) => uncached(StatusCode::NOT_FOUND, TEXT, "this network is not banned\n"),
            lifted => {
                info!(%network, "an operator lifted a ban");
                kept(lifted.map(|_| "lifted\n"))
            }
        },
        Err(answer) => *answer,
    }
}

/// The answer to a change in the bans. Writing them to the state directory may have failed.
fn kept(changed: io::Result<&'static str>) -> Answer {
    match changed {
        Ok(text) => uncached(StatusCode::OK, TEXT, text),
        Err(error) => {
            let text = format!("done, but it will not outlive this process: {error}\n");
            uncached(StatusCode::INTERNAL_SERVER_ERROR, TEXT, text)
        }
    }
}

/// Parses a network: an address with a prefix length, or just an address, which stands for itself or for its IPv6 /64.
fn network(words: &[&str]) -> Result<IpNet, Box<Answer>> {
    let text = words.join("/");
    let address = || text.parse().ok().map(prefix);
    text.parse().ok().or_else(address).ok_or_else(|| {
        let text =
            format!("found {text:?}; allowed: an address, or a network such as 203.0.113.0/24\n");
        Box::new(uncached(StatusCode::BAD_REQUEST, TEXT, text))
    })
}

fn drain(drain: &Notify) -> Answer {
    info!("an operator drains the server");
    drain.notify_one();
    uncached(StatusCode::OK, TEXT, "draining\n")
}

fn no_room() -> Answer {
    uncached(StatusCode::NOT_FOUND, TEXT, "no such room, or its queue of commands is full\n")
}
