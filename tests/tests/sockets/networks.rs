//! Tests in which one network tries to take resources from others: it opens rooms, downloads replays, connects through
//! a proxy, and forges host names.

use crate::client::{Client, LONG};
use crate::http::{Answer, raw};
use crate::replays::Dir;
use crate::server::Server;
use jostle_game::{Buttons, Scene};
use jostle_protocol::{Refusal, ServerMessage, VERSION};
use jostle_server::Config;
use jostle_server::limits::{ADDRESS_REPLAY_READERS_MAX, ADDRESS_ROOMS_MIN, REQUESTS_BURST_MAX};
use jostle_server::net::http::host::Hosts;
use jostle_tests::scenes::SMALL;
use jostle_tests::server::patient;
use std::fs;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::yield_now;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

/// Starts a server behind a proxy on this machine.
pub async fn behind_a_proxy(config: Config) -> Server {
    let proxies = vec!["127.0.0.0/8".parse().expect("a network")];
    Server::start_with(Config { trusted_proxies: proxies, ..config }).await
}

/// Formats a client's request as forwarded by a proxy.
pub fn passed_on(method: &str, path: &str, client: &str, body: &str) -> String {
    let length = body.len();
    format!(
        "{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
         X-Forwarded-For: {client}\r\nContent-Length: {length}\r\n\r\n{body}"
    )
}

