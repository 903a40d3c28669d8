//! One bot: a real socket, decoded snapshots, and [`Hands`].

use super::Target;
use super::report::ClientReport;
use crate::cli::hands::Hands;
use futures_util::{SinkExt, StreamExt};
use hyper::body::Bytes;
use jostle_protocol::limits::SERVER_MESSAGE_BYTES_MAX;
use jostle_protocol::{Appearance, ClientMessage, Refusal, ServerMessage, Stream, VERSION};
use jostle_sim::{Scene, TICKS_PER_SECOND, Vec2};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::time::{interval, sleep, timeout};
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

type Socket = WebSocketStream<TcpStream>;

/// Time to connect and to be welcomed.
const WELCOME_WAIT: Duration = Duration::from_secs(20);
/// Time between two pings.
const PING_EVERY: Duration = Duration::from_millis(250);

/// A bot before it plays.
pub struct Bot {
    /// Its number, from 0.
    pub index: u32,
    /// Seed of all bots.
    pub seed: u64,
    /// How long it plays.
    pub length: Duration,
    /// Where.
    pub target: Target,
}

/// Why a bot stopped early.
#[derive(Debug, thiserror::Error)]
enum BotError {
    #[error("no connection: {0}")]
    Connect(#[from] std::io::Error),
    #[error("socket: {0}")]
    Socket(#[from] Box<Error>),
    #[error("no welcome within {} s", WELCOME_WAIT.as_secs())]
    Late,
    #[error("refused: {0:?}")]
    Refused(Refusal),
    #[error("the server closed the socket")]
    Closed,
    #[error("the server sent what a client cannot read: {0}")]
    Decode(#[from] jostle_protocol::DecodeError),
    #[error("the server sent what a client does not expect")]
    Unexpected,
    #[error("the welcome's scene is wrong: {0}")]
    Scene(Box<jostle_sim::SceneError>),
}

impl From<Error> for BotError {
    fn from(error: Error) -> BotError {
        BotError::Socket(Box::new(error))
    }
}

impl Bot {
    /// Plays to the end or to the first error, and says how it went.
    pub async fn play(self) -> ClientReport {
        let mut report = ClientReport::new(self.index);
        if let Err(error) = self.try_play(&mut report).await {
            report.error = Some(error.to_string());
        }
        report
    }

    async fn try_play(&self, report: &mut ClientReport) -> Result<(), BotError> {
        let joined = timeout(WELCOME_WAIT, self.join(report)).await.map_err(|_| BotError::Late)?;
        let (mut socket, size) = joined?;
        let mut hands = Hands::new(self.seed, self.index, size);
        let mut seq = 0;
        let mut eyes = Eyes::default();
        let mut inputs = interval(Duration::from_secs(1) / TICKS_PER_SECOND);
        let mut pings = interval(PING_EVERY);
        let mut end = std::pin::pin!(sleep(self.length));
        loop {
            tokio::select! {
                frame = socket.next() => {
                    if let Some(bytes) = binary(frame)? {
                        report.bytes += bytes.len() as u64;
                        eyes.see(&bytes, report)?;
                    }
                }
                _ = inputs.tick() => {
                    seq += 1;
                    let input = hands.next_input();
                    send(&mut socket, &ClientMessage::Input { seq, input }).await?;
                }
                _ = pings.tick() => {
                    let stamp = report.stamp(Instant::now());
                    send(&mut socket, &ClientMessage::Ping { stamp }).await?;
                }
                () = end.as_mut() => break,
            }
        }
        report.ended_at = Some(Instant::now());
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        // The play is over; a server that is gone by now is none of its business.
        let _ = socket.close(Some(frame)).await;
        Ok(())
    }

    /// Connects and says hello; the socket and the size of the world.
    async fn join(&self, report: &mut ClientReport) -> Result<(Socket, Vec2), BotError> {
        let stream = TcpStream::connect(&self.target.authority).await?;
        stream.set_nodelay(true)?;
        let url = format!("ws://{}/{}", self.target.authority, self.target.room);
        let config = WebSocketConfig::default().max_message_size(Some(SERVER_MESSAGE_BYTES_MAX));
        let (mut socket, _) = client_async_with_config(url, stream, Some(config)).await?;
        let name = format!("bot {}", self.index + 1);
        let color = (self.index % u32::from(jostle_protocol::limits::COLORS)) as u8;
        let appearance = Appearance { name, color };
        let hello = ClientMessage::Hello { version: VERSION, appearance, token: None };
        send(&mut socket, &hello).await?;
        let welcome = loop {
            if let Some(bytes) = binary(socket.next().await)? {
                break ServerMessage::decode(&bytes)?;
            }
        };
        match welcome {
            ServerMessage::Welcome { seat, scene_name, scene, .. } => {
                report.seat = Some(seat);
                report.started_at = Some(Instant::now());
                let file = format!("{scene_name}.toml");
                let scene = Scene::parse(&file, &scene)
                    .map_err(|error| BotError::Scene(Box::new(error)))?;
                Ok((socket, scene.size))
            }
            ServerMessage::Refused { refusal } => Err(BotError::Refused(refusal)),
            _ => Err(BotError::Unexpected),
        }
    }
}

/// The bytes of the next message; `None` is a control frame, which the socket answers by itself.
fn binary(frame: Option<Result<Message, Error>>) -> Result<Option<Bytes>, BotError> {
    match frame {
        Some(Ok(Message::Binary(bytes))) => Ok(Some(bytes)),
        Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(None),
        Some(Ok(Message::Close(_))) | None => Err(BotError::Closed),
        Some(Ok(_)) => Err(BotError::Unexpected),
        Some(Err(error)) => Err(error.into()),
    }
}

async fn send(socket: &mut Socket, message: &ClientMessage) -> Result<(), BotError> {
    Ok(socket.send(Message::Binary(message.encode().into())).await?)
}

/// What a bot sees, as a page would hold it.
#[derive(Default)]
struct Eyes {
    stream: Stream,
}

impl Eyes {
    fn see(&mut self, bytes: &[u8], report: &mut ClientReport) -> Result<(), BotError> {
        match ServerMessage::decode(bytes)? {
            ServerMessage::Snapshot(coded) => {
                let still_until = self.stream.decode(&coded)?.still_until;
                let tick = self.stream.newest().map_or(0, |newest| newest.tick);
                report.saw(tick, still_until, Instant::now());
                Ok(())
            }
            ServerMessage::Pong { stamp, .. } => {
                report.ponged(stamp, Instant::now());
                Ok(())
            }
            ServerMessage::Draining { .. } => Ok(()),
            ServerMessage::Refused { refusal } => Err(BotError::Refused(refusal)),
            ServerMessage::Welcome { .. } => Err(BotError::Unexpected),
        }
    }
}
