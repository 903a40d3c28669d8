//! A fleet with players in all of its rooms.

use super::node::{Dir, Node};
use super::player::{Player, Stay};
use jostle_sim::TICKS_PER_SECOND;
use jostle_tests::nats::Cluster;
use jostle_tests::server::LONG;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::timeout;

/// Number of rooms in a fleet under test; every third is private.
pub const ROOMS: usize = 6;
pub const NODES: usize = 3;
const SCENES: [&str; 3] = ["arena", "pile", "hill"];

/// Total number of players; `JOSTLE_FLEET_PLAYERS` can request more.
fn players() -> usize {
    number("JOSTLE_FLEET_PLAYERS", 24)
}

/// Reads a number from an environment variable.
pub fn number(variable: &str, usual: usize) -> usize {
    let text = std::env::var(variable).ok();
    text.map_or(usual, |text| {
        text.parse().unwrap_or_else(|_| panic!("{variable} is a whole number"))
    })
}

/// NATS servers, nodes, and players who follow their rooms.
pub struct Games {
    // Fields are dropped in this order, so nodes go before the servers and files that they need.
    pub nodes: Vec<Node>,
    pub cluster: Cluster,
    pub dir: Dir,
    pub rooms: Vec<String>,
    players: Vec<Playing>,
    stop: watch::Sender<bool>,
}

struct Playing {
    room: String,
    seen: watch::Receiver<(u32, Option<SocketAddr>)>,
    task: JoinHandle<Player>,
}

impl Games {
    /// Starts everything and waits until every player is playing and each room has a spectator. `nats` returns the
    /// address at which a node, given by its number, reaches the cluster.
    pub async fn start(nats: impl Fn(&Cluster, usize) -> String) -> Games {
        let cluster = Cluster::start(NODES).await.expect("a cluster");
        Games::start_with(cluster, NODES, nats).await
    }

    /// Starts a fleet with an existing cluster and the given number of nodes.
    pub async fn start_with(
        cluster: Cluster,
        count: usize,
        nats: impl Fn(&Cluster, usize) -> String,
    ) -> Games {
        let dir = Dir::new();
        let mut nodes = Vec::new();
        let copies = cluster.addresses().len();
        for index in 0..count {
            let (name, nats) = (format!("node-{index}"), nats(&cluster, index));
            let mut node = Node::with_replicas(&dir, &name, &nats, copies);
            node.start().await;
            nodes.push(node);
        }
        let mut rooms = Vec::new();
        for index in 0..ROOMS {
            let scene = SCENES[index % SCENES.len()];
            let node = nodes[index % count].address;
            rooms.push(open(node, scene, index % 3 == 2).await);
        }
        let (stop, stopped) = watch::channel(false);
        // Most players initially ask a node that does not play their room.
        let node = |index: usize| nodes[index / ROOMS % count].address;
        let players = (0..players())
            .map(|index| Player::new(&rooms[index % ROOMS], &format!("P{index}"), node(index)));
        let spectators = rooms.iter().map(|room| Player::spectator(room, nodes[0].address));
        let players = players.chain(spectators).map(|player| {
            let (sender, seen) = watch::channel((0, None));
            let room = player.room.clone();
            let task = tokio::spawn(player.play(stopped.clone(), sender));
            Playing { room, seen, task }
        });
        let players = players.collect();
        let mut games = Games { nodes, cluster, dir, rooms, players, stop };
        games.all_play().await;
        games
    }

    /// Waits until every player has played for another second.
    pub async fn all_play(&mut self) {
        let before: Vec<u32> = self.players.iter().map(|player| player.seen.borrow().0).collect();
        let all = async {
            for (player, before) in self.players.iter_mut().zip(before) {
                let later = before + TICKS_PER_SECOND;
                player.seen.wait_for(|(tick, _)| *tick >= later).await.expect("a player");
            }
        };
        timeout(LONG, all).await.expect("all players play in time");
    }

    /// The node that plays each room, as seen by the room's first player.
    pub fn places(&self) -> BTreeMap<&str, SocketAddr> {
        let seen = self.players.iter().rev().map(|player| {
            let (_, node) = *player.seen.borrow();
            (player.room.as_str(), node.expect("a node"))
        });
        seen.collect()
    }

