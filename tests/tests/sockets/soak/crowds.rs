//! Many at once: rows 21 to 23 of docs/faults.md.

use super::stage::Stage;
use crate::client::{Client, LONG};
use crate::http::get_at_last;
use jostle_protocol::{Refusal, ServerMessage, VERSION};
use jostle_server::limits::OPS_CONNECTIONS_MAX;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use tokio::io::AsyncReadExt;
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::timeout;

/// Sockets of the crowd.
const CROWD: u16 = 500;

/// Joins from one of several addresses of this machine; a seat, or why there is none.
async fn attempt(server: SocketAddr, number: u16) -> Result<Client, Refusal> {
    let socket = TcpSocket::new_v4().expect("a socket");
    let own = Ipv4Addr::new(127, 0, 2, (number % 8) as u8 + 1);
    socket.bind(SocketAddr::new(IpAddr::V4(own), 0)).expect("an address of this machine");
    let mut client = Client::connect_over(socket, server, "crowd").await;
    client.hello(VERSION, "Many", None).await;
    match client.message().await {
        ServerMessage::Welcome { .. } => Ok(client),
        ServerMessage::Refused { refusal } => Err(refusal),
        other => panic!("{other:?} instead of an answer"),
    }
}

/// Rows 21 and 22: five hundred connect at once, and leave at once.
pub async fn crowd(stage: &Stage) {
    let address = stage.address;
    let attempts: Vec<_> =
        (0..CROWD).map(|number| tokio::spawn(attempt(address, number))).collect();
    let mut seated = Vec::new();
    for attempt in attempts {
        match timeout(2 * LONG, attempt).await.expect("an answer in time").expect("no panic") {
            Ok(client) => seated.push(client),
            // Machines that are slow take too long for so many hellos.
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

/// Row 23: the operators' port asked hard, and held open.
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
