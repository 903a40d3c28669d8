//! Checks that strangers cannot flood the server's log, and that the log never blocks the server.

use crate::client::{Client, LONG};
use crate::faults::refusals;
use crate::process::Process;
use crate::replays::Dir;
use crate::server::{count, until_count};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::net::SocketAddr;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::Stdio;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::oneshot::{self, error::TryRecvError};
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

/// Starts a server with the default log level.
async fn serve(log: Stdio) -> Process {
    let serve = move || Process::serve(&["--log", "info"], log);
    tokio::task::spawn_blocking(serve).await.expect("a server")
}

/// A flood of requests from a foreign page over one connection, about ten thousand per second.
struct Flood {
    stop: oneshot::Sender<()>,
    task: JoinHandle<()>,
}

impl Flood {
    fn start(address: SocketAddr) -> Flood {
        let (stop, mut stopped) = oneshot::channel();
        let (requests, last) = (request("keep-alive").repeat(20), request("close"));
        let task = tokio::spawn(async move {
            let stream = TcpStream::connect(address).await.expect("a connection");
            let (mut reads, mut writes) = stream.into_split();
            let mut scratch = vec![0; 1 << 16];
            let drain = async { while matches!(reads.read(&mut scratch).await, Ok(1..)) {} };
            let send = async {
                while stopped.try_recv() == Err(TryRecvError::Empty) {
                    writes.write_all(&requests).await.expect("a live socket");
                    sleep(Duration::from_millis(2)).await;
                }
                writes.write_all(&last).await.expect("a live socket");
            };
            tokio::join!(drain, send);
        });
        Flood { stop, task }
    }

    /// Stops the flood and waits until everything has been answered.
    async fn end(self) {
        self.stop.send(()).expect("a flood that goes on");
        timeout(LONG, self.task).await.expect("an end in time").expect("no panic");
    }
}

fn request(connection: &str) -> Vec<u8> {
    let head = format!("PUT / HTTP/1.1\r\nHost: localhost\r\nConnection: {connection}\r\n");
    [head.as_bytes(), b"Origin: http://", &[0xff; 4000], b"\r\n\r\n"].concat()
}

/// A full pipe that is never read.
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

/// Joins a player to a server under a flood of requests, at least 100 of which have been refused.
async fn flooded(process: &Process) -> (Client, Flood) {
    let player = Client::join(process.address, "arena", "Ann").await;
    let flood = Flood::start(process.address);
    until_count(process.ops, &refusals("foreign_page"), 100).await;
    (player, flood)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unread_log_stops_nothing() {
    let (log, _reader) = full_pipe();
    let process = serve(log).await;
    let (mut ann, flood) = flooded(&process).await;
    // Anything that waited for the log would wait forever.
    ann.plays_on().await;
    let refused = count(process.ops, &refusals("foreign_page")).await;
    until_count(process.ops, &refusals("foreign_page"), refused + 100).await;
    flood.end().await;
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
    let flood = Flood::start(process.address);
    until_count(process.ops, &refusals("foreign_page"), 500).await;
    let lines_so_far = || {
        let log = fs::read_to_string(&path).expect("a log");
        log.lines().filter(|line| line.contains("foreign_page")).count()
    };
    let logged = async {
        while lines_so_far() < 3 {
            sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(LONG, logged).await.expect("a line for each second");
    flood.end().await;
    let refused = count(process.ops, &refusals("foreign_page")).await;
    let seconds = began.elapsed().as_secs() + 1;
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));

    let log = fs::read_to_string(&path).expect("a log");
    let lines: Vec<_> = log.lines().filter(|line| line.contains("foreign_page")).collect();
    assert!((3..=seconds as usize + 1).contains(&lines.len()), "{log}");
    assert!(lines.iter().all(|line| line.len() < 340), "{log}");
    assert!(lines.iter().all(|line| line.contains(" at the host \"")), "{log}");
    let left_out = |line: &&str| {
        let (_, text) = line.rsplit_once("left_out=").expect("a tally");
        text.trim().parse::<u64>().expect("a number")
    };
    let counted: u64 = lines.iter().map(left_out).sum::<u64>() + lines.len() as u64;
    assert!(counted > 3 && counted <= refused, "{counted} of {refused}: {log}");
}