    /// Waits until no player's room is at the given node any more.
    pub async fn leave(&mut self, node: SocketAddr) {
        let all = async {
            for player in &mut self.players {
                player.seen.wait_for(|(_, at)| *at != Some(node)).await.expect("a player");
            }
        };
        timeout(LONG, all).await.expect("all players are elsewhere in time");
    }

    /// Ends the games and returns the players' observations, after checking invariants: no seat was lost, no player was
    /// refused, and no two nodes sent snapshots of the same room at the same time.
    pub async fn end(self) -> Seen {
        self.stop.send_replace(true);
        let mut players = Vec::new();
        for player in self.players {
            players.push(player.task.await.expect("a player without a panic"));
        }
        let faults: Vec<_> = players.iter().flat_map(|player| &player.faults).collect();
        assert!(faults.is_empty(), "{faults:?}");
        for room in &self.rooms {
            let of_room = players.iter().filter(|player| player.room == *room);
            one_node_at_a_time(room, of_room.flat_map(|player| player.stays.iter().copied()));
        }
        Seen { players, nodes: self.nodes, rooms: self.rooms, cluster: self.cluster, dir: self.dir }
    }
}

/// Observations of the players during the games.
pub struct Seen {
    pub players: Vec<Player>,
    pub nodes: Vec<Node>,
    pub rooms: Vec<String>,
    pub cluster: Cluster,
    pub dir: Dir,
}

impl Seen {
    /// The gaps between connections, sorted by duration.
    pub fn gaps(&self) -> Vec<Duration> {
        let gaps = self.players.iter().flat_map(|player| player.gaps().map(|(gap, _)| gap));
        let mut gaps: Vec<Duration> = gaps.collect();
        gaps.sort();
        gaps
    }

    /// Largest number of ticks that were played again after a player had seen them.
    pub fn lost_ticks_max(&self) -> i64 {
        let gaps = self.players.iter().flat_map(|player| player.gaps());
        gaps.map(|(_, lost)| lost).max().unwrap_or(0)
    }
}

/// The median, the 99th percentile and the maximum of sorted times.
pub fn percentiles(sorted: &[Duration]) -> [Duration; 3] {
    let at = |part: usize| sorted[(sorted.len() * part / 100).min(sorted.len() - 1)];
    [at(50), at(99), at(100)]
}

/// Checks that a room is played by only one node at any time. A node's last snapshots may still be in flight when the
/// next node sends its first, but the node must never send a tick that the next one has played.
fn one_node_at_a_time(room: &str, stays: impl Iterator<Item = Stay>) {
    let mut by_node: BTreeMap<SocketAddr, Vec<Stay>> = BTreeMap::new();
    for stay in stays {
        by_node.entry(stay.node).or_default().push(stay);
    }
    let nodes: Vec<_> = by_node.iter().collect();
    for (index, (a, stays)) in nodes.iter().enumerate() {
        for (b, others) in &nodes[index + 1..] {
            for (one, other) in stays.iter().flat_map(|s| others.iter().map(move |o| (s, o))) {
                let apart = one.at[1] <= other.at[0] || other.at[1] <= one.at[0];
                let in_order = one.ticks[1] < other.ticks[0] || other.ticks[1] < one.ticks[0];
                assert!(apart || in_order, "{room}: {one:?} at {a} and {other:?} at {b}");
            }
        }
    }
}

/// Opens a room through the given node.
async fn open(node: SocketAddr, scene: &str, private: bool) -> String {
    let body = format!(r#"{{"scene":"{scene}","private":{private}}}"#);
    let request = format!(
        "POST /api/rooms HTTP/1.1\r\nHost: {node}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    let answer = async {
        let mut stream = TcpStream::connect(node).await.expect("a connection");
        stream.write_all(request.as_bytes()).await.expect("a request");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.expect("an answer");
        answer
    };
    let answer = timeout(LONG, answer).await.expect("an answer in time");
    let (head, body) = answer.split_once("\r\n\r\n").expect("a body");
    assert!(head.starts_with("HTTP/1.1 201"), "{answer}");
    let created: serde_json::Value = serde_json::from_str(body).expect("JSON");
    created["code"].as_str().expect("a code").to_owned()
}
