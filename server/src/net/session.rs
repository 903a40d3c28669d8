//! One game session from its upgrade to its end: the hello, then messages in both directions until one side
//! ends it. It decides nothing about the game; it passes inputs to the room's inbox and empties
//! its outbox.

use crate::host::outbox::Outbox;
use crate::host::phase::Phase;
use crate::host::room_handle::{FromSession, Join, RoomInfo};
use crate::limits;
use crate::limits::token_bucket::TokenBucket;
use crate::net::game_socket::{End, Hello, Socket, accept, close, end_of, receive_hello};
use crate::net::maybe_tls_stream::MaybeTlsStream;
use crate::net::pongs::Pongs;
use crate::ops::metrics::reason;
use crate::state::ServerState;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use jostle_protocol::{ClientMessage, Refusal, ServerMessage, Token};
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::time::Instant;
use tokio::sync::watch;
use tokio::time::{interval_at, timeout};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tracing::debug;

/// Runs one session on an upgraded connection; `read` holds bytes that came with the upgrade.
pub async fn play(
    stream: MaybeTlsStream,
    read: Vec<u8>,
    code: &str,
    address: IpAddr,
    state: &ServerState,
) {
    let mut socket = accept(stream, read).await;
    let end = serve(&mut socket, code, address, state).await;
    match end {
        End::Refused(refusal) => {
            state.refused(reason(refusal), address, format_args!("a session in room {code:?}"));
        }
        End::Gone => debug!(room = %code, %address, "socket closed by the peer"),
    }
    // A peer that does not read its last messages does not get them.
    let _ = timeout(limits::CLOSE_WAIT, close(socket, end)).await;
}

async fn serve(socket: &mut Socket, code: &str, address: IpAddr, state: &ServerState) -> End {
    let Some(_permit) = state.sessions.admit(address) else {
        return End::Refused(Refusal::TooManySockets);
    };
    if *state.host.phase.borrow() != Phase::Running {
        return End::Refused(Refusal::Closing);
    }
    if !state.rooms.knows(code) {
        return End::Refused(Refusal::NoSuchRoom);
    }
    let mut phase = state.host.phase.clone();
    let hello = tokio::select! {
        hello = timeout(state.config.waits.hello, receive_hello(socket)) => hello,
        _ = phase.wait_for(|phase| *phase != Phase::Running) => Ok(Err(End::Refused(Refusal::Closing))),
    };
    let hello = match hello {
        Ok(Ok(hello)) => hello,
        Ok(Err(end)) => return end,
        Err(_late) => return End::Refused(Refusal::BadHello),
    };
    // A ban may have come since the upgrade.
    if state.bans.is_banned(address) {
        return End::Refused(Refusal::Kicked);
    }
    match Seated::new(hello, code, address, state) {
        Ok(seated) => seated.pump(socket, phase).await,
        Err(refusal) => End::Refused(refusal),
    }
}

/// A session that a room was asked to seat.
struct Seated {
    info: Arc<RoomInfo>,
    inbox: SyncSender<FromSession>,
    outbox: Arc<Outbox>,
    waits: limits::Waits,
    /// Whether rooms outlive the process.
    keeps_room: bool,
}

impl Seated {
    fn new(
        hello: Hello,
        code: &str,
        address: IpAddr,
        state: &ServerState,
    ) -> Result<Seated, Refusal> {
        let verified = |token: Token| state.host.signer.seat_claim(&token).ok_or(Refusal::BadToken);
        let claim = hello.token.map(verified).transpose()?;
        // A wrong key does not make its holder the host, and is no reason for a refusal.
        let hosted = hello.host_key.and_then(|key| state.host.signer.hosted(&key));
        let (sender, receiver) = sync_channel(limits::INBOX_MAX);
        let outbox = Arc::new(Outbox::default());
        let join = Join {
            appearance: hello.appearance,
            claim,
            hosted,
            address,
            inbox: receiver,
            outbox: Arc::clone(&outbox),
        };
        let info = state.rooms.join(code, join)?;
        let (waits, keeps_room) = (state.config.waits, state.host.state_writer.is_some());
        Ok(Seated { info, inbox: sender, outbox, waits, keeps_room })
    }

