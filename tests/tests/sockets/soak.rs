//! All faults from docs/faults.md in one soak test. While two players keep playing, peers repeatedly cause the faults
//! in rows 1 to 23, each at its own pace, and the machine causes those in rows 24 to 30. Each fault checks the response
//! that it gets, and at the end the counters must equal the sum of the faults. The games are recorded. When they are
//! replayed without faults, with the accepted inputs, each must have the same hash at every tick, and the two players
//! must have seen the same states.

mod bytes;
mod crowds;
pub mod host;
mod links;
mod machine;
mod networks;
mod stage;

use crate::client::{Client, LONG};
use crate::replays::{Dir, ticks, verify};
use host::Host;
use jostle_game::Buttons;
use jostle_protocol::replay::{Change, Replay};
use jostle_protocol::{Refusal, ServerMessage, Snapshot};
use jostle_room::Playback;
use jostle_sim::Vec2;
use stage::Stage;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{Instant, sleep, timeout};

/// How long peers cause faults before the machine does, and how long a tab is in the background, unless
/// `JOSTLE_SOAK_SECONDS` is set.
const SECONDS: u64 = 5;
/// Number of snapshots that a player receives before the machine's faults, and again after them.
const SNAPSHOTS: usize = 600;
/// Rows of the faults that peers cause repeatedly. Row 11 is part of row 10.
const PEERS: [&str; 20] = [
    "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "12", "13", "14", "15", "16", "17", "18",
    "19", "20", "23",
];
/// Rows of the faults caused by networks, if the machine has enough addresses.
const NETWORKS: [&str; 5] = ["4a", "21f", "21h", "21i", "21l"];
/// Refusals that must be counted exactly, because only these faults cause them.
const EXACT: [&str; 12] = [
    "version",
    "bad_message",
    "flood",
    "silent",
    "foreign_page",
    "bad_request",
    "slow_request",
    "bad_token",
    "room_failed",
    "bad_host",
    "no_room_created",
    "unreadable_forwarded_for",
];

async fn fault(row: &str, stage: &Stage) {
    match row {
        "1" => links::killed_inside_a_frame(stage).await,
        "2" => links::half_open(stage).await,
        "3" => links::stops_reading(stage).await,
        "4" => links::reads_byte_by_byte(stage).await,
        "5" => bytes::slow_handshakes(stage).await,
        "6" => bytes::segments_of_a_byte(stage).await,
        "7" => links::far_link(stage).await,
        "8" => links::background_tab(stage).await,
        "9" => bytes::endless_head(stage).await,
        "10" => bytes::broken_frames(stage).await,
        "12" => bytes::fragments(stage).await,
        "13" => bytes::flood(stage).await,
        "14" => bytes::another_version(stage).await,
        "15" => bytes::foreign_page(stage).await,
        "16" => bytes::invalid_pointers(stage).await,
        "17" => bytes::inputs_from_other_times(stage).await,
        "18" => bytes::jumping_clock(stage).await,
        "19" => links::invalid_tokens(stage).await,
        "20" => links::two_sockets_with_one_token(stage).await,
        "23" => crowds::operators(stage).await,
        "4a" => networks::slow_downloads(stage).await,
        "21f" => networks::idle_crowd(stage).await,
        "21h" => networks::forged_clients(stage).await,
        "21i" => networks::foreign_hosts(stage).await,
        "21l" => networks::look_alikes(stage).await,
        _ => unreachable!("row {row} is none of peers"),
    }
}

/// Rows of all faults that peers cause.
fn rows() -> impl Iterator<Item = &'static str> {
    let networks = if cfg!(target_os = "linux") { &NETWORKS[..] } else { &[] };
    PEERS.into_iter().chain(networks.iter().copied())
}

/// Causes one fault repeatedly until told to stop; returns the number of times.
async fn repeat(row: &str, stage: Arc<Stage>, stop: Arc<AtomicBool>) -> u32 {
    let mut rounds = 0;
    let number = row.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let number: u64 = number.parse().expect("a number");
    while !stop.load(Ordering::Relaxed) {
        // A background tab is away for longer than the machine's faults can be postponed.
        let quiet = match row {
            "8" => None,
            _ => Some(stage.machine.read().await),
        };
        // The machine faults may have ended the soak test.
        if stop.load(Ordering::Relaxed) {
            break;
        }
        fault(row, &stage).await;
        drop(quiet);
        rounds += 1;
        sleep(Duration::from_millis(number * 37 % 200)).await;
    }
    rounds
}

