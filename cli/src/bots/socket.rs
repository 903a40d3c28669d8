//! A bot's socket: connecting, the welcome and the first keyframe, and messages after that.

use super::target::Target;
use bytes::Bytes;
use futures_util::{SinkExt, StreamExt};
use jostle_game::Scene;
use jostle_protocol::limits::SERVER_MESSAGE_BYTES_MAX;
use jostle_protocol::{
    Appearance, ClientMessage, Refusal, ServerMessage, SnapshotStream, Token, VERSION,
};
use jostle_sim::{BodyId, Vec2};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

/// A game socket.
pub type Socket = WebSocketStream<TcpStream>;

/// Time to connect and to be sent the first keyframe.
const ARRIVAL_WAIT: Duration = Duration::from_secs(20);
/// Bytes read at a time: there may be many bots.
const READ_BUFFER_BYTES: usize = 8 << 10;

/// Why a bot stopped early.
#[derive(Debug, thiserror::Error)]
pub enum BotError {
    /// No TCP connection.
    #[error("no connection: {0}")]
    Connect(#[from] std::io::Error),
    /// The socket broke.
    #[error("socket: {0}")]
    Socket(#[from] Box<Error>),
    /// Not seated in time.
    #[error("no welcome and keyframe within {} s", ARRIVAL_WAIT.as_secs())]
    Late,
    /// The server refused it.
    #[error("refused ({0:?}): {text}", text = .0.message())]
    Refused(Refusal),
    /// The server closed the socket.
    #[error("the server closed the socket")]
    Closed,
    /// A message that does not decode.
    #[error("the server sent what a client cannot read: {0}")]
    Decode(#[from] jostle_protocol::DecodeError),
    /// A message that does not belong here.
    #[error("the server sent what a client does not expect")]
    Unexpected,
    /// A scene that does not parse.
    #[error("the welcome's scene is wrong: {0}")]
    Scene(Box<jostle_game::SceneError>),
}

impl From<Error> for BotError {
    fn from(error: Error) -> BotError {
        BotError::Socket(Box::new(error))
    }
}

/// A bot that was just sent its first keyframe.
pub struct Arrival {
    /// The socket.
    pub socket: Socket,
    /// The player's seat.
    pub seat: u16,
    /// Gives the seat back on another socket.
    pub token: Token,
    /// Holds that keyframe.
    pub stream: SnapshotStream,
    /// From the hello to its being decoded.
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
    pub fn size(&self) -> Result<Vec2, BotError> {
        let [name, source] = &self.scene;
        let scene = Scene::parse(&format!("{name}.toml"), source);
        Ok(scene.map_err(|error| BotError::Scene(Box::new(error)))?.size)
    }
}

/// Joins, or comes back with a token.
pub async fn connect(
    target: &Target,
    appearance: Appearance,
    token: Option<Token>,
) -> Result<Arrival, BotError> {
    timeout(ARRIVAL_WAIT, arrive(target, appearance, token)).await.map_err(|_| BotError::Late)?
}

async fn arrive(
    target: &Target,
    appearance: Appearance,
    token: Option<Token>,
) -> Result<Arrival, BotError> {
    let stream = TcpStream::connect(&target.authority).await?;
    stream.set_nodelay(true)?;
    let url = format!("ws://{}/{}", target.authority, target.room);
    let config = WebSocketConfig::default()
        .max_message_size(Some(SERVER_MESSAGE_BYTES_MAX))
        .read_buffer_size(READ_BUFFER_BYTES)
        .write_buffer_size(0);
    let (mut socket, _) = client_async_with_config(url, stream, Some(config)).await?;
    let said_at = Instant::now();
    let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key: None };
    send(&mut socket, &hello).await?;
    let (seat, token, scene) = match ServerMessage::decode(&message(&mut socket).await?)? {
        ServerMessage::Welcome { seat, token, scene_name, scene, .. } => {
            (seat, token, [scene_name, scene])
        }
        ServerMessage::Refused { refusal } => return Err(BotError::Refused(refusal)),
        _ => return Err(BotError::Unexpected),
    };
    let mut stream = SnapshotStream::default();
    match ServerMessage::decode(&message(&mut socket).await?)? {
        ServerMessage::Snapshot(coded) => stream.decode(&coded)?,
        ServerMessage::Refused { refusal } => return Err(BotError::Refused(refusal)),
        _ => return Err(BotError::Unexpected),
    };
    Ok(Arrival { socket, seat, token, stream, took: said_at.elapsed(), scene })
}

async fn message(socket: &mut Socket) -> Result<Bytes, BotError> {
    loop {
        if let Some(bytes) = next(socket).await? {
            return Ok(bytes);
        }
    }
}

/// The bytes of the next message; `None` is a control frame, which the socket answers by itself.
pub async fn next(socket: &mut Socket) -> Result<Option<Bytes>, BotError> {
    match socket.next().await {
        Some(Ok(Message::Binary(bytes))) => Ok(Some(bytes)),
        Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(None),
        Some(Ok(Message::Close(_))) | None => Err(BotError::Closed),
        Some(Ok(_)) => Err(BotError::Unexpected),
        Some(Err(error)) => Err(error.into()),
    }
}

/// Sends one message.
pub async fn send(socket: &mut Socket, message: &ClientMessage) -> Result<(), BotError> {
    Ok(socket.send(Message::Binary(message.encode().into())).await?)
}
