//! Carries out the directory's decisions and reports events to the directory.

use super::link::NatsLink;
use super::publisher::Publisher;
use super::records::{Message, Published, RecordStream, Records, RoomRecords};
use super::store::Store;
use crate::fleet::directory::{Action, Answer, RETRY, RoomEvent};
use crate::fleet::entry::{RoomCounts, RoomEntry};
use crate::fleet::handle::Fleet;
use crate::fleet::lease::RoomLease;
use crate::fleet::settings::FleetSettings;
use crate::host::room_handle::{AdminCommand, Host};
use crate::host::rooms::{Adopted, Rooms};
use crate::limits;
use crate::log::{SavedRoom, Seal};
use async_nats::jetstream::Context;
use bytes::Bytes;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::task::{JoinSet, spawn_blocking};
use tokio::time::{Instant, interval, sleep, timeout};
use tracing::{error, info, warn};

/// Interval at which the directory is polled.
const POLL_EVERY: Duration = Duration::from_millis(100);
/// Interval between load measurements.
const MEASURE_EVERY: Duration = Duration::from_secs(1);
/// Interval at which to check whether a room's thread has ended.
const THREAD_LOOK: Duration = Duration::from_millis(2);

pub struct Driver {
    settings: FleetSettings,
    fleet: Arc<Fleet>,
    rooms: Arc<Rooms>,
    host: Arc<Host>,
    publisher: Arc<Publisher>,
}

/// The driver with its connection.
#[derive(Clone)]
struct Connected {
    link: Arc<NatsLink>,
    store: Store,
    records: Records,
    fleet: Arc<Fleet>,
    rooms: Arc<Rooms>,
    publisher: Arc<Publisher>,
}

impl Driver {
    /// Creates the driver for a node's rooms.
    pub fn new(
        settings: FleetSettings,
        fleet: Arc<Fleet>,
        rooms: Arc<Rooms>,
        host: Arc<Host>,
        publisher: Arc<Publisher>,
    ) -> Driver {
        Driver { settings, fleet, rooms, host, publisher }
    }

    /// Takes part in the fleet over this connection until the task is dropped.
    pub async fn run(self, context: Context) {
        let link = NatsLink::new(context, self.settings.clone(), Arc::clone(&self.fleet));
        let (store, records) = link.open().await;
        store.warn_of_one_copy();
        let connected = Connected {
            link: Arc::new(link),
            store,
            records,
            fleet: Arc::clone(&self.fleet),
            rooms: Arc::clone(&self.rooms),
            publisher: Arc::clone(&self.publisher),
        };
        // These tasks end when this one does.
        let mut tasks = JoinSet::new();
        let follows = connected.clone();
        tasks.spawn(async move { follows.link.follow(&follows.store).await });
        tasks.spawn(connected.act());
        tasks.spawn(self.poll());
        tasks.join_all().await;
    }

    /// Advances the directory's time, and measures the load.
    async fn poll(self) {
        let mut every = interval(POLL_EVERY);
        // The node registers with its full capacity.
        self.measured(0.0);
        let (mut measured_at, mut busy) = (Instant::now(), Duration::ZERO);
        loop {
            every.tick().await;
            let elapsed = measured_at.elapsed();
            if elapsed >= MEASURE_EVERY {
                let total = self.host.metrics.ticks.busy();
                let used = (total - busy).as_secs_f64() / elapsed.as_secs_f64();
                (measured_at, busy) = (Instant::now(), total);
                self.measured(used);
            }
            let urls = self.fleet.tell(|directory, now| {
                directory.poll(now);
                directory.urls().map(str::to_owned).collect()
            });
            self.host.neighbours.set(urls);
        }
    }

    fn measured(&self, used: f64) {
        let open = self.rooms.list();
        let rooms_left = self.rooms.max().saturating_sub(open.len());
        let public = open.iter().filter(|info| !info.private);
        let counts = public.map(|info| RoomCounts {
            code: info.code.clone(),
            players: info.players.load(Ordering::Relaxed),
            connected: info.connected.load(Ordering::Relaxed),
            spectators: info.spectators.load(Ordering::Relaxed),
        });
        self.fleet.measured(used, rooms_left, counts.collect());
    }
}

impl Connected {
    async fn act(self) {
        loop {
            let (connection, actions) = self.fleet.actions().await;
            for action in actions {
                self.carry_out(action, connection);
            }
        }
    }

    fn carry_out(&self, action: Action, connection: u64) {
        match action {
            Action::Lease(incarnation, until) => self.fleet.lease().set(incarnation, until),
            Action::Resume(code) => {
                let incarnation = self.fleet.ask(|directory| directory.owned_under(&code));
                incarnation.into_iter().for_each(|number| self.rooms.resume(&code, number));
            }
            Action::Stop(code, url) => {
                self.insist(code, AdminCommand::Leave(url.map(Into::into)));
            }
            Action::Part(code) => self.insist(code, AdminCommand::Part),
            Action::Open(code, entry) => drop(tokio::spawn(self.clone().open(code, entry))),
            Action::Write(..) | Action::Remove(..) | Action::Look(_) => {
                tokio::spawn(self.clone().exchange(action, connection));
            }
        }
    }

