//! Checks that the Agones sidecar is informed of the server's lifecycle, and that players are not affected, whatever
//! the sidecar does.

use crate::client::Client;
use crate::http::admin;
use crate::process::Process;
use crate::server::Server;
use crate::sidecar::{Absent, Mood, Sidecar};
use jostle_protocol::Refusal;
use jostle_server::Config;
use jostle_server::limits::Timeouts;
use jostle_server::ops::agones::Settings;
use jostle_tests::server::{LONG, OPS_TOKEN, PATIENT, SOON, patient};
use std::net::SocketAddr;
use std::process::Stdio;
use std::time::Duration;

const READY: &str = "POST /ready {}";
const HEALTH: &str = "POST /health {}";
const SHUTDOWN: &str = "POST /shutdown {}";
const CHANGE: &str = "PATCH /v1beta1/counters/rooms";
const ONE_LESS: &str = r#"PATCH /v1beta1/counters/rooms {"countDiff":"-1"}"#;
const READ: &str = "GET /v1beta1/counters/rooms";
const ERRORS: &str = "jostle_agones_errors_total";

/// Settings with frequent polls and health signals, and with enough time for a sidecar on a slow machine.
fn settings(sidecar: SocketAddr) -> Settings {
    let often = Duration::from_millis(50);
    Settings {
        rooms_max: 5,
        health_every: often,
        look_every: often,
        retry: often,
        answer: LONG,
        ..Settings::new(sidecar, 64)
    }
}

async fn start(settings: Settings) -> Server {
    let ops_token = Some(OPS_TOKEN.to_owned());
    Server::start_with(Config { agones: Some(settings), ops_token, ..patient() }).await
}

async fn command(server: &Server, path: &str) {
    assert_eq!(admin(server.ops, "POST", path).await.status, 200, "{path}");
}

