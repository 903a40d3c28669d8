//! A game session from its socket's opening to its end: the hello, then messages in both directions until one side ends
//! the session. It makes no decisions about the game; its [`Pump`] passes inputs to the room's inbox and empties the
//! session's outbox.

use crate::fleet::directory::{Located, PlaceError};
use crate::fleet::entry::RoomFacts;
use crate::fleet::handle::Fleet;
use crate::host::inbox::inbox;
use crate::host::outbox::{Outbox, SendQueue};
use crate::host::room_handle::{Join, RoomInfo};
use crate::host::rooms::Rooms;
use crate::host::{Phase, random};
use crate::limits;
use crate::net::game_socket::{GameSocket, Hello, SocketEnd, close, receive_hello};
use crate::net::pump::{Pump, Seated};
use crate::ops::reasons;
use crate::state::ServerState;
use jostle_protocol::{Refusal, Role, ServerMessage, Token};
use std::future::poll_fn;
use std::net::IpAddr;
use std::sync::Arc;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::timeout;
use tracing::debug;

/// A peer that has asked for a session.
pub struct Caller {
    pub code: String,
    /// Address to which the session counts.
    pub address: IpAddr,
    /// The send queue of the session's thread.
    pub send_queue: Arc<SendQueue>,
}

/// Runs a session on a socket.
pub async fn play(mut socket: GameSocket, caller: Caller, state: &ServerState) {
    let end = serve(&mut socket, &caller, state).await;
    let Caller { code, address, .. } = caller;
    match end.refusal() {
        Some((Refusal::Moved, _)) => debug!(room = %code, %address, "the session was moved"),
        Some((refusal, _)) => {
            state.refused(
                reasons::of(refusal),
                address,
                format_args!("a session in room {code:?}"),
            );
        }
        None => debug!(room = %code, %address, "socket closed by the peer"),
    }
    // A peer that does not read its last messages will not receive them.
    let _ = timeout(limits::CLOSE_WAIT, close(socket, end)).await;
}

async fn serve(socket: &mut GameSocket, caller: &Caller, state: &ServerState) -> SocketEnd {
    let address = caller.address;
    let Some(_permit) = state.shares.sessions.admit(address) else {
        return SocketEnd::Refused(Refusal::TooManySockets);
    };
    if *state.host.phase.borrow() != Phase::Running {
        return SocketEnd::Refused(Refusal::Closing);
    }
    // A fleet may have a room that this server does not know yet.
    if state.fleet.is_none() && !state.rooms.knows(&caller.code) {
        return SocketEnd::Refused(Refusal::NoSuchRoom);
    }
    let mut phase = state.host.phase.clone();
    let hello = tokio::select! {
        hello = timeout(state.config.waits.hello, receive_hello(socket)) => hello,
        _ = phase.wait_for(|phase| *phase != Phase::Running) => Ok(Err(SocketEnd::Refused(Refusal::Closing))),
    };
    let hello = match hello {
        Ok(Ok(hello)) => hello,
        Ok(Err(end)) => return end,
        Err(_late) => return SocketEnd::Refused(Refusal::BadHello),
    };
    // The network may have been banned since the upgrade.
    if state.bans.is_banned(address) {
        return SocketEnd::Refused(Refusal::Kicked);
    }
    if let Some(fleet) = &state.fleet
        && let Err(end) = find(&caller.code, fleet, &state.rooms).await
    {
        return end;
    }
    let seated = match seat(hello, socket, caller, state) {
        Ok(seated) => seated,
        Err(refusal) => return SocketEnd::Refused(refusal),
    };
    // This is a separate task, so that it is not polled with every message. It ends with the session.
    let mut follows = JoinSet::new();
    let seconds = state.config.waits.drain_notice.as_secs().try_into().unwrap_or(u8::MAX);
    let keeps_room = state.host.logs.keeps_rooms();
    let notice = ServerMessage::Draining { seconds, keeps_room };
    let (info, outbox) = (Arc::clone(&seated.info), Arc::clone(&seated.outbox));
    follows.spawn(follow(phase, info, outbox, notice));
    let mut pump = Pump::new(&seated, socket);
    let end = poll_fn(|cx| pump.poll(cx)).await;
    match seated.outbox.moved_to() {
        Some(url) if end == SocketEnd::Refused(Refusal::Moved) => SocketEnd::Moved(url),
        _ => end,
    }
}

/// Waits until this server plays the room, opening a standing room on some node if needed. An error ends the session
/// because the room is on another server or does not exist.
async fn find(code: &str, fleet: &Fleet, rooms: &Rooms) -> Result<(), SocketEnd> {
    let mut located = fleet.find(code).await;
    if let (Located::Unknown, Some(scene)) = (&located, rooms.scene(code)) {
        let facts = RoomFacts {
            scene: scene.name.clone(),
            number: random(),
            private: false,
            creator: None,
            guest: false,
        };
        located = match fleet.place(code, facts).await {
            Ok(located) => located,
            // Another session or node was faster.
            Err(PlaceError::Taken) => fleet.find(code).await,
            Err(PlaceError::Full) => return Err(SocketEnd::Refused(Refusal::ServerFull)),
            Err(PlaceError::NotNow) => return Err(SocketEnd::Refused(Refusal::Moving)),
        };
    }
    match located {
        Located::Here if fleet.lease_left().is_zero() => Err(SocketEnd::Refused(Refusal::Moving)),
        Located::Here => Ok(()),
        Located::At(url) => Err(SocketEnd::Moved(url.into())),
        Located::Soon | Located::Lost => Err(SocketEnd::Refused(Refusal::Moving)),
        Located::Unknown => Err(SocketEnd::Refused(Refusal::NoSuchRoom)),
    }
}

/// Asks a room to seat the player or to let the spectator watch.
fn seat(
    hello: Hello,
    socket: &GameSocket,
    caller: &Caller,
    state: &ServerState,
) -> Result<Seated, Refusal> {
    let verified = |token: Token| state.host.signer.seat_claim(&token).ok_or(Refusal::BadToken);
    let claim = match hello.role {
        Role::Player => hello.token.map(verified).transpose()?,
        Role::Spectator => None,
    };
    // A wrong key does not make its sender the host, but it is no reason to refuse the session.
    let hosted = hello.host_key.and_then(|key| state.host.signer.hosted(&key));
    let (sender, receiver) = inbox(limits::INBOX_MAX);
    let outbox = Outbox::new(Arc::clone(&caller.send_queue), Arc::clone(&socket.writer));
    let outbox = Arc::new(outbox);
    let join = Join {
        role: hello.role,
        appearance: hello.appearance,
        claim,
        hosted,
        address: caller.address,
        inbox: receiver,
        outbox: Arc::clone(&outbox),
    };
    let info = state.rooms.join(&caller.code, join)?;
    Ok(Seated { info, inbox: sender, outbox, waits: state.config.waits })
}

/// Tells the session when the server ends, first with a notice and then by closing, and when a room ends whose thread
/// cannot say so.
async fn follow(
    mut phase: watch::Receiver<Phase>,
    info: Arc<RoomInfo>,
    outbox: Arc<Outbox>,
    notice: ServerMessage,
) {
    let closing = async {
        // An error means that the server is gone, which also ends the session.
        if phase.wait_for(|phase| *phase != Phase::Running).await.is_ok() {
            outbox.control(notice.encode());
            let _ = phase.wait_for(|phase| *phase == Phase::Closing).await;
        }
    };
    tokio::select! {
        () = closing => outbox.end(Refusal::Closing),
        () = info.given_up.cancelled() => outbox.end(Refusal::RoomFailed),
    }
}
