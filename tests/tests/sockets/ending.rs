//! Checks that the process shuts down in time, whatever its peers and its disk do, and immediately on a second signal.

use crate::client::{Client, LONG};
use crate::http::get;
use crate::process::Process;
use crate::replays::Dir;
use crate::server::until_count;
use crate::slow_reader::connect_small;
use jostle_server::limits::{DRAIN_MAX, Timeouts};
use jostle_tests::scenes::RESTLESS;
use std::fs::{self, File};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// Time after which a server that waits for its peers would give up on them and exit, well beyond its shutdown
/// deadline.
const TOO_LATE: Duration = Timeouts::USUAL.stall;
const _: () = assert!(TOO_LATE.as_secs() >= 2 * DRAIN_MAX.as_secs());
/// Size of a download that fills every buffer along the way.
const DOWNLOAD_BYTES: u64 = 64 << 20;

/// Starts a server that has a scene in which everything moves, a large replay, and a state directory.
async fn serve(dir: &Path) -> Process {
    for name in ["scenes", "replays", "state"] {
        fs::create_dir_all(dir.join(name)).expect("a directory");
    }
    fs::write(dir.join("scenes/restless.toml"), RESTLESS).expect("a scene");
    let replay = File::create(dir.join("replays/large.jostle")).expect("a file");
    replay.set_len(DOWNLOAD_BYTES).expect("a file with a hole");
    let [scenes, replays, state] = ["scenes", "replays", "state"]
        .map(|name| dir.join(name).to_str().expect("text").to_owned());
    let serve = move || {
        let flags = ["--scenes", &scenes, "--replays", &replays, "--state", &state];
        Process::serve(&flags, Stdio::inherit())
    };
    tokio::task::spawn_blocking(serve).await.expect("a server")
}

/// Makes writes of the room's state hang, because the writer opens a pipe that is never read and blocks.
async fn hang_disk(dir: &Path, server: SocketAddr) -> Client {
    // By the time it first responds, the server has read the directory.
    assert_eq!(get(server, "/api/rooms").await.status, 200);
    let made = Command::new("mkfifo").arg(dir.join("state/rooms/arena.new")).status();
    assert!(made.expect("mkfifo starts").success());
    Client::join(server, "arena", "Ann").await
}

/// Opens a connection and sends a text over it.
async fn sent(server: SocketAddr, text: &str) -> TcpStream {
    let mut stream = TcpStream::connect(server).await.expect("a connection");
    stream.write_all(text.as_bytes()).await.expect("a live socket");
    stream
}

/// Starts a download and then stops reading it.
async fn stuck_download(server: SocketAddr) -> TcpStream {
    let request = "GET /replays/large.jostle HTTP/1.1\r\nHost: localhost\r\n\r\n";
    let mut stream = sent(server, request).await;
    let mut begun = [0; 12];
    timeout(LONG, stream.read_exact(&mut begun)).await.expect("time").expect("an answer");
    assert_eq!(&begun, b"HTTP/1.1 200");
    stream
}

/// Sends SIGTERM and returns how long the process took to exit, and its exit status.
async fn terminate(process: Process) -> (Duration, Option<i32>) {
    let began = Instant::now();
    process.signal("TERM");
    let status = process.exit_status().await;
    (began.elapsed(), status)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_peer_and_no_disk_delays_the_end() {
    let dir = Dir::new("ending");
    let process = serve(dir.path()).await;
    let server = process.address;
    let mut slow = connect_small(server).await;
    slow.enter("Slow", None).await;
    until_count(process.ops, "jostle_sockets_late_total", 1).await;
    let silent = TcpStream::connect(server).await.expect("a connection");
    let half = sent(server, "GET / HTTP/1.1\r\nHost: local").await;
    let unknown = Client::connect(server, "arena").await;
    let mut downloads = Vec::new();
    for _ in 0..4 {
        downloads.push(stuck_download(server).await);
    }
    let ann = hang_disk(dir.path(), server).await;
    let (elapsed, status) = terminate(process).await;
    println!("the end came {elapsed:?} after the signal");
    assert!(elapsed < TOO_LATE, "{elapsed:?}");
    assert_eq!(status, Some(0));
    drop((slow, silent, half, unknown, downloads, ann));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_signal_ends_the_process_at_once() {
    for second in ["TERM", "INT"] {
        let dir = Dir::new(&format!("ending-{second}"));
        let process = serve(dir.path()).await;
        let ann = hang_disk(dir.path(), process.address).await;
        process.signal("TERM");
        // The port is closed once the first signal has arrived.
        let closed = async {
            while TcpStream::connect(process.address).await.is_ok() {
                sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(LONG, closed).await.expect("a closed port in time");
        process.signal(second);
        // Without a second signal, the exit status would be 0.
        assert_eq!(process.exit_status().await, Some(1), "{second}");
        drop(ann);
    }
}
