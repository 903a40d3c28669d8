//! Tests of rooms that outlive their nodes, which are drained, killed or cut off, or whose directory loses its leader.

use super::games::{Games, NODES, ROOMS, number, percentiles};
use super::joints::verify_joints;
use super::node::{LOOK_EVERY, Node};
use super::wire::Wire;
use jostle_server::fleet::directory::HELD_FOR;
use jostle_server::limits;
use jostle_sim::TICKS_PER_SECOND;
use jostle_tests::nats::Cluster;
use jostle_tests::nats::proxy::Proxy;
use jostle_tests::server::LONG;
use serde_json::Value;
use std::time::{Duration, Instant};
use tokio::time::{sleep, timeout};

/// The streams of the directory and of the records.
const STREAMS: [&str; 3] = ["KV_jostle_nodes", "KV_jostle_rooms", "jostle_records"];
/// Maximum number of ticks that a killed node may lose. On an idle machine this is one second of play, but a stalled
/// machine records late.
const LOST_TICKS_MAX: i64 = 10 * TICKS_PER_SECOND as i64;

/// Number of disturbances of the fleet; `JOSTLE_FLEET_TIMES` can request more.
fn times(usual: usize) -> usize {
    number("JOSTLE_FLEET_TIMES", usual)
}

/// The node with the most rooms, and the number of its rooms.
fn fullest(games: &Games) -> (usize, usize) {
    let places = games.places();
    let rooms_of = |node: &Node| places.values().filter(|at| **at == node.address).count();
    let counts = games.nodes.iter().map(rooms_of).enumerate();
    counts.max_by_key(|(_, rooms)| *rooms).expect("a node")
}

fn direct(cluster: &Cluster, _: usize) -> String {
    cluster.url()
}

impl Games {
    /// Number of times a text occurs in the logs of all nodes.
    fn count(&self, text: &str) -> usize {
        self.nodes.iter().map(|node| node.count(text)).sum()
    }

