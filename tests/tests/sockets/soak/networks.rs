//! Networks that exhaust shared resources, and peers that impersonate others, in rows 4a and 21e to 21l of
//! docs/faults.md. Linux treats all of 127.0.0.0/8 as local addresses; the server trusts [`PROXY`] as a proxy.

use super::stage::Stage;
use crate::client::{Client, LONG};
use crate::faults::refusals;
use crate::http::{Answer, admin_request, exchange, raw_over};
use jostle_protocol::{PlayerState, Refusal, ServerMessage, Snapshot, VERSION};
use jostle_server::limits::ADDRESS_ROOMS_MIN;
use jostle_tests::server::PROXY;
use std::collections::BTreeSet;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

const SMALL: &str = "small";
/// Addresses of the clients that fill the room, of newcomers who want a seat, and of a neighbour of the former.
const CROWD: Ipv4Addr = Ipv4Addr::new(127, 7, 0, 1);
const NEIGHBOUR: Ipv4Addr = Ipv4Addr::new(127, 7, 0, 9);
const NEWCOMER: Ipv4Addr = Ipv4Addr::new(127, 8, 0, 1);
const VISITOR: Ipv4Addr = Ipv4Addr::new(127, 10, 0, 1);
/// A flooding client behind the proxy, its network, and a well-behaved client.
const FLOODER: &str = "203.0.113.7";
const FLOODERS: &str = "203.0.113.0/24";
const BYSTANDER: &str = "198.51.100.1";

const ROOMS: &str = "GET /api/rooms HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";

/// Creates a socket with the given local address.
fn socket_of(own: Ipv4Addr) -> TcpSocket {
    let socket = TcpSocket::new_v4().expect("a socket");
    socket.bind(SocketAddr::new(own.into(), 0)).expect("an address of this machine");
    socket
}

/// Sends a request from an address that no other fault uses, so that no limits apply to it.
async fn ask(stage: &Stage, request: &str) -> Answer {
    raw_over(connect_from(VISITOR, stage.address).await, request).await
}

async fn connect_from(own: Ipv4Addr, server: SocketAddr) -> TcpStream {
    socket_of(own).connect(server).await.expect("a connection")
}

/// A client's request, as forwarded by the proxy.
fn passed_on(method: &str, path: &str, client: &str, body: &str) -> String {
    format!(
        "{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
         X-Forwarded-For: {client}\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    )
}

async fn ask_through_proxy(stage: &Stage, method: &str, client: &str, body: &str) -> Answer {
    let stream = connect_from(PROXY, stage.address).await;
    raw_over(stream, &passed_on(method, "/api/rooms", client, body)).await
}

/// Row 4a: downloads that are not read. Other clients still get the whole file.
pub async fn slow_downloads(stage: &Stage) {
    let request = "GET /assets/big.bin HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    let mut held = Vec::new();
    while held.len() < 8 {
        let mut stream = connect_from(CROWD, stage.address).await;
        stream.write_all(request.as_bytes()).await.expect("a live socket");
        let mut begun = [0; 12];
        let read = timeout(LONG, stream.read_exact(&mut begun)).await;
        read.expect("an answer in time").expect("an answer");
        held.push(stream);
    }
    assert_eq!(ask(stage, request).await.body.len(), 4 << 20);
}

/// Row 21e: the networks of one access line open as many rooms as they can. Other players can still open one and play
/// in it.
pub async fn many_networks(stage: &Stage) {
    const NETWORKS: usize = 64;
    let arena = r#"{"scene":"arena"}"#;
    let mut opened = 0;
    for network in 0..NETWORKS {
        let client = format!("2001:db8:1:{network:x}::1");
        match ask_through_proxy(stage, "POST", &client, arena).await.status {
            201 => opened += 1,
            429 => stage.refuses("no_room_created"),
            other => panic!("status {other}"),
        }
    }
    assert_eq!(opened, 2 * ADDRESS_ROOMS_MIN);
    let answer = ask_through_proxy(stage, "POST", "2001:db8:2::1", arena).await;
    assert_eq!(answer.status, 201);
    let room = answer.json()["code"].as_str().expect("a code").to_owned();
    let mut guest = stage.join(&room, "Elsewhere").await;
    guest.keeps_playing().await;
    stage.leave(guest).await;
}

