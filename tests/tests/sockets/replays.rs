//! Tests of a server's recordings and of disk faults.

use crate::client::{Client, LONG};
use crate::http::get;
use crate::process::Process;
use crate::server::Server;
use jostle_game::{Buttons, Seat};
use jostle_protocol::Refusal;
use jostle_protocol::replay::{Change, Ending, Replay, Tick};
use jostle_room::divergence;
use jostle_server::Config;
use jostle_server::log::{Create, Settings};
use jostle_sim::Vec2;
use jostle_tests::server::patient;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;
use tokio::time::timeout;

/// An empty directory for one test, which is removed if the test passes.
pub struct Dir(PathBuf);

impl Dir {
    /// Creates a unique directory, even if another test in this program uses the same name.
    pub fn new(test: &str) -> Dir {
        static MADE: AtomicU32 = AtomicU32::new(0);
        let name = format!("replays-{test}-{}", MADE.fetch_add(1, Ordering::Relaxed));
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).expect("a directory");
        Dir(dir)
    }

    pub fn settings(&self) -> Settings {
        Settings::new(self.0.clone())
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    fn text(&self) -> &str {
        self.0.to_str().expect("a path of plain characters")
    }

    /// All replays in the directory. A file that has only just been created may not be readable yet.
    pub fn replays(&self) -> Vec<Arc<Replay>> {
        let paths = fs::read_dir(&self.0)
            .expect("a directory")
            .map(|entry| entry.expect("an entry").path());
        let bytes = paths.map(|path| fs::read(path).expect("a file"));
        bytes.filter_map(|bytes| Some(Arc::new(Replay::read(bytes).ok()?))).collect()
    }
}

impl Drop for Dir {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = fs::remove_dir_all(&self.0);
        }
    }
}

pub async fn recording(settings: Settings) -> Server {
    Server::start_with(Config { replays: Some(settings), ..patient() }).await
}

/// Lets two players play for `ticks` ticks.
pub async fn play(one: &mut Client, other: &mut Client, ticks: u32) {
    let end = one.newest.tick + ticks;
    let played = async {
        while one.newest.tick < end {
            let x = 40.0 + (one.newest.tick % 90) as f32;
            one.input(Buttons::RIGHT, Some(Vec2::new(x, 60.0))).await;
            other.input(Buttons::FIRE, Some(Vec2::new(90.0, x * 0.5))).await;
            one.snapshot().await;
            other.snapshot().await;
        }
    };
    timeout(LONG, played).await.expect("the game goes on");
}

/// Verifies a replay and checks that it matches.
pub async fn verify(replay: &Arc<Replay>) {
    let replay = Arc::clone(replay);
    let found = tokio::task::spawn_blocking(move || divergence::verify(&replay, |_| {})).await;
    assert_eq!(found.expect("no panic"), Ok(None));
}

/// Waits until the server has counted more than the given number of errors.
async fn until_errors(server: &Server, more_than: u64) -> u64 {
    let counted = async {
        loop {
            let list = get(server.address, "/api/replays").await.json();
            let errors = list["errors"].as_u64().expect("a number");
            if errors > more_than {
                return errors;
            }
        }
    };
    timeout(LONG, counted).await.expect("an error")
}

