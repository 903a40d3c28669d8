//! Tests of rooms that outlive their process, which is killed, loses power, or is told to shut down.

use crate::client::{Client, LONG};
use crate::hosts::open;
use crate::http::get;
#[cfg(unix)]
use crate::power::Watch;
use crate::process::Process;
use crate::replays::Dir;
use crate::server::Server;
use futures_util::future::join_all;
use jostle_game::Buttons;
use jostle_protocol::replay::Replay;
use jostle_protocol::{ServerMessage, Token, VERSION};
use jostle_room::Playback;
use jostle_server::Config;
use jostle_server::log::{StateSettings, Sync};
use jostle_sim::{Rng, TICKS_PER_SECOND, Vec2};
use jostle_tests::server::patient;
use std::collections::BTreeMap;
use std::fs;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
#[cfg(target_os = "linux")]
use std::process::Command;
use std::process::Stdio;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::Message;

/// Number of players in each room.
const PLAYERS: usize = 8;
/// Minimum time between kills, and the maximum random addition to it in milliseconds.
const LIFE: Duration = Duration::from_millis(1000);
const LIFE_MORE: u32 = 2500;
/// Maximum number of ticks that may be lost when a process is killed.
const LOST_TICKS_MAX: u32 = TICKS_PER_SECOND;

/// Number of times the process is killed; `JOSTLE_KILLS` can request more.
fn kills() -> u32 {
    let kills = std::env::var("JOSTLE_KILLS").ok();
    kills.map_or(2, |text| text.parse().expect("JOSTLE_KILLS is a whole number"))
}

/// Seed of the kills and truncations; set `JOSTLE_KILLS_SEED` to repeat an earlier run.
fn seed(process: &Process) -> u64 {
    let seed = std::env::var("JOSTLE_KILLS_SEED").ok();
    let seed = seed.map_or(u64::from(process.address.port()), |text| {
        text.parse().expect("JOSTLE_KILLS_SEED is a whole number")
    });
    println!("JOSTLE_KILLS_SEED={seed}");
    seed
}

/// The knowledge of a player that has lost its socket.
#[derive(Clone)]
struct Player {
    room: String,
    name: String,
    token: Option<Token>,
    seat: u16,
    /// The newest tick that the player has seen.
    tick: u32,
}

impl Player {
    /// Takes a seat, or returns to the previous one.
    async fn enter(&mut self, server: SocketAddr) -> Client {
        let mut client = Client::connect(server, &self.room).await;
        client.hello(VERSION, &self.name, self.token).await;
        match client.message().await {
            ServerMessage::Welcome { seat: Some(own), .. } => {
                let (seat, token) = (own.seat.0, own.token);
                assert!(self.token.is_none() || seat == self.seat, "{}: seat {seat}", self.name);
                (self.seat, self.token) = (seat, Some(token));
            }
            other => panic!("{} in {}: {other:?} instead of a welcome", self.name, self.room),
        }
        client.snapshot().await;
        client
    }

    /// Plays until the socket is gone; returns whether the server announced its shutdown.
    async fn play(&mut self, mut client: Client, seed: u64) -> bool {
        let mut rng = Rng::new(seed, u64::from(self.seat));
        let mut announced = false;
        loop {
            let keys = [Buttons::RIGHT, Buttons::LEFT, Buttons::UP, Buttons::FIRE];
            let pointer = Vec2::new(rng.range(10.0, 150.0), rng.range(10.0, 80.0));
            let held = keys[rng.below(4) as usize];
            for _ in 0..8 {
                client.seq += 1;
                let input = jostle_game::Input::new(held, Some(pointer));
                let (seq, ack_tick) = (client.seq, client.newest.tick as u16);
                let input = jostle_protocol::ClientMessage::Input { seq, ack_tick, input };
                let sent = futures_util::SinkExt::send(
                    &mut client.socket,
                    Message::Binary(input.encode().into()),
                );
                // If the socket is broken, this is noticed below.
                let _ = timeout(LONG, sent).await.expect("a send in time");
                let until = Instant::now() + Duration::from_millis(16);
                while let Ok(frame) = tokio::time::timeout_at(until.into(), client.frame()).await {
                    match frame {
                        Some(Ok(Message::Binary(bytes))) => match client.read(&bytes) {
                            ServerMessage::Draining { keeps_room, .. } => announced = keeps_room,
                            ServerMessage::Snapshot(_) => self.tick = client.newest.tick,
                            _ => {}
                        },
                        _ => return announced,
                    }
                }
            }
        }
    }
}

