//! The list of open rooms. A code that equals a scene's name belongs to that scene's standing room, which opens on
//! demand; other rooms are created with random codes. Rooms take themselves off the list once they are empty.

use crate::fleet::entry::RoomFacts;
use crate::fleet::lease::RoomLease;
use crate::host::clock::SystemClock;
use crate::host::room_handle::{AdminCommand, Host, Join, RoomHandle, RoomInfo, take_off};
use crate::host::room_shares::{NoRoomLeft, RoomShares};
use crate::host::thread_time;
use crate::host::ticker::{self, Ends, RoomOrigin};
use crate::host::{Phase, random};
use crate::limits;
use crate::limits::networks::network;
use crate::log::{HostNotes, SavedRoom, Seal, SharedLog};
use crate::ops::panic_log::ROOM_THREAD;
use jostle_game::Scene;
use jostle_protocol::limits::ROOM_CODE_BYTES_MAX;
use jostle_protocol::{Refusal, Token};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::mpsc::{TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::time::sleep;
use tracing::error;

/// Maximum number of operators' commands waiting for a room's next tick.
const COMMANDS_WAITING_MAX: usize = 16;

/// Letters and digits that are not easily confused.
const CODE_ALPHABET: &[u8; 31] = b"abcdefghjkmnpqrstuvwxyz23456789";
/// Length of a random code. There are 887 million codes.
const CODE_CHARS: usize = 6;

/// Delay before a command is sent again to a room whose queue is full. The queue is emptied in every tick.
const COMMAND_RETRY: Duration = Duration::from_millis(2);

/// All open rooms, and the scenes for new ones.
pub struct Rooms {
    scenes: Vec<Arc<Scene>>,
    host: Arc<Host>,
    /// Whether a directory decides which rooms are open on this server.
    in_fleet: bool,
    /// Maximum number of rooms that people may have open at once.
    max: usize,
    guests: RoomShares,
    /// Guests' scenes, by room code, for rooms that the fleet's directory is about to assign to this node.
    expected: Mutex<BTreeMap<String, Expected>>,
}

/// A guest's scene whose room is about to open.
struct Expected {
    scene: Arc<Scene>,
    creator: IpAddr,
    since: Instant,
}

/// The result of [`Rooms::adopt`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adopted {
    /// The room is open.
    Open,
    /// This node cannot open the room: it cannot start another thread, or does not know the scene.
    NotHere,
    /// No node can open the room, because its guest's scene is lost.
    Over,
}

/// A newly created room.
pub struct Created {
    /// The code in the room's link.
    pub code: String,
    /// Key that makes its holder the host.
    pub host_key: Token,
}

/// An error from [`Rooms::create`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CreateError {
    /// The scene does not exist.
    #[error("That scene doesn't exist.")]
    NoSuchScene(String),
    /// The address already has its full share of rooms open, which is this many.
    #[error(
        "Your network already has {0} rooms open, the maximum. Close one or try again in two minutes."
    )]
    TooManyOfAddress(usize),
    /// The maximum number of rooms is already open.
    #[error("This server already has its maximum of {0} rooms open. Try again later.")]
    TooMany(usize),
    /// The server is closing, or could not start a thread.
    #[error("The server isn't opening new rooms right now. Try again later.")]
    NotNow,
    /// The maximum number of rooms with guests' scenes is already open ([`limits::guest_rooms_max`]).
    #[error("This server already plays as many scenes of guests as it can. Try again later.")]
    TooManyGuests,
    /// The address's networks already have their full share of rooms with guests' scenes open.
    #[error(
        "Your network already has its share of the rooms for scenes of guests open. Close one, or try again in a moment."
    )]
    TooManyGuestsOfAddress,
    /// No node in the fleet has capacity for another room.
    #[error("All servers are full at the moment. Try again later.")]
    FleetFull,
}

impl From<NoRoomLeft> for CreateError {
    fn from(reason: NoRoomLeft) -> CreateError {
        match reason {
            NoRoomLeft::OfNetwork(max) => CreateError::TooManyOfAddress(max),
            NoRoomLeft::OfAll(max) => CreateError::TooMany(max),
        }
    }
}

