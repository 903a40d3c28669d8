//! The socket of a bot: it connects, receives the welcome and the first keyframe, and then messages.

use super::target::Target;
use anyhow::{Context, Error, Result, anyhow, bail};
use bytes::Bytes;
use futures_util::{SinkExt, StreamExt};
use jostle_game::Scene;
use jostle_protocol::limits::SERVER_MESSAGE_BYTES_MAX;
use jostle_protocol::{
    Appearance, ClientMessage, DecodeError, Refusal, ServerMessage, SnapshotStream, Token, VERSION,
};
use jostle_sim::{BodyId, Vec2};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{self, Message};
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

/// A game socket.
pub type Socket = WebSocketStream<TcpStream>;

/// Time to connect and to receive the first keyframe.
const ARRIVAL_WAIT: Duration = Duration::from_secs(20);
/// Bytes read at a time: there may be many bots.
const READ_BUFFER_BYTES: usize = 8 << 10;

/// The error of a message that does not belong where it came.
pub fn unexpected() -> Error {
    anyhow!("the server sent what a client does not expect")
}

/// The error of a refused session.
pub fn refused(refusal: Refusal) -> Error {
    anyhow!("refused ({refusal:?}): {}", refusal.message())
}

/// The error of a message that does not decode.
pub fn unreadable(error: DecodeError) -> Error {
    anyhow!("the server sent what a client cannot read: {error}")
}

fn socket_error(error: tungstenite::Error) -> Error {
    anyhow!("socket: {error}")
}

/// A bot that has received its first keyframe.
pub struct Arrival {
    /// The socket.
    pub socket: Socket,
    /// The player's seat.
    pub seat: u16,
    /// Token that resumes the seat on another socket.
    pub token: Token,
    /// The stream, which holds that keyframe.
    pub stream: SnapshotStream,
    /// Time from the hello to the decoded keyframe.
    pub took: Duration,
    scene: [String; 2],
}

impl Arrival {
    /// The player's hero.
    pub fn hero(&self) -> Option<BodyId> {
        let newest = self.stream.newest()?;
        newest.players.iter().find(|player| player.seat.0 == self.seat)?.hero
    }

    /// Tick of the keyframe.
    pub fn tick(&self) -> u32 {
        self.stream.newest().map_or(0, |newest| newest.tick)
    }

    /// Size of the world.
    pub fn size(&self) -> Result<Vec2> {
        let [name, source] = &self.scene;
        let scene = Scene::parse(&format!("{name}.toml"), source);
        Ok(scene.map_err(|error| anyhow!("the welcome's scene is wrong: {error}"))?.size)
    }
}

/// Joins a room, or resumes a seat with a token.
pub async fn connect(
    target: &Target,
    appearance: Appearance,
    token: Option<Token>,
) -> Result<Arrival> {
    let arrival = timeout(ARRIVAL_WAIT, arrive(target, appearance, token)).await;
    arrival
        .with_context(|| format!("no welcome and keyframe within {} s", ARRIVAL_WAIT.as_secs()))?
}

async fn arrive(target: &Target, appearance: Appearance, token: Option<Token>) -> Result<Arrival> {
    let stream = TcpStream::connect(&target.authority).await;
    let stream = stream.map_err(|error| anyhow!("no connection: {error}"))?;
    stream.set_nodelay(true)?;
    let url = format!("ws://{}/{}", target.authority, target.room);
    let config = WebSocketConfig::default()
        .max_message_size(Some(SERVER_MESSAGE_BYTES_MAX))
        .read_buffer_size(READ_BUFFER_BYTES)
        .write_buffer_size(0);
    let (mut socket, _) =
        client_async_with_config(url, stream, Some(config)).await.map_err(socket_error)?;
    let hello_at = Instant::now();
    let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key: None };
    send(&mut socket, &hello).await?;
    let (seat, token, scene) =
        match ServerMessage::decode(&message(&mut socket).await?).map_err(unreadable)? {
            ServerMessage::Welcome { seat, token, scene_name, scene, .. } => {
                (seat, token, [scene_name, scene])
            }
            ServerMessage::Refused { refusal } => return Err(refused(refusal)),
            _ => return Err(unexpected()),
        };
    let mut stream = SnapshotStream::default();
    match ServerMessage::decode(&message(&mut socket).await?).map_err(unreadable)? {
        ServerMessage::Snapshot(coded) => stream.decode(&coded).map_err(unreadable)?,
        ServerMessage::Refused { refusal } => return Err(refused(refusal)),
        _ => return Err(unexpected()),
    };
    Ok(Arrival { socket, seat, token, stream, took: hello_at.elapsed(), scene })
}

async fn message(socket: &mut Socket) -> Result<Bytes> {
    loop {
        if let Some(bytes) = next(socket).await? {
            return Ok(bytes);
        }
    }
}

/// The bytes of the next message; `None` is a control frame, which the socket answers by itself.
pub async fn next(socket: &mut Socket) -> Result<Option<Bytes>> {
    match socket.next().await {
        Some(Ok(Message::Binary(bytes))) => Ok(Some(bytes)),
        Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(None),
        Some(Ok(Message::Close(_))) | None => bail!("the server closed the socket"),
        Some(Ok(_)) => Err(unexpected()),
        Some(Err(error)) => Err(socket_error(error)),
    }
}

/// Sends one message.
pub async fn send(socket: &mut Socket, message: &ClientMessage) -> Result<()> {
    socket.send(Message::Binary(message.encode().into())).await.map_err(socket_error)
}
