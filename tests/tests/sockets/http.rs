//! Tests of HTTP: the page, the lists, opened rooms, and unknown paths.

use crate::client::{Client, LONG};
use crate::server::Server;
use jostle_game::Scene;
use jostle_protocol::Refusal;
use jostle_server::net::assets;
use jostle_server::net::http::gallery::Gallery;
use jostle_server::net::http::headers::FrameOrigin;
use jostle_server::{Config, limits};
use jostle_tests::scenes::DUEL;
use jostle_tests::server::{OPS_TOKEN, patient};
use serde_json::Value;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

pub struct Answer {
    pub status: u16,
    head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn header(&self, name: &str) -> Option<&str> {
        let lines = self.head.lines().filter_map(|line| line.split_once(": "));
        lines.filter(|(key, _)| key.eq_ignore_ascii_case(name)).map(|(_, value)| value).next()
    }

    pub fn json(&self) -> Value {
        assert_eq!(self.header("content-type"), Some("application/json"));
        serde_json::from_slice(&self.body).expect("JSON")
    }
}

/// Sends one request verbatim and reads the whole response.
pub async fn raw(address: SocketAddr, request: &str) -> Answer {
    let stream = TcpStream::connect(address).await.expect("a connection");
    raw_over(stream, request).await
}

/// Sends one request with a binary body and reads the whole response.
pub async fn raw_bytes(address: SocketAddr, request: &[u8]) -> Answer {
    let stream = TcpStream::connect(address).await.expect("a connection");
    let answer = timeout(LONG, exchange_bytes(stream, request)).await.expect("an answer in time");
    answer.expect("an answer and not a closed connection")
}

/// Sends one request over a given stream and reads the whole response.
pub async fn raw_over(stream: impl AsyncRead + AsyncWrite + Unpin, request: &str) -> Answer {
    let answer = timeout(LONG, exchange(stream, request)).await.expect("an answer in time");
    answer.expect("an answer and not a closed connection")
}

/// Sends one request and reads the response. Returns `None` if the connection is closed instead.
pub async fn exchange(
    stream: impl AsyncRead + AsyncWrite + Unpin,
    request: &str,
) -> Option<Answer> {
    exchange_bytes(stream, request.as_bytes()).await
}

async fn exchange_bytes(
    mut stream: impl AsyncRead + AsyncWrite + Unpin,
    request: &[u8],
) -> Option<Answer> {
    stream.write_all(request).await.ok()?;
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).await.ok()?;
    let split = bytes.windows(4).position(|part| part == b"\r\n\r\n")?;
    let head = String::from_utf8(bytes[..split].to_vec()).expect("text");
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
    Some(Answer { status: status.expect("a status"), head, body: bytes[split + 4..].to_vec() })
}

pub async fn get(address: SocketAddr, path: &str) -> Answer {
    raw(address, &get_request(path)).await
}