    /// Reads and writes concurrently until one side ends.
    async fn pump(self, socket: &mut Socket, phase: watch::Receiver<Phase>) -> End {
        let (sink, stream) = socket.split();
        tokio::select! {
            end = self.read(stream) => end,
            end = self.write(sink) => end,
            refusal = self.outbox.ended() => End::Refused(refusal),
            end = self.follow(phase) => end,
        }
    }

    async fn read(&self, mut stream: SplitStream<&mut Socket>) -> End {
        let (rate, burst) = (limits::MESSAGES_PER_SECOND_MAX, limits::MESSAGES_BURST_MAX);
        let mut bucket = TokenBucket::new(rate, burst, Instant::now());
        let mut pongs = Pongs::default();
        loop {
            let Ok(message) = timeout(self.waits.silence, stream.next()).await else {
                return End::Refused(Refusal::Silent);
            };
            if !bucket.take(Instant::now()) {
                return End::Refused(Refusal::Flood);
            }
            let accepted = match message {
                Some(Ok(Message::Binary(bytes))) => self.accept(&bytes, &mut pongs),
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(()),
                Some(Ok(Message::Close(frame))) => Err(self.leave(frame)),
                Some(Err(error)) => Err(end_of(&error)),
                Some(Ok(_)) => Err(End::Refused(Refusal::BadMessage)),
                None => Err(End::Gone),
            };
            if let Err(end) = accepted {
                return end;
            }
        }
    }

    fn accept(&self, bytes: &[u8], pongs: &mut Pongs) -> Result<(), End> {
        match ClientMessage::decode(bytes) {
            Ok(ClientMessage::Input { seq, ack_tick, input }) => {
                self.pass_on(FromSession::Input { seq, ack_tick, input })
            }
            Ok(ClientMessage::Ping { stamp }) => {
                let tick = self.info.tick.load(Ordering::Relaxed);
                self.outbox.control(pongs.pong(stamp, tick));
                Ok(())
            }
            Ok(ClientMessage::View { size }) => self.pass_on(FromSession::View { size }),
            Ok(ClientMessage::Kick { seat }) => self.pass_on(FromSession::Kick { seat }),
            Ok(ClientMessage::CloseRoom) => self.pass_on(FromSession::CloseRoom),
            Ok(ClientMessage::Hello { .. }) | Err(_) => Err(End::Refused(Refusal::BadMessage)),
        }
    }

    fn pass_on(&self, message: FromSession) -> Result<(), End> {
        match self.inbox.try_send(message) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => Err(End::Refused(Refusal::Flood)),
            // The room dropped this session; the reason is in the outbox, where `pump` sees it.
            Err(TrySendError::Disconnected(_)) => Ok(()),
        }
    }

    /// Gives the seat up after a close with 1000; after a reload or a lost network it is held.
    fn leave(&self, frame: Option<CloseFrame>) -> End {
        if frame.is_some_and(|frame| frame.code == CloseCode::Normal) {
            let _ = self.pass_on(FromSession::Leave);
        }
        End::Gone
    }

    async fn write(&self, mut sink: SplitSink<&mut Socket, Message>) -> End {
        let first = tokio::time::Instant::now() + self.waits.keepalive;
        let mut keepalive = interval_at(first, self.waits.keepalive);
        loop {
            let message = tokio::select! {
                bytes = self.outbox.take() => Message::Binary(bytes),
                _ = keepalive.tick() => Message::Ping(Default::default()),
            };
            match timeout(self.waits.stall, sink.send(message)).await {
                Ok(Ok(())) => {}
                Ok(Err(_lost)) => return End::Gone,
                Err(_stalled) => return End::Refused(Refusal::Silent),
            }
        }
    }

    /// Follows the server's own end: first a notice, then the close.
    async fn follow(&self, mut phase: watch::Receiver<Phase>) -> End {
        // An error means that the server is gone already, which is an end as well.
        if phase.wait_for(|phase| *phase != Phase::Running).await.is_ok() {
            let seconds = self.waits.drain_notice.as_secs().try_into().unwrap_or(u8::MAX);
            let keeps_room = self.keeps_room;
            self.outbox.control(ServerMessage::Draining { seconds, keeps_room }.encode());
            let _ = phase.wait_for(|phase| *phase == Phase::Closing).await;
        }
        End::Refused(Refusal::Closing)
    }
}
