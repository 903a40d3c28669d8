//! Checks that if a room's thread hangs while other rooms keep playing, the room is detected, keeps its players, and
//! can be closed.

use crate::client::{Client, LONG};
use crate::http::{admin, get};
use crate::replays::Dir;
use crate::server::Server;
use jostle_game::{Buttons, Scene};
use jostle_protocol::{Refusal, VERSION};
use jostle_server::Config;
use jostle_server::limits::{INBOX_MAX, MESSAGES_BURST_MAX, MESSAGES_PER_SECOND_MAX, Timeouts};
use jostle_server::log::{StateSettings, Sync};
use jostle_tests::server::{OPS_TOKEN, PATIENT, patient};
use serde_json::Value;
use std::sync::{Condvar, LazyLock, Mutex, MutexGuard};
use std::thread::{ThreadId, current};
use std::time::Duration;
use tokio::time::{sleep, timeout};
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::{Interest, set_global_default};
use tracing::{Event, Metadata, Subscriber};

/// The room whose thread is blocked.
const ROOM: &str = "still";
const THREAD: &str = "room still";

static GATE: LazyLock<Gate> = LazyLock::new(Gate::default);

/// Blocks the room's thread the next time it logs something, which is between two steps of its work.
#[derive(Default)]
struct Gate {
    state: Mutex<State>,
    opened: Condvar,
}

#[derive(Default)]
struct State {
    is_shut: bool,
    held: Option<ThreadId>,
    /// Number of lines logged by the thread since it was blocked.
    said_since: u32,
}

impl Gate {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no panic under the lock")
    }

    async fn until(&self, what: &str, wanted: impl Fn(&State) -> bool) {
        let reached = async {
            while !wanted(&self.lock()) {
                sleep(Duration::from_millis(5)).await;
            }
        };
        timeout(LONG, reached).await.unwrap_or_else(|_| panic!("{what} in time"));
    }

    fn open(&self) {
        self.lock().is_shut = false;
        self.opened.notify_all();
    }
}

/// Passes log lines to the gate.
struct Lines;

impl Subscriber for Lines {
    fn register_callsite(&self, line: &'static Metadata<'static>) -> Interest {
        if self.enabled(line) { Interest::always() } else { Interest::never() }
    }

    fn enabled(&self, line: &Metadata<'_>) -> bool {
        line.target().starts_with("jostle_server::host::ticker")
    }

    fn event(&self, _: &Event<'_>) {
        if current().name() != Some(THREAD) {
            return;
        }
        let (mut state, thread) = (GATE.lock(), current().id());
        if state.held == Some(thread) {
            state.said_since += 1;
        } else if state.is_shut && state.held.is_none() {
            state.held = Some(thread);
            drop(GATE.opened.wait_while(state, |state| state.is_shut));
        }
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// Configuration of a server whose rooms must answer an operator within 0.3 s.
fn config(state: &Dir) -> Config {
    let mut config = patient();
    let scene = config.scenes[0].source.clone();
    config.scenes.push(Scene::parse(&format!("{ROOM}.toml"), &scene).expect("a shipped scene"));
    let state = Some(StateSettings { dir: state.path().to_owned(), sync: Sync::System });
    let waits = Timeouts { command: Duration::from_millis(300), ..PATIENT };
    Config { waits, state, ops_token: Some(OPS_TOKEN.to_owned()), ..config }
}

async fn listed(server: &Server, code: &str) -> Option<Value> {
    let rooms = admin(server.ops, "GET", "rooms").await.json();
    let mut rooms = rooms["rooms"].as_array().expect("a list").iter();
    rooms.find(|room| room["code"] == code).cloned()
}

async fn oldest_tick(server: &Server) -> f64 {
    let text = String::from_utf8(get(server.ops, "/metrics").await.body).expect("text");
    let age = text.lines().find_map(|line| line.strip_prefix("jostle_room_tick_age_seconds "));
    age.expect("the metric").parse().expect("a number")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_room_that_stands_still_is_seen_keeps_its_players_and_can_be_closed() {
    set_global_default(Lines).expect("no other test reads the log");
    let dir = Dir::new("still-room");
    let mut server = Server::start_with(config(&dir)).await;
    let mut ann = Client::join(server.address, ROOM, "Ann").await;
    let mut cid = Client::join(server.address, "arena", "Cid").await;
    // The thread blocks while seating Bob.
    GATE.lock().is_shut = true;
    let mut bob = Client::connect(server.address, ROOM).await;
    bob.hello(VERSION, "Bob", None).await;
    GATE.until("a room that is held", |state| state.held.is_some()).await;

    // More messages than the room's inbox holds, but no more than a session may send.
    for sent in 0..INBOX_MAX + 20 {
        ann.input(Buttons::default(), None).await;
        if sent > MESSAGES_BURST_MAX as usize - 20 {
            sleep(Duration::from_secs(1) / MESSAGES_PER_SECOND_MAX).await;
        }
    }
    // Ann's session answers this rather than the room.
    ann.tick().await;
    cid.keeps_playing().await;
    let still = listed(&server, ROOM).await.expect("a listed room");
    let arena = listed(&server, "arena").await.expect("a listed room");
    let age = |room: &Value| room["tick_age_seconds"].as_f64().expect("seconds");
    assert!(still["players"].is_null() && age(&still) > age(&arena), "{still} {arena}");
    assert!(oldest_tick(&server).await >= age(&still), "the metric is that of the room");

    let answer = admin(server.ops, "POST", &format!("rooms/{ROOM}/close")).await;
    let text = String::from_utf8_lossy(&answer.body);
    assert!(answer.status == 200 && text.contains("did not answer"), "{text}");
    ann.is_refused(Refusal::RoomFailed).await;
    bob.is_refused(Refusal::RoomFailed).await;
    assert!(listed(&server, ROOM).await.is_none());

    // From now on, the name belongs to a new room, whatever the old thread does when it wakes.
    let mut dan = Client::join(server.address, ROOM, "Dan").await;
    GATE.open();
    GATE.until("the end of the old thread", |state| state.said_since > 0).await;
    let mut eve = Client::join(server.address, ROOM, "Eve").await;
    let both = |room: &jostle_protocol::Snapshot| room.players.len() == 2;
    eve.until("both in one room", both).await;
    dan.keeps_playing().await;
    server.stop();
    server.ended().await;
    assert!(dir.path().join("rooms").join(format!("{ROOM}.jostle")).exists(), "Dan's room");
}