/// The rooms' files, by code.
fn files(state: &Path) -> BTreeMap<String, PathBuf> {
    let entries = fs::read_dir(state.join("rooms")).expect("a directory");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let rooms = paths.filter(|path| path.extension().is_some_and(|ending| ending == "jostle"));
    rooms.map(|path| (path.file_stem().expect("a code").to_string_lossy().into(), path)).collect()
}

/// Replays a file and verifies every tick; returns the last tick and its state hash.
fn verified(bytes: Vec<u8>) -> (u32, u64) {
    let replay = Replay::read(bytes).expect("a file of a room");
    let mut playback = Playback::new(Arc::new(replay)).expect("a scene and a state");
    while let Some(played) = playback.step().expect("a tick") {
        assert!(played.agrees, "tick {}", played.tick);
    }
    (playback.tick(), playback.game().hash())
}

/// The tick and hash from which a room continues, which are those of the first state in the file that replaces the
/// previous one.
async fn restored(path: &Path, before: &[u8]) -> (u32, u64) {
    let replaced = async {
        loop {
            let bytes = fs::read(path).expect("a file");
            if !bytes.starts_with(before) {
                return bytes;
            }
            sleep(Duration::from_millis(10)).await;
        }
    };
    let replay = Replay::read(timeout(LONG, replaced).await.expect("a restored room in time"));
    let replay = replay.expect("a file of a room");
    let keyframe = replay.keyframe_before(replay.first_tick()).expect("its first state");
    (keyframe.tick, keyframe.hash)
}

async fn serve(state: &Path) -> Process {
    let dir = state.to_str().expect("a readable path").to_owned();
    let serve = move || Process::serve(&["--state", &dir], Stdio::inherit());
    tokio::task::spawn_blocking(serve).await.expect("a server")
}

