//! Tests of game sessions over HTTP: a streamed response down, and posts up. Each client is a usual one, whose frames
//! travel in the bodies.

use crate::client::{Client, LONG};
use crate::http::{Answer, raw, raw_bytes};
use crate::networks::behind_a_proxy;
use crate::server::Server;
use crate::slow_reader::catches_up;
use futures_util::SinkExt;
use jostle_game::Buttons;
use jostle_protocol::limits::POST_BYTES_MAX;
use jostle_protocol::{
    self as protocol, Appearance, ClientMessage, Refusal, ServerMessage, VERSION,
};
use jostle_server::Config;
use jostle_server::limits::{MESSAGES_BURST_MAX, Timeouts};
use jostle_tests::http_proxy::HttpProxy;
use jostle_tests::scenes::RESTLESS;
use jostle_tests::server::{PATIENT, patient};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt, BufReader, DuplexStream, copy, duplex, split};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::{sleep, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, Role};

/// Number of digits of a session's id.
const ID_DIGITS: usize = 32;
/// Bytes between a client and its requests, few compared with those in the kernel.
const PIPE_BYTES: usize = 4096;

/// An open stream.
struct Stream {
    connection: BufReader<TcpStream>,
    head: String,
    id: String,
}

impl Stream {
    async fn open(address: SocketAddr, room: &str) -> Stream {
        Stream::open_with(TcpSocket::new_v4().expect("a socket"), address, room, "").await
    }

    /// Opens a stream with additional header lines.
    async fn open_with(socket: TcpSocket, address: SocketAddr, room: &str, lines: &str) -> Stream {
        let connection = socket.connect(address).await.expect("a connection");
        let mut connection = BufReader::new(connection);
        let request = format!(
            "POST /api/stream/{room} HTTP/1.1\r\nHost: localhost\r\n{lines}Content-Length: 0\r\n\r\n"
        );
        connection.write_all(request.as_bytes()).await.expect("a live socket");
        let head = timeout(LONG, read_head(&mut connection)).await.expect("an answer in time");
        let mut id = [0; ID_DIGITS];
        connection.read_exact(&mut id).await.expect("an id");
        Stream { connection, head, id: String::from_utf8(id.to_vec()).expect("digits") }
    }

    /// A client that uses this stream.
    async fn client(self, posts_to: SocketAddr) -> Client<DuplexStream> {
        let (near, far) = duplex(PIPE_BYTES);
        tokio::spawn(carry(self, posts_to, far));
        Client::of(WebSocketStream::from_raw_socket(near, Role::Client, None).await)
    }
}

async fn read_head(connection: &mut BufReader<TcpStream>) -> String {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        head.push(connection.read_u8().await.expect("an answer"));
    }
    String::from_utf8(head).expect("text")
}

/// Carries a client's bytes until either side ends.
async fn carry(stream: Stream, posts_to: SocketAddr, client: DuplexStream) {
    let Stream { mut connection, id, .. } = stream;
    let (mut from_client, mut to_client) = split(client);
    let down = async {
        let _ = copy(&mut connection, &mut to_client).await;
        let _ = to_client.shutdown().await;
    };
    let up = async {
        let posts = TcpStream::connect(posts_to).await.expect("a connection");
        posts.set_nodelay(true).expect("a live socket");
        let mut posts = BufReader::new(posts);
        let mut body = vec![0; POST_BYTES_MAX];
        for number in 0.. {
            let count = from_client.read(&mut body).await.unwrap_or(0);
            if count == 0 {
                return;
            }
            let head = format!("{}Content-Length: {count}\r\n\r\n", post_head(&id, number));
            let request = [head.as_bytes(), &body[..count]].concat();
            let sent = posts.write_all(&request).await;
            if sent.is_err() || !read_head(&mut posts).await.starts_with("HTTP/1.1 204") {
                // The reason is in the stream.
                std::future::pending::<()>().await;
            }
        }
    };
    tokio::select! { () = down => {}, () = up => {} }
}

fn post_head(id: &str, number: u32) -> String {
    format!("POST /api/send/{id}/{number} HTTP/1.1\r\nHost: localhost\r\n")
}

/// Sends a post on a connection of its own.
async fn post(address: SocketAddr, id: &str, number: u32, body: &[u8]) -> Answer {
    let head = post_head(id, number);
    let length = body.len();
    let head = format!("{head}Connection: close\r\nContent-Length: {length}\r\n\r\n");
    raw_bytes(address, &[head.as_bytes(), body].concat()).await
}

async fn connect(address: SocketAddr, room: &str) -> Client<DuplexStream> {
    Stream::open(address, room).await.client(address).await
}

async fn join(address: SocketAddr, room: &str, name: &str) -> Client<DuplexStream> {
    let mut client = connect(address, room).await;
    client.enter(name, None).await;
    client
}