    /// Writes, removes or reads an entry over the connection with this number. An answer that arrives over a later
    /// connection could come from a store that has forgotten something reported over this one.
    async fn exchange(self, action: Action, connection: u64) {
        let (store, is_current) = (&self.store, self.link.is_current(connection));
        match action {
            Action::Write(key, entry, expected) => {
                let answer = match is_current {
                    true => store.write(&key, &entry, expected).await,
                    false => Answer::Unknown,
                };
                self.fleet.tell_over(connection, |directory, now| {
                    directory.answered(key, answer, now);
                });
            }
            Action::Remove(key, expected) => {
                let answer = match is_current {
                    true => store.remove(&key, expected).await,
                    false => Answer::Unknown,
                };
                self.fleet.tell_over(connection, |directory, now| {
                    directory.answered(key, answer, now);
                });
            }
            Action::Look(key) => {
                let found = match is_current {
                    true => store.look(&key).await.ok(),
                    false => None,
                };
                self.fleet.tell_over(connection, |directory, now| match found {
                    Some(found) => directory.looked(key, found, now),
                    None => directory.look_failed(&key, now),
                });
            }
            _ => {}
        }
    }

    /// Sends a command to a room. It is delivered unless the room ends first, even if the room's queue is briefly full.
    fn insist(&self, code: String, command: AdminCommand) {
        // Tried immediately, so that the command precedes the directory's next actions.
        let Some(command) = self.rooms.try_command(&code, command) else { return };
        let rooms = Arc::clone(&self.rooms);
        tokio::spawn(async move { rooms.insist(&code, command).await });
    }

    async fn open(self, code: String, entry: RoomEntry) {
        let opened = timeout(limits::FLEET_OPEN, self.try_open(&code, &entry)).await;
        match opened.unwrap_or_else(|_| Err("NATS does not answer".to_owned())) {
            Ok(Adopted::Over) => {
                warn!(room = %code, "a room is over: its node ended before the scene of its guest was kept");
            }
            Ok(_) => {
                info!(room = %code, epoch = entry.epoch, "the room is played here");
                self.fleet.tell(|directory, now| directory.room(&code, RoomEvent::Opened, now));
                if !self.fleet.ask(|directory| directory.holds_epoch(&code, entry.epoch)) {
                    self.insist(code, AdminCommand::Leave(None));
                }
            }
            Err(reason) => {
                error!(room = %code, reason, "a room of the fleet cannot be opened here");
                self.fleet.tell(|directory, now| directory.room(&code, RoomEvent::OpenFailed, now));
            }
        }
    }

    async fn try_open(&self, code: &str, entry: &RoomEntry) -> Result<Adopted, String> {
        while self.rooms.is_open(code) {
            sleep(THREAD_LOOK).await;
        }
        let records = self.take_over(code, entry.epoch).await?;
        let saved = match records.file {
            None => None,
            Some(file) => {
                let name = code.to_owned();
                let read = spawn_blocking(move || SavedRoom::from_bytes(name, file)).await;
                read.map_err(|error| error.to_string())?
                    .inspect_err(|reason| {
                        error!(room = %code, reason, "the records of a room cannot be read; it begins again");
                    })
                    .ok()
            }
        };
        let incarnation = self.fleet.ask(|directory| directory.owned_under(code));
        let incarnation = incarnation.ok_or("it went to another node meanwhile")?;
        let lease = RoomLease::new(Arc::clone(self.fleet.lease()), incarnation);
        let shared = self.publisher.open(&self.records, code, entry.epoch, records.last);
        let shared = shared.ok_or("the server ends")?;
        let adopted = self.rooms.adopt(code, &entry.room, saved, lease, Arc::clone(&shared));
        match adopted {
            Adopted::NotHere => {
                shared.seal(Seal::Leave);
                return Err(format!("no thread or no scene {:?}", entry.room.scene));
            }
            Adopted::Over => {
                shared.seal(Seal::Remove);
            }
            Adopted::Open => {}
        }
        Ok(adopted)
    }

    /// Reads a room's records, and shuts out the node that wrote them. An error means that this node is the late one.
    async fn take_over(&self, code: &str, epoch: u64) -> Result<RoomRecords, String> {
        loop {
            if let Ok(records) = self.records.read(code).await {
                if records.epoch > epoch {
                    self.fleet.tell(|directory, now| directory.outdated(code, records.epoch, now));
                    return Err("another node has begun to play it".to_owned());
                }
                let message = Message {
                    epoch,
                    writer: self.publisher.next_writer(),
                    from: records.from,
                    part: None,
                    payload: Bytes::new(),
                };
                if let Published::Done(last) =
                    self.records.publish(code, &message, records.last).await
                {
                    return Ok(RoomRecords { last, ..records });
                }
            } else {
                sleep(RETRY).await;
            }
        }
    }
}
