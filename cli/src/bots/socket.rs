//! A bot's socket. It connects, and receives the welcome, the first keyframe, and then messages.

use super::target::BotTarget;
use bytes::Bytes;
use futures_util::{SinkExt, StreamExt};
use jostle_game::{Scene, Seat};
use jostle_protocol::limits::SERVER_MESSAGE_BYTES_MAX;
use jostle_protocol::{
    Appearance, ClientMessage, DecodeError, Refusal, Role, ServerMessage, SnapshotStream, Token,
    VERSION, WelcomeSeat,
};
use jostle_sim::{BodyId, Vec2};
use std::net::{IpAddr, SocketAddr};
use std::time::{Duration, Instant};
use tokio::net::{TcpSocket, TcpStream, lookup_host};
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{self, Message};
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

pub type Socket = WebSocketStream<TcpStream>;

/// Timeout for connecting and for receiving the first keyframe.
const ARRIVAL_WAIT: Duration = Duration::from_secs(20);
/// Number of bytes read in one go. It is small, because there may be many bots.
const READ_BUFFER_BYTES: usize = 8 << 10;

/// The reason why a session, or an attempt to start one, has ended.
#[derive(Debug, thiserror::Error)]
pub enum SessionEnd {
    /// Another server plays the room; contains that server's origin.
    #[error("the room moved to {0}")]
    Moved(String),
    /// The server ended the session.
    #[error("refused ({:?}): {}", .0, .0.message())]
    Refused(Refusal),
    /// The bot dropped the socket.
    #[error("the bot dropped its socket")]
    Dropped,
    /// The connection failed or was lost.
    #[error("{0}")]
    Lost(String),
    /// The server broke the protocol.
    #[error("the server sent what a client cannot read: {0}")]
    Unreadable(#[from] DecodeError),
    /// A message arrived at the wrong point, or its contents are wrong.
    #[error("the server sent what a client does not expect")]
    Unexpected,
}

fn socket_error(error: tungstenite::Error) -> SessionEnd {
    SessionEnd::Lost(format!("socket: {error}"))
}

/// A bot that has received its first keyframe.
pub struct JoinedBot {
    pub socket: Socket,
    pub seat: u16,
    /// Token for resuming the seat on another socket.
    pub token: Token,
    /// The snapshot stream, which contains the first keyframe.
    pub stream: SnapshotStream,
    /// Time from the hello to the decoded keyframe.
    pub took: Duration,
    /// The fleet's other servers, if the server sent them.
    pub nodes: Option<Vec<String>>,
    scene: [String; 2],
}

impl JoinedBot {
    pub fn hero(&self) -> Option<BodyId> {
        let newest = self.stream.newest()?;
        newest.players.iter().find(|player| player.seat.0 == self.seat)?.hero
    }

    /// The keyframe's tick.
    pub fn tick(&self) -> u32 {
        self.stream.newest().map_or(0, |newest| newest.tick)
    }

    /// The world's size.
    pub fn size(&self) -> Result<Vec2, SessionEnd> {
        let [name, source] = &self.scene;
        let scene = Scene::parse(&format!("{name}.toml"), source);
        Ok(scene.map_err(|_| SessionEnd::Unexpected)?.size)
    }
}

/// Joins a room, or resumes a seat with a token. Connects from this local address if one is given.
pub async fn connect(
    target: &BotTarget,
    from: Option<IpAddr>,
    appearance: Appearance,
    token: Option<Token>,
) -> Result<JoinedBot, SessionEnd> {
    connect_within(ARRIVAL_WAIT, target, from, appearance, token).await
}

/// Like [`connect`], with this timeout.
pub async fn connect_within(
    wait: Duration,
    target: &BotTarget,
    from: Option<IpAddr>,
    appearance: Appearance,
    token: Option<Token>,
) -> Result<JoinedBot, SessionEnd> {
    let arrival = timeout(wait, arrive(target, from, appearance, token)).await;
    let late = |_| SessionEnd::Lost(format!("no welcome and keyframe within {} s", wait.as_secs()));
    arrival.map_err(late)?
}

async fn arrive(
    target: &BotTarget,
    from: Option<IpAddr>,
    appearance: Appearance,
    token: Option<Token>,
) -> Result<JoinedBot, SessionEnd> {
    let mut socket = open(target, from).await?;
    let hello_at = Instant::now();
    let (host_key, role) = (None, Role::Player);
    let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key, role };
    send(&mut socket, &hello).await?;
    let ServerMessage::Welcome {
        seat: Some(WelcomeSeat { seat: Seat(seat), token, .. }),
        scene_name,
        scene,
        ..
    } = message(&mut socket).await?
    else {
        return Err(SessionEnd::Unexpected);
    };
    let (mut stream, mut nodes) = (SnapshotStream::default(), None);
    loop {
        match message(&mut socket).await? {
            ServerMessage::Snapshot(coded) => {
                stream.decode(&coded)?;
                break;
            }
            ServerMessage::Nodes { urls } => nodes = Some(urls),
            _ => return Err(SessionEnd::Unexpected),
        }
    }
    let scene = [scene_name, scene];
    Ok(JoinedBot { socket, seat, token, stream, took: hello_at.elapsed(), nodes, scene })
}