/// A frame as a client sends it, with a mask of zeros.
fn frame(message: &ClientMessage) -> Vec<u8> {
    let payload = message.encode();
    let length = u8::try_from(payload.len()).expect("a short message");
    [&[0x82, 0x80 | length, 0, 0, 0, 0][..], &payload].concat()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_game_is_played_over_http() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = join(server.address, "arena", "Bob").await;
    bob.plays_on().await;
    bob.tick().await;
    ann.until("two players", |snapshot| snapshot.players.len() == 2).await;
    // The seat is held, and given back over a WebSocket.
    let (seat, token) = (bob.seat, bob.token);
    drop(bob);
    server.counts("jostle_leaves_total{how=\"lost\"}", 1).await;
    let mut bob = Client::connect(server.address, "arena").await;
    bob.enter("Bob", Some(token)).await;
    assert_eq!(bob.seat, seat);
    drop(bob);
    server.counts("jostle_leaves_total{how=\"lost\"}", 2).await;
    // A player who leaves gives up the seat.
    let mut cleo = join(server.address, "arena", "Cleo").await;
    let close = CloseFrame { code: CloseCode::Normal, reason: "".into() };
    cleo.send_raw(Message::Close(Some(close))).await;
    while let Some(Ok(_)) = cleo.frame().await {}
    server.counts("jostle_leaves_total{how=\"left\"}", 1).await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stream_is_neither_kept_nor_collected_on_the_way() {
    let server = Server::start().await;
    let stream = Stream::open(server.address, "arena").await;
    for line in [
        "HTTP/1.1 200 OK",
        "content-type: application/octet-stream",
        "cache-control: no-store, no-transform",
        "x-accel-buffering: no",
        "x-content-type-options: nosniff",
        "connection: close",
    ] {
        assert!(stream.head.lines().any(|known| known == line), "{line}: {}", stream.head);
    }
    assert!(stream.id.bytes().all(|digit| digit.is_ascii_hexdigit()), "{}", stream.id);
    let other = Stream::open(server.address, "arena").await;
    assert_ne!(stream.id, other.id);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn posts_are_taken_in_order_and_once() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let stream = Stream::open(server.address, "arena").await;
    let id = stream.id.clone();
    let send = |number, body: Vec<u8>| {
        let id = &id;
        async move { post(server.address, id, number, &body).await.status }
    };
    let mut bob = stream.client(server.address).await;
    let appearance = Appearance { name: "Bob".into(), color: 1 };
    let (token, host_key, role) = (None, None, protocol::Role::Player);
    let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key, role };
    let hello = frame(&hello);
    // A frame may be spread over posts.
    let (first, second) = hello.split_at(5);
    assert_eq!(send(1, second.to_vec()).await, 409, "the first is missing");
    let answer = post(server.address, &id, 0, first).await;
    // A session sends many posts, so their answers are short.
    assert_eq!((answer.status, answer.header("content-security-policy")), (204, None));
    assert_eq!(send(0, b"not read".to_vec()).await, 204, "its answer may have been lost");
    assert_eq!(send(1, second.to_vec()).await, 204);
    bob.welcomed("Bob").await;
    let ping = |stamp| frame(&ClientMessage::Ping { stamp });
    assert_eq!(send(4, ping(4)).await, 409);
    for number in [2, 2, 1, 3, 0, 2, 4] {
        assert_eq!(send(number, ping(number)).await, 204, "{number}");
    }
    let mut stamps = Vec::new();
    while stamps.len() < 3 {
        if let ServerMessage::Pong { stamp, .. } = bob.message().await {
            stamps.push(stamp);
        }
    }
    assert_eq!(stamps, [2, 3, 4]);
    assert_eq!(send(5, vec![0; POST_BYTES_MAX + 1]).await, 413);
    assert_eq!(send(5, Vec::new()).await, 204, "an empty one is no message");
    // The id ends with the session.
    drop(bob);
    let ended = async {
        while send(6, Vec::new()).await != 404 {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, ended).await.expect("the end in time");
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn requests_that_belong_to_no_session_are_refused() {
    let origins = vec!["https://friends.example.org".to_owned()];
    let server = Server::start_with(Config { origins, ..patient() }).await;
    let address = server.address;
    for id in ["00112233445566778899aabbccddeeff", "", "0", "+0112233445566778899aabbccddeeff"] {
        assert_eq!(post(address, id, 0, b"").await.status, 404, "{id}");
    }
    let stream = Stream::open(address, "arena").await;
    for path in [format!("send/{}", stream.id), format!("send/{}/x", stream.id)] {
        let request =
            format!("POST /api/{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        assert_eq!(raw(address, &request).await.status, 404, "{path}");
    }
    let ask = |method: &'static str, path: String, origin: &'static str| async move {
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: localhost\r\nOrigin: {origin}\r\n\
             Connection: close\r\nContent-Length: 1\r\n\r\nx"
        );
        raw(address, &request).await
    };
    let send = format!("/api/send/{}/0", stream.id);
    for path in ["/api/stream/arena", &send] {
        assert_eq!(ask("POST", path.to_owned(), "http://elsewhere").await.status, 403);
        let answer = ask("PUT", path.to_owned(), "http://localhost").await;
        assert_eq!((answer.status, answer.header("allow")), (405, Some("POST")), "{path}");
    }
    let answer = ask("POST", "/api/stream/arena".to_owned(), "http://localhost").await;
    assert_eq!(answer.status, 400, "a stream is opened without a body");
    // A page of an allowed site can read the answer.
    let answer = ask("POST", send, "https://friends.example.org").await;
    let allowed = answer.header("access-control-allow-origin");
    assert_eq!((answer.status, allowed), (204, Some("https://friends.example.org")));
    connect(address, "nosuch").await.is_refused(Refusal::NoSuchRoom).await;
    connect(address, "no%20code").await.is_refused(Refusal::NoSuchRoom).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_limits_are_those_of_a_websocket() {
    let server = Server::start().await;
    let mut ann = join(server.address, "arena", "Ann").await;
    let mut long = join(server.address, "arena", "Long").await;
    long.send_raw(Message::Binary(vec![0; 193].into())).await;
    assert_eq!(long.refusal().await, (Refusal::BadMessage, 1009));
    let mut text = join(server.address, "arena", "Text").await;
    text.send_raw(Message::text("hello")).await;
    assert_eq!(text.refusal().await, (Refusal::BadMessage, 1003));
    let mut flood = join(server.address, "arena", "Flood").await;
    for _ in 0..2 * MESSAGES_BURST_MAX {
        let ping = ClientMessage::Ping { stamp: 0 }.encode();
        // The socket may already be closed.
        if timeout(LONG, flood.socket.send(Message::Binary(ping.into())))
            .await
            .is_ok_and(|sent| sent.is_err())
        {
            break;
        }
    }
    flood.is_refused(Refusal::Flood).await;
    // Posts without messages are limited as well.
    let idle = Stream::open(server.address, "arena").await;
    let mut statuses = Vec::new();
    for number in 0..2 * MESSAGES_BURST_MAX {
        statuses.push(post(server.address, &idle.id, number, b"").await.status);
        if statuses.last() == Some(&429) {
            break;
        }
    }
    assert!(statuses.iter().all(|status| [204, 429].contains(status)), "{statuses:?}");
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_address_of_the_stream_counts_and_posts_come_from_any() {
    let config = Config { address_sessions_max: Some(1), ..patient() };
    let server = behind_a_proxy(config).await;
    let open = async |from: &str| {
        let lines = format!("X-Forwarded-For: {from}\r\n");
        let socket = TcpSocket::new_v4().expect("a socket");
        let stream = Stream::open_with(socket, server.address, "arena", &lines).await;
        // The posts do not name a client, so their address is another one.
        stream.client(server.address).await
    };
    let mut ann = open("203.0.113.7").await;
    ann.enter("Ann", None).await;
    open("203.0.113.7").await.is_refused(Refusal::TooManySockets).await;
    let mut bob = open("198.51.100.1").await;
    bob.enter("Bob", None).await;
    bob.keeps_playing().await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slow_reader_over_http_gets_the_newest_state() {
    let server = Server::start_with_scene("restless", RESTLESS).await;
    let small = TcpSocket::new_v4().expect("a socket");
    small.set_recv_buffer_size(4096).expect("a small buffer");
    let stream = Stream::open_with(small, server.address, "restless", "").await;
    let slow = stream.client(server.address).await;
    catches_up(server, slow).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_end_of_the_server_is_announced_and_inputs_count_until_then() {
    let waits = Timeouts { drain_notice: LONG, ..PATIENT };
    let mut server = Server::start_with_waits(waits).await;
    let mut ann = join(server.address, "arena", "Ann").await;
    ann.play_one_input().await;
    server.stop();
    while !matches!(ann.message().await, ServerMessage::Draining { .. }) {}
    ann.play_one_input().await;
    drop(ann);
    // The notice ends early because no socket is left.
    server.ended().await;

    let mut server = Server::start().await;
    let mut bob = join(server.address, "arena", "Bob").await;
    bob.input(Buttons::RIGHT, None).await;
    server.stop();
    while !matches!(bob.message().await, ServerMessage::Draining { .. }) {}
    bob.is_refused(Refusal::Closing).await;
    server.ended().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_proxy_that_refuses_upgrades_lets_a_game_through() {
    let server = Server::start().await;
    let proxy = HttpProxy::without_upgrades(server.address).await.expect("a proxy");
    let upgrade = "GET /arena HTTP/1.1\r\nHost: localhost\r\nConnection: upgrade\r\n\
        Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
        Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    assert_eq!(raw(proxy.address, upgrade).await.status, 426);
    join(proxy.address, "arena", "Ann").await.plays_on().await;
}
