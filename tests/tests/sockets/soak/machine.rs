//! Machine faults, in rows 24 to 29 of docs/faults.md, one after another and without other faults in the meantime.

use super::host::Host;
use super::stage::Stage;
use crate::client::{Client, LONG};
use crate::faults::refusals;
use crate::http::get;
use jostle_game::Buttons;
use jostle_protocol::Refusal;
use jostle_sim::Vec2;
use serde_json::Value;
use std::collections::BTreeSet;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// Row 24: the process stalls for 250 ms.
pub async fn stands_still(stage: &Stage, host: &mut Host) {
    let before = stage.count("jostle_ticks_missed_total").await;
    host.process.signal("STOP");
    sleep(Duration::from_millis(250)).await;
    host.process.signal("CONT");
    // In each room about 15 ticks were due, of which 5 are caught up. The bound allows for some that were due just
    // before or after.
    stage.moved("jostle_ticks_missed_total", before, 8).await;
    stage.counts("jostle_ticks_missed_total", 8);
}

/// The names of the finished replays, waiting until there is one.
async fn finished(stage: &Stage) -> BTreeSet<String> {
    let some = async {
        loop {
            let list = get(stage.address, "/api/replays").await.json();
            let replays = list["replays"].as_array().expect("a list");
            // A game that is still being recorded leaves the list when it ends without inputs.
            let finished = replays.iter().filter(|replay| replay["recording"] == false);
            let name = |replay: &Value| replay["name"].as_str().expect("a name").to_owned();
            let names: BTreeSet<_> = finished.map(name).collect();
            if !names.is_empty() {
                return names;
            }
            sleep(Duration::from_millis(50)).await;
        }
    };
    timeout(LONG, some).await.expect("a finished game")
}

/// Row 25: the wall clock jumps by more than the time that replays are kept.
pub async fn clock_steps(stage: &Stage, host: &mut Host) {
    let before = finished(stage).await;
    for step in ["clock on", "clock back"] {
        host.order(step);
        sleep(Duration::from_secs(1)).await;
        assert!(finished(stage).await.is_superset(&before), "none is deleted");
    }
}

/// Rows 26 and 27: the disk is full, then no files can be created, and then the disk recovers.
pub async fn disk_fails(stage: &Stage, host: &mut Host) {
    const ERRORS: &str = "jostle_replay_errors_total";
    // A room that has ended encounters only one error. Several errors show that the continuing room has encountered one
    // too and is trying to create a file.
    for (fault, errors) in [("disk full", 4), ("disk closed", 1)] {
        let before = stage.count(ERRORS).await;
        host.order(fault);
        stage.moved(ERRORS, before, errors).await;
        stage.counts(ERRORS, 1);
    }
    host.order("disk good");
    let before = stage.count("jostle_replay_bytes_total").await;
    stage.moved("jostle_replay_bytes_total", before, 1).await;
}

/// Row 28: no descriptors are left. Players who are present keep playing, and others wait.
pub async fn no_descriptors(stage: &Stage, host: &mut Host) {
    // The counter cannot be read in the meantime, and on a busy machine the server may not have tried to accept yet.
    while stage.count(&refusals("cannot_accept")).await == 0 {
        host.order("descriptors none");
        // Some connections get descriptors from sockets that have just closed.
        let mut waiting = Vec::new();
        while waiting.len() < 32 {
            waiting.push(TcpStream::connect(stage.address).await.expect("a place in the queue"));
        }
        sleep(Duration::from_millis(500)).await;
        host.order("descriptors some");
    }
    stage.counts(&refusals("cannot_accept"), 1);
    let guest = stage.join("impulse", "Waited").await;
    stage.leave(guest).await;
}

/// Row 29: a room panics. Returns the last tick that the room's player saw.
pub async fn room_panics(stage: &Stage) -> u32 {
    let mut guest = Client::join(stage.address, "cracked", "Doomed").await;
    guest.keeps_playing().await;
    guest.input(Buttons::MAKE, Some(Vec2::new(50.0, 50.0))).await;
    timeout(LONG, guest.is_refused(Refusal::RoomFailed)).await.expect("an answer in time");
    stage.refuses("room_failed");
    stage.counts("jostle_rooms_failed_total", 1);
    stage.counts("jostle_joins_total{how=\"new\"}", 1);
    guest.newest.tick
}