/// Returns all recorded ticks of a replay.
pub fn ticks(replay: &Replay) -> Vec<Tick> {
    let (mut ticks, mut next) = (Vec::new(), replay.first_tick() + 1);
    while let Some(block) = replay.block_with(next) {
        next = block.first + block.ticks.len() as u32;
        ticks.extend(block.ticks.iter().cloned());
    }
    ticks
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_game_of_two_is_recorded_and_plays_again() {
    let dir = Dir::new("two");
    let mut server = recording(dir.settings()).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    play(&mut ann, &mut bob, 400).await;
    let last_tick = ann.newest.tick;
    server.stop();
    ann.is_refused(Refusal::Closing).await;
    bob.is_refused(Refusal::Closing).await;
    drop((ann, bob));
    server.ended().await;

    let replays = dir.replays();
    let [replay] = &replays[..] else { panic!("{} replays", replays.len()) };
    assert_eq!(replay.ending(), Ending::Whole);
    assert!(replay.last_tick() >= last_tick && replay.first_tick() == 0);
    let ticks = ticks(replay);
    let changes = ticks.iter().flat_map(|tick| &tick.changes);
    let joins = changes.filter_map(|change| match change {
        Change::Join(_, appearance) => Some(appearance.name.to_string()),
        _ => None,
    });
    assert_eq!(joins.collect::<Vec<_>>(), ["Ann", "Bob"]);
    let moves = |seat: u16| {
        let inputs = ticks.iter().flat_map(|tick| &tick.inputs);
        inputs.filter(|(of, input)| *of == Seat(seat) && input.pointer().is_some()).count()
    };
    assert!(moves(0) > 100 && moves(1) > 100, "{} and {}", moves(0), moves(1));
    verify(replay).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_replay_is_listed_and_read_while_it_is_recorded() {
    let dir = Dir::new("listed");
    let server = recording(dir.settings()).await;
    let mut ann = Client::join(server.address, "impulse", "Ann").await;
    let mut bob = Client::join(server.address, "impulse", "Bob").await;
    play(&mut ann, &mut bob, 320).await;
    let listed = async {
        loop {
            let list = get(server.address, "/api/replays").await.json();
            let replay = list["replays"][0].clone();
            if replay["bytes"].as_u64().is_some_and(|bytes| bytes > 1500) {
                return replay;
            }
        }
    };
    let listed = timeout(LONG, listed).await.expect("a replay");
    assert_eq!((&listed["scene"], &listed["room"]), (&"impulse".into(), &"impulse".into()));
    assert_eq!(listed["recording"], true);
    assert!(listed["unix_s"].as_u64().is_some_and(|unix_s| unix_s > 1_600_000_000));
    let name = listed["name"].as_str().expect("a name");
    assert!(name.starts_with("impulse-impulse-20"), "{name}");

    let answer = get(server.address, &format!("/replays/{name}.jostle")).await;
    assert_eq!(
        (answer.status, answer.header("content-type")),
        (200, Some("application/octet-stream"))
    );
    let length = answer.header("content-length").and_then(|length| length.parse().ok());
    assert_eq!(length, Some(answer.body.len()));
    let replay = Arc::new(Replay::read(answer.body).expect("a replay"));
    assert!(replay.last_tick() >= 300, "{}", replay.last_tick());
    verify(&replay).await;

    let page = get(server.address, &format!("/replay/{name}")).await;
    assert_eq!((page.status, page.header("content-type")), (200, Some("text/html; charset=utf-8")));
    for around in [".", ").", "%22"] {
        let answer = get(server.address, &format!("/replay/{name}{around}")).await;
        let link = format!("/replay/{name}");
        assert_eq!((answer.status, answer.header("location")), (302, Some(&*link)), "{around}");
    }
    assert_eq!(get(server.address, "/replay/another").await.status, 404);
    for path in [
        "/replays/".to_owned(),
        "/replays/.jostle".to_owned(),
        "/replays/another.jostle".to_owned(),
        format!("/replays/{name}"),
        format!("/replays/{name}.jostle/"),
        format!("/replays/../{name}.jostle"),
        format!("/replays/%2e%2e/{name}.jostle"),
        format!("/replays//{name}.jostle"),
        format!("/replays/./{name}.jostle"),
        "/replays/../../Cargo.toml".to_owned(),
    ] {
        assert_eq!(get(server.address, &path).await.status, 404, "{path}");
    }
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_directory_nothing_is_recorded_and_the_list_is_empty() {
    let server = Server::start().await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let list = get(server.address, "/api/replays").await;
    assert_eq!(list.status, 200);
    assert_eq!(list.json(), serde_json::json!({ "replays": [], "errors": 0, "dropped": 0 }));
    assert_eq!(get(server.address, "/replays/a.jostle").await.status, 404);
    assert_eq!(get(server.address, "/replay/a").await.status, 404);
    ann.keeps_playing().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_file_in_place_of_the_directory_stops_no_game() {
    let dir = Dir::new("file");
    let file = dir.0.join("file");
    fs::write(&file, "in the way").expect("a written file");
    let server = recording(Settings::new(file.clone())).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    until_errors(&server, 1).await;
    assert!(server.count("jostle_replay_errors_total").await > 1);
    ann.plays_on().await;
    assert_eq!(fs::read_to_string(&file).expect("still there"), "in the way");
}

/// A disk that accepts some bytes and is then full.
struct FullDisk {
    file: File,
    left: usize,
}

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.left == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let count = bytes.len().min(self.left);
        self.left -= count;
        self.file.write(&bytes[..count])
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

fn on_full_disk(path: &Path) -> io::Result<Box<dyn Write + Send>> {
    let file = File::options().write(true).create_new(true).open(path)?;
    // Enough space for the start, the first block of ticks and part of the second.
    Ok(Box::new(FullDisk { file, left: 3600 }))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_disk_that_fills_up_stops_no_game_and_keeps_what_was_written() {
    let dir = Dir::new("full");
    // So long that no other file is started, however long the test takes.
    let settings = Settings { create: on_full_disk, retry: 2 * LONG, ..dir.settings() };
    let server = recording(settings).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    let mut bob = Client::join(server.address, "arena", "Bob").await;
    let filled = async {
        while get(server.address, "/api/replays").await.json()["errors"] == 0 {
            play(&mut ann, &mut bob, 30).await;
        }
    };
    timeout(LONG, filled).await.expect("a full disk");
    assert!(server.count("jostle_replay_errors_total").await > 0);
    ann.plays_on().await;
    let replays = dir.replays();
    let [replay] = &replays[..] else { panic!("{} replays", replays.len()) };
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert!(replay.last_tick() >= 300, "{}", replay.last_tick());
    verify(replay).await;
}

static DISK_STANDS_STILL: AtomicBool = AtomicBool::new(true);

/// A disk that responds only on command.
struct DeadDisk;

impl Write for DeadDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        while DISK_STANDS_STILL.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_disk_that_stalls_stops_no_game() {
    let dir = Dir::new("dead");
    let create: Create = |_| Ok(Box::new(DeadDisk));
    let server = recording(Settings { create, ..dir.settings() }).await;
    let mut ann = Client::join(server.address, "arena", "Ann").await;
    // A tick that waited for the disk would wait forever.
    ann.plays_on().await;
    DISK_STANDS_STILL.store(false, Ordering::Relaxed);
    ann.keeps_playing().await;
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_server_leaves_a_replay_up_to_its_last_record() {
    let dir = Dir::new("killed");
    let arguments = ["--replays", dir.text()].map(str::to_owned);
    let serve = move || Process::serve(&arguments.each_ref().map(String::as_str), Stdio::inherit());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let mut ann = Client::join(process.address, "arena", "Ann").await;
    let mut bob = Client::join(process.address, "arena", "Bob").await;
    let played = async {
        // Play until the first block is in the file.
        while dir.replays().first().is_none_or(|replay| replay.last_tick() < 300) {
            play(&mut ann, &mut bob, 20).await;
        }
    };
    timeout(LONG, played).await.expect("a recorded block");
    process.signal("KILL");
    assert_eq!(process.exit_status().await, None);
    let replays = dir.replays();
    let [replay] = &replays[..] else { panic!("{} replays", replays.len()) };
    assert!(matches!(replay.ending(), Ending::Cut(_)));
    assert!(replay.last_tick().is_multiple_of(300), "{}", replay.last_tick());
    verify(replay).await;
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_error_is_logged_once_and_the_server_stops_cleanly() {
    let dir = Dir::new("told");
    let (file, log) = (dir.0.join("file"), dir.0.join("log"));
    fs::write(&file, "in the way").expect("a written file");
    // A file in place of the directory is refused at startup; a directory that cannot be created is only noticed later.
    let replays = file.join("replays");
    let arguments = ["--replays", replays.to_str().expect("plain characters")].map(str::to_owned);
    let out = Stdio::from(File::create(&log).expect("a file"));
    let serve = move || Process::serve(&arguments.each_ref().map(String::as_str), out);
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    for room in ["arena", "pile", "impulse"] {
        Client::join(process.address, room, "Ann").await.keeps_playing().await;
    }
    process.signal("TERM");
    assert_eq!(process.exit_status().await, Some(0));
    let log_text = fs::read_to_string(&log).expect("a log");
    let errors: Vec<_> = log_text.lines().filter(|line| line.contains("ERROR")).collect();
    assert_eq!(errors.len(), 1, "{log_text}");
    let path = file.to_str().expect("plain characters");
    assert!(errors[0].contains("CANNOT RECORD") && errors[0].contains(path), "{log_text}");
}