/// Creates eight rooms, two of them private, and returns their players.
async fn rooms(server: SocketAddr) -> Vec<Player> {
    let mut codes: Vec<String> = ["arena", "pile", "hill", "race"].map(str::to_owned).to_vec();
    for (scene, private) in [("arena", false), ("splash", false), ("arena", true), ("hill", true)] {
        let body = format!(r#"{{"scene":"{scene}","private":{private}}}"#);
        codes.push(open(server, &body).await.0);
    }
    let players = codes.iter().flat_map(|room| {
        (0..PLAYERS).map(|index| {
            let (room, name) = (room.clone(), format!("P{index}"));
            Player { room, name, token: None, seat: 0, tick: 0 }
        })
    });
    players.collect()
}

/// Lets all players take their seats and play until `end` ends the process. Returns how long it took for all to get
/// their seats, how many were notified of the shutdown, and the process's exit status.
async fn play(
    process: Process,
    players: &mut [Player],
    life: Duration,
    end: impl FnOnce(&Process),
) -> (Duration, usize, Option<i32>) {
    let (began, server) = (Instant::now(), process.address);
    let entered = join_all(players.iter_mut().map(|player| player.enter(server))).await;
    let seated = began.elapsed();
    let seed = u64::from(server.port());
    let playing = players.iter_mut().zip(entered).map(|(player, client)| player.play(client, seed));
    let ending = async {
        sleep(life).await;
        end(&process);
    };
    let (heard, ()) = tokio::join!(join_all(playing), ending);
    let heard = heard.into_iter().filter(|heard| *heard).count();
    (seated, heard, process.exit_status().await)
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_process_loses_a_second_at_most_and_no_seat() {
    kill_again_and_again("killed", false).await;
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_power_cut_costs_a_second_at_most_and_no_seat() {
    kill_again_and_again("unpowered", true).await;
}

/// Kills and restarts a server several times. If `without_power` is set, data that may not have reached the disk is
/// lost.
#[cfg(unix)]
async fn kill_again_and_again(name: &str, without_power: bool) {
    let dir = Dir::new(name);
    let state = dir.path();
    let mut process = serve(state).await;
    let mut players = rooms(process.address).await;
    let mut rng = Rng::new(seed(&process), 0);
    for kill in 0..kills() {
        let life = LIFE + Duration::from_millis(rng.below(LIFE_MORE).into());
        let watch = Watch::start(state);
        let mut killed = Instant::now();
        play(process, &mut players, life, |process| {
            killed = Instant::now();
            process.signal("KILL");
        })
        .await;
        let growth = watch.end();
        let late = growth.lateness(killed);
        if without_power {
            growth.cut_power(killed, &mut rng);
        }
        let kept: BTreeMap<String, Vec<u8>> = files(state)
            .into_iter()
            .map(|(code, path)| (code, fs::read(path).expect("a file")))
            .collect();
        assert_eq!(kept.len(), 8, "{:?}", kept.keys());

        let began = Instant::now();
        process = serve(state).await;
        let listed = get(process.address, "/api/rooms").await.json().to_string();
        // Every file is an unbroken chain of ticks, and the room continues from the end of its file.
        let mut lost_most = 0;
        for (code, bytes) in kept {
            let is_private = code.len() == jostle_server::limits::PRIVATE_CODE_CHARS;
            assert_eq!(listed.contains(&format!("{code:?}")), !is_private, "{code} in {listed}");
            let (last, hash) = verified(bytes.clone());
            let known = players.iter().filter(|player| player.room == code);
            for player in known {
                lost_most = lost_most.max(player.tick.saturating_sub(last));
            }
            let path = state.join("rooms").join(format!("{code}.jostle"));
            assert_eq!(restored(&path, &bytes).await, (last, hash), "{code}");
        }
        let up = began.elapsed();
        assert!(lost_most <= LOST_TICKS_MAX + late, "kill {kill}: {lost_most} ticks, {late} late");
        println!(
            "kill {kill} after {life:?}: {lost_most} ticks lost, all rooms play on after {up:?}"
        );
    }
    let (seated, ..) = play(process, &mut players, LIFE, |process| process.signal("TERM")).await;
    println!("all seats taken again in {seated:?}");
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_that_is_told_to_end_loses_nothing() {
    let dir = Dir::new("ended");
    let state = dir.path();
    let process = serve(state).await;
    let mut players = rooms(process.address).await;
    let (_, heard, status) =
        play(process, &mut players, LIFE, |process| process.signal("TERM")).await;
    assert_eq!((heard, status), (players.len(), Some(0)));
    for (code, path) in files(state) {
        let (last, _) = verified(fs::read(path).expect("a file"));
        for player in players.iter().filter(|player| player.room == code) {
            assert!(player.tick <= last, "{code}: {} after {last}", player.tick);
        }
    }
    let process = serve(state).await;
    play(process, &mut players, LIFE, |process| process.signal("TERM")).await;
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pipes_and_devices_in_the_directory_do_not_hang_the_start() {
    let dir = Dir::new("irregular");
    let path = |name: &str| dir.path().join(name);
    fs::create_dir_all(path("rooms")).expect("a directory");
    for name in ["rooms/arena.jostle", "bans.json"] {
        let made = Command::new("mkfifo").arg(path(name)).status();
        assert!(made.expect("mkfifo starts").success());
    }
    std::os::unix::fs::symlink("/dev/zero", path("rooms/pile.jostle")).expect("a link");
    let state = Some(StateSettings { dir: dir.path().to_owned(), sync: Sync::System });
    let server = Server::start_with(Config { state, ..patient() }).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    ann.keeps_playing().await;
    server.counts("jostle_state_errors_total", 2).await;
    for name in ["rooms/arena.damaged", "rooms/pile.damaged", "bans.damaged"] {
        assert!(fs::symlink_metadata(path(name)).is_ok(), "{name}");
    }
}
