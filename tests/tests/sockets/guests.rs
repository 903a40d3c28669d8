//! Tests of rooms with guest scenes: which scenes are refused because of which field, and which are played.

use crate::client::Client;
use crate::http::{Answer, get, post, raw};
use crate::networks::{behind_a_proxy, passed_on};
use crate::replays::Dir;
use crate::server::{Server, until_count};
use jostle_game::scene::Budget;
use jostle_protocol::{Appearance, ClientMessage, Refusal, Role, Token, VERSION};
use jostle_server::Config;
use jostle_server::guests::GuestScenes;
use jostle_server::limits::{
    ADDRESS_ROOMS_MIN, GUEST_BUDGET, GUEST_SCENE_BYTES_MAX, GUESTS_UPLINK_SHARE,
    PRIVATE_CODE_CHARS, Timeouts, UPLINK_BURST_SECONDS, guest_rooms_max,
};
use jostle_server::log::{StateSettings, Sync};
use jostle_tests::guest_scenes::{DEAR, random_scene};
use jostle_tests::server::{LONG, PATIENT, patient};
use serde_json::Value;
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use tokio::net::TcpSocket;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::timeout;

const ROUTE: &str = "/api/guest-rooms";

/// A pit with some balls, and with extra lines at the top level and at the end.
fn scene(top: &str, rest: &str) -> String {
    format!(
        "title = \"A pit\"\nsize = [100, 60]\ngroups = [\"hero\", \"ball\", \"wall\"]\n\
         pairs = [[\"ball\", \"wall\"], [\"ball\", \"ball\"], [\"hero\", \"ball\"]]\n{top}\n\
         [hero]\nspawns = [[50, 30]]\n\
         [[bodies]]\nkind = \"wall\"\ngroup = \"wall\"\nposition = [50, 2]\nsize = [100, 4]\n\
         [[layouts]]\nkind = \"block\"\ngroup = \"ball\"\ncount = 20\nradius = 1\narea = [[10, 10], [90, 50]]\n\
         {rest}"
    )
}

/// Configuration of a server whose trials have unlimited time, because the test machine may be slow.
fn hospitable(guest_scenes: GuestScenes) -> Config {
    let waits = Timeouts { guest_trial: LONG, guest_excess: LONG, ..PATIENT };
    Config { guest_scenes, waits, ..patient() }
}

/// Opens a room with a guest scene.
async fn open(server: SocketAddr, path: &str, text: &str) -> (String, Token) {
    let created = post(server, path, text).await;
    assert_eq!(created.status, 201, "{}", String::from_utf8_lossy(&created.body));
    let created = created.json();
    let text = |field: &str| created[field].as_str().expect("a text").to_owned();
    (text("code"), Token::parse(&text("host_key")).expect("a key"))
}

