//! The operators' port: alive, ready, and what is counted.

use crate::client::Client;
use crate::http::get;
use crate::server::Server;
use jostle_protocol::{Refusal, ServerMessage};

/// Value of a series in the metrics; `None` if it is not there.
fn series(text: &str, name: &str) -> Option<f64> {
    let mut values = text.lines().filter_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    values.next().and_then(|value| value.parse().ok())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn operators_see_who_plays_and_who_was_refused() {
    let mut server = Server::start().await;
    let ops = server.ops;
    assert_eq!(get(ops, "/healthz").await.body, b"alive\n");
    assert_eq!(get(ops, "/readyz").await.status, 200);
    assert_eq!(get(ops, "/arena").await.status, 404, "nobody plays here");
    assert_eq!(get(server.address, "/metrics").await.status, 404, "and no player sees this");

    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut lost = Client::connect(server.address, "nowhere").await;
    lost.is_refused(Refusal::NoSuchRoom).await;
    for _ in 0..30 {
        ann.snapshot().await;
    }
    let answer = get(ops, "/metrics").await;
    assert!(answer.header("content-type").is_some_and(|kind| kind.contains("openmetrics")));
    let text = String::from_utf8(answer.body).expect("text");
    let value = |name: &str| series(&text, name).unwrap_or_else(|| panic!("no {name}:\n{text}"));
    assert_eq!(value("jostle_rooms"), 1.0);
    assert_eq!(value("jostle_players"), 1.0);
    assert!(value("jostle_bodies") > 5.0);
    assert_eq!(value("jostle_joins_total{how=\"new\"}"), 1.0);
    assert_eq!(value("jostle_refusals_total{reason=\"no_such_room\"}"), 1.0);
    assert!(value("jostle_ticks_total") >= 30.0);
    assert_eq!(
        value("jostle_tick_play_seconds_count"),
        value("jostle_tick_lateness_seconds_count")
    );
    assert!(value("jostle_snapshots_bytes_total{hz=\"60\"}") > 0.0);
    assert!(!text.contains("Ann") && !text.contains("127.0.0.1"), "nobody is named");

    server.stop();
    while !matches!(ann.message().await, ServerMessage::Draining { .. }) {}
    assert_eq!(get(ops, "/readyz").await.status, 503);
    assert_eq!(get(ops, "/healthz").await.status, 200);
    drop(ann);
    server.ended().await;
}