/// Connects to a room as a spectator, and waits for the welcome. Snapshots follow.
pub async fn watch(target: &BotTarget, appearance: Appearance) -> Result<Socket, SessionEnd> {
    let mut socket = open(target, None).await?;
    let (host_key, role) = (None, Role::Spectator);
    let hello = ClientMessage::Hello { version: VERSION, appearance, token: None, host_key, role };
    send(&mut socket, &hello).await?;
    match message(&mut socket).await? {
        ServerMessage::Welcome { seat: None, .. } => Ok(socket),
        _ => Err(SessionEnd::Unexpected),
    }
}

/// Connects to a server, given as `host:port`, from this local address if one is given.
pub async fn dial(authority: &str, from: Option<IpAddr>) -> std::io::Result<TcpStream> {
    let Some(from) = from else { return TcpStream::connect(authority).await };
    let mut addresses = lookup_host(authority).await?;
    let fits = |address: &SocketAddr| address.is_ipv4() == from.is_ipv4();
    let address = addresses.find(fits).ok_or(std::io::ErrorKind::AddrNotAvailable)?;
    let socket = if from.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    socket.bind((from, 0).into())?;
    socket.connect(address).await
}

/// Opens a room's WebSocket.
async fn open(target: &BotTarget, from: Option<IpAddr>) -> Result<Socket, SessionEnd> {
    let stream = dial(&target.authority, from).await;
    let unconnected = |error| SessionEnd::Lost(format!("no connection: {error}"));
    let stream = stream.map_err(unconnected)?;
    stream.set_nodelay(true).map_err(unconnected)?;
    let url = format!("ws://{}/{}", target.authority, target.room);
    let config = WebSocketConfig::default()
        .max_message_size(Some(SERVER_MESSAGE_BYTES_MAX))
        .read_buffer_size(READ_BUFFER_BYTES)
        .write_buffer_size(0);
    let (socket, _) =
        client_async_with_config(url, stream, Some(config)).await.map_err(socket_error)?;
    Ok(socket)
}

async fn message(socket: &mut Socket) -> Result<ServerMessage, SessionEnd> {
    loop {
        if let Some(bytes) = next(socket).await? {
            return read(&bytes);
        }
    }
}

/// Decodes a message. If the message ends the session, returns it as an error.
pub fn read(bytes: &[u8]) -> Result<ServerMessage, SessionEnd> {
    match ServerMessage::decode(bytes)? {
        ServerMessage::Refused { refusal } => Err(SessionEnd::Refused(refusal)),
        ServerMessage::Moved { url } => Err(SessionEnd::Moved(url)),
        message => Ok(message),
    }
}

/// The next message's bytes; `None` for a control frame, which the socket answers automatically.
pub async fn next(socket: &mut Socket) -> Result<Option<Bytes>, SessionEnd> {
    match socket.next().await {
        Some(Ok(Message::Binary(bytes))) => Ok(Some(bytes)),
        Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(None),
        Some(Ok(Message::Close(_))) | None => {
            Err(SessionEnd::Lost("the server closed the socket".to_owned()))
        }
        Some(Ok(_)) => Err(SessionEnd::Unexpected),
        Some(Err(error)) => Err(socket_error(error)),
    }
}

pub async fn send(socket: &mut Socket, message: &ClientMessage) -> Result<(), SessionEnd> {
    socket.send(Message::Binary(message.encode().into())).await.map_err(socket_error)
}
