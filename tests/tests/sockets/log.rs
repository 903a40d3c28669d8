//! The server's log: strangers cannot fill it, and nothing waits for it.

use crate::client::{Client, LONG};
use crate::faults::refusals;
use crate::process::Process;
use crate::replays::Dir;
use crate::server::{count, until_count};
use jostle_game::Buttons;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::net::SocketAddr;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::Stdio;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

/// Time during which a player counts snapshots.
const PLAYED: Duration = Duration::from_secs(3);
/// Share of 60 snapshots a second that even a busy machine has to deliver.
const SHARE_MIN: f64 = 0.8;

/// A server with its usual log.
async fn serve(log: Stdio) -> Process {
    let serve = move || Process::serve(&["--log", "info"], log);
    tokio::task::spawn_blocking(serve).await.expect("a server")
}

/// Sends requests of a foreign page over one connection, about ten thousand a second, until it is
/// aborted or the connection ends.
fn flood(address: SocketAddr) -> JoinHandle<()> {
    let mut request = b"PUT / HTTP/1.1\r\nHost: jostle\r\nOrigin: http://".to_vec();
    request.extend([0xff; 4000]);
    request.extend(b"\r\n\r\n");
    let requests = request.repeat(20);
    tokio::spawn(async move {
        let stream = TcpStream::connect(address).await.expect("a connection");
        let (mut reads, mut writes) = stream.into_split();
        let mut scratch = vec![0; 1 << 16];
        let drain = async { while matches!(reads.read(&mut scratch).await, Ok(1..)) {} };
        let send = async {
            while writes.write_all(&requests).await.is_ok() {
                sleep(Duration::from_millis(2)).await;
            }
        };
        tokio::join!(drain, send);
    })
}

/// A full pipe that nothing reads.
fn full_pipe() -> (Stdio, UnixStream) {
    let (mut log, reader) = UnixStream::pair().expect("a pair of sockets");
    log.set_nonblocking(true).expect("a live socket");
    let filled = loop {
        if let Err(error) = log.write(b"x") {
            break error;
        }
    };
    assert_eq!(filled.kind(), ErrorKind::WouldBlock);
    log.set_nonblocking(false).expect("a live socket");
    (Stdio::from(OwnedFd::from(log)), reader)
}

/// Snapshots that a moving player receives, as a share of 60 a second.
async fn share_of_snapshots(player: &mut Client) -> f64 {
    let (began, before) = (Instant::now(), player.snapshots);
    while began.elapsed() < PLAYED {
        player.input(Buttons::RIGHT, None).await;
        player.snapshot().await;
    }
    f64::from(player.snapshots - before) / (60.0 * began.elapsed().as_secs_f64())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unread_log_stops_nothing() {
    let (log, _reader) = full_pipe();
    let process = serve(log).await;
    let mut ann = Client::join(process.address, "arena", "Ann").await;
    let flood = flood(process.address);
    until_count(process.ops, &refusals("foreign_page"), 100).await;
    let share = timeout(LONG, share_of_snapshots(&mut ann)).await.expect("a game that goes on");
    println!("an honest player: {:.1} snapshots a second", 60.0 * share);
    assert!(share >= SHARE_MIN, "{share} of 60 snapshots a second");
    flood.abort();
    drop(ann);
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn refusals_are_logged_once_a_second_with_a_count_and_little_of_their_text() {
    let dir = Dir::new("log");
    let path = dir.path().join("log");
    let process = serve(File::create(&path).expect("a file").into()).await;
    let began = Instant::now();
    let flood = flood(process.address);
    until_count(process.ops, &refusals("foreign_page"), 500).await;
    sleep(Duration::from_secs(2)).await;
    flood.abort();
    let refused = count(process.ops, &refusals("foreign_page")).await;
    let seconds = began.elapsed().as_secs() + 1;
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));

    let log = fs::read_to_string(&path).expect("a log");
    let lines: Vec<_> = log.lines().filter(|line| line.contains("foreign_page")).collect();
    assert!((2..=seconds as usize + 1).contains(&lines.len()), "{log}");
    assert!(lines.iter().all(|line| line.len() < 300), "{log}");
    let left_out = |line: &&str| {
        let (_, text) = line.rsplit_once("left_out=").expect("a tally");
        text.trim().parse::<u64>().expect("a number")
    };
    let counted: u64 = lines.iter().map(left_out).sum::<u64>() + lines.len() as u64;
    assert!(counted > 1 && counted <= refused + 20, "{counted} of {refused}: {log}");
}
