//! Tests of notifications to systemd: when the server is ready, while it is alive, and when it exits.

use crate::client::{Client, LONG};
use crate::process::Process;
use crate::replays::Dir;
use std::process::Stdio;
use std::time::Duration;
use tokio::net::UnixDatagram;
use tokio::time::timeout;

/// systemd's watchdog interval.
const WITHIN: Duration = Duration::from_millis(300);
/// Number of notifications that the server sends within that interval.
const SIGNS: usize = 3;

const READY: &str = "READY=1\n";
const ALIVE: &str = "WATCHDOG=1\n";
const STOPPING: &str = "STOPPING=1\n";

/// Receives the next notification.
async fn sign(socket: &UnixDatagram) -> String {
    let mut bytes = [0; 256];
    let received = timeout(LONG, socket.recv(&mut bytes)).await.expect("a sign in time");
    String::from_utf8_lossy(&bytes[..received.expect("a sign")]).into_owned()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_service_manager_hears_of_the_whole_life_of_a_server() {
    let dir = Dir::new("supervised");
    let path = dir.path().join("notify");
    let socket = UnixDatagram::bind(&path).expect("a socket");
    let serve = move || Process::serve_supervised(&path, WITHIN, Stdio::inherit());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    // A server that starts slowly reports that it is alive even before it is ready.
    let mut first = sign(&socket).await;
    while first == ALIVE {
        first = sign(&socket).await;
    }
    assert_eq!(first, READY);
    assert_eq!(sign(&socket).await, ALIVE, "also without a room");

    // Skip notifications that were sent earlier. Later ones are sent while a room is running.
    let mut client = Client::join(process.address, "arena", "Ann").await;
    let mut bytes = [0; 256];
    while socket.try_recv(&mut bytes).is_ok() {}
    for _ in 0..SIGNS {
        assert_eq!(sign(&socket).await, ALIVE);
    }
    client.keeps_playing().await;

    process.signal("TERM");
    let mut last = ALIVE.to_owned();
    while last == ALIVE {
        last = sign(&socket).await;
    }
    assert_eq!(last, STOPPING);
    drop(client);
    assert_eq!(process.exit_status().await, Some(0));
}