/// Plays until the server closes, counting the snapshots; returns the snapshots by tick.
async fn play_to_the_end(
    mut player: Client,
    received: watch::Sender<usize>,
) -> BTreeMap<u32, Snapshot> {
    let mut seen = BTreeMap::new();
    loop {
        match player.message().await {
            ServerMessage::Snapshot(_) => {
                let tick = player.newest.tick;
                received.send_replace(seen.len());
                seen.insert(tick, player.newest.clone());
                let x = 40.0 + (tick % 90) as f32;
                let buttons = if tick.is_multiple_of(7) { Buttons::FIRE } else { Buttons::RIGHT };
                player.input(buttons, Some(Vec2::new(x, 60.0))).await;
            }
            ServerMessage::Draining { .. } => {
                player.is_refused(Refusal::Closing).await;
                return seen;
            }
            other => panic!("{other:?} in a game that should go on"),
        }
    }
}

/// Plays a replay and compares it with a player's snapshots; returns the number of compared ticks.
fn compare(replay: &Arc<Replay>, seen: &BTreeMap<u32, Snapshot>) -> u32 {
    let mut playback = Playback::new(Arc::clone(replay)).expect("a replay that plays");
    let mut compared = 0;
    while let Some(played) = playback.step().expect("a replay that plays") {
        assert!(played.agrees, "{played:?}");
        let Some(expected) = seen.get(&played.tick) else { continue };
        assert_eq!(playback.snapshot().bodies, expected.bodies, "tick {}", played.tick);
        compared += 1;
    }
    compared
}

/// Number of joins and leaves in a replay.
fn changes(replay: &Replay) -> usize {
    let ticks = ticks(replay);
    let changes = ticks.iter().flat_map(|tick| &tick.changes);
    changes.filter(|change| !matches!(change, Change::Look(..))).count()
}

/// Waits until a player has received enough snapshots for a comparison. On a busy machine, waiting for a fixed time
/// would not be enough.
async fn plays_on(receives: &mut watch::Receiver<usize>) {
    let goal = *receives.borrow() + SNAPSHOTS;
    let received = timeout(LONG, receives.wait_for(|received| *received >= goal)).await;
    received.expect("snapshots in time").expect("a game that goes on");
}

fn soak_seconds() -> u64 {
    let seconds = std::env::var("JOSTLE_SOAK_SECONDS").ok();
    seconds.map_or(SECONDS, |text| text.parse().expect("JOSTLE_SOAK_SECONDS is a whole number"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn faults_change_no_game_except_by_accepted_inputs() {
    let dir = Dir::new("soak");
    let seconds = Duration::from_secs(soak_seconds());
    let mut host = Host::start(dir.path());
    let stage = Arc::new(Stage::new(host.process.address, host.process.ops, seconds));
    let ann = stage.join("arena", "Ann").await;
    let bob = stage.join("arena", "Bob").await;
    let (received, mut receives) = watch::channel(0);
    let players = [ann, bob].map(|player| tokio::spawn(play_to_the_end(player, received.clone())));

    let stop = Arc::new(AtomicBool::new(false));
    let repeated = |row| tokio::spawn(repeat(row, Arc::clone(&stage), Arc::clone(&stop)));
    let peers: Vec<_> = rows().map(|row| (row, repeated(row))).collect();
    let started = Instant::now();
    crowds::crowd(&stage).await;
    if cfg!(target_os = "linux") {
        networks::many_networks(&stage).await;
        networks::banned_flood(&stage).await;
    }
    sleep(seconds.saturating_sub(started.elapsed())).await;
    plays_on(&mut receives).await;
    let failed_tick = {
        let _alone = stage.machine.write().await;
        machine::stands_still(&stage, &mut host).await;
        machine::no_descriptors(&stage, &mut host).await;
        machine::clock_steps(&stage, &mut host).await;
        let failed_tick = machine::room_panics(&stage).await;
        machine::disk_fails(&stage, &mut host).await;
        stop.store(true, Ordering::Relaxed);
        failed_tick
    };
    for (row, peer) in peers {
        let rounds = timeout(seconds + LONG, peer).await;
        let rounds = rounds.unwrap_or_else(|_| panic!("row {row} does not end"));
        println!("row {row}: {} times", rounds.expect("every fault has its answer"));
    }
    // Now that the disk works again, a new file is started.
    plays_on(&mut receives).await;
    stage.check_tally(&EXACT).await;
    host.process.signal("TERM");
    let mut seen = Vec::new();
    for player in players {
        seen.push(player.await.expect("a game that goes on to the end"));
    }
    assert_eq!(host.process.exit_status().await, Some(0));

    let mut compared = 0;
    for replay in dir.replays() {
        verify(&replay).await;
        if replay.start().room == "cracked" {
            assert!(replay.last_tick() >= failed_tick, "up to the tick that failed");
        }
        if replay.start().room == "arena" {
            // No one but the two players ever joined this game.
            assert!(changes(&replay) <= 2);
            compared += seen.iter().map(|seen| compare(&replay, seen)).sum::<u32>();
        }
    }
    let ticks: usize = seen.iter().map(BTreeMap::len).sum();
    println!("{compared} of {ticks} snapshots compared with games without faults");
    // Some ticks were lost to the disk faults.
    assert!(compared as usize >= SNAPSHOTS, "{compared} of {ticks}");
}
