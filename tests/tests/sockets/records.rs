//! Tests of records over HTTP: submitted runs are verified by replaying them, and manipulated replays are refused.

use crate::http::{Answer, admin, get, raw_bytes};
use crate::networks::behind_a_proxy;
use crate::replays::Dir;
use crate::server::Server;
use jostle_game::{Buttons, Scene};
use jostle_protocol::replay::{Block, Record, Start};
use jostle_server::Config;
use jostle_server::limits::{
    ADDRESS_LONG_BODIES_MAX, LONG_BODIES_MAX, RECORDS_MAX, RUN_BYTES_MAX, RUN_TRIALS_MAX, Timeouts,
};
use jostle_server::log::{StateSettings, Sync};
use jostle_tests::runs::{DASH, DASH_NAME, dash, file, race};
use jostle_tests::server::{LONG, OPS_TOKEN, PATIENT, patient};
use serde_json::Value;
use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

const ROUTE: &str = "/api/records";

/// Configuration of a server that keeps its records in `dir` and has the dash scene with the given text.
fn keeping(dir: &Dir, text: &str) -> Config {
    let mut config = Config { waits: Timeouts { run_trial: LONG, ..PATIENT }, ..patient() };
    config.state = Some(StateSettings { dir: dir.path().to_owned(), sync: Sync::System });
    config.scenes.push(Scene::parse("dash.toml", text).expect("a scene"));
    config
}

async fn send(server: SocketAddr, bytes: &[u8]) -> Answer {
    let length = bytes.len();
    let head = format!(
        "POST {ROUTE} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n"
    );
    raw_bytes(server, &[head.as_bytes(), bytes].concat()).await
}

/// Submits a run, which must be accepted, and returns its name.
async fn enters(server: SocketAddr, bytes: &[u8], rank: u64) -> String {
    let answer = send(server, bytes).await;
    assert_eq!(answer.status, 201, "{}", String::from_utf8_lossy(&answer.body));
    assert_eq!(answer.json()["rank"], rank);
    answer.json()["name"].as_str().expect("a name").to_owned()
}

/// The best runs of the dash, as players and file names, starting with the best.
async fn best(server: SocketAddr) -> Vec<(String, String)> {
    let list = get(server, &format!("{ROUTE}?scene={DASH_NAME}")).await.json();
    let records = list["scenes"][0]["records"].as_array().expect("a list").clone();
    let text = |value: &Value| value.as_str().expect("a text").to_owned();
    records.iter().map(|record| (text(&record["players"][0]), text(&record["name"]))).collect()
}

fn players(best: &[(String, String)]) -> Vec<&str> {
    best.iter().map(|(player, _)| player.as_str()).collect()
}

