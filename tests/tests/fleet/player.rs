//! A player or spectator in a fleet. It follows its room from node to node, and searches for it when the node goes
//! silent.

use futures_util::{SinkExt, StreamExt};
use jostle_game::{Buttons, Input};
use jostle_protocol::{
    Appearance, ClientMessage, Refusal, Role, ServerMessage, SnapshotStream, Token, VERSION,
};
use jostle_sim::{Rng, Vec2};
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::time::{interval, sleep, timeout, timeout_at};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::{WebSocketStream, client_async_with_config};

type Socket = WebSocketStream<TcpStream>;

/// Silence after which a player assumes that its node is dead.
const SILENCE: Duration = Duration::from_secs(3);
/// Delay before asking the next node.
const RETRY: Duration = Duration::from_millis(100);
/// Time between inputs.
const INPUT_EVERY: Duration = Duration::from_millis(50);

/// The snapshots received over one connection.
#[derive(Clone, Copy, Debug)]
pub struct Stay {
    pub node: SocketAddr,
    pub ticks: [u32; 2],
    /// When the first and the last snapshot arrived.
    pub at: [Instant; 2],
    /// Longest time between consecutive snapshots.
    pub pause: Duration,
}

/// A player and what it observed.
pub struct Player {
    pub room: String,
    pub name: String,
    /// Nodes to ask, starting with the current one.
    nodes: Vec<SocketAddr>,
    token: Option<Token>,
    role: Role,
    pub seat: Option<u16>,
    pub stays: Vec<Stay>,
    /// Observations that should not have been possible.
    pub faults: Vec<String>,
}

/// Why a connection ended.
enum Left {
    Stopped,
    Moved(SocketAddr),
    Lost,
}

impl Player {
    pub fn new(room: &str, name: &str, node: SocketAddr) -> Player {
        let (room, name) = (room.to_owned(), name.to_owned());
        let (token, seat, stays, faults) = (None, None, Vec::new(), Vec::new());
        Player { room, name, nodes: vec![node], token, role: Role::Player, seat, stays, faults }
    }

    /// Creates a spectator, which nevertheless sends inputs.
    pub fn spectator(room: &str, node: SocketAddr) -> Player {
        Player { role: Role::Spectator, ..Player::new(room, "Eve", node) }
    }

    /// Plays until told to stop, publishing the newest tick and node to `ticks`.
    pub async fn play(
        mut self,
        mut stop: watch::Receiver<bool>,
        ticks: watch::Sender<(u32, Option<SocketAddr>)>,
    ) -> Player {
        loop {
            let node = self.nodes[0];
            let left = tokio::select! {
                left = self.visit(node, &ticks) => left,
                _ = stop.wait_for(|stop| *stop) => Left::Stopped,
            };
            match left {
                Left::Stopped => return self,
                Left::Moved(to) => self.ask_first(to),
                Left::Lost => {
                    self.nodes.rotate_left(1);
                    sleep(RETRY).await;
                }
            }
        }
    }

    fn ask_first(&mut self, node: SocketAddr) {
        self.nodes.retain(|known| *known != node);
        self.nodes.insert(0, node);
    }

