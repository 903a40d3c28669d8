use super::*;
use crate::config::Config;
use crate::net::assets::AssetFile;
use crate::state::Parts;
use std::net::Ipv4Addr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};
use tokio::time::Instant;
use tokio_io_timeout::TimeoutStream;

static FILES: [AssetFile; 1] =
    [AssetFile { name: "big.bin", etag: "\"big\"", bytes: &[7; 1 << 20] }];
/// Smaller than a response head, so that the rest of the response waits for the peer to read.
const PIPE_BYTES: usize = 64;

/// A server in memory and its peer, which has requested [`FILES`].
async fn asked() -> (
    Arc<ServerState>,
    DuplexStream,
    impl Future<Output = Option<Taken<Pin<Box<TimeoutStream<DuplexStream>>>>>>,
) {
    let config = Config { files: &FILES, ..Config::default() };
    let (sender, phase) = watch::channel(Phase::Running);
    let state = Arc::new(ServerState::new(Parts::new(phase), config));
    let (mut peer, server) = duplex(PIPE_BYTES);
    let request = b"GET /assets/big.bin HTTP/1.1\r\nHost: localhost\r\n\r\n";
    peer.write_all(request).await.expect("a pipe in memory");
    let served = state.clone();
    let spoken = async move {
        // If the sender were dropped, the server would count as having ended.
        let _phase = sender;
        let server = with_write_timeout(server, served.config.waits.http_stall);
        let peer = IpAddr::V4(Ipv4Addr::LOCALHOST);
        let permit = Arc::new(served.shares.connections.admit(peer).expect("the first"));
        speak_http(server, peer, &permit, &served).await
    };
    (state, peer, spoken)
}

fn stalled(state: &ServerState) -> bool {
    let text = state.host.metrics.text(Default::default());
    text.contains("jostle_refusals_total{reason=\"stalled_response\"} 1\n")
}

#[tokio::test(start_paused = true)]
async fn a_response_that_makes_no_progress_is_closed() {
    let (state, peer, spoken) = asked().await;
    let began = Instant::now();
    assert!(spoken.await.is_none());
    let lasted = began.elapsed();
    assert!(lasted >= limits::Timeouts::USUAL.http_stall, "{lasted:?}");
    assert!(lasted < limits::Timeouts::USUAL.http_stall + Duration::from_secs(1), "{lasted:?}");
    assert!(stalled(&state));
    drop(peer);
}

#[tokio::test(start_paused = true)]
async fn a_slow_response_that_makes_progress_is_not_closed() {
    let (state, mut peer, spoken) = asked().await;
    let slow = async {
        let pause = limits::Timeouts::USUAL.http_stall - Duration::from_secs(1);
        for _ in 0..100 {
            sleep(pause).await;
            let mut bytes = [0; PIPE_BYTES];
            peer.read_exact(&mut bytes).await.expect("the response goes on");
        }
    };
    tokio::select! {
        _ = spoken => panic!("a peer that reads was closed"),
        () = slow => {}
    }
    assert!(!stalled(&state));
}

/// A connection on which the beginning of a request has been sent. Returns how long the draining server waits for the
/// rest.
async fn waits_for_the_rest_of(sent: &[u8]) -> Duration {
    let (sender, phase) = watch::channel(Phase::Running);
    let state = Arc::new(ServerState::new(Parts::new(phase), Config::default()));
    let (mut peer, server) = duplex(1024);
    peer.write_all(sent).await.expect("a pipe in memory");
    let served = tokio::spawn(async move {
        let ip = IpAddr::V4(Ipv4Addr::LOCALHOST);
        let permit = Arc::new(state.shares.connections.admit(ip).expect("the first"));
        speak_http(server, ip, &permit, &state).await.is_none()
    });
    // The clock advances only when everything is waiting, so by now all bytes have been read.
    sleep(Duration::from_millis(1)).await;
    let began = Instant::now();
    sender.send_replace(Phase::Draining);
    sleep(limits::Timeouts::USUAL.drain_notice).await;
    sender.send_replace(Phase::Closing);
    assert!(served.await.expect("no panic"));
    drop(peer);
    began.elapsed()
}

#[tokio::test(start_paused = true)]
async fn half_a_request_does_not_delay_the_end() {
    let notice = limits::Timeouts::USUAL.drain_notice;
    let spare = Duration::from_millis(10);
    for half in [
        "GET / HTTP/1.1\r\nHost: local",
        "POST /api/rooms HTTP/1.1\r\nHost: localhost\r\nContent-Length: 20\r\n\r\n{\"scene\"",
    ] {
        let waited = waits_for_the_rest_of(half.as_bytes()).await;
        assert!(waited <= notice + spare, "{half:?}: {waited:?}");
    }
}
