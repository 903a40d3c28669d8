//! The admin paths of the operators' port: list rooms and players, kick a player, close a room, drain the
//! server. They need the operators' token; a server without one has no such paths.

use crate::host::room_handle::{AdminCommand, RoomInfo};
use crate::limits;
use crate::ops::response::{TEXT, respond};
use crate::state::ServerState;
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderMap, HeaderValue};
use hyper::{Method, Request, Response, StatusCode};
use jostle_game::Seat;
use jostle_protocol::PlayerState;
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
pub async fn answer(request: &Request<Incoming>, rest: &str, state: &ServerState) -> Answer {
    let Some(token) = &state.ops_token else {
        let text = "this server was started without --ops-token-file\n";
        return respond(StatusCode::NOT_FOUND, TEXT, text.into());
    };
    if !bearer(request.headers()).is_some_and(|given| state.signer.same(given, token.as_bytes())) {
        // Counted and not logged: anyone who reaches the port could fill the log.
        state.metrics.refused("ops_unauthorized");
        return unauthorized();
    }
    let words: Vec<&str> = rest.split('/').collect();
    match (request.method(), words.as_slice()) {
        (&Method::GET, ["rooms"]) => rooms(state).await,
        (&Method::POST, ["rooms", code, "close"]) => close(code, state),
        (&Method::POST, ["rooms", code, "kick", seat]) => kick(code, seat, state).await,
        (&Method::POST, ["drain"]) => drain(state),
        _ => respond(StatusCode::NOT_FOUND, TEXT, PATHS.into()),
    }
}

/// The token of a request, if it has one.
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

async fn rooms(state: &ServerState) -> Answer {
    // All are asked before the first is waited for.
    let deadline = Instant::now() + limits::COMMAND_WAIT;
    let asked: Vec<_> =
        state.rooms.list().into_iter().map(|info| (ask(&info, state), info)).collect();
    let mut rooms = Vec::new();
    for (players, info) in asked {
        // A room that is closing, or whose queue of commands is full, drops the question.
        let players = timeout_at(deadline, players).await.ok().and_then(Result::ok);
        rooms.push(entry(&info, players));
    }
    let body = serde_json::to_string(&serde_json::json!({ "rooms": rooms }));
    let body = body.expect("strings and numbers only");
    respond(StatusCode::OK, "application/json", body)
}

/// Asks a room for its players.
fn ask(info: &RoomInfo, state: &ServerState) -> oneshot::Receiver<Vec<PlayerState>> {
    let (answer, players) = oneshot::channel();
    state.rooms.command(&info.code, AdminCommand::Players(answer));
    players
}

fn entry(info: &RoomInfo, players: Option<Vec<PlayerState>>) -> RoomEntry {
    let shown = |player: PlayerState| PlayerEntry {
        seat: player.seat.0,
        name: player.appearance.name.to_string(),
        connected: player.connected,
        score: player.score,
    };
    RoomEntry {
        code: info.code.clone(),
        scene: info.scene.name.clone(),
        private: info.private,
        players: players.map(|players| players.into_iter().map(shown).collect()),
    }
}

fn close(code: &str, state: &ServerState) -> Answer {
    if !state.rooms.command(code, AdminCommand::Close) {
        return no_room();
    }
    info!(room = %code, "an operator closed a room");
    respond(StatusCode::OK, TEXT, "closing\n".into())
}

async fn kick(code: &str, seat: &str, state: &ServerState) -> Answer {
    let Ok(seat) = seat.parse() else {
        let text = format!("the seat is a number, found {seat:?}\n");
        return respond(StatusCode::BAD_REQUEST, TEXT, text);
    };
    let (answer, kicked) = oneshot::channel();
    if !state.rooms.command(code, AdminCommand::Kick(Seat(seat), answer)) {
        return no_room();
    }
    match timeout(limits::COMMAND_WAIT, kicked).await {
        Ok(Ok(true)) => respond(StatusCode::OK, TEXT, "kicked\n".into()),
        Ok(Ok(false)) => respond(StatusCode::NOT_FOUND, TEXT, "no player in this seat\n".into()),
        _ => respond(StatusCode::SERVICE_UNAVAILABLE, TEXT, "the room did not answer\n".into()),
    }
}

fn drain(state: &ServerState) -> Answer {
    info!("an operator drains the server");
    state.drain.notify_one();
    respond(StatusCode::OK, TEXT, "draining\n".into())
}

fn no_room() -> Answer {
    respond(StatusCode::NOT_FOUND, TEXT, "no such room, or its queue of commands is full\n".into())
}
