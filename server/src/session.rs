//! One game socket from its upgrade to its end: the hello, then messages in and out until one side
//! has enough. It decides nothing about the game; it passes inputs to the room's inbox and empties
//! its outbox.

use crate::limits;
use crate::metered::Metered;
use crate::outbox::Outbox;
use crate::pongs::Pongs;
use crate::rate::TokenBucket;
use crate::rooms::Facts;
use crate::stream::Stream;
use crate::ticker::{FromSession, Join};
use crate::{App, Phase};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use jostle_protocol::limits::{CLIENT_MESSAGE_BYTES_MAX, SERVER_MESSAGE_BYTES_MAX};
use jostle_protocol::{Appearance, ClientMessage, Refusal, ServerMessage, Token, VERSION};
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::time::Instant;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::sync::watch;
use tokio::time::{interval_at, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tracing::{debug, info};

type Socket = WebSocketStream<Metered>;

/// How a session ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// We end it, and say why.
    Refused(Refusal),
    /// The peer closed the socket, on purpose or not.
    Gone,
}

/// Plays one session on an upgraded connection; `read` holds bytes that came with the upgrade.
pub async fn play(stream: Stream, read: Vec<u8>, code: &str, address: IpAddr, app: &App) {
    let config = Some(socket_config());
    let stream = Metered::new(stream);
    let mut socket = WebSocketStream::from_partially_read(stream, read, Role::Server, config).await;
    let end = serve(&mut socket, code, address, app).await;
    match end {
        End::Refused(refusal) => {
            app.metrics.refused(refusal);
            info!(room = %code, %address, reason = ?refusal, "session ended");
        }
        End::Gone => debug!(room = %code, %address, "socket closed by the peer"),
    }
    // A peer that does not read its last words does not get them.
    let _ = timeout(limits::CLOSE_WAIT, close(socket, end)).await;
}

fn socket_config() -> WebSocketConfig {
    // The write buffer takes one message, because each is flushed before the next, and a pong.
    WebSocketConfig::default()
        .max_message_size(Some(CLIENT_MESSAGE_BYTES_MAX))
        .max_frame_size(Some(CLIENT_MESSAGE_BYTES_MAX))
        .read_buffer_size(limits::READ_BUFFER_BYTES)
        .write_buffer_size(0)
        .max_write_buffer_size(SERVER_MESSAGE_BYTES_MAX + limits::READ_BUFFER_BYTES)
}

async fn serve(socket: &mut Socket, code: &str, address: IpAddr, app: &App) -> End {
    let Some(_permit) = app.sessions.admit(address) else {
        return End::Refused(Refusal::TooManySockets);
    };
    if *app.phase.borrow() != Phase::Running {
        return End::Refused(Refusal::Closing);
    }
    if !app.rooms.knows(code) {
        return End::Refused(Refusal::NoSuchRoom);
    }
    let mut phase = app.phase.clone();
    let hello = tokio::select! {
        hello = timeout(app.waits.hello, hello(socket)) => hello,
        _ = phase.wait_for(|phase| *phase != Phase::Running) => Ok(Err(End::Refused(Refusal::Closing))),
    };
    let hello = match hello {
        Ok(Ok(hello)) => hello,
        Ok(Err(end)) => return end,
        Err(_late) => return End::Refused(Refusal::BadHello),
    };
    match Seated::new(hello, code, address, app) {
        Ok(seated) => seated.pump(socket, phase).await,
        Err(refusal) => End::Refused(refusal),
    }
}

/// Who comes, and what they hold of earlier.
struct Hello {
    appearance: Appearance,
    token: Option<Token>,
    host_key: Option<Token>,
}

