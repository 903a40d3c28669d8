//! Tests of misbehaving clients: each gets a clear response, and the other player's game continues.

use crate::client::{Client, LONG};
use crate::faults::frames::{WHOLE, flood, frame};
use crate::server::Server;
use jostle_game::{Buttons, Input};
use jostle_protocol::limits::CLIENT_MESSAGE_BYTES_MAX;
use jostle_protocol::{ClientMessage, Refusal, ServerMessage, VERSION};
use jostle_server::limits::{self, Timeouts};
use jostle_tests::server::{BRIEF, PATIENT, SOON};
use std::io::ErrorKind::WouldBlock;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::Message;

/// A small scene for two players.
const PAIR: &str = r#"title = "Pair"
size = [100, 50]
tools = ["steer"]
groups = ["hero", "platform"]
pairs = [["hero", "platform"]]

[limits]
players = 2

[hero]
spawns = [[30, 20], [70, 20]]

[[bodies]]
kind = "wall"
position = [50, 0]
size = [100, 4]
"#;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn garbage_instead_of_http_is_closed() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    for garbage in [
        &b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 a TLS hello\r\n\r\n"[..],
        b"GET\r\n\r\n",
        b"GET /arena HTTP/9.9\r\n\r\n",
        &[0xff; 64 << 10],
    ] {
        let mut stream = TcpStream::connect(server.address).await.expect("a connection");
        // The server may close the connection before it has read everything.
        let _ = stream.write_all(garbage).await;
        let mut answer = Vec::new();
        let closed = timeout(LONG, stream.read_to_end(&mut answer)).await;
        closed.expect("the server closes").ok();
        let text = String::from_utf8_lossy(&answer);
        assert!(text.is_empty() || text.starts_with("HTTP/1.1 4"), "{text}");
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broken_upgrade_is_refused_in_http() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    for headers in [
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n",
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 8\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n",
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n",
        "Upgrade: h2c\r\nConnection: Upgrade\r\n",
    ] {
        let request = format!("GET /arena HTTP/1.1\r\nHost: localhost\r\n{headers}\r\n");
        let mut stream = TcpStream::connect(server.address).await.expect("a connection");
        stream.write_all(request.as_bytes()).await.expect("a live socket");
        let mut answer = [0; 64];
        let read = timeout(LONG, stream.read(&mut answer)).await.expect("an answer in time");
        let text = String::from_utf8_lossy(&answer[..read.expect("an answer")]).into_owned();
        assert!(text.starts_with("HTTP/1.1 400 "), "{headers}: {text}");
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn another_version_is_refused() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut old = Client::connect(server.address, "arena").await;
    old.hello(VERSION + 1, "Old", None).await;
    old.is_refused(Refusal::Version).await;
    server.counts("jostle_refusals_total{reason=\"version\"}", 1).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_first_message_other_than_a_hello_is_refused() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let input = ClientMessage::Input { seq: 1, ack_tick: 0, input: Input::default() };
    for bytes in [input.encode(), vec![0xee; 20], Vec::new()] {
        let mut client = Client::connect(server.address, "arena").await;
        client.send_raw(Message::Binary(bytes.into())).await;
        client.is_refused(Refusal::BadHello).await;
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn text_garbage_and_oversize_are_refused_before_and_after_the_hello() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let hello_again = ClientMessage::Hello {
        version: VERSION,
        appearance: jostle_protocol::Appearance { name: "Again".into(), color: 0 },
        token: None,
        host_key: None,
        role: jostle_protocol::Role::Player,
    };
    let bad = [
        Message::Text("hello".into()),
        Message::Binary(vec![0; CLIENT_MESSAGE_BYTES_MAX + 1].into()),
        Message::Binary(vec![7; 1 << 20].into()),
    ];
    let seated_only = [
        Message::Binary(vec![0xee; 20].into()),
        Message::Binary(Vec::new().into()),
        Message::Binary(hello_again.encode().into()),
    ];
    for message in &bad {
        let mut client = Client::connect(server.address, "arena").await;
        send_unless_closed(&mut client, message.clone()).await;
        client.is_refused(Refusal::BadMessage).await;
    }
    for message in bad.iter().chain(&seated_only) {
        let mut client = Client::join(server.address, "arena", "Eve").await;
        send_unless_closed(&mut client, message.clone()).await;
        client.is_refused(Refusal::BadMessage).await;
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_is_cut_off() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut eve = Client::join(server.address, "arena", "Eve").await;
    let input = ClientMessage::Input { seq: 1, ack_tick: 0, input: Input::default() };
    flood(&mut eve, &frame(WHOLE, &input.encode())).await;
    server.counts("jostle_refusals_total{reason=\"flood\"}", 1).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_honest_client_is_no_flood() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    // The inputs of a two-second stall arrive at once. After that, play continues at the rate of the server's ticks; if
    // snapshots set the pace, the client would hurry, because some are still queued for it.
    for _ in 0..120 {
        bob.input(Buttons::LEFT, None).await;
    }
    let resumed_tick = bob.tick().await;
    for tick in resumed_tick..resumed_tick + 60 {
        bob.input(Buttons::LEFT, None).await;
        bob.send(&ClientMessage::Ping { stamp: 1 }).await;
        bob.until("the next tick", |snapshot| snapshot.tick > tick).await;
    }
    bob.keeps_playing().await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unknown_room_is_refused_on_the_socket() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    for code in ["nowhere", "zzzzzz"] {
        let mut lost = Client::connect(server.address, code).await;
        lost.is_refused(Refusal::NoSuchRoom).await;
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_room_is_refused_and_has_a_seat_again_later() {
    let server = Server::start_with_scene("pair", PAIR).await;
    let mut ann = Client::join(server.address, "pair", "Ann").await;
    let mut bob = Client::join(server.address, "pair", "Bob").await;
    let mut eve = Client::connect(server.address, "pair").await;
    eve.hello(VERSION, "Eve", None).await;
    eve.is_refused(Refusal::RoomFull).await;
    ann.keeps_playing().await;
    bob.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_socket_that_never_says_hello_is_closed() {
    let server = Server::start_with_waits(Timeouts { hello: SOON, ..PATIENT }).await;
    let patient = Server::start().await;
    let mut waited_for = Client::connect(patient.address, "arena").await;
    let mut mute = Client::connect(server.address, "arena").await;
    mute.is_refused(Refusal::BadHello).await;
    // A server with a longer timeout has not given up, even though its connection is older.
    waited_for.enter("Late", None).await;
    let mut ann = Client::join_at_last(server.address, "arena", "Ann").await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_answers_no_pings_is_closed() {
    // No ping is due before the silence timeout.
    let waits = Timeouts { silence: BRIEF, keepalive: LONG, ..PATIENT };
    let server = Server::start_with_waits(waits).await;
    let mut mute = Client::join(server.address, "arena", "Mute").await;
    mute.is_refused(Refusal::Silent).await;
    server.counts("jostle_refusals_total{reason=\"silent\"}", 1).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    for _ in 0..60 {
        ann.play_one_input().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_half_sent_request_is_closed() {
    let server = Server::start_with_waits(Timeouts { http_head: SOON, ..PATIENT }).await;
    let patient = Server::start().await;
    for part in ["", "GET /arena HTTP/1.1\r\nHost: jos"] {
        let mut waited_for = half_sent(patient.address, part).await;
        let mut stream = half_sent(server.address, part).await;
        let mut answer = Vec::new();
        let closed = timeout(LONG, stream.read_to_end(&mut answer)).await;
        closed.expect("the server gives up").expect("a clean end");
        // A server with a longer timeout has not given up, even though its connection is older.
        assert!(waited_for.try_read(&mut [0]).is_err_and(|error| error.kind() == WouldBlock));
        waited_for.shutdown().await.expect("a live socket");
    }
    assert!(server.count("jostle_refusals_total{reason=\"slow_request\"}").await >= 2);
}

/// Opens a connection and sends part of a request over it.
async fn half_sent(address: SocketAddr, part: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.expect("a connection");
    stream.write_all(part.as_bytes()).await.expect("a live socket");
    stream
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slow_body_is_closed() {
    let waits = Timeouts { http_body: Duration::from_secs(1), ..PATIENT };
    let server = Server::start_with_waits(waits).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let head = "POST /api/rooms HTTP/1.1\r\nHost: localhost\r\nContent-Length: 17\r\n\r\n{";
    let mut stream = TcpStream::connect(server.address).await.expect("a connection");
    stream.write_all(head.as_bytes()).await.expect("a live socket");
    let mut answer = [0; 64];
    let read = timeout(LONG, stream.read(&mut answer)).await.expect("an answer in time");
    let text = String::from_utf8_lossy(&answer[..read.expect("an answer")]).into_owned();
    assert!(text.starts_with("HTTP/1.1 408 "), "{text}");
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sockets_of_one_address_are_counted() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    // None of them sends a hello, so admitted ones keep their place, and so does Ann.
    let mut sockets = JoinSet::new();
    for _ in 0..limits::ADDRESS_SESSIONS_MIN + 4 {
        sockets.spawn(refusal_without_hello(server.address));
    }
    for _ in 0..1 + 4 {
        let refused = timeout(LONG, sockets.join_next()).await.expect("an answer in time");
        assert_eq!(refused.expect("a socket").expect("a refusal"), Refusal::TooManySockets);
    }
    server.counts("jostle_refusals_total{reason=\"too_many_sockets\"}", 1 + 4).await;
    sockets.shutdown().await;
    // The server may not have noticed yet that the others are gone.
    let mut bob = loop {
        let mut bob = Client::connect(server.address, "arena").await;
        bob.hello(VERSION, "Bob", None).await;
        match bob.message().await {
            ServerMessage::Welcome { seat: Some(own), .. } => {
                bob.seat = own.seat.0;
                break bob;
            }
            ServerMessage::Refused { refusal } => assert_eq!(refusal, Refusal::TooManySockets),
            other => panic!("{other:?} instead of an answer"),
        }
        sleep(Duration::from_millis(50)).await;
    };
    bob.keeps_playing().await;
    ann.keeps_playing().await;
}

async fn refusal_without_hello(address: SocketAddr) -> Refusal {
    Client::connect(address, "arena").await.refusal().await.0
}

/// Sends a message that the server may refuse before all of it has been sent.
async fn send_unless_closed(client: &mut Client, message: Message) {
    use futures_util::SinkExt;
    let _ = timeout(LONG, client.socket.send(message)).await.expect("time");
}