    /// Waits until a text has occurred `times` times in the logs of all nodes together.
    async fn say(&self, text: &str, times: usize) {
        let said = async {
            while self.count(text) < times {
                sleep(LOOK_EVERY).await;
            }
        };
        timeout(LONG, said).await.unwrap_or_else(|_| panic!("not {text:?} in time"));
    }
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_drains_hands_its_rooms_over() {
    let mut games = Games::start(direct).await;
    let mut moved = 0;
    while moved < times(6) {
        let (node, rooms) = fullest(&games);
        games.nodes[node].signal("TERM");
        let (status, took) = games.nodes[node].ended().await;
        assert_eq!(status, Some(0), "after {took:?}");
        moved += rooms;
        games.leave(games.nodes[node].address).await;
        games.all_play().await;
        println!("{rooms} rooms moved; the node ended in {took:?}");
        games.nodes[node].start().await;
    }
    let seen = games.end().await;
    let [p50, p99, max] = percentiles(&seen.gaps());
    let lost = seen.lost_ticks_max();
    println!("{moved} moves: without snapshots for {p50:?} (p50), {p99:?} (p99), {max:?} (max)");
    // Ticks may be lost on the way to a player, but must never be repeated.
    assert!(lost <= 0, "{lost} ticks were played twice");
    let joints = verify_joints(seen).await;
    println!("replays of public rooms went on at {joints} moves, with the same state");
    assert!(joints > 0);
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_rooms_of_a_killed_node_go_on_elsewhere() {
    let mut games = Games::start(direct).await;
    for _ in 0..times(1) {
        let (node, rooms) = fullest(&games);
        games.nodes[node].signal("KILL");
        let killed = Instant::now();
        games.nodes[node].ended().await;
        games.leave(games.nodes[node].address).await;
        let back = killed.elapsed();
        games.all_play().await;
        println!("{rooms} rooms of a killed node went on after {back:?}");
        games.nodes[node].start().await;
    }
    let seen = games.end().await;
    let lost = seen.lost_ticks_max();
    println!("{lost} ticks lost at most");
    assert!(lost <= LOST_TICKS_MAX, "{lost} ticks");
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_room_stops_when_the_leader_of_the_directory_is_killed() {
    let mut games = Games::start(direct).await;
    for kill in 0..times(1) {
        let stream = STREAMS[kill % STREAMS.len()];
        let leader = games.cluster.leader_of_stream(stream).await.expect("an answer");
        let leader = leader.expect("a leader");
        games.cluster.kill(leader);
        let killed = Instant::now();
        while games.cluster.leader_of_stream(stream).await.expect("an answer").is_none() {
            sleep(Duration::from_millis(50)).await;
        }
        println!("{stream} has another leader after {:?}", killed.elapsed());
        games.all_play().await;
        games.cluster.restart(leader).await.expect("a NATS server");
        games.cluster.ready().await.expect("a ready cluster");
        games.all_play().await;
    }
    for node in &games.nodes {
        assert_eq!(node.count("stands still"), 0, "{}", node.name);
    }
    let seen = games.end().await;
    for player in &seen.players {
        let stays = player.stays.iter().map(|stay| stay.node).collect::<Vec<_>>();
        assert!(stays.windows(2).all(|pair| pair[0] == pair[1]), "{}: {stays:?}", player.name);
    }
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_without_the_directory_stands_still_before_another_plays() {
    let mut proxies = Vec::new();
    let cluster = Cluster::start(NODES).await.expect("a cluster");
    for _ in 0..NODES {
        proxies.push(Proxy::start(cluster.addresses()).await.expect("a proxy"));
    }
    let mut games = Games::start_with(cluster, NODES, |_, index| proxies[index].url()).await;
    for _ in 0..times(1) {
        let (node, rooms) = fullest(&games);
        let before = games.nodes[node].count("the room stands still");
        proxies[node].stall();
        let cut_off = Instant::now();
        games.leave(games.nodes[node].address).await;
        println!("{rooms} rooms of a node that was cut off went on after {:?}", cut_off.elapsed());
        assert!(games.nodes[node].count("stands still") > before);
        proxies[node].resume();
        games.all_play().await;
        games.nodes[node].says("registered in the fleet", 2).await;
    }
    // This also checks that no two nodes ever played the same room.
    let seen = games.end().await;
    let lost = seen.lost_ticks_max();
    println!("{lost} ticks lost at most");
    // The node kept playing until its lease expired, but could not record it.
    let held_ticks = HELD_FOR.as_secs() as i64 * i64::from(TICKS_PER_SECOND);
    assert!(lost <= held_ticks + LOST_TICKS_MAX, "{lost} ticks");
}

/// Waits until the state of a stream satisfies a condition.
async fn stream_is(cluster: &Cluster, stream: &str, is_so: impl Fn(&Value) -> bool) {
    let waited = async {
        let mut wire = Wire::connect(cluster.addresses()[0]).await;
        while !is_so(&wire.state_of(stream).await) {
            sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(LONG, waited).await.unwrap_or_else(|_| panic!("{stream} is not so in time"));
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn rooms_stay_where_they_were_when_nats_is_back_after_all_leases_have_ended() {
    let cluster = Cluster::start(1).await.expect("a server");
    let proxy = Proxy::start(cluster.addresses()).await.expect("a proxy");
    let mut games = Games::start_with(cluster, 2, |_, _| proxy.url()).await;
    let opened = games.count("the room is played here");
    proxy.stall();
    games.say("the room stands still", ROOMS).await;
    games.say("CANNOT KEEP A ROOM", ROOMS).await;
    stream_is(&games.cluster, "KV_jostle_nodes", |state| state["messages"] == 0).await;
    // The connection has buffered records whose writes were abandoned; they now arrive late.
    proxy.resume();
    games.all_play().await;
    // Long enough for each room to start a new file.
    for _ in 0..=limits::STATE_RETRY.as_secs() {
        games.all_play().await;
    }
    assert_eq!(games.count("records were refused"), 0);
    assert_eq!(games.count("the room is played here"), opened);
    let lost = games.end().await.lost_ticks_max();
    assert!(lost <= 0, "{lost} ticks were played twice");
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn rooms_are_played_on_and_kept_again_when_nats_comes_back_empty() {
    let cluster = Cluster::start(1).await.expect("a server");
    let mut games = Games::start_with(cluster, 2, direct).await;
    let opened = games.count("the room is played here");
    games.cluster.lose(0).expect("a server without files");
    games.cluster.restart(0).await.expect("a NATS server");
    let subjects = |state: &Value| state["subjects"].as_object().map_or(0, |all| all.len());
    // The bucket itself has one more subject.
    stream_is(&games.cluster, "KV_jostle_rooms", |state| subjects(state) > ROOMS).await;
    stream_is(&games.cluster, "jostle_records", |state| subjects(state) == ROOMS).await;
    games.all_play().await;
    assert_eq!(games.count("the room is played here"), opened);
    // Rooms can still move to other nodes.
    let (node, _) = fullest(&games);
    games.nodes[node].signal("TERM");
    games.nodes[node].ended().await;
    games.leave(games.nodes[node].address).await;
    games.all_play().await;
    let lost = games.end().await.lost_ticks_max();
    assert!(lost <= 0, "{lost} ticks were played twice");
}