fn record_file(dir: &Dir, name: &str) -> PathBuf {
    dir.path().join("records").join(format!("{name}.jostle"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_best_runs_of_a_scene_are_listed_and_can_be_watched() {
    let dir = Dir::new("records-best");
    let server = Server::start_with(keeping(&dir, DASH)).await;
    let address = server.address;
    let slow = file(&dash("Ann", 90));
    let first = enters(address, &slow, 1).await;
    let fast = enters(address, &file(&dash("Bob", 30)), 1).await;
    assert_eq!(players(&best(address).await), ["Bob", "Ann"]);
    // The stored file is identical to the submitted one.
    let answer = get(address, &format!("/records/{first}.jostle")).await;
    assert_eq!((answer.status, answer.body), (200, slow));
    // Ann beats her own record, and her older run is removed.
    let better = enters(address, &file(&dash("Ann", 60)), 2).await;
    assert_eq!(best(address).await[1], ("Ann".to_owned(), better.clone()));
    assert_eq!(get(address, &format!("/records/{first}.jostle")).await.status, 404);
    assert!(!record_file(&dir, &first).exists() && record_file(&dir, &better).exists());
    let worse = send(address, &file(&dash("Ann", 120))).await;
    assert_eq!((worse.status, &worse.json()["rank"]), (200, &Value::Null));
    // Each scene has a separate table, and the overall list has the best run of each scene.
    assert_eq!(send(address, &file(&race())).await.status, 201);
    let all = get(address, ROUTE).await.json();
    let table = |scene: &str| {
        let tables = all["scenes"].as_array().expect("a list").iter();
        tables.clone().find(|table| table["scene"] == scene).expect("a table").clone()
    };
    assert_eq!(table(DASH_NAME)["records"].as_array().expect("a list").len(), 1);
    assert_eq!(table(DASH_NAME)["records"][0]["name"], fast);
    assert_eq!(table("race")["measure"], "time");
    assert_eq!(table("splash")["measure"], "points");
    let run = &table("race")["records"][0];
    assert_eq!((&run["begin"], &run["seat"], &run["points"]), (&180.into(), &1.into(), &3.into()));
    assert_eq!(get(address, "/api/records?scene=hockey").await.status, 404, "teams");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_run_that_was_tampered_with_is_refused_with_what_was_found() {
    let dir = Dir::new("records-tampered");
    let server = Server::start_with(keeping(&dir, DASH)).await;
    let whole = dash("Ann", 30);
    let blocks = |change: &dyn Fn(&mut Block)| {
        let mut records = whole.clone();
        for record in &mut records {
            if let Record::Ticks(block) = record {
                change(block);
                break;
            }
        }
        file(&records)
    };
    let start = |change: &dyn Fn(&mut Start)| {
        let mut records = whole.clone();
        let Record::Start(start) = &mut records[0] else { panic!("a start") };
        change(start);
        file(&records)
    };
    let mut changed_byte = file(&whole);
    let middle = changed_byte.len() - 100;
    changed_byte[middle] ^= 4;
    let mut without_end = whole.clone();
    without_end.pop();
    let cases = [
        // A changed input, in which Ann flies five ticks earlier than she really did.
        (
            blocks(&|block| {
                block.ticks[85..90].iter_mut().for_each(|tick| {
                    let input = &mut tick.inputs[0].1;
                    *input = input.with_buttons(Buttons::RIGHT);
                });
            }),
            "tick 86 does not have the recorded hash",
        ),
        (blocks(&|block| block.ticks[70].hash ^= 1), "tick 71 does not have the recorded hash"),
        (
            start(&|start| start.scene = start.scene.replace("[80, 0]", "[20, 0]")),
            "is not the one that is played here",
        ),
        (start(&|start| start.scene_name = "dish".to_owned()), "this server has no scene \"dish\""),
        (start(&|start| start.scene_name = "race".to_owned()), "is not the one that is played"),
        (start(&|start| start.seed = 99), "tick 1 does not have the recorded hash"),
        (changed_byte, "its checksum differs"),
        (file(&without_end), "without an end record"),
        (file(&whole[..1]), "without an end record"),
        // A replay that claims to be a run but does not contain one.
        (
            {
                // The round's time is up before Ann flies.
                file(&dash("Ann", 4000))
            },
            "no player wins a round in this replay",
        ),
        (b"a run of two seconds, honestly".to_vec(), "this is no replay that can be read"),
        (Vec::new(), "this is no replay that can be read"),
    ];
    for (bytes, sentence) in &cases {
        let answer = send(server.address, bytes).await;
        let error = answer.json()["error"].as_str().expect("a sentence").to_owned();
        assert_eq!(answer.status, 422, "{sentence}: {error}");
        assert!(error.contains(sentence), "{error:?} says {sentence:?}");
    }
    let count = cases.len() as u64;
    server.counts("jostle_refusals_total{reason=\"run\"}", count).await;
    assert_eq!(send(server.address, &vec![0; RUN_BYTES_MAX + 1]).await.status, 413);
    assert!(best(server.address).await.is_empty());
    assert!(!dir.path().join("records").exists(), "it is made for the first one");
    // The original that all of these were made from is a valid run.
    enters(server.address, &file(&whole), 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn records_outlive_the_server_unless_their_files_were_tampered_with() {
    let dir = Dir::new("records-restart");
    let mut server = Server::start_with(keeping(&dir, DASH)).await;
    let ann = enters(server.address, &file(&dash("Ann", 60)), 1).await;
    let bob = enters(server.address, &file(&dash("Bob", 30)), 1).await;
    let cid = enters(server.address, &file(&dash("Cid", 90)), 3).await;
    server.stop();
    server.ended().await;
    // A copy of another player's file, since a file's name proves nothing.
    fs::copy(record_file(&dir, &bob), record_file(&dir, "dash-0000000000000000")).expect("a copy");
    let mut bytes = fs::read(record_file(&dir, &ann)).expect("a file");
    let last = bytes.len() - 40;
    bytes[last] ^= 1;
    fs::write(record_file(&dir, &ann), &bytes).expect("a file that may be written");
    fs::write(dir.path().join("records/half.new"), b"jost").expect("a file");

    let mut server = Server::start_with(keeping(&dir, DASH)).await;
    let aside = record_file(&dir, &ann).with_extension("damaged");
    let reloaded = async {
        while players(&best(server.address).await) != ["Bob", "Cid"] || !aside.exists() {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, reloaded).await.expect("all files were played again");
    assert_eq!(best(server.address).await[1].1, cid);
    assert!(!record_file(&dir, &ann).exists() && !dir.path().join("records/half.new").exists());
    server.stop();
    server.ended().await;

    // A scene with a different text has a separate table; files for the old text are kept in case it returns.
    let text = DASH.replace("[80, 0]", "[60, 0]");
    let server = Server::start_with(keeping(&dir, &text)).await;
    let refused = send(server.address, &file(&dash("Dan", 30))).await;
    assert_eq!(refused.status, 422);
    assert!(best(server.address).await.is_empty());
    assert!(record_file(&dir, &bob).exists());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_disk_that_fails_costs_a_run_which_can_be_sent_again() {
    let dir = Dir::new("records-disk");
    let server = Server::start_with(keeping(&dir, DASH)).await;
    fs::write(dir.path().join("records"), "in the way").expect("a file");
    let answer = send(server.address, &file(&dash("Ann", 30))).await;
    assert_eq!(answer.status, 500);
    assert!(best(server.address).await.is_empty());
    fs::remove_file(dir.path().join("records")).expect("it was there");
    enters(server.address, &file(&dash("Ann", 30)), 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_without_a_directory_keeps_no_records() {
    let server = Server::start().await;
    let answer = send(server.address, &file(&dash("Ann", 30))).await;
    assert_eq!(answer.status, 403);
    assert!(answer.json()["error"].as_str().expect("a sentence").contains("--state DIR"));
    let list = get(server.address, ROUTE).await.json();
    assert_eq!((&list["kept"], list["scenes"].as_array().map(Vec::len)), (&false.into(), Some(0)));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_run_that_takes_too_long_to_play_is_refused() {
    let dir = Dir::new("records-slow");
    let mut config = keeping(&dir, DASH);
    config.waits.run_trial = Duration::ZERO;
    let server = Server::start_with(config).await;
    let answer = send(server.address, &file(&dash("Ann", 30))).await;
    assert_eq!(answer.status, 422);
    let error = answer.json()["error"].as_str().expect("a sentence").to_owned();
    assert!(error.contains("takes too long to play: it came to tick 64"), "{error}");
}

/// Starts submitting a run as a client with the given address, but sends nothing once the server reads the body.
async fn send_nothing(server: SocketAddr, client: &str) -> TcpStream {
    let mut stream = TcpStream::connect(server).await.expect("a connection");
    let head = format!(
        "POST {ROUTE} HTTP/1.1\r\nHost: localhost\r\nX-Forwarded-For: {client}\r\nContent-Length: 9000\r\n\
         Expect: 100-continue\r\n\r\n"
    );
    stream.write_all(head.as_bytes()).await.expect("a live socket");
    let mut status = [0; 12];
    let read = timeout(LONG, stream.read_exact(&mut status)).await;
    read.expect("an answer in time").expect("an answer");
    assert_eq!(&status, b"HTTP/1.1 100", "the body is read");
    stream
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn addresses_that_send_nothing_keep_no_others_from_sending_their_runs() {
    let dir = Dir::new("records-silent");
    let server = behind_a_proxy(keeping(&dir, DASH)).await;
    let mut silent = Vec::new();
    let client = |number: usize| format!("198.51.{}.1", number / ADDRESS_LONG_BODIES_MAX);
    for number in 0..RUN_TRIALS_MAX {
        silent.push(send_nothing(server.address, &client(number)).await);
    }
    enters(server.address, &file(&dash("Ann", 60)), 1).await;
    for number in RUN_TRIALS_MAX..LONG_BODIES_MAX {
        silent.push(send_nothing(server.address, &client(number)).await);
    }
    // Once all slots are taken, the request that has waited longest is dropped.
    let bytes = file(&dash("Bob", 30));
    let sent = async {
        while send(server.address, &bytes).await.status != 201 {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, sent).await.expect("a place");
    assert_eq!(players(&best(server.address).await), ["Bob", "Ann"]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_record_that_bots_displaced_is_back_once_an_operator_removes_one_of_theirs() {
    let dir = Dir::new("records-bots");
    let config = || Config { ops_token: Some(OPS_TOKEN.to_owned()), ..keeping(&dir, DASH) };
    let mut server = Server::start_with(config()).await;
    let run = file(&dash("Ann", 90));
    let ann = enters(server.address, &run, 1).await;
    let mut bots = Vec::new();
    for number in 0..RECORDS_MAX as u32 {
        bots.push(file(&dash(&format!("Bot {number}"), 60 - number)));
        enters(server.address, &bots[number as usize], 1).await;
    }
    assert_eq!(get(server.address, &format!("/records/{ann}.jostle")).await.status, 404);
    server.stop();
    server.ended().await;

    let server = Server::start_with(config()).await;
    let has = async |expected: &str| {
        let listed = async {
            while !players(&best(server.address).await).contains(&expected) {
                sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(LONG, listed).await.expect("it is listed in time");
    };
    has("Bot 9").await;
    let bot = best(server.address).await[0].1.clone();
    let remove = format!("records/{bot}/remove");
    assert_eq!(admin(server.ops, "POST", &remove).await.status, 200);
    has("Ann").await;
    assert_eq!(get(server.address, &format!("/records/{ann}.jostle")).await.body, run);
    assert_eq!(admin(server.ops, "POST", &remove).await.status, 404, "it is gone");
    let again = send(server.address, &bots[RECORDS_MAX - 1]).await;
    assert_eq!(again.status, 422);
    assert!(again.json()["error"].as_str().expect("a sentence").contains("by an operator"));
}