async fn open_room(server: &Server, client: &str) -> u16 {
    let body = r#"{"scene":"arena"}"#;
    raw(server.address, &passed_on("POST", "/api/rooms", client, body)).await.status
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn clients_behind_a_proxy_count_each_for_itself_however_it_writes_them() {
    let server = behind_a_proxy(patient()).await;
    for room in 0..ADDRESS_ROOMS_MIN {
        assert_eq!(open_room(&server, &format!("203.0.113.7:{}", 4000 + room)).await, 201);
    }
    assert_eq!(open_room(&server, "203.0.113.7:5000").await, 429);
    assert_eq!(open_room(&server, "198.51.100.1:5000").await, 201);
    assert_eq!(open_room(&server, "6.6.6.6, [2001:db8::1]:443").await, 201);
    assert_eq!(server.count("jostle_refusals_total{reason=\"unreadable_forwarded_for\"}").await, 0);
    assert_eq!(open_room(&server, "unknown").await, 201);
    server.counts("jostle_refusals_total{reason=\"unreadable_forwarded_for\"}", 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_line_with_many_networks_cannot_open_all_rooms() {
    let server = behind_a_proxy(patient()).await;
    let mut opened = 0;
    for household in 0..64 {
        let client = format!("2001:db8:1:{household:x}::1");
        opened += usize::from(open_room(&server, &client).await == 201);
    }
    assert_eq!(opened, 2 * ADDRESS_ROOMS_MIN);
    assert_eq!(open_room(&server, "2001:db8:2::1").await, 201);
}

/// Requests a replay and reads only the status.
async fn begin_download(server: SocketAddr, client: &str) -> (TcpStream, u16) {
    let mut stream = TcpStream::connect(server).await.expect("a connection");
    let request = passed_on("GET", "/replays/big.jostle", client, "");
    stream.write_all(request.as_bytes()).await.expect("a live socket");
    let mut status = [0; 12];
    let read = timeout(LONG, stream.read_exact(&mut status)).await;
    read.expect("an answer in time").expect("an answer");
    let status = str::from_utf8(&status[9..]).ok().and_then(|status| status.parse().ok());
    (stream, status.expect("a status"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_address_cannot_use_up_all_downloads() {
    let dir = Dir::new("downloads");
    // Larger than the system's socket buffers.
    fs::write(dir.path().join("big.jostle"), vec![7; 32 << 20]).expect("a place");
    let server = behind_a_proxy(Config { replays: Some(dir.settings()), ..patient() }).await;
    let known = async { while begin_download(server.address, "192.0.2.1").await.1 != 200 {} };
    timeout(LONG, known).await.expect("the replay is found in time");
    let mut held = Vec::new();
    for _ in 0..ADDRESS_REPLAY_READERS_MAX {
        let (stream, status) = begin_download(server.address, "203.0.113.7:80").await;
        assert_eq!(status, 200);
        held.push(stream);
    }
    assert_eq!(begin_download(server.address, "203.0.113.7:80").await.1, 503);
    server.counts("jostle_refusals_total{reason=\"replays_busy\"}", 1).await;
    assert_eq!(begin_download(server.address, "198.51.100.1").await.1, 200);
}

/// Sends a request with the given header lines.
async fn ask(address: SocketAddr, lines: &str) -> Answer {
    raw(address, &format!("GET /healthz HTTP/1.1\r\nConnection: close\r\n{lines}\r\n")).await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_request_has_one_host_and_it_is_one_of_ours() {
    let hosts = Hosts::Listed(vec!["play.example.org".to_owned()]);
    let server = Server::start_with(Config { hosts, ..patient() }).await;
    for (lines, is_known) in [
        ("Host: play.example.org\r\n", true),
        ("Host: PLAY.example.org:8443\r\n", true),
        ("Host: 127.0.0.1:8080\r\n", true),
        ("Host: localhost\r\n", true),
        ("", false),
        ("Host: localhost\r\nHost: localhost\r\n", false),
        ("Host: evil.example\r\n", false),
        // A page from that site, whose name now resolves to this server (DNS rebinding).
        ("Host: evil.example\r\nOrigin: http://evil.example\r\nUpgrade: websocket\r\n", false),
    ] {
        let answer = ask(server.address, lines).await;
        assert_eq!(answer.status == 400, !is_known, "{lines:?}: {}", answer.status);
    }
    server.counts("jostle_refusals_total{reason=\"bad_host\"}", 4).await;
    for (lines, status) in [
        ("Host: localhost\r\n", 200),
        ("Host: play.example.org\r\n", 200),
        ("Host: evil.example\r\n", 400),
        ("", 400),
    ] {
        assert_eq!(ask(server.ops, lines).await.status, status, "{lines:?}");
    }
    // Without a list of host names, the operators' port accepts only IP addresses and local names.
    let any = Server::start().await;
    assert_eq!(ask(any.address, "Host: evil.example\r\n").await.status, 404);
    assert_eq!(ask(any.ops, "Host: evil.example\r\n").await.status, 400);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_requests_slows_its_own_client_only() {
    let server = behind_a_proxy(patient()).await;
    let stream = TcpStream::connect(server.address).await.expect("a connection");
    let (mut reads, mut writes) = stream.into_split();
    let request =
        "GET /api/rooms HTTP/1.1\r\nHost: localhost\r\nX-Forwarded-For: 203.0.113.7\r\n\r\n";
    let last = passed_on("GET", "/api/rooms", "198.51.100.1", "");
    /// Maximum number of requests that wait for answers.
    const IN_FLIGHT_MAX: usize = 200;
    // The allowance refills with time, so the flood goes on until it has been refused for a while, however slow the
    // machine is.
    let [answered, refused] = [AtomicUsize::new(0), AtomicUsize::new(0)];
    let mut sent = 1;
    let send = async {
        while refused.load(Ordering::Relaxed) < 100 {
            writes.write_all(request.as_bytes()).await.expect("a live socket");
            sent += 1;
            while sent > answered.load(Ordering::Relaxed) + IN_FLIGHT_MAX {
                yield_now().await;
            }
        }
        writes.write_all(last.as_bytes()).await.expect("a live socket");
    };
    let mut answers = String::new();
    let read = async {
        let mut bytes = [0; 4096];
        loop {
            let count = reads.read(&mut bytes).await.expect("a live socket");
            if count == 0 {
                return;
            }
            let before = answers.len();
            answers.push_str(str::from_utf8(&bytes[..count]).expect("text"));
            // One that was cut in two is counted now.
            let new = |begins: &str| {
                answers[before.saturating_sub(begins.len() - 1)..].matches(begins).count()
            };
            answered.fetch_add(new("HTTP/1.1"), Ordering::Relaxed);
            refused.fetch_add(new("HTTP/1.1 429"), Ordering::Relaxed);
        }
    };
    timeout(LONG, async { tokio::join!(read, send) }).await.expect("answers in time");
    let count = |status: &str| answers.matches(&format!("HTTP/1.1 {status}")).count();
    assert_eq!(count("200") + count("429"), sent);
    assert!(count("429") > 0 && count("200") > REQUESTS_BURST_MAX, "{}", count("429"));
    assert!(answers.rfind("HTTP/1.1 200") > answers.rfind("HTTP/1.1 429"), "another client");
}

/// Connects a client to the small room through a proxy; returns the client and the response to its hello.
async fn says_hello(server: SocketAddr, own: &str, name: &str) -> (Client, ServerMessage) {
    let stream = TcpStream::connect(server).await.expect("a connection");
    let mut request = format!("ws://{server}/small").into_client_request().expect("a request");
    request.headers_mut().insert("x-forwarded-for", own.parse().expect("a value"));
    let mut client = Client::upgraded(stream, request).await;
    client.hello(VERSION, name, None).await;
    let answer = client.message().await;
    (client, answer)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_crowd_of_one_network_that_plays_leaves_room_for_newcomers() {
    let mut config = patient();
    config.scenes.push(Scene::parse("small.toml", SMALL).expect("a scene"));
    let server = behind_a_proxy(config).await;
    let seated = |answer| matches!(answer, ServerMessage::Welcome { .. });
    let mut crowd = Vec::new();
    // While there are no other players, one network may take all four seats.
    for number in 0..4 {
        let (mut client, answer) =
            says_hello(server.address, "203.0.113.7", &format!("Crowd {number}")).await;
        assert!(seated(answer));
        client.input(Buttons::RIGHT, None).await;
        crowd.push(client);
    }
    let (_, answer) = says_hello(server.address, "203.0.113.9", "Neighbour").await;
    assert_eq!(answer, ServerMessage::Refused { refusal: Refusal::RoomFull });
    let mut newcomers = Vec::new();
    for number in 1..4 {
        let own = format!("198.51.{number}.1");
        let (newcomer, answer) = says_hello(server.address, &own, "Newcomer").await;
        assert!(seated(answer), "{own}");
        newcomers.push(newcomer);
    }
    server.counts("jostle_leaves_total{how=\"displaced\"}", 3).await;
    server.counts("jostle_refusals_total{reason=\"gave_way\"}", 3).await;
    let (_, answer) = says_hello(server.address, "198.51.4.1", "Late").await;
    assert_eq!(answer, ServerMessage::Refused { refusal: Refusal::RoomFull }, "one seat each");
}
