//! A test client that behaves like a page. Every wait has a time limit.

use futures_util::{SinkExt, StreamExt};
use jostle_game::{Buttons, Input};
use jostle_protocol::limits::{SERVER_MESSAGE_BYTES_MAX, TOKEN_BYTES};
use jostle_protocol::{
    Appearance, BAD_MESSAGE_CODES, ClientMessage, PlayerState, Refusal, Role, ServerMessage,
    Snapshot, SnapshotStream, Token, VERSION,
};
use jostle_sim::Vec2;
use std::net::SocketAddr;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

pub use jostle_tests::server::LONG;

/// A socket and the newest snapshot received over it.
pub struct Client<S = TcpStream> {
    pub socket: WebSocketStream<S>,
    pub seat: u16,
    pub token: Token,
    /// Whether this client is the host, according to the welcome.
    pub host: bool,
    pub newest: Snapshot,
    pub stream: SnapshotStream,
    /// Total size of all received messages in bytes.
    pub bytes: usize,
    /// Number of received snapshots.
    pub snapshots: u32,
    pub seq: u32,
}

impl Client {
    /// Connects and upgrades a socket without sending a hello.
    pub async fn connect(address: SocketAddr, room: &str) -> Client {
        let socket = TcpSocket::new_v4().expect("a socket");
        Client::connect_over(socket, address, room).await
    }

    /// Connects and upgrades an existing socket without sending a hello.
    pub async fn connect_over(socket: TcpSocket, address: SocketAddr, room: &str) -> Client {
        let stream = socket.connect(address).await.expect("a connection");
        stream.set_nodelay(true).expect("a live socket");
        Client::upgraded(stream, &format!("ws://{address}/{room}")).await
    }

    /// Joins as a player and waits for a seat and a first snapshot.
    pub async fn join(address: SocketAddr, room: &str, name: &str) -> Client {
        let mut client = Client::connect(address, room).await;
        client.enter(name, None).await;
        client
    }

    /// Joins a server with short timeouts as a player. On a busy machine a well-behaved client may be too slow, so
    /// failures are retried.
    pub async fn join_at_last(address: SocketAddr, room: &str, name: &str) -> Client {
        let joined = async {
            loop {
                let mut client = Client::connect(address, room).await;
                let appearance = Appearance { name: name.into(), color: 1 };
                let (token, host_key, role) = (None, None, Role::Player);
                let hello =
                    ClientMessage::Hello { version: VERSION, appearance, token, host_key, role };
                // The socket may already be closed.
                let _ = client.socket.send(Message::Binary(hello.encode().into())).await;
                if let Some(Ok(Message::Binary(bytes))) = client.frame().await
                    && let ServerMessage::Welcome { seat: Some(own), .. } = client.read(&bytes)
                {
                    (client.seat, client.token) = (own.seat.0, own.token);
                    client.snapshot().await;
                    return client;
                }
            }
        };
        timeout(LONG, joined).await.expect("a seat in time")
    }

