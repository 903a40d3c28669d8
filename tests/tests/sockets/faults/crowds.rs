//! Tests of crowds: connections, departures, and requests to the operators' port.

use super::refusals;
use crate::client::{Client, LONG};
use crate::http::{get, raw_over};
use crate::server::Server;
use jostle_protocol::{Refusal, ServerMessage, VERSION};
use jostle_server::Config;
use jostle_server::limits::{ADDRESS_CONNECTIONS_MIN, OPS_CONNECTIONS_MAX};
use jostle_tests::server::patient;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::timeout;

/// Number of sockets in the crowd.
const CROWD: u16 = 500;
/// Number of seats in the arena.
const SEATS: usize = 64;

/// Local addresses used by misbehaving clients.
const EVE: Ipv4Addr = Ipv4Addr::new(127, 0, 1, 1);
const MALLORY: Ipv4Addr = Ipv4Addr::new(127, 0, 1, 2);

/// Creates a socket bound to a local address.
fn socket_of(own: Ipv4Addr) -> TcpSocket {
    let socket = TcpSocket::new_v4().expect("a socket");
    socket.bind(SocketAddr::new(IpAddr::V4(own), 0)).expect("an address of this machine");
    socket
}

/// Joins a room from one of several local networks; returns a seat or the refusal.
pub async fn attempt(server: SocketAddr, room: &str, number: u16) -> Result<Client, Refusal> {
    // No network has more than a quarter of the seats; with more it would lose some to others.
    let own = Ipv4Addr::new(127, 0, (number % 32) as u8 + 1, 1);
    let mut client = Client::connect_over(socket_of(own), server, room).await;
    client.hello(VERSION, "Many", None).await;
    match client.message().await {
        ServerMessage::Welcome { .. } => Ok(client),
        ServerMessage::Refused { refusal } => Err(refusal),
        other => panic!("{other:?} instead of an answer"),
    }
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn five_hundred_connect_at_once_and_leave_at_once() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let address = server.address;
    let attempts: Vec<_> =
        (0..CROWD).map(|number| tokio::spawn(attempt(address, "arena", number))).collect();
    let (mut seated, mut refused) = (Vec::new(), 0);
    for attempt in attempts {
        match timeout(LONG, attempt).await.expect("an answer in time").expect("no panic") {
            Ok(client) => seated.push(client),
            Err(Refusal::RoomFull | Refusal::ServerFull) => refused += 1,
            Err(other) => panic!("{other:?}"),
        }
    }
    // Every seat was taken, and all other clients were refused.
    assert_eq!((seated.len(), refused), (SEATS - 1, usize::from(CROWD) + 1 - SEATS));
    server.counts("jostle_joins_total{how=\"new\"}", SEATS as u64).await;
    let full = server.count(&refusals("room_full")).await;
    assert_eq!(full + server.count(&refusals("server_full")).await, refused as u64);
    ann.keeps_playing().await;

    let left = seated.len() as u64;
    drop(seated);
    server.counts("jostle_leaves_total{how=\"lost\"}", left).await;
    ann.until("everybody else gone", |snapshot| {
        snapshot.players.iter().filter(|player| player.connected).count() == 1
    })
    .await;
    ann.keeps_playing().await;
}

/// An empty scene with four seats.
const SMALL: &str = "title = \"Small\"\nsize = [40, 30]\ngroups = [\"a\"]\n[limits]\nplayers = 4\n";

/// Joins from a local address, plays if requested, and vanishes. Returns `false` if no seat was free.
async fn join_and_vanish(server: SocketAddr, own: Ipv4Addr, plays: bool) -> bool {
    let mut client = Client::connect_over(socket_of(own), server, "small").await;
    client.hello(VERSION, "Gone", None).await;
    let ServerMessage::Welcome { seat: Some(own), .. } = client.message().await else {
        return false;
    };
    client.seat = own.seat.0;
    if plays {
        client.play_one_input().await;
    }
    true
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn clients_that_join_and_vanish_fill_no_room() {
    let server = Server::start_with_scene("small", SMALL).await;
    let mut ann = Client::join(server.address, "small", "Ann").await;
    // Without an input, no seat is held. After an input, a full room reassigns held seats of the same address.
    for plays in [false, true] {
        for _ in 0..9 {
            assert!(join_and_vanish(server.address, EVE, plays).await);
            ann.play_one_input().await;
        }
    }
    assert!(server.count("jostle_leaves_total{how=\"displaced\"}").await > 0);
    // A client from another address still gets a seat.
    assert!(join_and_vanish(server.address, MALLORY, true).await);
    assert_eq!(server.count(&refusals("room_full")).await, 0);
    ann.keeps_playing().await;
}

/// Connects without sending anything; returns the server's response.
async fn response_to_silence(mut stream: TcpStream) -> String {
    let mut said = String::new();
    // The connection may already be closed; the response is then empty.
    let _ = stream.shutdown().await;
    let _ = timeout(LONG, stream.read_to_string(&mut said)).await.expect("an end in time");
    said
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_address_that_connects_without_end_is_limited_and_no_other() {
    let config = Config { address_sessions_max: Some(1), ..patient() };
    let server = Server::start_with(config).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let flood = async {
        loop {
            let mut streams = Vec::new();
            for _ in 0..ADDRESS_CONNECTIONS_MIN {
                let stream = socket_of(EVE).connect(server.address).await;
                streams.push(stream.expect("a connection"));
            }
            for stream in streams {
                let said = response_to_silence(stream).await;
                if said.starts_with("HTTP/1.1 429 ") {
                    return said;
                }
            }
        }
    };
    let said = timeout(LONG, flood).await.expect("an answer in time");
    assert!(said.contains("\r\nRetry-After: 1\r\n"), "{said}");
    assert!(server.count(&refusals("connects_too_fast")).await > 0);
    let mallory = socket_of(MALLORY).connect(server.address).await.expect("a connection");
    let request = "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    assert_eq!(raw_over(mallory, request).await.status, 200);
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flooded_operators_port_costs_players_nothing() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let ops = server.ops;
    let asking: Vec<_> = (0..OPS_CONNECTIONS_MAX / 2)
        .map(|_| {
            tokio::spawn(async move {
                for _ in 0..25 {
                    assert_eq!(get(ops, "/metrics").await.status, 200);
                }
            })
        })
        .collect();
    ann.keeps_playing().await;
    for asked in asking {
        timeout(LONG, asked).await.expect("answers in time").expect("only good answers");
    }

    // Holding all of the operators' port's connections open blocks only that port.
    let mut held = Vec::new();
    while held.len() < OPS_CONNECTIONS_MAX + 4 {
        held.push(TcpStream::connect(ops).await.expect("a connection"));
    }
    let mut last = held.pop().expect("the last connection");
    let closed = timeout(LONG, last.read(&mut [0])).await.expect("an end in time");
    assert!(!matches!(closed, Ok(1..)), "closed without an answer");
    ann.keeps_playing().await;
    drop(held);
    timeout(LONG, until_answered(ops)).await.expect("a free connection");
    assert!(server.count(&refusals("ops_busy")).await >= 4);
}

/// Retries until the server has noticed that connections are available again.
async fn until_answered(ops: SocketAddr) {
    loop {
        let mut stream = TcpStream::connect(ops).await.expect("a connection");
        let asked = stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").await;
        if asked.is_ok() && matches!(stream.read(&mut [0; 8]).await, Ok(1..)) {
            return;
        }
    }
}
