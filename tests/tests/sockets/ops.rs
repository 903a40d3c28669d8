//! Tests of the operators' port: health, readiness and counters.

use crate::client::{Client, LONG};
use crate::http::{Answer, get, raw};
use crate::replays::Dir;
use crate::server::{Server, until_count};
use jostle_protocol::{Refusal, ServerMessage};
use jostle_server::Config;
use jostle_server::limits::Timeouts;
use jostle_server::log::{StateSettings, Sync};
use jostle_tests::server::{PATIENT, patient};
use std::net::SocketAddr;
use tokio::time::timeout;

/// The value of a series in the metrics; `None` if it is missing.
fn series(text: &str, name: &str) -> Option<f64> {
    let mut values = text.lines().filter_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    values.next().and_then(|value| value.parse().ok())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn metrics_count_players_and_refusals() {
    // Leave time to query a server that is shutting down.
    let waits = Timeouts { drain_notice: LONG, ..PATIENT };
    let mut server = Server::start_with_waits(waits).await;
    let ops = server.ops;
    assert_eq!(get(ops, "/healthz").await.body, b"alive\n");
    assert_eq!(get(ops, "/readyz").await.status, 200);
    assert_eq!(get(ops, "/arena").await.status, 404, "nobody plays here");
    assert_eq!(get(server.address, "/metrics").await.status, 404, "and no player sees this");

    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut lost = Client::connect(server.address, "nowhere").await;
    lost.is_refused(Refusal::NoSuchRoom).await;
    until_count(ops, "jostle_ticks_total", 30).await;
    let text = timeout(LONG, metrics_between_ticks(ops)).await.expect("ticks that were counted");
    let value = |name: &str| series(&text, name).unwrap_or_else(|| panic!("no {name}:\n{text}"));
    assert_eq!(value("jostle_rooms"), 1.0);
    assert_eq!(value("jostle_players"), 1.0);
    assert!(value("jostle_bodies") > 5.0);
    assert_eq!(value("jostle_joins_total{how=\"new\"}"), 1.0);
    assert_eq!(value("jostle_refusals_total{reason=\"no_such_room\"}"), 1.0);
    assert!(value("jostle_snapshots_bytes_total{hz=\"60\"}") > 0.0);
    assert!(!text.contains("Ann") && !text.contains("127.0.0.1"), "nobody is named");

    server.stop();
    while !matches!(ann.message().await, ServerMessage::Draining { .. }) {}
    assert_eq!(get(ops, "/readyz").await.status, 503);
    assert_eq!(get(ops, "/healthz").await.status, 200);
    drop(ann);
    server.ended().await;
}

/// Reads the metrics until every wakeup of the room is counted in full.
async fn metrics_between_ticks(ops: SocketAddr) -> String {
    loop {
        let answer = get(ops, "/metrics").await;
        assert!(answer.header("content-type").is_some_and(|kind| kind.contains("openmetrics")));
        let text = String::from_utf8(answer.body).expect("text");
        let counts = ["jostle_tick_play_seconds_count", "jostle_tick_lateness_seconds_count"];
        let [played, late] = counts.map(|name| series(&text, name).expect("a count"));
        if played == late && played > 0.0 {
            return text;
        }
    }
}

/// Sends a request with additional headers to the operators' port.
async fn ask(server: &Server, method: &str, path: &str, headers: &str) -> Answer {
    let head = format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n");
    raw(server.ops, &format!("{head}{headers}\r\n")).await
}

const TOKEN: &str = "correct-horse-battery";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn operators_with_the_token_list_kick_close_and_drain() {
    let config = Config { ops_token: Some(TOKEN.to_owned()), ..patient() };
    let server = Server::start_with(config).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    let mut cid = Client::join(server.address, "pile", "Cid").await;
    let bearer = format!("Authorization: Bearer {TOKEN}\r\n");
    bob.play_one_input().await;

    let rooms = ask(&server, "GET", "/admin/rooms", &bearer).await.json();
    let arena = &rooms["rooms"][0];
    assert_eq!((arena["code"].as_str(), arena["private"].as_bool()), (Some("arena"), Some(false)));
    assert_eq!(arena["players"][1]["name"], "Bob");
    assert_eq!(arena["players"].as_array().map(Vec::len), Some(2));

    let kick = format!("/admin/rooms/arena/kick/{}", bob.seat);
    assert_eq!(ask(&server, "POST", &kick, &bearer).await.status, 200);
    bob.is_refused(Refusal::Kicked).await;
    for (path, status) in [
        (kick.as_str(), 404),
        ("/admin/rooms/nowhere/kick/0", 404),
        ("/admin/rooms/arena/kick/x", 400),
        ("/admin/nothing", 404),
    ] {
        assert_eq!(ask(&server, "POST", path, &bearer).await.status, status, "{path}");
    }
    assert_eq!(ask(&server, "POST", "/admin/rooms/pile/close", &bearer).await.status, 200);
    cid.is_refused(Refusal::RoomClosed).await;
    ann.keeps_playing().await;

    assert_eq!(ask(&server, "POST", "/admin/drain", &bearer).await.status, 200);
    while !matches!(ann.message().await, ServerMessage::Draining { .. }) {}
    drop(ann);
    server.ended().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_the_token_nothing_is_answered_and_nothing_happens() {
    let config = Config { ops_token: Some(TOKEN.to_owned()), ..patient() };
    let server = Server::start_with(config).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let long = format!("Authorization: Bearer {TOKEN}x\r\n");
    let basic = format!("Authorization: Basic {TOKEN}\r\n");
    for headers in ["", "Authorization: Bearer \r\n", &long, &basic] {
        for (method, path) in [("GET", "/admin/rooms"), ("POST", "/admin/drain")] {
            let answer = ask(&server, method, path, headers).await;
            assert_eq!((answer.status, answer.header("www-authenticate")), (401, Some("Bearer")));
            assert!(!String::from_utf8_lossy(&answer.body).contains("Ann"));
        }
    }
    server.counts("jostle_refusals_total{reason=\"ops_unauthorized\"}", 8).await;
    ann.keeps_playing().await;
    // If no token is configured, none is accepted.
    let open = Server::start().await;
    let bearer = format!("Authorization: Bearer {TOKEN}\r\n");
    assert_eq!(ask(&open, "POST", "/admin/drain", &bearer).await.status, 404);
    let head = "GET /admin/rooms HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n";
    let answer = raw(server.address, &format!("{head}{bearer}\r\n")).await;
    assert_eq!(answer.status, 404, "and not on the players' port");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn operators_see_who_holds_what_and_ban_networks_for_a_while() {
    let state = Dir::new("bans");
    let config = || Config {
        ops_token: Some(TOKEN.to_owned()),
        state: Some(StateSettings { dir: state.path().to_owned(), sync: Sync::System }),
        trusted_proxies: vec!["127.0.0.0/8".parse().expect("a network")],
        ..patient()
    };
    let mut server = Server::start_with(config()).await;
    let bearer = format!("Authorization: Bearer {TOKEN}\r\n");
    let open = async |server: &Server, client: &str| {
        let body = r#"{"scene":"arena"}"#;
        let request = format!(
            "POST /api/rooms HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
             X-Forwarded-For: {client}\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        raw(server.address, &request).await.status
    };
    for client in ["203.0.113.7", "203.0.113.7", "2001:db8:1:2:3::4"] {
        assert_eq!(open(&server, client).await, 201);
    }
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let networks = ask(&server, "GET", "/admin/networks", &bearer).await.json();
    let found = |network: &str| {
        let all = networks["networks"].as_array().expect("a list");
        all.iter().find(|entry| entry["network"] == network).cloned().expect(network)
    };
    assert_eq!((&found("203.0.113.7/32")["rooms"], &networks["in_all"]), (&2.into(), &3.into()));
    assert_eq!(found("2001:db8:1:2::/64")["rooms"], 1);
    assert_eq!(found("127.0.0.1/32")["players"], 1);

    // A ban removes the network's players and admits no others.
    for (path, status) in [
        ("/admin/ban/nonsense", 400),
        ("/admin/ban/203.0.113.0/24?minutes=0", 400),
        ("/admin/ban/203.0.113.0/24?hours=1", 400),
        ("/admin/ban/203.0.113.0/24?minutes=5", 200),
        ("/admin/ban/127.0.0.1", 200),
        ("/admin/ban/2001:db8:1:2::9", 200),
    ] {
        assert_eq!(ask(&server, "POST", path, &bearer).await.status, status, "{path}");
    }
    ann.is_refused(Refusal::Kicked).await;
    assert_eq!(open(&server, "203.0.113.200").await, 403);
    assert_eq!(open(&server, "203.0.114.200").await, 201);
    assert_eq!(open(&server, "2001:db8:1:2:3::4").await, 403, "of the same household");
    server.counts("jostle_refusals_total{reason=\"banned\"}", 2).await;
    assert_eq!(ask(&server, "DELETE", "/admin/ban/2001:db8:1:2::/64", &bearer).await.status, 200);
    let lifted = ask(&server, "DELETE", "/admin/ban/127.0.0.1", &bearer).await;
    assert_eq!(lifted.status, 200);
    assert_eq!(ask(&server, "DELETE", "/admin/ban/127.0.0.1", &bearer).await.status, 404);

    // Bans survive a restart.
    server.stop();
    server.ended().await;
    let server = Server::start_with(config()).await;
    assert_eq!(open(&server, "203.0.113.200").await, 403);
    let networks = ask(&server, "GET", "/admin/networks", &bearer).await.json();
    assert_eq!(networks["bans"][0]["network"], "203.0.113.0/24");
    assert_eq!(networks["bans"].as_array().map(Vec::len), Some(1));
}