impl Rooms {
    /// Creates an empty list on which people can create up to `max` rooms. In a fleet, only [`Rooms::adopt`] opens
    /// rooms.
    pub fn new(scenes: &[Scene], host: Arc<Host>, in_fleet: bool, max: usize) -> Rooms {
        let guests_max = limits::guest_rooms_max(limits::processors()).min(max);
        Rooms {
            scenes: scenes.iter().cloned().map(Arc::new).collect(),
            host,
            in_fleet,
            max,
            guests: RoomShares::of_guests(guests_max),
            expected: Mutex::default(),
        }
    }

    /// Maximum number of rooms that people may have open at once. The scenes' standing rooms do not count.
    pub fn max(&self) -> usize {
        self.max
    }

    /// The scenes, in the order in which they are offered.
    pub fn scenes(&self) -> &[Arc<Scene>] {
        &self.scenes
    }

    /// The open rooms, sorted by code.
    pub fn list(&self) -> Vec<Arc<RoomInfo>> {
        self.host.lock().values().map(|room| Arc::clone(&room.info)).collect()
    }

    /// Returns whether a session with this code would find a room.
    pub fn knows(&self, code: &str) -> bool {
        self.scene(code).is_some() || self.is_open(code)
    }

    /// Returns whether this room is open.
    pub fn is_open(&self, code: &str) -> bool {
        self.host.lock().contains_key(code)
    }

    /// Opens a room with a random code.
    pub fn create(
        &self,
        scene: &str,
        private: bool,
        creator: IpAddr,
    ) -> Result<Created, CreateError> {
        let Some(scene) = self.scene(scene) else {
            return Err(CreateError::NoSuchScene(scene.to_owned()));
        };
        let mut rooms = self.host.lock();
        self.check_created(&rooms, creator)?;
        self.create_in(&mut rooms, scene, private, false, creator)
    }

    /// Opens a room with a random code and a guest's scene.
    pub fn create_guest(
        &self,
        scene: &Arc<Scene>,
        private: bool,
        creator: IpAddr,
    ) -> Result<Created, CreateError> {
        let mut rooms = self.host.lock();
        self.check_created(&rooms, creator)?;
        self.check_guests(&rooms, creator)?;
        self.create_in(&mut rooms, scene, private, true, creator)
    }

    /// Checks whether [`Rooms::create_guest`] could currently open a room.
    pub fn check_guest(&self, creator: IpAddr) -> Result<(), CreateError> {
        if *self.host.phase.borrow() != Phase::Running {
            return Err(CreateError::NotNow);
        }
        let rooms = self.host.lock();
        // In a fleet, the directory counts all nodes' rooms.
        if !self.in_fleet {
            self.check_created(&rooms, creator)?;
        }
        self.check_guests(&rooms, creator)
    }

    /// Checks that a creator's networks may have one more room on this server.
    fn check_created(
        &self,
        rooms: &BTreeMap<String, RoomHandle>,
        creator: IpAddr,
    ) -> Result<(), CreateError> {
        let creators = rooms.values().filter_map(|room| room.info.creator);
        Ok(RoomShares::of_rooms(self.max).check(creators, creator)?)
    }

    fn check_guests(
        &self,
        rooms: &BTreeMap<String, RoomHandle>,
        creator: IpAddr,
    ) -> Result<(), CreateError> {
        let expected = self.expected();
        let open = rooms.values().filter(|room| room.info.guest);
        let creators = open.filter_map(|room| room.info.creator);
        let creators = creators.chain(expected.values().map(|expected| expected.creator));
        self.guests.check(creators, creator).map_err(|reason| match reason {
            NoRoomLeft::OfNetwork(_) => CreateError::TooManyGuestsOfAddress,
            NoRoomLeft::OfAll(_) => CreateError::TooManyGuests,
        })
    }

    fn create_in(
        &self,
        rooms: &mut BTreeMap<String, RoomHandle>,
        scene: &Arc<Scene>,
        private: bool,
        guest: bool,
        creator: IpAddr,
    ) -> Result<Created, CreateError> {
        let creator = Some(network(creator));
        let code = self.free_code(private, |code| rooms.contains_key(code));
        let info = RoomInfo::new(&code, random(), private, creator, scene);
        let room = self.open(RoomInfo { guest, ..info }).ok_or(CreateError::NotNow)?;
        let host_key = self.host.signer.host_key(room.info.number);
        rooms.insert(code.clone(), room);
        Ok(Created { code, host_key })
    }

    /// A random unused code.
    pub fn free_code(&self, private: bool, is_taken: impl Fn(&str) -> bool) -> String {
        let chars = if private { limits::PRIVATE_CODE_CHARS } else { CODE_CHARS };
        loop {
            let code = random_code(chars, random);
            if !is_taken(&code) && self.scene(&code).is_none() {
                return code;
            }
        }
    }