/// Retries until there is a response, since a port at its connection limit closes further connections.
pub async fn get_at_last(address: SocketAddr, path: &str) -> Answer {
    let asking = async {
        loop {
            let stream = TcpStream::connect(address).await.expect("a connection");
            if let Some(answer) = exchange(stream, &get_request(path)).await {
                return answer;
            }
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, asking).await.expect("an answer in time")
}

fn get_request(path: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
}

/// Sends an operator's request to a path below `/admin/`, with the tests' token.
pub async fn admin(ops: SocketAddr, method: &str, path: &str) -> Answer {
    raw(ops, &admin_request(method, path)).await
}

/// Formats the request that [`admin`] sends.
pub fn admin_request(method: &str, path: &str) -> String {
    format!(
        "{method} /admin/{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
         Authorization: Bearer {OPS_TOKEN}\r\n\r\n"
    )
}

pub async fn post(address: SocketAddr, path: &str, body: &str) -> Answer {
    let length = body.len();
    let head = format!("POST {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n");
    raw(address, &format!("{head}Content-Length: {length}\r\n\r\n{body}")).await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_page_comes_with_headers_that_protect_it() {
    let server = Server::start().await;
    for (path, status) in [("/", 200), ("/arena", 200), ("/zzzzzz", 404)] {
        let answer = get(server.address, path).await;
        assert_eq!(answer.status, status, "{path}");
        assert_eq!(answer.header("content-type"), Some("text/html; charset=utf-8"));
        assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
        assert_eq!(answer.header("referrer-policy"), Some("no-referrer"));
        assert_eq!(answer.header("cross-origin-opener-policy"), Some("same-origin"));
        assert_eq!(answer.header("cross-origin-resource-policy"), Some("same-origin"));
        assert!(answer.header("permissions-policy").is_some_and(|text| text.contains("camera=()")));
        assert_eq!(answer.header("strict-transport-security"), None, "without TLS");
        assert_eq!(answer.header("x-frame-options"), Some("DENY"));
        let policy = answer.header("content-security-policy").expect("a policy");
        assert!(policy.ends_with("frame-ancestors 'none'"), "{policy}");
        assert!(policy.contains("default-src 'none'") && policy.contains("'wasm-unsafe-eval'"));
        assert!(
            answer.body.starts_with(b"<!doctype html>")
                || assets::find(assets::files(), "index.html").is_some()
        );
    }
    let head = "HEAD / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    let answer = raw(server.address, head).await;
    assert_eq!((answer.status, answer.body.len()), (200, 0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_of_other_sites_neither_play_nor_create_rooms() {
    let origins = vec!["https://friends.example.org".to_owned()];
    let server = Server::start_with(Config { origins, ..patient() }).await;
    let upgrade = |origin: &str| {
        format!(
            "GET /arena HTTP/1.1\r\nHost: localhost\r\nOrigin: {origin}\r\nConnection: upgrade\r\n\
             Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        )
    };
    let refused = raw(
        server.address,
        &(upgrade("http://elsewhere")).replace("Connection: upgrade", "Connection: upgrade, close"),
    )
    .await;
    assert_eq!(refused.status, 403);
    assert!(refused.json()["error"].as_str().expect("a reason").contains("--allow-origin"));
    for origin in ["http://localhost", "https://friends.example.org"] {
        assert_eq!(status_line(server.address, &upgrade(origin)).await, "HTTP/1.1 101", "{origin}");
    }
    let create = "POST /api/rooms HTTP/1.1\r\nHost: localhost\r\nOrigin: null\r\n\
        Connection: close\r\nContent-Length: 17\r\n\r\n{\"scene\":\"arena\"}";
    assert_eq!(raw(server.address, create).await.status, 403);
    let get = "GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: null\r\nConnection: close\r\n\r\n";
    assert_eq!(raw(server.address, get).await.status, 200, "reading is free");
    server.counts("jostle_refusals_total{reason=\"foreign_page\"}", 2).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_site_that_may_frame_the_page_may_do_nothing_else() {
    let site = "https://friends.example.org";
    let embedders = vec![FrameOrigin::parse(site).expect("an origin")];
    let server = Server::start_with(Config { embedders, ..patient() }).await;
    let answer = get(server.address, "/arena").await;
    let policy = answer.header("content-security-policy").expect("a policy");
    assert!(policy.ends_with("frame-ancestors https://friends.example.org"), "{policy}");
    assert_eq!(answer.header("x-frame-options"), None, "it could only forbid all frames");
    let create = format!(
        "POST /api/rooms HTTP/1.1\r\nHost: localhost\r\nOrigin: {site}\r\n\
         Connection: close\r\nContent-Length: 17\r\n\r\n{{\"scene\":\"arena\"}}"
    );
    assert_eq!(raw(server.address, &create).await.status, 403);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_proxy_that_breaks_upgrades_is_named() {
    let server = Server::start().await;
    let key = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    for (version, headers) in [
        ("1.1", "Connection: close\r\n"),
        ("1.1", "Connection: close\r\nUpgrade: websocket\r\n"),
        ("1.0", "Connection: upgrade\r\nUpgrade: websocket\r\n"),
    ] {
        let request = format!("GET /arena HTTP/{version}\r\nHost: localhost\r\n{headers}{key}\r\n");
        let answer = raw(server.address, &request).await;
        let error = answer.json()["error"].as_str().expect("a reason").to_owned();
        assert_eq!(
            (answer.status, error.contains("Upgrade and Connection")),
            (400, true),
            "{error}"
        );
    }
    server.counts("jostle_refusals_total{reason=\"no_upgrade\"}", 3).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn doubled_headers_that_decide_something_are_refused() {
    let server = Server::start().await;
    let head = "POST /api/rooms HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: 17\r\n";
    let body = "{\"scene\":\"arena\"}";
    let own = "Origin: http://localhost\r\n";
    assert_eq!(raw(server.address, &format!("{head}{own}\r\n{body}")).await.status, 201);
    for other in [own, "Origin: http://elsewhere\r\n"] {
        let answer = raw(server.address, &format!("{head}{own}{other}\r\n{body}")).await;
        let error = answer.json()["error"].as_str().expect("a reason").to_owned();
        assert_eq!((answer.status, error.contains("2 headers origin")), (400, true), "{error}");
    }
    server.counts("jostle_refusals_total{reason=\"doubled_header\"}", 2).await;
}

/// Reads the first 12 bytes of the response, then drops the socket.
async fn status_line(address: SocketAddr, request: &str) -> String {
    let exchange = async {
        let mut stream = TcpStream::connect(address).await.expect("a connection");
        stream.write_all(request.as_bytes()).await.expect("a live socket");
        let mut bytes = [0; 12];
        stream.read_exact(&mut bytes).await.expect("an answer");
        String::from_utf8(bytes.to_vec()).expect("text")
    };
    timeout(LONG, exchange).await.expect("an answer in time")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn odd_links_lead_to_their_room_or_to_the_page_that_explains() {
    let server = Server::start().await;
    for path in [
        "/ARENA",
        "/arena/",
        "/%20arena",
        "/Arena%20/",
        "//arena",
        "/arena.",
        "/(Arena),",
        "/arena%22%3E",
    ] {
        let answer = get(server.address, path).await;
        assert_eq!((answer.status, answer.header("location")), (302, Some("/arena")), "{path}");
    }
    // The code of a closed room still causes a redirect.
    assert_eq!(get(server.address, "/ZZZZZZ").await.header("location"), Some("/zzzzzz"));
    for path in ["/r/ABC", "/abc.html", "/%ff", "/a%20b"] {
        let answer = get(server.address, path).await;
        assert_eq!(answer.status, 404, "{path}");
        assert_eq!(answer.header("content-type"), Some("text/html; charset=utf-8"), "{path}");
        let mut lost = Client::connect(server.address, &path[1..]).await;
        lost.is_refused(Refusal::NoSuchRoom).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn embedded_files_are_cached_by_their_etag() {
    let server = Server::start().await;
    // If the page has not been built, there are no files to serve.
    for file in assets::files().iter().filter(|file| !file.name.ends_with(".br")) {
        let path = format!("/assets/{}", file.name);
        let answer = get(server.address, &path).await;
        assert_eq!((answer.status, answer.body.as_slice()), (200, file.bytes), "{path}");
        assert_eq!(answer.header("cache-control"), Some("no-cache"));
        assert_eq!(answer.header("content-type"), Some(assets::content_type(file.name)));
        let etag = answer.header("etag").expect("an etag");
        let again = format!(
            "GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nIf-None-Match: {etag}\r\n\r\n"
        );
        assert_eq!(raw(server.address, &again).await.status, 304, "{path}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_the_document_names_is_kept_for_good() {
    let server = Server::start().await;
    let Some(version) = assets::version(assets::files()) else { return };
    let document = get(server.address, "/").await;
    assert_eq!(document.header("cache-control"), Some("no-cache"));
    let text = String::from_utf8(document.body).expect("UTF-8");
    let named: Vec<&str> = text.split("=\"/assets/").skip(1).collect();
    assert!(named.len() > 4, "{} files", named.len());
    for rest in named {
        let path = format!("/assets/{}", rest.split('"').next().expect("an end"));
        assert!(path.contains(version), "{path}");
        let answer = get(server.address, &path).await;
        assert_eq!(answer.status, 200, "{path}");
        assert_eq!(answer.header("cache-control"), Some("public, max-age=31536000, immutable"));
        let other = get(server.address, &path.replace(version, "v-0")).await;
        assert_eq!((other.status, other.header("cache-control")), (200, Some("no-cache")));
    }
    assert_eq!(get(server.address, &format!("/assets/{version}/nothing")).await.status, 404);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_files_of_added_and_changed_scenes_are_those_that_rooms_play() {
    let own = |name: &str| Scene::parse(&format!("{name}.toml"), DUEL).expect("a good scene");
    let scenes = vec![own("duel"), own("hockey")];
    let server = Server::start_with(Config { scenes, ..patient() }).await;
    for name in ["duel", "hockey"] {
        let answer = get(server.address, &format!("/assets/scenes/{name}.toml")).await;
        assert_eq!((answer.status, answer.body.as_slice()), (200, DUEL.as_bytes()), "{name}");
    }
    let shipped = get(server.address, "/assets/scenes/arena.toml").await;
    assert_eq!((shipped.status, shipped.header("cache-control")), (200, Some("no-cache")));
    assert_eq!(get(server.address, "/assets/scenes/nothing.toml").await.status, 404);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn scenes_are_listed_with_everything_that_the_lobby_shows() {
    let server = Server::start().await;
    let answer = get(server.address, "/api/scenes").await;
    assert_eq!(answer.status, 200);
    let list = answer.json();
    let scenes = list["scenes"].as_array().expect("a list");
    assert_eq!(scenes[0]["name"], "arena");
    for scene in scenes {
        assert!(scene["title"].as_str().is_some_and(|title| !title.is_empty()), "{scene}");
        assert!(scene["about"].as_str().is_some_and(|about| !about.is_empty()), "{scene}");
        assert!(scene["players_max"].as_u64().is_some_and(|players| players > 0), "{scene}");
        let picture = &scene["picture"];
        let name = format!("/pictures/{}.webp", scene["name"].as_str().expect("a name"));
        let address = picture.as_str().unwrap_or_default();
        let is_its_own = address.starts_with("/assets/") && address.ends_with(&name);
        assert!(picture.is_null() || is_its_own, "{scene}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn scenes_of_the_gallery_are_listed_with_their_pictures() {
    let pictures = [("arena", Some("a picture".into())), ("hill", None)];
    let pictures = pictures.map(|(name, picture)| (name.to_owned(), picture));
    let gallery = Gallery(pictures.into_iter().collect());
    let server = Server::start_with(Config { gallery, ..patient() }).await;
    let list = get(server.address, "/api/scenes").await.json();
    let scenes = list["scenes"].as_array().expect("a list").iter();
    let shown: Vec<_> = scenes.filter(|scene| scene["category"] == "gallery").collect();
    assert_eq!((&shown[0]["name"], &shown[1]["name"]), (&"arena".into(), &"hill".into()));
    assert_eq!((shown.len(), &shown[1]["picture"]), (2, &Value::Null));
    let picture = get(server.address, shown[0]["picture"].as_str().expect("an address")).await;
    assert_eq!((picture.status, &picture.body[..]), (200, &b"a picture"[..]));
    assert_eq!(picture.header("content-type"), Some("image/webp"));
    assert_eq!(picture.header("cache-control"), Some("public, max-age=3600"));
    for path in ["/gallery/hill.webp", "/gallery/arena", "/gallery/", "/gallery/../arena.webp"] {
        assert_eq!(get(server.address, path).await.status, 404, "{path}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_created_room_is_listed_and_can_be_joined() {
    let server = Server::start().await;
    assert_eq!(get(server.address, "/api/rooms").await.json()["rooms"], Value::Array(vec![]));
    let created = post(server.address, "/api/rooms", "{\"scene\":\"impulse\"}").await;
    assert_eq!(created.status, 201);
    let code = created.json()["code"].as_str().expect("a code").to_owned();
    let mut ann = Client::join(server.address, &code, "Ann").await;
    ann.keeps_playing().await;
    let list = get(server.address, "/api/rooms").await.json();
    let room = &list["rooms"][0];
    assert_eq!(room["code"], code.as_str());
    assert_eq!(room["scene"], "impulse");
    assert_eq!(room["players"], 1);
    assert!(room["title"].is_string() && room["players_max"].is_u64(), "{room}");
    assert_eq!(get(server.address, &format!("/{code}")).await.status, 200);
    // Another room has a separate world.
    let bob = Client::join(server.address, "impulse", "Bob").await;
    assert_eq!(bob.newest.players.len(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn bad_requests_are_answered_with_a_sentence() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let long = format!("{{\"scene\":\"{}\"}}", "a".repeat(limits::HTTP_BODY_BYTES_MAX));
    for (body, status) in [
        ("{\"scene\":\"nothing\"}", 404),
        ("{\"scene\":7}", 400),
        ("{\"scene\":\"arena\",\"bodies\":1}", 400),
        ("", 400),
        ("\u{1F600}", 400),
        (long.as_str(), 413),
    ] {
        let answer = post(server.address, "/api/rooms", body).await;
        assert_eq!(answer.status, status, "{body}");
        assert!(answer.json()["error"].as_str().is_some_and(|error| error.len() > 10), "{body}");
    }
    let answer = get(server.address, "/api/nothing").await;
    assert_eq!(answer.status, 404);
    assert!(answer.json()["error"].as_str().is_some_and(|error| error.len() > 10));
    for (method, path) in [("PUT", "/api/rooms"), ("DELETE", "/arena"), ("POST", "/api/scenes")] {
        let request =
            format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        let answer = raw(server.address, &request).await;
        assert_eq!(answer.status, 405, "{method} {path}");
        assert!(answer.header("allow").is_some_and(|allow| allow.contains("GET")));
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_address_cannot_take_all_rooms() {
    let server = Server::start().await;
    for _ in 0..limits::ADDRESS_ROOMS_MIN {
        assert_eq!(post(server.address, "/api/rooms", "{\"scene\":\"bounds\"}").await.status, 201);
    }
    let answer = post(server.address, "/api/rooms", "{\"scene\":\"bounds\"}").await;
    assert_eq!(answer.status, 429);
    assert!(answer.json()["error"].as_str().is_some_and(|error| error.contains("maximum")));
    // Standing rooms are still open to everyone.
    Client::join(server.address, "bounds", "Ann").await.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn as_many_rooms_open_as_the_host_allows() {
    let server = Server::start_with(Config { rooms_max: 2, ..patient() }).await;
    for _ in 0..2 {
        assert_eq!(post(server.address, "/api/rooms", "{\"scene\":\"bounds\"}").await.status, 201);
    }
    let answer = post(server.address, "/api/rooms", "{\"scene\":\"bounds\"}").await;
    assert_eq!(answer.status, 503);
    let error = &answer.json()["error"];
    assert!(error.as_str().is_some_and(|error| error.contains("maximum of 2 rooms")), "{error}");
    for (text, found) in [("", 2), ("BOUND", 2), ("bo%75nds", 2), ("elsewhere", 0)] {
        let list = get(server.address, &format!("/api/rooms?find={text}")).await.json();
        assert_eq!(list["total"], found, "{text}: {list}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_path_leads_out_of_the_embedded_files() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    for path in [
        "/assets/../Cargo.toml",
        "/assets/../../etc/passwd",
        "/assets/%2e%2e/%2e%2e/etc/passwd",
        "/assets/..%2f..%2fetc%2fpasswd",
        "/assets//etc/passwd",
        "/assets/",
        "/assets/.",
        "/..",
        "//etc/passwd",
        "/etc/passwd",
        "/arena/../../etc/passwd",
        "/Cargo.toml",
        "/arena%00",
        "http://elsewhere/assets/../Cargo.toml",
    ] {
        let answer = get(server.address, path).await;
        assert_eq!(answer.status, 404, "{path}: {}", String::from_utf8_lossy(&answer.body));
    }
    for line in ["CONNECT elsewhere:80", "OPTIONS *", "GET *", "OPTIONS /"] {
        let request = format!("{line} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        let status = raw(server.address, &request).await.status;
        assert!((400..500).contains(&status), "{line}: {status}");
    }
    let mut lost = Client::connect(server.address, "api").await;
    lost.is_refused(Refusal::NoSuchRoom).await;
    ann.keeps_playing().await;
}
