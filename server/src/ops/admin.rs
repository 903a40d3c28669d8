//! What operators do, on their port and with their token: see rooms and players, have a player leave,
//! close a room, drain the server. Who has no token, or a server that was started without one, changes
//! nothing and sees no names.

use super::{TEXT, respond};
use crate::rooms::Facts;
use crate::ticker::Order;
use crate::{App, limits};
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderMap, HeaderValue};
use hyper::{Method, Request, Response, StatusCode};
use jostle_protocol::PlayerState;
use jostle_sim::Seat;
use serde::Serialize;
use tokio::sync::oneshot;
use tokio::time::{Instant, timeout, timeout_at};
use tracing::info;

type Answer = Response<Full<Bytes>>;

const PATHS: &str = "GET /admin/rooms, POST /admin/rooms/CODE/close, \
    POST /admin/rooms/CODE/kick/SEAT or POST /admin/drain\n";

#[derive(Serialize)]
struct RoomEntry {
    code: String,
    scene: String,
    private: bool,
    /// `null` if the room did not answer in time.
    players: Option<Vec<PlayerEntry>>,
}

#[derive(Serialize)]
struct PlayerEntry {
    seat: u16,
    name: String,
    connected: bool,
    score: u16,
}

/// Answers a request whose path begins with `/admin/`; `rest` is what follows.
pub async fn answer(request: &Request<Incoming>, rest: &str, app: &App) -> Answer {
    let Some(token) = &app.ops_token else {
        let text = "this server was started without --ops-token-file\n";
        return respond(StatusCode::NOT_FOUND, TEXT, text.into());
    };
    if !bearer(request.headers()).is_some_and(|given| app.sealer.same(given, token.as_bytes())) {
        // Counted and not logged: anybody who reaches the port could fill the log.
        app.metrics.turned_away("ops_unauthorized");
        return unauthorized();
    }
    let words: Vec<&str> = rest.split('/').collect();
    match (request.method(), words.as_slice()) {
        (&Method::GET, ["rooms"]) => rooms(app).await,
        (&Method::POST, ["rooms", code, "close"]) => close(code, app),
        (&Method::POST, ["rooms", code, "kick", seat]) => kick(code, seat, app).await,
        (&Method::POST, ["drain"]) => drain(app),
        _ => respond(StatusCode::NOT_FOUND, TEXT, PATHS.into()),
    }
}

/// The token that a request brings, if it brings one.
fn bearer(headers: &HeaderMap) -> Option<&[u8]> {
    headers.get(header::AUTHORIZATION)?.as_bytes().strip_prefix(b"Bearer ")
}

fn unauthorized() -> Answer {
    let text = "the header Authorization: Bearer TOKEN is missing or wrong\n";
    let mut answer = respond(StatusCode::UNAUTHORIZED, TEXT, text.into());
    let scheme = HeaderValue::from_static("Bearer");
    answer.headers_mut().insert(header::WWW_AUTHENTICATE, scheme);
    answer
}

async fn rooms(app: &App) -> Answer {
    // All are asked before the first is waited for.
    let deadline = Instant::now() + limits::ORDER_WAIT;
    let asked: Vec<_> =
        app.rooms.list().into_iter().map(|facts| (ask(&facts, app), facts)).collect();
    let mut rooms = Vec::new();
    for (players, facts) in asked {
        // A room that is closing, or has too many orders waiting, drops the question.
        let players = timeout_at(deadline, players).await.ok().and_then(Result::ok);
        rooms.push(entry(&facts, players));
    }
    let body = serde_json::to_string(&serde_json::json!({ "rooms": rooms }));
    let body = body.expect("strings and numbers only");
    respond(StatusCode::OK, "application/json", body)
}

/// Asks a room who plays there.
fn ask(facts: &Facts, app: &App) -> oneshot::Receiver<Vec<PlayerState>> {
    let (answer, players) = oneshot::channel();
    app.rooms.order(&facts.code, Order::Players(answer));
    players
}

fn entry(facts: &Facts, players: Option<Vec<PlayerState>>) -> RoomEntry {
    let shown = |player: PlayerState| PlayerEntry {
        seat: player.seat.0,
        name: player.appearance.name,
        connected: player.connected,
        score: player.score,
    };
    RoomEntry {
        code: facts.code.clone(),
        scene: facts.scene.name.clone(),
        private: facts.private,
        players: players.map(|players| players.into_iter().map(shown).collect()),
    }
}

fn close(code: &str, app: &App) -> Answer {
    if !app.rooms.order(code, Order::Close) {
        return no_room();
    }
    info!(room = %code, "an operator closed a room");
    respond(StatusCode::OK, TEXT, "closing\n".into())
}

async fn kick(code: &str, seat: &str, app: &App) -> Answer {
    let Ok(seat) = seat.parse() else {
        let text = format!("the seat is a number, found {seat:?}\n");
        return respond(StatusCode::BAD_REQUEST, TEXT, text);
    };
    let (answer, kicked) = oneshot::channel();
    if !app.rooms.order(code, Order::Kick(Seat(seat), answer)) {
        return no_room();
    }
    match timeout(limits::ORDER_WAIT, kicked).await {
        Ok(Ok(true)) => respond(StatusCode::OK, TEXT, "kicked\n".into()),
        Ok(Ok(false)) => respond(StatusCode::NOT_FOUND, TEXT, "nobody sits there\n".into()),
        _ => respond(StatusCode::SERVICE_UNAVAILABLE, TEXT, "the room did not answer\n".into()),
    }
}

fn drain(app: &App) -> Answer {
    info!("an operator drains the server");
    app.drain.notify_one();
    respond(StatusCode::OK, TEXT, "draining\n".into())
}

fn no_room() -> Answer {
    respond(StatusCode::NOT_FOUND, TEXT, "no such room, or it has enough to do\n".into())
}