/// Row 21f: idle players from one network occupy all seats of a room. A newcomer from another network still gets one.
pub async fn idle_crowd(stage: &Stage) {
    let mut crowd = JoinSet::new();
    for number in 0..4 {
        let mut client = Client::connect_over(socket_of(CROWD), stage.address, SMALL).await;
        client.enter(&format!("Crowd {number}"), None).await;
        // This client does nothing but read.
        crowd
            .spawn(async move { while client.frame().await.is_some_and(|frame| frame.is_ok()) {} });
    }
    stage.counts("jostle_joins_total{how=\"new\"}", 5);
    let full = enter_small(stage, NEIGHBOUR).await;
    assert!(full.is_none(), "the neighbour's network has enough");
    let newcomer = async {
        loop {
            match enter_small(stage, NEWCOMER).await {
                Some(client) => return client,
                None => sleep(Duration::from_millis(200)).await,
            }
        }
    };
    let newcomer = timeout(LONG, newcomer).await.expect("a seat in time");
    let displaced = timeout(LONG, crowd.join_next()).await.expect("a closed socket in time");
    displaced.expect("four players").expect("a socket that ends well");
    stage.refuses("gave_way");
    stage.counts("jostle_leaves_total{how=\"displaced\"}", 1);
    crowd.shutdown().await;
    drop(newcomer);
    let empty = async {
        loop {
            let rooms = ask(stage, ROOMS).await.json();
            let rooms = rooms["rooms"].as_array().expect("a list").clone();
            if rooms.iter().all(|room| room["code"] != SMALL || room["players"] == 0) {
                return;
            }
            sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(LONG, empty).await.expect("an empty room in time");
}

/// Joins the small room from the given address; `None` if the room is full.
async fn enter_small(stage: &Stage, own: Ipv4Addr) -> Option<Client> {
    let mut client = Client::connect_over(socket_of(own), stage.address, SMALL).await;
    client.hello(VERSION, "Newcomer", None).await;
    match client.message().await {
        ServerMessage::Welcome { .. } => Some(client),
        ServerMessage::Refused { refusal: Refusal::RoomFull } => {
            stage.refuses("room_full");
            None
        }
        other => panic!("{other:?}"),
    }
}

/// Row 21h: unreadable client addresses from the proxy, and a client outside the proxy that claims another client's
/// address. All of them get a response.
pub async fn forged_clients(stage: &Stage) {
    for nonsense in ["unknown", "999.1.1.1", "::1::"] {
        assert_eq!(ask_through_proxy(stage, "GET", nonsense, "").await.status, 200);
        stage.refuses("unreadable_forwarded_for");
    }
    let request = passed_on("GET", "/api/rooms", "unknown", "");
    assert_eq!(ask(stage, &request).await.status, 200, "no proxy, so it is not read");
}

/// Row 21i: no Host header, two of them, or one for another site.
pub async fn foreign_hosts(stage: &Stage) {
    for hosts in ["", "Host: localhost\r\nHost: localhost\r\n", "Host: evil.example\r\n"] {
        let request = format!("GET /api/rooms HTTP/1.1\r\n{hosts}Connection: close\r\n\r\n");
        assert_eq!(ask(stage, &request).await.status, 400, "{hosts:?}");
        stage.refuses("bad_host");
    }
}

/// Rows 21j and 21k: a client behind the proxy floods, and its network is banned in the meantime. Another client behind
/// the same proxy is always answered.
pub async fn banned_flood(stage: &Stage) {
    let stop = AtomicBool::new(false);
    let attack = async {
        let mut refused = 0;
        while !stop.load(Ordering::Relaxed) {
            refused += flood(stage).await;
        }
        refused
    };
    let defence = async {
        stage.moved(&refusals("requests_too_fast"), 0, 1).await;
        assert_eq!(ask_through_proxy(stage, "GET", BYSTANDER, "").await.status, 200);
        assert_eq!(ban(stage, "POST", FLOODERS).await, 200);
        assert_eq!(ask_through_proxy(stage, "GET", "203.0.113.99", "").await.status, 403);
        assert_eq!(ask_through_proxy(stage, "GET", BYSTANDER, "").await.status, 200);
        // A ban applies to the address, not to clients that merely claim to have it.
        let forged = passed_on("GET", "/api/rooms", FLOODER, "");
        assert_eq!(ask(stage, &forged).await.status, 200);
        stop.store(true, Ordering::Relaxed);
    };
    let (refused, ()) = tokio::join!(attack, defence);
    assert!(refused > 0);
    assert_eq!(ban(stage, "DELETE", FLOODERS).await, 200);
    stage.refuses("banned");
    stage.refuses("requests_too_fast");
}

/// Sends the flooder's requests over one of the proxy's connections; returns how many were refused.
async fn flood(stage: &Stage) -> usize {
    const REQUESTS: usize = 500;
    let (mut reads, mut writes) = connect_from(PROXY, stage.address).await.into_split();
    let one =
        format!("GET /api/rooms HTTP/1.1\r\nHost: localhost\r\nX-Forwarded-For: {FLOODER}\r\n\r\n");
    let last = passed_on("GET", "/api/rooms", FLOODER, "");
    let send = async {
        let all = one.repeat(REQUESTS - 1) + &last;
        writes.write_all(all.as_bytes()).await.expect("a live socket");
    };
    let mut answers = String::new();
    let (read, ()) = tokio::join!(timeout(LONG, reads.read_to_string(&mut answers)), send);
    read.expect("answers in time").expect("text");
    let count = |status: &str| answers.matches(&format!("HTTP/1.1 {status}")).count();
    let refused = count("429") + count("403");
    assert_eq!(count("200") + refused, REQUESTS);
    refused
}

async fn ban(stage: &Stage, method: &str, network: &str) -> u16 {
    let request = admin_request(method, &format!("ban/{network}"));
    // The port may be at its connection limit (row 23).
    let asking = async {
        loop {
            let stream = TcpStream::connect(stage.ops).await.expect("a connection");
            if let Some(answer) = exchange(stream, &request).await {
                return answer.status;
            }
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, asking).await.expect("an answer in time")
}

/// Row 21l: names that look like another player's name.
pub async fn look_alikes(stage: &Stage) {
    let join = async |name| {
        let mut guest = Client::connect_over(socket_of(VISITOR), stage.address, "impulse").await;
        guest.enter(name, None).await;
        stage.counts("jostle_joins_total{how=\"new\"}", 1);
        guest
    };
    let first = join("Olga").await;
    // Names with a Greek letter and a Cyrillic letter.
    let greek = join("\u{39f}lga").await;
    let mut cyrillic = join("Olg\u{430}").await;
    let seats = [first.seat, greek.seat, cyrillic.seat];
    let is_one = |player: &&PlayerState| seats.contains(&player.seat.0);
    let all = |snapshot: &Snapshot| snapshot.players.iter().filter(is_one).count() == seats.len();
    cyrillic.until("all three", all).await;
    let players = cyrillic.newest.players.iter().filter(is_one);
    let names: BTreeSet<&str> = players.map(|player| &*player.appearance.name).collect();
    assert_eq!(names.len(), seats.len(), "{names:?}");
    assert!(names.iter().all(|name| name.starts_with("Olga")), "{names:?}");
    for guest in [first, greek, cyrillic] {
        stage.leave(guest).await;
    }
}
