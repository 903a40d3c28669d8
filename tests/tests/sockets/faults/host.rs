//! Tests of machine faults with the real program: the process stalls, or no descriptors are left.
#![cfg(unix)]

use super::refusals;
use crate::client::{Client, LONG};
use crate::http::get;
use crate::process::Process;
use crate::server::{count, until_count};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stalled_server_skips_the_time_and_plays_on() {
    let serve = || Process::serve(&[], Stdio::null());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let mut ann = Client::join(process.address, "arena", "Ann").await;
    ann.keeps_playing().await;
    let before = count(process.ops, "jostle_ticks_missed_total").await;
    process.signal("STOP");
    sleep(Duration::from_millis(250)).await;
    process.signal("CONT");
    // About 15 ticks were due, of which 5 are caught up. The bound allows for some that were due just before or after.
    until_count(process.ops, "jostle_ticks_missed_total", before + 8).await;
    ann.keeps_playing().await;
    assert_eq!(count(process.ops, "jostle_leaves_total{how=\"lost\"}").await, 0);
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
}

/// The descriptor limit, which is enough for the program itself and a few players.
const DESCRIPTORS: u32 = 48;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn with_few_descriptors_fewer_connections_are_taken_and_operators_keep_theirs() {
    let log = Path::new(env!("CARGO_TARGET_TMPDIR")).join("descriptors.log");
    let file = std::fs::File::create(&log).expect("a file");
    let serve = || Process::serve_with_descriptors("-n", DESCRIPTORS, file.into());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let mut ann = Client::join(process.address, "arena", "Ann").await;
    let descriptors = async || count(process.ops, "process_open_fds").await;
    let few = descriptors().await;
    let mut idle = Vec::new();
    for _ in 0..2 * DESCRIPTORS {
        idle.push(TcpStream::connect(process.address).await.expect("a place in the queue"));
    }
    until_count(process.ops, &refusals("too_many_connections"), DESCRIPTORS.into()).await;
    ann.keeps_playing().await;
    assert_eq!(count(process.ops, &refusals("cannot_accept")).await, 0);
    let said = std::fs::read_to_string(&log).expect("a log");
    assert!(said.contains("the limit on open files") && said.contains("connections=12"), "{said}");

    drop(idle);
    let freed = async {
        while descriptors().await > few {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, freed).await.expect("connections that are over are given up");
    let mut bob = Client::join(process.address, "arena", "Bob").await;
    bob.keeps_playing().await;
    ann.keeps_playing().await;
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
    std::fs::remove_file(&log).expect("the log");
}

/// Sets a process's descriptor limit to its lowest unused descriptor number, so that it gets no further ones.
#[cfg(target_os = "linux")]
fn take_all_descriptors(process: &Process) {
    use rustix::process::{Pid, Resource, Rlimit, prlimit};
    let id = process.child.id();
    let open = std::fs::read_dir(format!("/proc/{id}/fd")).expect("a living process");
    let name = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.ok()?.file_name().to_str()?.parse::<u64>().ok()
    };
    let open: std::collections::BTreeSet<u64> = open.filter_map(name).collect();
    let free = (0..).find(|number| !open.contains(number));
    let limit = Rlimit { current: free, maximum: Some(DESCRIPTORS.into()) };
    let id = Pid::from_raw(id.try_into().expect("a process id"));
    prlimit(id, Resource::Nofile, limit).expect("a lower limit");
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn operators_are_answered_when_no_descriptor_is_left() {
    let serve = || Process::serve_with_descriptors("-n", DESCRIPTORS, Stdio::null());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let mut ann = Client::join(process.address, "arena", "Ann").await;
    until_count(process.ops, "jostle_joins_total{how=\"new\"}", 1).await;
    take_all_descriptors(&process);
    let mut waiting = Vec::new();
    for _ in 0..8 {
        waiting.push(TcpStream::connect(process.address).await.expect("a place in the queue"));
    }
    // The first requests use descriptors that have just become free; later ones use the reserve.
    until_count(process.ops, &refusals("cannot_accept"), 4).await;
    for path in ["/healthz", "/readyz", "/metrics", "/healthz"] {
        assert_eq!(get(process.ops, path).await.status, 200, "{path}");
    }
    // Two simultaneous connections, one of them silent.
    let held = TcpStream::connect(process.ops).await.expect("a connection");
    assert_eq!(get(process.ops, "/readyz").await.status, 200);
    drop(held);
    ann.keeps_playing().await;
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_limit_on_descriptors_is_raised_as_far_as_the_system_allows() {
    let serve = || Process::serve_with_descriptors("-Sn", DESCRIPTORS, Stdio::null());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let mut idle = Vec::new();
    for _ in 0..2 * DESCRIPTORS {
        idle.push(Client::connect(process.address, "arena").await);
    }
    assert_eq!(count(process.ops, &refusals("too_many_connections")).await, 0);
    assert_eq!(count(process.ops, &refusals("cannot_accept")).await, 0);
}