    /// Hands a session to a room, first opening a standing room if needed. The room answers through the session's
    /// outbox. An error means that no room took the session.
    pub fn join(&self, code: &str, join: Join) -> Result<Arc<RoomInfo>, Refusal> {
        let mut rooms = self.host.lock();
        if !rooms.contains_key(code) {
            if self.in_fleet {
                return Err(Refusal::Moving);
            }
            let scene = self.scene(code).ok_or(Refusal::NoSuchRoom)?;
            let info = RoomInfo::new(code, random(), false, None, scene);
            let room = self.open(info).ok_or(Refusal::ServerFull)?;
            rooms.insert(code.to_owned(), room);
        }
        let room = &rooms[code];
        match room.joins.try_send(join) {
            Ok(()) => Ok(Arc::clone(&room.info)),
            Err(TrySendError::Full(_)) => Err(Refusal::ServerFull),
            Err(TrySendError::Disconnected(_)) => Err(Refusal::RoomFailed),
        }
    }

    /// The room with this code, if it is open.
    pub fn get(&self, code: &str) -> Option<Arc<RoomInfo>> {
        self.host.lock().get(code).map(|room| Arc::clone(&room.info))
    }

    /// Gives up a room whose thread does not respond: its sessions end, its records are removed, and its code is freed.
    /// The thread cannot be ended from outside; it ends when it wakes.
    pub fn give_up(&self, info: &Arc<RoomInfo>) {
        // This comes first, so that a thread that wakes in the meantime starts no new file.
        info.given_up.cancel();
        let Some(room) = take_off(&mut self.host.lock(), info) else { return };
        room.shared.inspect(|shared| shared.seal(Seal::Remove));
    }

    /// Sends a command to a room; returns `false` if the room does not exist or its queue is full.
    pub fn command(&self, code: &str, command: AdminCommand) -> bool {
        self.host.lock().get(code).is_some_and(|room| room.commands.try_send(command).is_ok())
    }

    /// Sends a command to a room, if the room is open. Returns the command if the room's queue is full.
    pub fn try_command(&self, code: &str, command: AdminCommand) -> Option<AdminCommand> {
        match self.host.lock().get(code)?.commands.try_send(command) {
            Err(TrySendError::Full(command)) => Some(command),
            Ok(()) | Err(TrySendError::Disconnected(_)) => None,
        }
    }

    /// Sends a command to a room, retrying until the room's queue accepts it or the room has ended.
    pub async fn insist(&self, code: &str, mut command: AdminCommand) {
        while let Some(refused) = self.try_command(code, command) {
            command = refused;
            sleep(COMMAND_RETRY).await;
        }
    }

    /// Waits for all rooms' threads, which end when the server closes.
    pub fn wait(&self) {
        let rooms = std::mem::take(&mut *self.host.lock());
        for room in rooms.into_values() {
            // If the room panicked, that has already been logged.
            let _ = room.thread.join();
        }
    }

    /// The scene with this name.
    pub fn scene(&self, name: &str) -> Option<&Arc<Scene>> {
        self.scenes.iter().find(|scene| scene.name == name)
    }

    fn open(&self, info: RoomInfo) -> Option<RoomHandle> {
        if *self.host.phase.borrow() != Phase::Running {
            return None;
        }
        self.start(info, None, None, RoomOrigin::New(random()))
    }

    /// Keeps a guest's scene for a room that the fleet's directory is about to assign to this node.
    pub fn expect_guest(&self, code: &str, scene: &Arc<Scene>, creator: IpAddr) {
        let scene = Arc::clone(scene);
        let expected = Expected { scene, creator, since: Instant::now() };
        self.expected().insert(code.to_owned(), expected);
    }

    pub fn forget_guest(&self, code: &str) {
        self.expected().remove(code);
    }

