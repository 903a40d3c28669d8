//! Faults of the machine under the real program: the process stalls, or no descriptor is left.
#![cfg(unix)]

use super::refusals;
use crate::client::Client;
use crate::process::Process;
use crate::server::{count, until_count};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::sleep;

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
    // 15 ticks were due; 5 are caught up, and some may have been due just before or after.
    until_count(process.ops, "jostle_ticks_missed_total", before + 8).await;
    ann.keeps_playing().await;
    assert_eq!(count(process.ops, "jostle_leaves_total{how=\"lost\"}").await, 0);
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
}

/// Enough for the program itself and some players.
const DESCRIPTORS: u32 = 48;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn with_few_descriptors_fewer_connections_are_taken_and_operators_keep_theirs() {
    let log = Path::new(env!("CARGO_TARGET_TMPDIR")).join("descriptors.log");
    let file = std::fs::File::create(&log).expect("a file");
    let serve = || Process::serve_with_descriptors("-n", DESCRIPTORS, file.into());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let mut ann = Client::join(process.address, "arena", "Ann").await;
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
    let mut bob = Client::join(process.address, "arena", "Bob").await;
    bob.keeps_playing().await;
    ann.keeps_playing().await;
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
    std::fs::remove_file(&log).expect("the log");
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
