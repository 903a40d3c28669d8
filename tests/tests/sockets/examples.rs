//! Checks that the clients in `docs/examples`, written in another language from `docs/protocol.md` alone, report the
//! same positions as our own client.

use crate::client::{Client, LONG};
use crate::server::Server;
use jostle_game::{Buttons, Scene};
use jostle_protocol::Snapshot;
use jostle_sim::Vec2;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Command, Stdio};
use tokio::task::JoinHandle;
use tokio::time::timeout;

/// Centres in world units, by index and generation.
type Positions = BTreeMap<String, [f64; 2]>;

/// A line printed by `stream.py`.
#[derive(Deserialize)]
struct Line {
    tick: u32,
    bodies: Positions,
}

/// Starts an example and returns its output. The example ends no later than the server.
fn start(program: &str, address: SocketAddr, more: &[&str]) -> JoinHandle<String> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples");
    let mut python = Command::new("python3");
    python.arg(examples.join(program)).arg(address.to_string()).args(more);
    python.stderr(Stdio::inherit()).env("PYTHONDONTWRITEBYTECODE", "1");
    tokio::task::spawn_blocking(move || {
        let output = python.output().expect("python3 starts; `cargo xtask test` installs it");
        assert!(output.status.success(), "{python:?} failed");
        String::from_utf8(output.stdout).expect("text")
    })
}

/// Size of a quantum in a room, in world units.
fn quantum_of(room: &str) -> f64 {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == room);
    scene.expect("a built-in scene").world.quantum.into()
}

fn positions(snapshot: &Snapshot, quantum: f64) -> Positions {
    let bodies = snapshot.bodies.iter().map(|body| {
        let name = format!("{}.{}", body.id.index, body.id.generation);
        (name, body.quanta.map(|axis| f64::from(axis) * quantum))
    });
    bodies.collect()
}

/// Plays in a room until the example has ended; returns the example's output and the positions of bodies by tick.
async fn play_beside(
    mut ann: Client,
    room: &str,
    example: JoinHandle<String>,
) -> (String, BTreeMap<u32, Positions>) {
    let all = [Buttons::RIGHT, Buttons::FIRE, Buttons::MAKE, Buttons::LEFT, Buttons::UP];
    let quantum = quantum_of(room);
    let mut seen = BTreeMap::from([(ann.newest.tick, positions(&ann.newest, quantum))]);
    while !example.is_finished() {
        let seq = ann.seq as usize;
        let pointer = Vec2::new(20.0 + (seq % 90) as f32, 30.0);
        // The pointer appears and disappears, as do bodies that the player creates and throws.
        let pointer = (seq / 100).is_multiple_of(2).then_some(pointer);
        ann.input(all[seq / 7 % all.len()], pointer).await;
        let snapshot = ann.snapshot().await;
        seen.insert(snapshot.tick, positions(snapshot, quantum));
    }
    (timeout(LONG, example).await.expect("an end in time").expect("no panic"), seen)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_short_python_client_prints_positions() {
    let server = Server::start().await;
    // On a busy machine the comparing client may receive fewer ticks and miss the printed one.
    let compared = async { while !is_printed_as_sent(server.address).await {} };
    timeout(LONG, compared).await.expect("a printed tick that the other client was sent too");
}

/// Runs the example alongside a player and compares its output with the player's snapshot of the same tick; returns
/// whether the player had one.
async fn is_printed_as_sent(address: SocketAddr) -> bool {
    let mut ann = Client::join(address, "arena", "Ann").await;
    ann.keeps_playing().await;
    let example = start("positions.py", address, &["arena"]);
    let (printed, seen) = play_beside(ann, "arena", example).await;
    let mut lines = printed.lines();
    let tick = lines.next().and_then(|line| line.strip_prefix("tick ")).expect("a tick first");
    let found: Positions = lines.map(position_of).collect();
    assert!(found.len() > 4, "a hero besides the walls in {printed}");
    let sent = seen.get(&tick.parse().expect("a number"));
    if let Some(expected) = sent {
        assert_eq!(&found, expected);
    }
    sent.is_some()
}

/// Parses a line such as `3.0 12.5 7`.
fn position_of(line: &str) -> (String, [f64; 2]) {
    let words: Vec<&str> = line.split(' ').collect();
    let number = |word: &str| word.parse().unwrap_or_else(|_| panic!("no number in {line}"));
    (words[0].to_owned(), [number(words[1]), number(words[2])])
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_python_client_follows_all_moving_bodies() {
    for room in ["arena", "pile"] {
        let server = Server::start().await;
        // On a busy machine each client receives only some of the ticks, and few are received by both.
        let compared = async {
            let mut ticks = 0;
            while ticks < 60 {
                ticks += ticks_printed_as_sent(server.address, room).await;
            }
        };
        timeout(2 * LONG, compared).await.expect("enough ticks that both clients were sent");
    }
}

/// Runs the example alongside two players and compares each line with a player's snapshot of the same tick; returns the
/// number of compared ticks.
async fn ticks_printed_as_sent(address: SocketAddr, room: &'static str) -> u32 {
    let ann = Client::join(address, room, "Ann").await;
    let example = start("stream.py", address, &[room, "300"]);
    // In the meantime a player with a pointer joins and leaves.
    let bob = tokio::spawn(async move {
        let mut bob = Client::join(address, room, "Bob").await;
        for x in 0..60 {
            bob.input(Buttons::FIRE, Some(Vec2::new(x as f32, 9.0))).await;
            bob.snapshot().await;
        }
    });
    let (printed, seen) = play_beside(ann, room, example).await;
    bob.await.expect("Bob plays");
    assert_eq!(printed.lines().count(), 300);
    let mut compared = 0;
    for line in printed.lines() {
        let Line { tick, bodies } = serde_json::from_str(line).expect("a line of JSON");
        if let Some(seen) = seen.get(&tick) {
            assert_eq!(&bodies, seen, "{room}, tick {tick}");
            compared += 1;
        }
    }
    compared
}
