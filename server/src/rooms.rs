//! The list of open rooms. A code that is a scene's name is that scene's standing room and opens on
//! demand; others are created with a random code. Rooms take themselves off the list when empty.

use crate::limits;
use crate::metrics::Metrics;
use crate::peers::network;
use crate::replays::Recording;
use crate::seal::Sealer;
use crate::ticker::{Door, Join, Order, Ticker};
use crate::{Config, Phase};
use jostle_protocol::limits::ROOM_CODE_BYTES_MAX;
use jostle_protocol::{Refusal, Token};
use jostle_sim::Scene;
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::atomic::{AtomicU32, AtomicUsize};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::watch;
use tracing::error;

/// Letters and digits that nobody mistakes for each other.
const CODE_ALPHABET: &[u8; 31] = b"abcdefghjkmnpqrstuvwxyz23456789";
/// Characters of a random code: 887 million codes.
const CODE_CHARS: usize = 6;

/// What others may know about an open room.
pub struct Facts {
    /// The word in its link.
    pub code: String,
    /// Drawn at random when it opened: no other room, of no other time either, has it.
    pub number: u64,
    /// Only who was given its link knows of it: it is in no list, and is not recorded.
    pub private: bool,
    /// Its scene.
    pub scene: Arc<Scene>,
    /// Newest tick.
    pub tick: AtomicU32,
    /// Seats taken.
    pub players: AtomicUsize,
    /// Bodies in its world.
    pub bodies: AtomicUsize,
}

/// All open rooms, and the scenes to open more of.
pub struct Rooms {
    scenes: Vec<Arc<Scene>>,
    empty_grace: Duration,
    hearing: Duration,
    phase: watch::Receiver<Phase>,
    recording: Option<Arc<Recording>>,
    metrics: Arc<Metrics>,
    sealer: Arc<Sealer>,
    open: Mutex<BTreeMap<String, Open>>,
}

struct Open {
    facts: Arc<Facts>,
    joins: SyncSender<Join>,
    orders: SyncSender<Order>,
    /// Who created it; `None` for a standing room.
    creator: Option<IpAddr>,
    thread: JoinHandle<()>,
}

/// A room that somebody created.
pub struct Created {
    /// The word in its link.
    pub code: String,
    /// Makes its holder the host.
    pub host_key: Token,
}

/// Why no room was created.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CreateError {
    /// There is no such scene.
    #[error("there is no scene {0:?}; GET /api/scenes lists them")]
    NoSuchScene(String),
    /// One address has enough rooms.
    #[error("{max} rooms from one address are open, which is the limit; close one first", max = limits::ADDRESS_ROOMS_MAX)]
    TooManyOfAddress,
    /// There are enough rooms.
    #[error("{max} rooms are open, which is the limit of this server; try again later", max = limits::ROOMS_MAX)]
    TooMany,
    /// The server is about to end, or has no thread left.
    #[error("the server opens no rooms now; try again later")]
    NotNow,
}

impl Rooms {
    /// No rooms yet. Those that open are recorded if there is a way to.
    pub fn new(
        config: Config,
        phase: watch::Receiver<Phase>,
        recording: Option<Arc<Recording>>,
        metrics: Arc<Metrics>,
        sealer: Arc<Sealer>,
    ) -> Arc<Rooms> {
        let scenes = config.scenes.into_iter().map(Arc::new).collect();
        let (empty_grace, hearing) = (config.waits.room_empty, config.waits.hearing);
        let open = Mutex::default();
        Arc::new(Rooms { scenes, empty_grace, hearing, phase, recording, metrics, sealer, open })
    }

    /// The scenes, in the order in which they are offered.
    pub fn scenes(&self) -> &[Arc<Scene>] {
        &self.scenes
    }

    /// Open rooms in the order of their codes.
    pub fn list(&self) -> Vec<Arc<Facts>> {
        self.lock().values().map(|open| Arc::clone(&open.facts)).collect()
    }

    /// Whether a session with this code would find a room.
    pub fn knows(&self, code: &str) -> bool {
        self.scene(code).is_some() || self.lock().contains_key(code)
    }

    /// Opens a room with a random code.
    pub fn create(
        self: &Arc<Self>,
        scene: &str,
        private: bool,
        creator: IpAddr,
    ) -> Result<Created, CreateError> {
        let Some(scene) = self.scene(scene) else {
            return Err(CreateError::NoSuchScene(scene.to_owned()));
        };
        let creator = network(creator);
        let mut open = self.lock();
        let created = open.values().filter_map(|open| open.creator);
        if created.clone().filter(|address| *address == creator).count()
            >= limits::ADDRESS_ROOMS_MAX
        {
            return Err(CreateError::TooManyOfAddress);
        }
        if created.count() >= limits::ROOMS_MAX {
            return Err(CreateError::TooMany);
        }
        let chars = if private { limits::PRIVATE_CODE_CHARS } else { CODE_CHARS };
        let code = loop {
            let code = random_code(chars, random);
            if !open.contains_key(&code) && self.scene(&code).is_none() {
                break code;
            }
        };
        let room = self.open(&code, scene, private, Some(creator)).ok_or(CreateError::NotNow)?;
        let host_key = self.sealer.host_key(room.facts.number);
        open.insert(code.clone(), room);
        Ok(Created { code, host_key })
    }