/// The first message of a socket.
async fn hello(socket: &mut Socket) -> Result<Hello, End> {
    loop {
        let bytes = match socket.next().await {
            Some(Ok(Message::Binary(bytes))) => bytes,
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
            Some(Ok(Message::Close(_))) | None => return Err(End::Gone),
            Some(Err(error)) => return Err(end_of(&error)),
            Some(Ok(_)) => return Err(End::Refused(Refusal::BadMessage)),
        };
        return match ClientMessage::decode(&bytes) {
            Ok(ClientMessage::Hello { version, .. }) if version != VERSION => {
                Err(End::Refused(Refusal::Version))
            }
            Ok(ClientMessage::Hello { appearance, token, host_key, .. }) => {
                Ok(Hello { appearance, token, host_key })
            }
            _ => Err(End::Refused(Refusal::BadHello)),
        };
    }
}

/// A session that a room was asked to seat.
struct Seated {
    facts: Arc<Facts>,
    inbox: SyncSender<FromSession>,
    outbox: Arc<Outbox>,
    waits: limits::Waits,
}

impl Seated {
    fn new(hello: Hello, code: &str, address: IpAddr, app: &App) -> Result<Seated, Refusal> {
        let sealed = |token: Token| app.sealer.seat_claim(&token).ok_or(Refusal::BadToken);
        let claim = hello.token.map(sealed).transpose()?;
        // A wrong key makes nobody host, and is no reason to stay outside.
        let hosted = hello.host_key.and_then(|key| app.sealer.hosted(&key));
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
        let facts = app.rooms.join(code, join)?;
        Ok(Seated { facts, inbox: sender, outbox, waits: app.waits })
    }

    /// Reads and writes at once until one side ends.
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
            Ok(ClientMessage::Input { seq, heard, input }) => {
                self.pass_on(FromSession::Input { seq, heard, input })
            }
            Ok(ClientMessage::Ping { stamp }) => {
                let tick = self.facts.tick.load(Ordering::Relaxed);
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
            // The room dropped this session; why is in the outbox, and `pump` sees it.
            Err(TrySendError::Disconnected(_)) => Ok(()),
        }
    }

    /// A page that closes with 1000 means it; a reload or a lost network gets the seat back.
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
            let seconds = limits::DRAIN_NOTICE.as_secs() as u8;
            self.outbox.control(ServerMessage::Draining { seconds }.encode());
            let _ = phase.wait_for(|phase| *phase == Phase::Closing).await;
        }
        End::Refused(Refusal::Closing)
    }
}

/// What an error of the socket ends: too many bytes, a lost connection, or else something that the
/// peer said.
fn end_of(error: &tokio_tungstenite::tungstenite::Error) -> End {
    use tokio_tungstenite::tungstenite::error::{Error, ProtocolError};
    match error {
        Error::Io(error) if error.kind() == Metered::SPENT => End::Refused(Refusal::Flood),
        Error::Io(_)
        | Error::ConnectionClosed
        | Error::AlreadyClosed
        | Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => End::Gone,
        _ => End::Refused(Refusal::BadMessage),
    }
}

/// Says why, closes, and reads on until the peer has closed too: closing a socket with unread bytes
/// would reset it, and the peer would never see our last message.
async fn close(mut socket: Socket, end: End) {
    match end {
        End::Refused(refusal) => {
            let bytes = ServerMessage::Refused { refusal }.encode();
            let reason = CloseFrame {
                code: CloseCode::from(refusal.close_code()),
                reason: refusal.message().into(),
            };
            let said = match socket.send(Message::Binary(bytes.into())).await {
                Ok(()) => socket.send(Message::Close(Some(reason))).await,
                lost => lost,
            };
            if said.is_err() {
                return;
            }
        }
        // Answers the peer's close frame, if that is what ended it.
        End::Gone => {
            let _ = socket.flush().await;
        }
    }
    let mut stream = socket.into_inner().into_inner();
    if stream.shutdown().await.is_err() {
        return;
    }
    let mut scratch = [0; limits::READ_BUFFER_BYTES];
    let mut discarded = 0;
    while discarded < limits::CLOSE_DISCARD_BYTES_MAX {
        match stream.read(&mut scratch).await {
            Ok(0) | Err(_) => return,
            Ok(count) => discarded += count,
        }
    }
}
