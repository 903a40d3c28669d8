//! Checks that a client that stops reading delays no other client, and later gets the newest state in one keyframe.

use crate::client::{Client, LONG};
use crate::server::Server;
use futures_util::StreamExt;
use jostle_game::Scene;
use jostle_protocol::Snapshot;
use jostle_server::Config;
use jostle_server::limits::Timeouts;
use jostle_tests::scenes::RESTLESS;
use jostle_tests::server::{BRIEF, PATIENT};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpSocket;
use tokio::time::timeout;

/// More than the kernel buffers at both ends of a socket.
const BYTES_MISSED: usize = 512 << 10;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slow_reader_delays_no_one_and_gets_the_newest_state() {
    let server = Server::start_with_scene("restless", RESTLESS).await;
    let slow = connect_small(server.address).await;
    catches_up(server, slow).await;
}

/// Lets a client read nothing for a while, and checks that it then catches up and that others play on.
pub async fn catches_up<S>(server: Server, mut slow: Client<S>)
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let mut ann = Client::join(server.address, "restless", "Ann").await;
    slow.enter("Slow", None).await;
    // For comparison, a player in the same scene on another server reads everything.
    let other = Server::start_with_scene("restless", RESTLESS).await;
    let mut bob = Client::join(other.address, "restless", "Bob").await;
    let mut carl = Client::join(other.address, "restless", "Carl").await;
    tokio::spawn(async move { while carl.socket.next().await.is_some() {} });

    // From here on, `slow` reads nothing until Ann has received more than any buffer could hold. In the meantime Ann
    // misses hardly more ticks than Bob, who also misses some on a busy machine.
    let stopped_tick = slow.newest.tick;
    let (stopped_bytes, before) = (ann.bytes, [&ann, &bob].map(Progress::of));
    let mut seen = BTreeMap::new();
    let play = async {
        loop {
            tokio::select! {
                snapshot = ann.snapshot() => {
                    let snapshot = snapshot.clone();
                    seen.insert(snapshot.tick, snapshot);
                }
                _ = bob.snapshot() => {}
            }
            let [own, others] = [before[0].share_missed(&ann), before[1].share_missed(&bob)];
            if ann.bytes - stopped_bytes >= BYTES_MISSED
                && ann.newest.tick >= stopped_tick + 120
                && own <= others + 0.25
            {
                return;
            }
        }
    };
    let went_on = timeout(LONG, play).await;
    let missed = [before[0].share_missed(&ann), before[1].share_missed(&bob)];
    went_on.unwrap_or_else(|_| panic!("Ann's game does not go on: {missed:?} of ticks missed"));
    let resumed_tick = ann.newest.tick;
    let elapsed = resumed_tick - stopped_tick;

    // The slow client catches up immediately, with far fewer messages than ticks, and its state is correct.
    let before = slow.snapshots;
    slow.until("the newest state", |snapshot| snapshot.tick >= resumed_tick).await;
    let messages = slow.snapshots - before;
    assert!(messages < elapsed / 2, "{messages} messages for {elapsed} ticks");
    assert!(server.count("jostle_sockets_late_total").await > 0);
    let equal = same_tick(&mut ann, &mut slow, &mut seen).await;
    assert!(equal, "both see the same world at the same tick");
    ann.keeps_playing().await;
    slow.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_reads_nothing_for_too_long_is_closed() {
    let waits = Timeouts { stall: BRIEF, ..PATIENT };
    let mut config = Config { waits, ..Config::default() };
    config.scenes.push(Scene::parse("restless.toml", RESTLESS).expect("a good scene"));
    let server = Server::start_with(config).await;
    let mut ann = Client::join(server.address, "restless", "Ann").await;
    let mut stuck = connect_small(server.address).await;
    stuck.enter("Stuck", None).await;
    stuck.play_one_input().await;
    let seat = stuck.seat;
    ann.until("the end of the stuck socket", |snapshot| {
        snapshot.players.iter().any(|player| player.seat.0 == seat && !player.connected)
    })
    .await;
    server.counts("jostle_refusals_total{reason=\"silent\"}", 1).await;
    server.counts("jostle_leaves_total{how=\"lost\"}", 1).await;
    // A tab that was in the background for too long returns to its seat and gets the newest state.
    let mut back = Client::connect(server.address, "restless").await;
    back.enter("Stuck", Some(stuck.token)).await;
    assert_eq!(back.seat, seat);
    server.counts("jostle_joins_total{how=\"resumed\"}", 1).await;
    ann.keeps_playing().await;
    back.keeps_playing().await;
}

/// A client's newest tick and its number of snapshots at some moment.
struct Progress {
    tick: u32,
    snapshots: u32,
}

impl Progress {
    fn of(client: &Client) -> Progress {
        Progress { tick: client.newest.tick, snapshots: client.snapshots }
    }

    /// The share of ticks since then that came without a snapshot.
    fn share_missed(&self, client: &Client) -> f64 {
        let ticks = f64::from(client.newest.tick - self.tick).max(1.0);
        1.0 - f64::from(client.snapshots - self.snapshots) / ticks
    }
}

/// Connects a client with the smallest possible kernel buffer.
pub async fn connect_small(server: SocketAddr) -> Client {
    let small = TcpSocket::new_v4().expect("a socket");
    small.set_recv_buffer_size(4096).expect("a small buffer");
    Client::connect_over(small, server, "restless").await
}

/// Reads until both clients have seen the same tick, and compares their snapshots.
async fn same_tick<S>(
    ann: &mut Client,
    slow: &mut Client<S>,
    seen: &mut BTreeMap<u32, Snapshot>,
) -> bool
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let compare = async {
        loop {
            while ann.newest.tick < slow.newest.tick {
                let snapshot = ann.snapshot().await.clone();
                seen.insert(snapshot.tick, snapshot);
            }
            if let Some(snapshot) = seen.get(&slow.newest.tick) {
                return *snapshot == slow.newest;
            }
            slow.snapshot().await;
        }
    };
    timeout(LONG, compare).await.expect("a tick that both saw")
}