/// Checks that the structured parts of a refusal agree with its message, and checks how the reported line begins.
fn is_about(answer: &Answer, source: &str, field: &str, line: &str) {
    let body = answer.json();
    let text = |name: &str| body[name].as_str().expect("a text");
    assert_eq!((answer.status, text("field")), (422, field), "{body}");
    let number = body["line"].as_u64().expect("a line") as usize;
    let (found, allowed) = (text("found"), text("allowed"));
    let sentence = format!("guest.toml:{number}: {field}: found {found}; allowed: {allowed}");
    assert_eq!(text("error"), sentence);
    let named = source.lines().nth(number - 1).expect("a line of the file");
    assert!(named.starts_with(line), "{sentence} is about {named:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_guests_scene_plays_in_a_room_that_is_not_listed() {
    let server = Server::start_with(hospitable(GuestScenes::Private)).await;
    let address = server.address;
    let mut ann = Client::join(address, "arena", "Ann").await;
    let (code, key) = open(address, ROUTE, &scene("", "")).await;
    assert_eq!(code.len(), PRIVATE_CODE_CHARS);
    let mut host = Client::host(address, &code, "Host", key).await;
    let mut other = Client::join(address, &code, "Other").await;
    assert!(host.host && !other.host);
    assert_eq!(other.newest.bodies.len(), 1 + 20 + 2);
    let list = get(address, "/api/rooms").await;
    assert!(!String::from_utf8(list.body).expect("text").contains(&code));
    assert_eq!(get(address, "/api/scenes").await.json()["guest_scenes"], "private");
    let listed = post(address, "/api/guest-rooms?listed=true", &scene("", "")).await;
    assert_eq!(listed.status, 403);
    assert!(
        listed.json()["error"].as_str().is_some_and(|text| text.contains("--guest-scenes all"))
    );
    host.keeps_playing().await;
    other.keeps_playing().await;
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_operator_decides_whether_there_are_such_rooms_and_whether_they_are_listed() {
    let server = Server::start_with(hospitable(GuestScenes::Off)).await;
    let refused = post(server.address, ROUTE, &scene("", "")).await;
    assert_eq!(refused.status, 403);
    assert_eq!(get(server.address, "/api/scenes").await.json()["guest_scenes"], "off");
    server.counts("jostle_refusals_total{reason=\"guest_scenes_off\"}", 1).await;

    let server = Server::start_with(hospitable(GuestScenes::All)).await;
    let (listed, _) = open(server.address, "/api/guest-rooms?listed=true", &scene("", "")).await;
    let (private, _) = open(server.address, ROUTE, &scene("", "")).await;
    let list = get(server.address, "/api/rooms").await.json();
    assert_eq!(list["rooms"][0]["code"], listed.as_str());
    assert_eq!(list["rooms"][0]["title"], "A pit");
    assert!(!list.to_string().contains(&private));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scene_over_each_budget_is_refused_with_its_field() {
    let server = Server::start_with(hospitable(GuestScenes::Private)).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let Budget { bodies, particles, size, solver, .. } = GUEST_BUDGET;
    let cases = [
        (scene("limits = { players = 100 }", ""), "limits.players", "limits"),
        (scene(&format!("limits = {{ bodies = {} }}", bodies + 1), ""), "limits.bodies", "limits"),
        (
            scene(&format!("limits = {{ particles = {} }}", particles + 1), ""),
            "limits.particles",
            "limits",
        ),
        (
            scene(&format!("relaxation = {{ iterations = {} }}", solver.iterations + 1), ""),
            "relaxation.iterations",
            "relaxation",
        ),
        (
            scene("solver = \"conjugate\"\nconjugate = { work_max = 9000000 }", ""),
            "conjugate.work_max",
            "conjugate",
        ),
        (scene("", "").replace("[100, 60]", &format!("[{}, 60]", size * 2.0)), "size", "size"),
        (
            scene("limits = { bodies = 900 }", &layout(800))
                .replace("pairs", "solver = \"conjugate\"\npairs"),
            "layouts[1].count",
            "count = 800",
        ),
        (
            scene("", "[[emitters]]\nrecipe = \"fire\"\ncount = 5000\nposition = [9, 9]\n"),
            "emitters[0].count",
            "count = 5000",
        ),
        (scene("", "").replace("A pit", "A\\u202Epit"), "title", "title"),
        (scene("", "").replace("radius = 1", "radius = -1"), "layouts[0].radius", "radius = -1"),
        ("title = ".to_owned(), "file", "title = "),
        ("#".repeat(GUEST_SCENE_BYTES_MAX + 1), "file", "#"),
    ];
    for (text, field, line) in &cases {
        is_about(&post(server.address, ROUTE, text).await, text, field, line);
    }
    server.counts("jostle_refusals_total{reason=\"guest_scene\"}", cases.len() as u64).await;
    assert_eq!(
        get(server.address, "/api/rooms").await.json()["rooms"][1],
        Value::Null,
        "none opened"
    );
    ann.keeps_playing().await;
}

fn layout(count: u32) -> String {
    format!(
        "[[layouts]]\nkind = \"block\"\ngroup = \"ball\"\nradius = 0.1\narea = [[10, 10], [90, 50]]\ncount = {count}\n"
    )
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scene_whose_trial_takes_too_long_is_refused_with_what_costs_most() {
    let waits = Timeouts { guest_trial: Duration::from_nanos(1), ..PATIENT };
    let server = Server::start_with(Config { waits, ..patient() }).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let answer = post(server.address, ROUTE, DEAR).await;
    assert_eq!(answer.status, 422);
    let body = answer.json();
    assert_eq!(body["field"], "layouts[0].count");
    assert!(
        body["found"].as_str().is_some_and(|found| found.starts_with("a slow scene")),
        "{body}"
    );
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_room_that_takes_more_than_its_share_is_closed_and_others_go_on() {
    // On any machine, every tick takes longer than this, so the first one exceeds the limit.
    let waits = Timeouts { guest_trial: LONG, guest_excess: Duration::from_nanos(1), ..PATIENT };
    let server = Server::start_with(Config { waits, ..patient() }).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let (code, _) = open(server.address, ROUTE, DEAR).await;
    // A client that joins while the room is closing gets the reason.
    let closed = async {
        loop {
            let mut guest = Client::connect(server.address, &code).await;
            guest.hello(VERSION, "Guest", None).await;
            match guest.refusal().await.0 {
                Refusal::NoSuchRoom => return,
                refusal => assert_eq!(refusal, Refusal::TooCostly),
            }
        }
    };
    timeout(LONG, closed).await.expect("an end in time");
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_address_has_a_quarter_of_these_rooms_and_leaves_the_others_to_the_rest() {
    let server = behind_a_proxy(hospitable(GuestScenes::Private)).await;
    let processors = std::thread::available_parallelism().map_or(1, Into::into);
    let share = (guest_rooms_max(processors) / 4).min(ADDRESS_ROOMS_MIN);
    let ask = async |client: &str| {
        let request = passed_on("POST", ROUTE, client, &scene("", ""));
        raw(server.address, &request).await.status
    };
    for _ in 0..share {
        assert_eq!(ask("203.0.113.7").await, 201);
    }
    assert_eq!(ask("203.0.113.7").await, 429);
    assert_eq!(ask("198.51.100.7").await, 201, "another network");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_guests_room_outlives_the_process_with_its_scene() {
    let dir = Dir::new("guests");
    let state = || {
        let settings = StateSettings { dir: dir.path().to_owned(), sync: Sync::System };
        Config { state: Some(settings), ..hospitable(GuestScenes::Private) }
    };
    let mut server = Server::start_with(state()).await;
    let (code, _) = open(server.address, ROUTE, &scene("", "")).await;
    Client::join(server.address, &code, "Ann").await.play_one_input().await;
    server.stop();
    server.ended().await;

    // In the next process, guests may not open rooms, but this room continues.
    let server = Server::start_with(Config { guest_scenes: GuestScenes::Off, ..state() }).await;
    let mut ann = Client::join(server.address, &code, "Ann").await;
    assert_eq!(ann.newest.bodies.len(), 1 + 20 + ann.newest.players.len());
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn random_scenes_are_refused_with_a_field_or_play_within_the_budget() {
    let server = Server::start_with(hospitable(GuestScenes::Private)).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let (mut played, mut refused) = (0, 0);
    for seed in 0..40 {
        let text = random_scene(seed);
        let answer = post(server.address, ROUTE, &text).await;
        if answer.status == 422 {
            let line = answer.json()["line"].as_u64().expect("a line");
            assert!((1..=text.lines().count() as u64).contains(&line), "seed {seed}");
            refused += 1;
            continue;
        }
        assert_eq!(answer.status, 201, "seed {seed}: {}", String::from_utf8_lossy(&answer.body));
        let created = answer.json();
        let key = Token::parse(created["host_key"].as_str().expect("a key")).expect("a key");
        let code = created["code"].as_str().expect("a code");
        let mut host = Client::host(server.address, code, "Host", key).await;
        host.snapshot().await;
        assert!(host.newest.bodies.len() <= GUEST_BUDGET.bodies, "seed {seed}");
        host.send(&ClientMessage::CloseRoom).await;
        host.is_refused(Refusal::RoomClosed).await;
        played += 1;
    }
    assert!(played > 5 && refused > 5, "{played} played, {refused} refused");
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_scenes_of_some_networks_delay_a_newcomer_by_one_trial() {
    let waits = Timeouts { guest_trial: Duration::from_millis(250), ..PATIENT };
    let server = behind_a_proxy(Config { waits, ..patient() }).await;
    let address = server.address;
    let (sender, mut tried) = mpsc::unbounded_channel();
    for number in 0..8 {
        let request = passed_on("POST", ROUTE, &format!("198.51.{}.1", number / 2), DEAR);
        let sender = sender.clone();
        tokio::spawn(async move { sender.send(raw(address, &request).await.status) });
    }
    tried.recv().await;
    let text = scene("", "").replace("A pit", "A\\u202Epit");
    let newcomer = raw(address, &passed_on("POST", ROUTE, "203.0.113.1", &text)).await;
    // Trials run in the order of `TrialQueue`. How many finish before the newcomer is queued depends on the machine.
    assert!(tried.len() < 7, "all were tried first");
    is_about(&newcomer, &text, "title", "title");
}

/// Balls that never stop bouncing.
const HAIL: &str = "title = \"Hail\"\nsize = [60, 60]\ngroups = [\"ball\", \"wall\"]\n\
    pairs = [[\"ball\", \"wall\"], [\"ball\", \"ball\"]]\n\
    [[bodies]]\nkind = \"wall\"\ngroup = \"wall\"\nposition = [30, 1]\nsize = [60, 2]\n\
    [[layouts]]\nkind = \"block\"\ngroup = \"ball\"\ncount = 300\nradius = 0.8\nrestitution = 1\n\
    area = [[4, 4], [56, 56]]\ngap = 0.01\n";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_crowd_of_two_addresses_is_sent_the_guests_part_of_the_uplink() {
    const MEGABITS: u32 = 4;
    const CROWD: u8 = 40;
    let config = Config { uplink_megabits: MEGABITS, ..hospitable(GuestScenes::Private) };
    let server = Server::start_with(config).await;
    let (code, _) = open(server.address, ROUTE, HAIL).await;
    // The uplink budget is now exhausted.
    let began = Instant::now();
    let mut crowd = JoinSet::new();
    let (limited, _) = watch::channel(false);
    for number in 0..CROWD {
        let socket = TcpSocket::new_v4().expect("a socket");
        let from = SocketAddr::from(([127, 0, 0, 2 + number % 2], 0));
        socket.bind(from).expect("an address of this machine");
        let mut eye = Client::connect_over(socket, server.address, &code).await;
        let appearance = Appearance { name: "Eye".into(), color: 1 };
        let (token, host_key, role) = (None, None, Role::Spectator);
        let version = VERSION;
        eye.send(&ClientMessage::Hello { version, appearance, token, host_key, role }).await;
        let mut limit = limited.subscribe();
        crowd.spawn(async move {
            let mut sent = 0;
            let watched = async {
                while let Some(Ok(message)) = eye.frame().await {
                    sent += message.len();
                }
            };
            tokio::select! {
                () = watched => panic!("closed"),
                limited = limit.wait_for(|limited| *limited) => drop(limited.expect("a server")),
            }
            sent
        });
    }
    // Without a limit, they would receive 600 kB/s.
    until_count(server.ops, "jostle_snapshots_skipped_total{reason=\"uplink\"}", u64::from(CROWD))
        .await;
    limited.send_replace(true);
    let sent = crowd.join_all().await;
    let seconds = began.elapsed().as_secs_f64() + f64::from(UPLINK_BURST_SECONDS);
    let most = f64::from(MEGABITS * 125_000 / GUESTS_UPLINK_SHARE) * seconds;
    let all: usize = sent.iter().sum();
    assert!(all as f64 <= most, "{all} bytes in {seconds} s, {most} at most");
}