    /// Hands a session to a room, which is opened if it is a standing one. The room answers through
    /// the session's outbox; an error here means that no room took it.
    pub fn join(self: &Arc<Self>, code: &str, join: Join) -> Result<Arc<Facts>, Refusal> {
        let mut rooms = self.lock();
        if !rooms.contains_key(code) {
            let scene = self.scene(code).ok_or(Refusal::NoSuchRoom)?;
            let room = self.open(code, scene, false, None).ok_or(Refusal::ServerFull)?;
            rooms.insert(code.to_owned(), room);
        }
        let room = &rooms[code];
        match room.joins.try_send(join) {
            Ok(()) => Ok(Arc::clone(&room.facts)),
            Err(TrySendError::Full(_)) => Err(Refusal::ServerFull),
            Err(TrySendError::Disconnected(_)) => Err(Refusal::RoomFailed),
        }
    }

    /// Passes an order on to a room; `false` if there is none, or it has enough to do.
    pub fn order(&self, code: &str, order: Order) -> bool {
        self.lock().get(code).is_some_and(|room| room.orders.try_send(order).is_ok())
    }

    /// Takes an empty room off the list, or returns a session that is just joining it.
    pub fn retire(&self, facts: &Facts, joins: &Receiver<Join>) -> Option<Join> {
        // Sessions join under this lock, so none can slip in between the look and the removal.
        let mut rooms = self.lock();
        let join = joins.try_recv().ok();
        if join.is_none() {
            rooms.remove(&facts.code);
        }
        join
    }

    /// Takes a room off the list whatever happens to it.
    pub fn remove(&self, facts: &Facts) {
        self.lock().remove(&facts.code);
    }

    /// Waits for the threads of all rooms; they end by themselves when the server closes.
    pub fn wait(&self) {
        let rooms = std::mem::take(&mut *self.lock());
        for room in rooms.into_values() {
            // A room that failed has told so.
            let _ = room.thread.join();
        }
    }

    fn scene(&self, name: &str) -> Option<&Arc<Scene>> {
        self.scenes.iter().find(|scene| scene.name == name)
    }

    fn open(
        self: &Arc<Self>,
        code: &str,
        scene: &Arc<Scene>,
        private: bool,
        creator: Option<IpAddr>,
    ) -> Option<Open> {
        if *self.phase.borrow() != Phase::Running {
            return None;
        }
        let facts = Arc::new(Facts {
            code: code.to_owned(),
            number: random(),
            private,
            scene: Arc::clone(scene),
            tick: AtomicU32::new(0),
            players: AtomicUsize::new(0),
            bodies: AtomicUsize::new(0),
        });
        let (sender, receiver) = sync_channel(limits::JOINS_WAITING_MAX);
        let (orders, ordered) = sync_channel(limits::ORDERS_WAITING_MAX);
        let recording = self.recording.clone().filter(|_| !private);
        let ticker = Ticker {
            facts: Arc::clone(&facts),
            rooms: Arc::clone(self),
            joins: receiver,
            orders: ordered,
            phase: self.phase.clone(),
            empty_grace: self.empty_grace,
            hearing: self.hearing,
            seed: random(),
            members: Vec::new(),
            door: Door::default(),
            closed: false,
            recording,
            metrics: Arc::clone(&self.metrics),
            sealer: Arc::clone(&self.sealer),
        };
        let spawned = std::thread::Builder::new()
            .name(format!("room {code}"))
            .spawn(move || ticker.run())
            .inspect_err(|error| error!(room = %code, %error, "no thread for a room"));
        Some(Open { facts, joins: sender, orders, creator, thread: spawned.ok()? })
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Open>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether a path segment could be a room's code at all.
pub fn is_code(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    (1..=ROOM_CODE_BYTES_MAX).contains(&text.len()) && text.bytes().all(allowed)
}

/// A random number that nobody can guess.
pub fn random() -> u64 {
    getrandom::u64().expect("the system's random source worked when the server started")
}

/// A key that nobody can guess.
pub fn random_key() -> [u8; 32] {
    let mut key = [0; 32];
    getrandom::fill(&mut key).expect("the system's random source worked when the server started");
    key
}

fn random_code(chars: usize, mut random: impl FnMut() -> u64) -> String {
    let base = CODE_ALPHABET.len() as u64;
    (0..chars).map(|_| char::from(CODE_ALPHABET[(random() % base) as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_codes_are_codes_and_differ() {
        let chars = limits::PRIVATE_CODE_CHARS;
        let mut codes: Vec<_> = (0..1000).map(|_| random_code(chars, random)).collect();
        assert!(codes.iter().all(|code| is_code(code) && code.len() == chars));
        codes.sort();
        codes.dedup();
        assert_eq!(codes.len(), 1000);
    }

    #[test]
    fn only_words_are_codes() {
        for code in ["arena", "k7f3q2", "d1-herd", &"a".repeat(ROOM_CODE_BYTES_MAX)] {
            assert!(is_code(code), "{code}");
        }
        let long = "a".repeat(ROOM_CODE_BYTES_MAX + 1);
        for text in ["", "Arena", "..", "a/b", "a.html", "%61", "a b", "é", &long] {
            assert!(!is_code(text), "{text}");
        }
    }
}