    /// The expected scenes. Drops those whose rooms should have opened long ago.
    fn expected(&self) -> MutexGuard<'_, BTreeMap<String, Expected>> {
        let mut expected = self.expected.lock().unwrap_or_else(PoisonError::into_inner);
        expected.retain(|_, expected| expected.since.elapsed() < limits::FLEET_OPEN);
        expected
    }

    /// Opens a room that the fleet's directory assigns to this node, using the saved state if there is any. A new room
    /// needs its scene, and every room needs a thread. The room seals its `shared` log when it ends on this node.
    pub fn adopt(
        &self,
        code: &str,
        facts: &RoomFacts,
        saved: Option<SavedRoom>,
        lease: RoomLease,
        shared: Arc<SharedLog>,
    ) -> Adopted {
        let mut rooms = self.host.lock();
        if rooms.contains_key(code) || rooms.len() >= self.max + self.scenes.len() {
            return Adopted::NotHere;
        }
        let new = || match facts.guest {
            true => self.expected().remove(code).map(|expected| expected.scene),
            false => self.scene(&facts.scene).cloned(),
        };
        let Some(scene) = saved.as_ref().map(|saved| Arc::clone(&saved.scene)).or_else(new) else {
            return if facts.guest { Adopted::Over } else { Adopted::NotHere };
        };
        let info = RoomInfo::new(code, facts.number, facts.private, facts.creator, &scene);
        let info = RoomInfo { guest: facts.guest, ..info };
        let origin = saved
            .map_or_else(|| RoomOrigin::New(random()), |saved| RoomOrigin::Saved(saved.into()));
        match self.start(info, Some(lease), Some(shared), origin) {
            Some(room) => {
                rooms.insert(code.to_owned(), room);
                Adopted::Open
            }
            None => Adopted::NotHere,
        }
    }

    /// Moves a room to another incarnation of this node.
    pub fn resume(&self, code: &str, incarnation: u64) {
        let rooms = self.host.lock();
        if let Some(lease) = rooms.get(code).and_then(|room| room.lease.as_ref()) {
            lease.renew(incarnation);
        }
    }

    /// Reopens the rooms from the previous process. Each catches up to its last tick on its own thread.
    pub fn restore(&self, saved: Vec<SavedRoom>) {
        let mut rooms = self.host.lock();
        for saved in saved {
            let HostNotes { number, private, creator, guest, .. } = saved.notes;
            let info = RoomInfo::new(&saved.code, number, private, creator, &saved.scene);
            let info = RoomInfo { guest, ..info };
            let code = saved.code.clone();
            if let Some(room) = self.start(info, None, None, RoomOrigin::Saved(saved.into())) {
                rooms.insert(code, room);
            }
        }
    }

    /// Starts a room's thread; `None` if that fails. In a fleet, the stream's reader already has the room's log.
    fn start(
        &self,
        info: RoomInfo,
        lease: Option<RoomLease>,
        of_stream: Option<Arc<SharedLog>>,
        origin: RoomOrigin,
    ) -> Option<RoomHandle> {
        let info = Arc::new(info);
        let guest = info.guest;
        let shared = self.host.logs.share(&info.code, info.number, info.private, of_stream);
        let (sender, receiver) = sync_channel(limits::JOINS_WAITING_MAX);
        let (commands, commanded) = sync_channel(COMMANDS_WAITING_MAX);
        let ends = Ends {
            host: Arc::clone(&self.host),
            info: Arc::clone(&info),
            joins: receiver,
            commands: commanded,
            lease: lease.clone(),
            shared: shared.clone(),
        };
        let spawned = std::thread::Builder::new()
            .name(format!("{ROOM_THREAD}{}", info.code))
            .spawn(move || {
                if guest {
                    thread_time::go_after_others(limits::GUEST_NICENESS);
                }
                ticker::run(&ends, origin, &mut SystemClock::of_this_thread());
            })
            .inspect_err(|error| error!(room = %info.code, %error, "no thread for a room"));
        let Ok(thread) = spawned else {
            shared.inspect(|shared| shared.seal(Seal::Leave));
            return None;
        };
        Some(RoomHandle { info, joins: sender, commands, lease, shared, thread })
    }
}

/// Returns whether a path segment looks like a room code.
pub fn is_code(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    (1..=ROOM_CODE_BYTES_MAX).contains(&text.len()) && text.bytes().all(allowed)
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
    fn only_lower_case_words_are_codes() {
        for code in ["arena", "k7f3q2", "d1-herd", &"a".repeat(ROOM_CODE_BYTES_MAX)] {
            assert!(is_code(code), "{code}");
        }
        let long = "a".repeat(ROOM_CODE_BYTES_MAX + 1);
        for text in ["", "Arena", "..", "a/b", "a.html", "%61", "a b", "é", &long] {
            assert!(!is_code(text), "{text}");
        }
    }
}
