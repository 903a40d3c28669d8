//! Measures the cost to the server of connections that request a large file but do not read it.

use crate::client::LONG;
use crate::http::{get, get_at_last};
use crate::replays::Dir;
use crate::soak::host::Host;
use crate::tls::Identity;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// Number of connections that stall at the same time.
const STALLED: usize = 256;
/// Maximum memory for all of them together, in bytes. The requested file is 4 MiB.
const GROWTH_MAX: f64 = (16 << 20) as f64;
const REQUEST: &[u8] = b"GET /assets/big.bin HTTP/1.1\r\nHost: localhost.example.org\r\n\r\n";

/// The server's physical memory in bytes.
async fn resident_bytes(host: &Host) -> f64 {
    let body = get_at_last(host.process.ops, "/metrics").await.body;
    let text = String::from_utf8(body).expect("text");
    let value = text.lines().find_map(|line| line.strip_prefix("process_resident_memory_bytes "));
    value.expect("Linux tells it").parse().expect("a number")
}

/// Requests the file and waits until the response has begun.
async fn ask<S: AsyncRead + AsyncWrite + Unpin>(mut stream: S) -> S {
    let mut begun = [0; 12];
    let asked = async {
        stream.write_all(REQUEST).await?;
        stream.read_exact(&mut begun).await
    };
    timeout(LONG, asked).await.expect("an answer in time").expect("a live socket");
    assert_eq!(&begun, b"HTTP/1.1 200");
    stream
}

/// Checks that the connections take less memory than [`GROWTH_MAX`].
async fn cost_little<S>(stalled: Vec<S>, host: &Host, before: f64) {
    // Wait until the server has filled all its buffers, however long that takes.
    let (mut growth, mut grown) = (0.0, true);
    while grown {
        sleep(Duration::from_millis(500)).await;
        let now = resident_bytes(host).await - before;
        assert!(now < GROWTH_MAX, "{now} bytes for {} stalled downloads", stalled.len());
        grown = now > growth;
        growth = now;
    }
    println!("{STALLED} stalled downloads: {:.1} MiB", growth / f64::from(1 << 20));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stalled_downloads_cost_little_memory() {
    let dir = Dir::new("stalled");
    let host = Host::start(dir.path());
    let address = host.process.address;
    // The file itself is mapped into memory only once for all connections.
    assert_eq!(get(address, "/assets/big.bin").await.body.len(), 4 << 20);
    let before = resident_bytes(&host).await;
    let mut stalled = Vec::new();
    for _ in 0..STALLED {
        stalled.push(ask(TcpStream::connect(address).await.expect("a connection")).await);
    }
    cost_little(stalled, &host, before).await;
    assert_eq!(get(address, "/assets/big.bin").await.body.len(), 4 << 20);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stalled_downloads_under_tls_cost_little_memory() {
    let dir = Dir::new("stalled-tls");
    let identity = Identity::new("stalled");
    let host = Host::start_with_tls(dir.path(), &identity);
    let address = host.process.address;
    let connect = || async { identity.connect(address).await.expect("a handshake") };
    let mut whole = ask(connect().await).await;
    let mut bytes = vec![0; 4 << 20];
    timeout(LONG, whole.read_exact(&mut bytes)).await.expect("time").expect("the whole file");
    let before = resident_bytes(&host).await;
    let mut stalled = Vec::new();
    for _ in 0..STALLED {
        stalled.push(ask(connect().await).await);
    }
    cost_little(stalled, &host, before).await;
}
