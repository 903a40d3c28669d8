//! Crowds, in rows 21 to 23 of docs/faults.md.

use super::stage::Stage;
use crate::client::LONG;
use crate::faults::crowds::attempt;
use crate::http::get_at_last;
use jostle_protocol::Refusal;
use jostle_server::limits::OPS_CONNECTIONS_MAX;
use tokio::io::AsyncReadExt;
use tokio::net::TcpStream;
use tokio::time::timeout;

/// Number of sockets in the crowd.
const CROWD: u16 = 500;

/// Rows 21 and 22: five hundred clients connect and leave simultaneously.
pub async fn crowd(stage: &Stage) {
    let address = stage.address;
    let attempts: Vec<_> =
        (0..CROWD).map(|number| tokio::spawn(attempt(address, "crowd", number))).collect();
    let mut seated = Vec::new();
    for attempt in attempts {
        match timeout(LONG, attempt).await.expect("an answer in time").expect("no panic") {
            Ok(client) => seated.push(client),
            // A slow machine may take too long for this many hellos.
            Err(Refusal::ServerFull | Refusal::BadHello) => {}
            Err(other) => panic!("{other:?}"),
        }
    }
    println!("of {CROWD} at once {} have a seat", seated.len());
    assert!(!seated.is_empty());
    stage.counts("jostle_joins_total{how=\"new\"}", seated.len() as u64);
    stage.counts("jostle_leaves_total{how=\"lost\"}", seated.len() as u64);
    let before = stage.count("jostle_leaves_total{how=\"lost\"}").await;
    let count = seated.len() as u64;
    drop(seated);
    stage.moved("jostle_leaves_total{how=\"lost\"}", before, count).await;
}

/// Row 23: the operators' port is flooded, and its connections are held open.
pub async fn operators(stage: &Stage) {
    for _ in 0..20 {
        assert_eq!(get_at_last(stage.ops, "/metrics").await.status, 200);
    }
    let mut held = Vec::new();
    while held.len() < OPS_CONNECTIONS_MAX + 4 {
        held.push(TcpStream::connect(stage.ops).await.expect("a connection"));
    }
    let mut last = held.pop().expect("the last connection");
    let closed = timeout(LONG, last.read(&mut [0])).await.expect("an end in time");
    assert!(!matches!(closed, Ok(1..)), "closed without an answer");
    stage.counts(&crate::faults::refusals("ops_busy"), 4);
    drop(held);
    assert_eq!(get_at_last(stage.ops, "/healthz").await.status, 200);
}