/// Closes a room, so that its player is disconnected.
async fn close(server: &Server, room: &str, mut player: Client) {
    command(server, &format!("rooms/{room}/close")).await;
    player.is_refused(Refusal::RoomClosed).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn agones_hears_of_the_life_of_a_server_from_ready_to_shutdown() {
    let sidecar = Sidecar::start();
    let server = start(settings(sidecar.address)).await;
    sidecar.hears(READY).await;
    let calls = sidecar.game_server().asked.clone();
    let others: Vec<_> = calls.iter().filter(|call| *call != HEALTH).collect();
    assert_eq!(others, [&format!(r#"{CHANGE} {{"count":"0","capacity":"5"}}"#), READY]);
    sidecar.hears_after(3, HEALTH).await;

    sidecar.allocate();
    let player = Client::join(server.address, "arena", "Ann").await;
    sidecar.hears_after(sidecar.count_of(HEALTH) + 3, HEALTH).await;
    sidecar.is_read_again().await;
    assert_eq!(sidecar.count_of(CHANGE), 1, "the allocator has counted the room");

    close(&server, "arena", player).await;
    sidecar.hears(SHUTDOWN).await;
    let calls = sidecar.game_server().asked.clone();
    let counted: Vec<_> = calls.iter().filter(|call| call.contains("counters")).collect();
    assert_eq!(counted[counted.len() - 3..], [READ, ONE_LESS, READ], "{calls:?}");
    assert_eq!(sidecar.game_server().rooms, Some([0, 5]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn rooms_that_the_allocator_did_not_count_take_nothing_off_the_count() {
    let sidecar = Sidecar::start();
    let server = start(settings(sidecar.address)).await;
    sidecar.hears(READY).await;
    sidecar.allocate();
    let [ann, bob] = ["arena", "pile"].map(|room| Client::join(server.address, room, "Ann"));
    let (ann, bob) = (ann.await, bob.await);
    sidecar.is_read_again().await;
    close(&server, "arena", ann).await;
    sidecar.is_read_again().await;
    assert_eq!(sidecar.count_of(ONE_LESS), 0);
    close(&server, "pile", bob).await;
    sidecar.hears(SHUTDOWN).await;
    assert_eq!(sidecar.count_of(ONE_LESS), 1);
    assert_eq!(sidecar.game_server().rooms, Some([0, 5]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_game_server_waits_for_players_who_are_on_their_way_to_it() {
    let sidecar = Sidecar::start();
    let server = start(settings(sidecar.address)).await;
    sidecar.hears(READY).await;
    sidecar.allocate();
    sidecar.allocate();
    let player = Client::join(server.address, "arena", "Ann").await;
    sidecar.is_read_again().await;
    close(&server, "arena", player).await;
    sidecar.hears(ONE_LESS).await;
    sidecar.is_read_again().await;
    assert_eq!(sidecar.count_of(SHUTDOWN), 0);

    let player = Client::join(server.address, "pile", "Bob").await;
    sidecar.is_read_again().await;
    close(&server, "pile", player).await;
    sidecar.hears(SHUTDOWN).await;
    assert_eq!(sidecar.game_server().rooms, Some([0, 5]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_game_server_to_which_no_players_come_in_time_ends() {
    let sidecar = Sidecar::start();
    let waits = Timeouts { room_empty: SOON, ..PATIENT };
    let agones = Some(settings(sidecar.address));
    let server = Server::start_with(Config { agones, waits, ..patient() }).await;
    sidecar.hears(READY).await;
    sidecar.allocate();
    sidecar.hears(SHUTDOWN).await;
    assert_eq!(sidecar.game_server().rooms, Some([0, 5]));
    drop(server);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_game_server_that_was_not_allocated_goes_on_after_its_last_room() {
    let sidecar = Sidecar::start();
    let server = start(settings(sidecar.address)).await;
    sidecar.hears(READY).await;
    let player = Client::join(server.address, "arena", "Ann").await;
    sidecar.is_read_again().await;
    close(&server, "arena", player).await;
    sidecar.hears("GET /gameserver").await;
    sidecar.hears_after(sidecar.count_of(HEALTH) + 3, HEALTH).await;
    assert_eq!(sidecar.count_of(SHUTDOWN), 0);
    command(&server, "drain").await;
    server.ended().await;
    assert_eq!(sidecar.count_of(SHUTDOWN), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_the_counter_the_server_goes_on_and_ends_with_its_last_room() {
    let sidecar = Sidecar::start();
    sidecar.game_server().rooms = None;
    let server = start(settings(sidecar.address)).await;
    sidecar.hears(READY).await;
    sidecar.allocate();
    let player = Client::join(server.address, "arena", "Ann").await;
    sidecar.hears_after(sidecar.count_of(HEALTH) + 3, HEALTH).await;
    close(&server, "arena", player).await;
    sidecar.hears(SHUTDOWN).await;
    assert_eq!((sidecar.count_of(CHANGE), sidecar.count_of(READ)), (1, 0));
    server.counts(ERRORS, 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_change_whose_answer_is_lost_is_not_made_twice() {
    let sidecar = Sidecar::start();
    let answer = Duration::from_secs(3);
    let server = start(Settings { answer, ..settings(sidecar.address) }).await;
    sidecar.hears(READY).await;
    sidecar.allocate();
    let player = Client::join(server.address, "arena", "Ann").await;
    sidecar.is_read_again().await;
    sidecar.game_server().mood = Mood::LosingOne;
    close(&server, "arena", player).await;
    sidecar.hears(SHUTDOWN).await;
    assert_eq!(sidecar.count_of(ONE_LESS), 1);
    assert_eq!(sidecar.game_server().rooms, Some([0, 5]));
}

/// Plays while calls fail, and then until the sidecar works again and hears from the server.
async fn plays_on(server: &Server, recovered: impl FnOnce() -> Sidecar) {
    let mut player = Client::join(server.address, "arena", "Ann").await;
    crate::server::until_count(server.ops, ERRORS, 4).await;
    player.keeps_playing().await;
    let sidecar = recovered();
    sidecar.game_server().mood = Mood::Well;
    sidecar.hears(READY).await;
    player.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_sidecar_that_is_absent_or_hangs_costs_no_player_anything() {
    let absent = Absent::new();
    let server = start(settings(absent.address())).await;
    plays_on(&server, || absent.appears()).await;

    let hanging = Sidecar::start();
    hanging.game_server().mood = Mood::Hanging;
    let answer = Duration::from_millis(100);
    let server = start(Settings { answer, ..settings(hanging.address) }).await;
    plays_on(&server, || hanging).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_ends_though_its_sidecar_fails_or_hangs() {
    for mood in [Mood::Failing, Mood::Hanging] {
        let sidecar = Sidecar::start();
        sidecar.game_server().mood = mood;
        let answer = Duration::from_millis(100);
        let mut server = start(Settings { answer, ..settings(sidecar.address) }).await;
        let mut player = Client::join(server.address, "arena", "Ann").await;
        crate::server::until_count(server.ops, ERRORS, 4).await;
        player.keeps_playing().await;
        drop(player);
        server.stop();
        server.ended().await;
        assert!(sidecar.count_of(SHUTDOWN) > 1, "tried again");
    }
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_program_finds_the_sidecar_by_the_variable_of_agones() {
    let sidecar = Sidecar::start();
    let port = sidecar.address.port();
    let serve = move || Process::serve_for_agones(port, Stdio::inherit());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    sidecar.hears(READY).await;
    sidecar.hears(HEALTH).await;
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
    assert_eq!(sidecar.count_of(SHUTDOWN), 1);
}