    async fn visit(
        &mut self,
        node: SocketAddr,
        ticks: &watch::Sender<(u32, Option<SocketAddr>)>,
    ) -> Left {
        let Some(mut socket) = connect(node, &self.room).await else { return Left::Lost };
        let appearance = Appearance { name: self.name.as_str().into(), color: 0 };
        let (token, host_key, role) = (self.token, None, self.role);
        let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key, role };
        if socket.send(Message::Binary(hello.encode().into())).await.is_err() {
            return Left::Lost;
        }
        let mut snapshots = SnapshotStream::default();
        let mut rng = Rng::new(u64::from(node.port()), self.stays.len() as u64);
        let (mut seq, mut newest, mut stay) = (0, 0, None);
        let (mut inputs, mut heard_at) = (interval(INPUT_EVERY), Instant::now());
        loop {
            let frame = tokio::select! {
                frame = timeout_at((heard_at + SILENCE).into(), socket.next()) => frame,
                _ = inputs.tick(), if stay.is_some() => {
                    seq += 1;
                    let pointer = Some(Vec2::new(rng.range(10.0, 150.0), rng.range(10.0, 80.0)));
                    let keys = [Buttons::RIGHT, Buttons::LEFT, Buttons::UP, Buttons::FIRE];
                    let input = Input::new(keys[rng.below(4) as usize], pointer);
                    let input = ClientMessage::Input { seq, ack_tick: newest as u16, input };
                    // If the socket is broken, the next read notices it.
                    let _ = socket.send(Message::Binary(input.encode().into())).await;
                    continue;
                }
            };
            let bytes = match frame {
                Ok(Some(Ok(Message::Binary(bytes)))) => bytes,
                Ok(Some(Ok(Message::Ping(_) | Message::Pong(_)))) => continue,
                _ => return Left::Lost,
            };
            heard_at = Instant::now();
            match ServerMessage::decode(&bytes).expect("a message of the protocol") {
                ServerMessage::Welcome { seat: Some(own), tick, .. } => {
                    self.welcomed(own.seat.0, tick);
                    self.token = Some(own.token);
                    newest = tick;
                }
                ServerMessage::Welcome { seat: None, tick, .. } => newest = tick,
                ServerMessage::Snapshot(bytes) => {
                    snapshots.decode(&bytes).expect("a snapshot");
                    newest = snapshots.newest().expect("it was read").tick;
                    self.saw(node, newest, &mut stay);
                    ticks.send_replace((newest, Some(node)));
                }
                ServerMessage::Moved { url } => return Left::Moved(address(&url)),
                ServerMessage::Nodes { urls } => {
                    for node in urls.iter().map(|url| address(url)) {
                        if !self.nodes.contains(&node) {
                            self.nodes.push(node);
                        }
                    }
                }
                ServerMessage::Refused { refusal } => {
                    if !matches!(refusal, Refusal::Moving | Refusal::Closing) {
                        self.faults.push(format!("{refusal:?} of {node}"));
                    }
                    if refusal == Refusal::BadToken {
                        self.token = None;
                    }
                    return Left::Lost;
                }
                _ => {}
            }
        }
    }

    fn welcomed(&mut self, seat: u16, tick: u32) {
        match self.seat.replace(seat) {
            Some(before) if before != seat => {
                self.faults.push(format!("seat {seat} instead of {before} at tick {tick}"));
            }
            _ => {}
        }
    }

    fn saw(&mut self, node: SocketAddr, tick: u32, stay: &mut Option<usize>) {
        let now = Instant::now();
        match *stay {
            Some(index) => {
                let stay = &mut self.stays[index];
                stay.pause = stay.pause.max(now - stay.at[1]);
                (stay.ticks[1], stay.at[1]) = (tick, now);
            }
            None => {
                *stay = Some(self.stays.len());
                let pause = Duration::ZERO;
                self.stays.push(Stay { node, ticks: [tick; 2], at: [now; 2], pause });
            }
        }
    }

    /// The gaps without snapshots between connections, each with the number of lost ticks.
    pub fn gaps(&self) -> impl Iterator<Item = (Duration, i64)> {
        self.stays.windows(2).map(|pair| {
            let lost = i64::from(pair[0].ticks[1]) + 1 - i64::from(pair[1].ticks[0]);
            (pair[1].at[0] - pair[0].at[1], lost)
        })
    }
}

async fn connect(node: SocketAddr, room: &str) -> Option<Socket> {
    let connected = async {
        let stream = TcpStream::connect(node).await.ok()?;
        stream.set_nodelay(true).ok()?;
        // The default buffer of 128 KiB is cleared at each read.
        let config = Some(WebSocketConfig::default().read_buffer_size(4096));
        let url = format!("ws://{node}/{room}");
        Some(client_async_with_config(url, stream, config).await.ok()?.0)
    };
    timeout(SILENCE, connected).await.ok()?
}

fn address(url: &str) -> SocketAddr {
    url.strip_prefix("http://").and_then(|address| address.parse().ok()).expect("a node's address")
}