    /// Joins a room as its host.
    pub async fn host(address: SocketAddr, room: &str, name: &str, key: Token) -> Client {
        let mut client = Client::connect(address, room).await;
        let appearance = Appearance { name: name.into(), color: 1 };
        let (token, host_key, role) = (None, Some(key), Role::Player);
        let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key, role };
        client.send(&hello).await;
        client.welcomed(name).await;
        client
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> Client<S> {
    /// Upgrades a stream to a server without sending a hello.
    pub async fn upgraded(stream: S, request: impl IntoClientRequest + Unpin) -> Client<S> {
        let config = WebSocketConfig::default()
            .max_message_size(Some(SERVER_MESSAGE_BYTES_MAX))
            .read_buffer_size(4096);
        let (socket, _) =
            client_async_with_config(request, stream, Some(config)).await.expect("an upgrade");
        Client::of(socket)
    }

    /// A client with an open socket that has not sent a hello.
    pub fn of(socket: WebSocketStream<S>) -> Client<S> {
        let newest = Snapshot::default();
        let stream = SnapshotStream::default();
        let token = Token([0; TOKEN_BYTES]);
        let (seat, host) = (u16::MAX, false);
        Client { socket, seat, token, host, stream, newest, bytes: 0, snapshots: 0, seq: 0 }
    }

    /// Sends a hello and waits for a seat and a first snapshot.
    pub async fn enter(&mut self, name: &str, token: Option<Token>) {
        self.hello(VERSION, name, token).await;
        self.welcomed(name).await;
    }

    /// Waits for a seat and a first snapshot.
    pub async fn welcomed(&mut self, name: &str) {
        match self.message().await {
            ServerMessage::Welcome { seat: Some(own), .. } => {
                (self.seat, self.token, self.host) = (own.seat.0, own.token, own.host);
            }
            other => panic!("{name}: {other:?} instead of a welcome"),
        }
        self.snapshot().await;
    }

    pub async fn hello(&mut self, version: u16, name: &str, token: Option<Token>) {
        let appearance = Appearance { name: name.into(), color: 1 };
        let (host_key, role) = (None, Role::Player);
        self.send(&ClientMessage::Hello { version, appearance, token, host_key, role }).await;
    }

    pub async fn send(&mut self, message: &ClientMessage) {
        self.send_raw(Message::Binary(message.encode().into())).await;
    }

    pub async fn send_raw(&mut self, message: Message) {
        timeout(LONG, self.socket.send(message)).await.expect("time").expect("a live socket");
    }

    pub async fn input(&mut self, buttons: Buttons, pointer: Option<Vec2>) {
        self.seq += 1;
        let input = Input::new(buttons, pointer);
        let ack_tick = self.newest.tick as u16;
        self.send(&ClientMessage::Input { seq: self.seq, ack_tick, input }).await;
    }

    /// Reads the next frame that is not a ping or pong.
    pub async fn frame(&mut self) -> Option<Result<Message, Error>> {
        loop {
            let frame = timeout(LONG, self.socket.next()).await.expect("a frame in time");
            if !matches!(frame, Some(Ok(Message::Ping(_) | Message::Pong(_)))) {
                return frame;
            }
        }
    }

    /// Reads the next message; a snapshot is decoded into `newest`.
    pub async fn message(&mut self) -> ServerMessage {
        let frame = self.frame().await;
        let Some(Ok(Message::Binary(bytes))) = frame else {
            panic!("{frame:?} instead of a message");
        };
        self.read(&bytes)
    }

    /// Reads up to the response to a WebSocket ping, or up to a refusal sent instead.
    pub async fn pong(&mut self) -> Result<(), Refusal> {
        loop {
            match timeout(LONG, self.socket.next()).await.expect("a frame in time") {
                Some(Ok(Message::Pong(_))) => return Ok(()),
                Some(Ok(Message::Ping(_))) => {}
                Some(Ok(Message::Binary(bytes))) => {
                    if let ServerMessage::Refused { refusal } = self.read(&bytes) {
                        return Err(refusal);
                    }
                }
                other => panic!("{other:?} instead of a pong"),
            }
        }
    }

    /// Reads a message, and decodes it into `newest` if it is a snapshot.
    pub fn read(&mut self, bytes: &[u8]) -> ServerMessage {
        self.bytes += bytes.len();
        let message = ServerMessage::decode(bytes).expect("a readable message");
        if let ServerMessage::Snapshot(coded) = &message {
            self.stream.decode(coded).expect("a readable snapshot");
            let newest = self.stream.newest().expect("a snapshot was read");
            let forward = self.snapshots == 0 || newest.tick > self.newest.tick;
            assert!(forward, "ticks go forward");
            self.newest = Snapshot::clone(newest);
            self.snapshots += 1;
        }
        message
    }

    /// Waits for the next snapshot.
    pub async fn snapshot(&mut self) -> &Snapshot {
        while !matches!(self.message().await, ServerMessage::Snapshot(_)) {}
        &self.newest
    }

    /// Waits for a snapshot that satisfies `wanted`.
    pub async fn until(&mut self, what: &str, wanted: impl Fn(&Snapshot) -> bool) {
        let found = async {
            while !wanted(&self.newest) {
                self.snapshot().await;
            }
        };
        timeout(LONG, found).await.unwrap_or_else(|_| panic!("{what} did not happen in time"));
    }

    /// Returns the client's own player.
    pub fn player(&self) -> &PlayerState {
        let own = self.newest.players.iter().find(|player| player.seat.0 == self.seat);
        own.expect("a player is in every snapshot after the welcome")
    }

    /// Returns the server's tick at some point during the call.
    pub async fn tick(&mut self) -> u32 {
        self.send(&ClientMessage::Ping { stamp: 77 }).await;
        loop {
            if let ServerMessage::Pong { stamp, tick } = self.message().await {
                assert_eq!(stamp, 77);
                return tick;
            }
        }
    }

    /// Plays for `ticks` ticks, with an input for each snapshot.
    pub async fn plays(&mut self, ticks: u32) {
        let last_tick = self.newest.tick + ticks;
        while self.newest.tick < last_tick {
            self.input(Buttons::RIGHT, None).await;
            self.snapshot().await;
        }
    }

    /// Sends an input and waits until it has been played; after that, the seat is held.
    pub async fn play_one_input(&mut self) {
        self.input(Buttons::default(), None).await;
        let (seat, seq) = (self.seat, self.seq);
        self.until("an input that is played", |snapshot| {
            let own = snapshot.players.iter().find(|player| player.seat.0 == seat);
            own.is_some_and(|own| own.input_seq >= seq)
        })
        .await;
    }

    /// Checks that this player's game is not stuck, which means that two seconds of ticks arrive and inputs are played.
    pub async fn plays_on(&mut self) {
        timeout(LONG, self.plays(120)).await.expect("two seconds of ticks");
        self.keeps_playing().await;
    }

    /// Checks that this player's game continues, which means that one second of ticks arrives and an input is played.
    pub async fn keeps_playing(&mut self) {
        self.input(Buttons::RIGHT, None).await;
        let (seat, seq) = (self.seat, self.seq);
        let tick = self.newest.tick + 60;
        self.until("a second of play", |snapshot| {
            let own = snapshot.players.iter().find(|player| player.seat.0 == seat);
            snapshot.tick >= tick && own.is_some_and(|own| own.input_seq >= seq)
        })
        .await;
    }

    /// Reads until the socket is closed; returns the server's refusal and the close code.
    pub async fn refusal(&mut self) -> (Refusal, u16) {
        let refusal = loop {
            if let ServerMessage::Refused { refusal } = self.message().await {
                break refusal;
            }
        };
        (refusal, self.close_code(refusal).await)
    }

    /// Reads the close code after a refusal.
    pub async fn close_code(&mut self, refusal: Refusal) -> u16 {
        match self.frame().await {
            Some(Ok(Message::Close(Some(CloseFrame { code, reason })))) => {
                assert_eq!(reason, refusal.message());
                code.into()
            }
            other => panic!("{other:?} instead of a close frame after {refusal:?}"),
        }
    }

    /// Checks that the server closes the socket with the expected refusal and one of its close codes.
    pub async fn is_refused(&mut self, expected: Refusal) {
        let (refusal, code) = self.refusal().await;
        assert_eq!(refusal, expected);
        let is_bad_message = expected == Refusal::BadMessage;
        assert!(
            code == expected.close_code() || is_bad_message && BAD_MESSAGE_CODES.contains(&code),
            "{refusal:?} with {code}"
        );
    }
}
