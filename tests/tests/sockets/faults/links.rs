//! Tests of links that are slow, silent or lost, and of tokens presented over them.

use super::refusals;
use crate::client::{Client, LONG};
use crate::server::{Server, until_count};
use crate::slow_reader::connect_small;
use jostle_game::{Buttons, Scene};
use jostle_protocol::limits::TOKEN_BYTES;
use jostle_protocol::{Refusal, Token, VERSION};
use jostle_server::Config;
use jostle_server::limits::Timeouts;
use jostle_tests::scenes::RESTLESS;
use jostle_tests::server::{BRIEF, PATIENT};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, sleep, sleep_until, timeout};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_that_vanished_is_closed_and_may_come_back() {
    let waits = Timeouts { keepalive: Duration::from_millis(200), silence: BRIEF, ..PATIENT };
    let server = Server::start_with_waits(waits).await;
    let mut gone = Client::join(server.address, "arena", "Gone").await;
    gone.play_one_input().await;
    // This socket is not read, so no pings are answered, and it is never closed from this end.
    server.counts(&refusals("silent"), 1).await;
    server.counts("jostle_leaves_total{how=\"lost\"}", 1).await;
    let mut back = Client::connect(server.address, "arena").await;
    back.enter("Gone", Some(gone.token)).await;
    assert_eq!(back.seat, gone.seat);
    server.counts("jostle_joins_total{how=\"resumed\"}", 1).await;
    back.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_reads_byte_by_byte_is_closed() {
    let waits = Timeouts { stall: BRIEF, ..PATIENT };
    let mut config = Config { waits, ..Config::default() };
    config.scenes.push(Scene::parse("restless.toml", RESTLESS).expect("a good scene"));
    let server = Server::start_with(config).await;
    let mut ann = Client::join(server.address, "restless", "Ann").await;
    let mut slow = connect_small(server.address).await;
    slow.enter("Slow", None).await;
    slow.play_one_input().await;
    let reading = tokio::spawn(async move {
        let mut byte = [0];
        while slow.socket.get_mut().read_exact(&mut byte).await.is_ok() {
            sleep(Duration::from_millis(50)).await;
        }
    });
    ann.until("the end of the slow socket", |snapshot| {
        snapshot.players.iter().any(|player| !player.connected)
    })
    .await;
    server.counts(&refusals("silent"), 1).await;
    ann.keeps_playing().await;
    reading.abort();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_used_or_forged_token_gives_no_seat_back() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    bob.play_one_input().await;
    let (seat, used) = (bob.seat, bob.token);
    drop(bob);
    let mut bob = Client::connect(server.address, "arena").await;
    bob.enter("Bob", Some(used)).await;
    assert_ne!(bob.token, used, "every session gets a token of its own");
    // The first input proves that the new token has arrived; after that, the old one is invalid.
    bob.keeps_playing().await;
    let mut forged = ann.token;
    forged.0[0] ^= 1;
    for token in [used, Token([0; TOKEN_BYTES]), Token([255; TOKEN_BYTES]), forged] {
        let mut eve = Client::connect(server.address, "arena").await;
        eve.hello(VERSION, "Eve", Some(token)).await;
        eve.is_refused(Refusal::BadToken).await;
    }
    server.counts(&refusals("bad_token"), 4).await;
    server.counts("jostle_joins_total{how=\"resumed\"}", 1).await;
    assert_eq!(bob.seat, seat);
    bob.keeps_playing().await;
    ann.keeps_playing().await;
    assert_eq!(ann.newest.players.len(), 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_of_another_room_or_process_gives_no_seat_back() {
    let (server, restarted) = (Server::start().await, Server::start().await);
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "pile", "Bob").await;
    for (address, room) in [(server.address, "pile"), (restarted.address, "arena")] {
        let mut eve = Client::connect(address, room).await;
        eve.hello(VERSION, "Eve", Some(ann.token)).await;
        eve.is_refused(Refusal::BadToken).await;
    }
    server.counts(&refusals("bad_token"), 1).await;
    restarted.counts(&refusals("bad_token"), 1).await;
    ann.keeps_playing().await;
    bob.keeps_playing().await;
}

/// One direction of a slow link. Bytes arrive in order, each chunk 100 to 200 ms after it was sent, except that every
/// fifteenth chunk, and everything behind it, is delayed by another half a second.
async fn delayed(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, mut seed: u32) {
    let (sender, mut parts) = mpsc::unbounded_channel::<(Instant, Vec<u8>)>();
    let reading = async move {
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = from.read(&mut buffer).await {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let stall = if (seed >> 16).is_multiple_of(15) { 500 } else { 0 };
            let delay = Duration::from_millis(u64::from(100 + (seed >> 8) % 100 + stall));
            if sender.send((Instant::now() + delay, buffer[..count].to_vec())).is_err() {
                return;
            }
        }
    };
    let writing = async move {
        while let Some((due, bytes)) = parts.recv().await {
            sleep_until(due).await;
            if to.write_all(&bytes).await.is_err() {
                return;
            }
        }
    };
    tokio::join!(reading, writing);
}

/// Opens a port that forwards one connection to `server` over a link with a round trip of 200 to 400 ms.
pub async fn far_away(server: SocketAddr) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("a bound port");
    tokio::spawn(async move {
        let (near, _) = listener.accept().await.expect("a client");
        let far = TcpStream::connect(server).await.expect("a server");
        let (near, far) = (near.into_split(), far.into_split());
        tokio::join!(delayed(near.0, far.1, 1), delayed(far.0, near.1, 2));
    });
    address
}

/// Opens a port that forwards one connection to `server` through a buffering proxy, which accepts everything from the
/// server and withholds it on command.
async fn buffering_proxy(server: SocketAddr) -> (SocketAddr, watch::Sender<bool>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("a bound port");
    let (hold, mut held) = watch::channel(false);
    tokio::spawn(async move {
        let (near, _) = listener.accept().await.expect("a client");
        let far = TcpStream::connect(server).await.expect("a server");
        let ((mut inputs, mut to_client), (mut news, mut to_server)) =
            (near.into_split(), far.into_split());
        let (sender, mut parts) = mpsc::unbounded_channel::<Vec<u8>>();
        let reading = async move {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = news.read(&mut buffer).await {
                // The client may already be gone.
                let _ = sender.send(buffer[..count].to_vec());
            }
        };
        let writing = async move {
            while let Some(bytes) = parts.recv().await {
                let free = held.wait_for(|held| !held).await.is_ok();
                if !free || to_client.write_all(&bytes).await.is_err() {
                    return;
                }
            }
        };
        tokio::join!(reading, writing, tokio::io::copy(&mut inputs, &mut to_server)).2.ok();
    });
    (address, hold)
}

/// Creates a client that has been playing for a while behind a buffering proxy.
async fn behind_a_buffering_proxy(hearing: Duration) -> (Server, Client, watch::Sender<bool>) {
    let waits = Timeouts { hearing, ..PATIENT };
    let mut config = Config { waits, ..Config::default() };
    config.scenes.push(Scene::parse("restless.toml", RESTLESS).expect("a good scene"));
    let server = Server::start_with(config).await;
    let (address, hold) = buffering_proxy(server.address).await;
    let mut far = Client::join(address, "restless", "Far").await;
    while far.seq < 30 {
        far.play_one_input().await;
    }
    (server, far, hold)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn bytes_buffered_on_the_way_lower_the_rate() {
    let (server, mut far, hold) = behind_a_buffering_proxy(LONG).await;
    hold.send_replace(true);
    let lowered = async {
        // The client receives nothing new, and its acknowledgements show it.
        while server.count("jostle_sockets_late_total").await == 0 {
            far.input(Buttons::RIGHT, None).await;
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, lowered).await.expect("a lower rate");
    until_count(server.ops, "jostle_snapshots_skipped_total{reason=\"rate\"}", 1).await;
    hold.send_replace(false);
    far.keeps_playing().await;
    assert_eq!(server.count(&refusals("silent")).await, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_whose_bytes_are_buffered_for_too_long_is_closed() {
    let (server, mut far, hold) = behind_a_buffering_proxy(BRIEF).await;
    let mut ann = Client::join(server.address, "restless", "Ann").await;
    hold.send_replace(true);
    let silenced = async {
        while server.count(&refusals("silent")).await == 0 {
            far.input(Buttons::RIGHT, None).await;
            // An input acknowledges received snapshots.
            ann.play_one_input().await;
        }
    };
    timeout(LONG, silenced).await.expect("an end");
    server.counts("jostle_leaves_total{how=\"lost\"}", 1).await;
    hold.send_replace(false);
    far.is_refused(Refusal::Silent).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_distant_player_on_a_bad_link_plays_on() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut far = Client::join(far_away(server.address).await, "arena", "Far").await;
    let play = async {
        while far.seq < 180 {
            far.input(Buttons::RIGHT, None).await;
            timeout(Duration::from_millis(16), far.snapshot()).await.ok();
        }
    };
    timeout(LONG, play).await.expect("a game that goes on");
    far.keeps_playing().await;
    assert!(far.player().connected);
    // The distant client's inputs arrived in bursts, but all were valid.
    assert_eq!(server.count("jostle_inputs_ignored_total").await, 0);
    for reason in ["flood", "silent", "bad_message"] {
        assert_eq!(server.count(&refusals(reason)).await, 0, "{reason}");
    }
    ann.keeps_playing().await;
}
