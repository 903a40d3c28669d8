//! The driver of a simulated node, which carries out the directory's actions and plays the rooms.

use super::node::{Node, PlayedRoom, RoomState, Watch};
use super::queue::{Event, NodeEvent, Process, Reply, Request};
use super::settings::Violation;
use super::store::Tail;
use super::{POLL_EVERY, RECORD_EVERY, Simulation};
use jostle_server::fleet::directory::{
    Action, Directory, LEASE_TTL, Load, NodeSettings, ROOM_COST, RoomEvent,
};
use jostle_server::fleet::entry::{RoomCounts, RoomEntry, RoomFacts};
use std::collections::BTreeMap;
use std::time::Duration;

/// Time after which a room ends if it was reopened even though it had already ended.
const OVER_AFTER: Duration = Duration::from_secs(3);

impl Simulation {
    /// Starts a node that is not running.
    pub(super) fn start(&mut self, index: usize) {
        if self.nodes[index].is_some() {
            return;
        }
        let process = Process { node: index, life: self.lives[index] };
        self.lives[index] += 1;
        let skew = self.settings.faults.skew;
        let skew = f64::from(self.rng.range(-skew, skew.max(f32::MIN_POSITIVE)));
        let settings = NodeSettings {
            name: format!("node-{index}"),
            url: format!("https://node-{index}.example.org"),
            capacity: (self.settings.rooms_max + 1) as f64 * ROOM_COST,
            incarnation: u64::from(self.rng.next_u32()) << 20,
            secret_mark: 0,
        };
        self.nodes[index] = Some(Node {
            process,
            directory: Directory::new(settings),
            born: self.now,
            rate: 1.0 + skew,
            lease: (0, Duration::ZERO),
            rooms: BTreeMap::new(),
            requests: BTreeMap::new(),
            watch: Watch::default(),
            store: self.store.forgot(),
            is_cut: false,
            standstill: None,
            backlog: Vec::new(),
            draining: false,
            left: false,
            measures_at: Duration::ZERO,
            ended: BTreeMap::new(),
        });
        self.connected(process);
        self.queue.push(self.now, Event::At(process, NodeEvent::Poll));
    }

    /// Handles an event at a node.
    pub(super) fn at_node(&mut self, process: Process, event: NodeEvent) -> Result<(), Violation> {
        let Some(node) = self.node(process) else { return Ok(()) };
        if node.standstill.is_some() {
            node.backlog.push(event);
            return Ok(());
        }
        match event {
            NodeEvent::Poll => self.poll(process),
            NodeEvent::Connected => self.connected(process),
            NodeEvent::Deliver(bucket, round) => self.deliver(process, bucket, round),
            NodeEvent::TimeLimit(number) => {
                if let Some(request) = node.requests.remove(&number) {
                    self.timed_out(process, request);
                }
            }
            NodeEvent::Reply(number, reply) => {
                if let Some(request) = node.requests.remove(&number) {
                    self.replied(process, request, reply);
                }
            }
            NodeEvent::Opened(code, number, well) => self.opened(process, code, number, well)?,
            NodeEvent::Parted(code, number) => self.parted(process, &code, number),
            NodeEvent::Record(code, number) => self.record(process, code, number),
            NodeEvent::Over(code, number) => self.over(process, &code, number),
        }
        self.drive(process)
    }

    fn poll(&mut self, process: Process) {
        let now = self.now;
        let rooms_max = self.settings.rooms_max;
        let Some(node) = self.node(process) else { return };
        let clock = node.clock(now);
        if clock >= node.measures_at {
            node.measures_at = clock + Duration::from_secs(1);
            let counts = |code: &String| RoomCounts {
                code: code.clone(),
                players: 8,
                connected: 7,
                spectators: 0,
            };
            let load = Load {
                used: node.rooms.len() as f64 * ROOM_COST,
                rooms_left: rooms_max.saturating_sub(node.directory.holds()),
                rooms: node.rooms.keys().map(counts).collect(),
            };
            node.directory.measured(load);
        }
        node.directory.poll(clock);
        if node.draining && !node.left && node.directory.holds() == 0 {
            node.left = true;
            node.directory.leave();
        }
        let next = node.after(now, POLL_EVERY);
        self.queue.push(next, Event::At(process, NodeEvent::Poll));
    }

    fn replied(&mut self, process: Process, request: Request, reply: Reply) {
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        let clock = node.clock(now);
        match (request, reply) {
            (Request::Put(key, ..), Reply::Put(answer)) => {
                node.directory.answered(key, answer, clock);
            }
            (Request::Look(key), Reply::Found(found)) => self.found(process, key, found),
            (Request::Watch(bucket, round), Reply::Watching(found, next)) => {
                if round == node.watch.round {
                    self.watching(process, bucket, found, next);
                }
            }
            (Request::ReadTail(code, number), Reply::Tail(tail)) => {
                self.read_tail(process, code, number, tail);
            }
            (Request::Append(code, _, number, _), Reply::Appended(accepted)) => {
                self.appended(process, code, number, accepted);
            }
            (request, reply) => unreachable!("{reply:?} to {request:?}"),
        }
    }

    /// Carries out the actions of a node's directory and checks the node's rooms.
    pub(super) fn drive(&mut self, process: Process) -> Result<(), Violation> {
        let mut began = false;
        while let Some(node) = self.node(process) {
            let actions = node.directory.take_actions();
            if actions.is_empty() {
                break;
            }
            for action in actions {
                began |= matches!(action, Action::Lease(..) | Action::Resume(..));
                self.act(process, action)?;
            }
        }
        if began { self.check_rooms_of(process.node) } else { Ok(()) }
    }

    fn act(&mut self, process: Process, action: Action) -> Result<(), Violation> {
        let Some(node) = self.node(process) else { return Ok(()) };
        match action {
            Action::Write(key, entry, revision) => {
                self.send(process, Request::Put(key, Some(Box::new(entry)), revision));
            }
            Action::Remove(key, revision) => self.send(process, Request::Put(key, None, revision)),
            Action::Look(key) => self.send(process, Request::Look(key)),
            Action::Lease(incarnation, until) => node.lease = (incarnation, until),
            Action::Resume(code) => {
                let incarnation = node.lease.0;
                let Some(room) = node.rooms.get_mut(&code) else { return Ok(()) };
                room.held_under = incarnation;
                room.epoch += 1;
                let number = room.number;
                if self.ended.contains(&code) {
                    // This is an empty room that was written back by a node unaware that it had ended.
                    let over = NodeEvent::Over(code, number);
                    self.queue.push(self.now + OVER_AFTER, Event::At(process, over));
                }
            }
            Action::Open(code, entry) => return self.open(process, code, &entry),
            Action::Part(code) => {
                let took = self.seconds(0.005, 0.1);
                if let Some(room) = self.node(process).and_then(|node| node.rooms.get_mut(&code)) {
                    room.state = RoomState::Parting;
                    let parted = NodeEvent::Parted(code, room.number);
                    self.queue.push(self.now + took, Event::At(process, parted));
                }
            }
            Action::Stop(code, _) => self.stop(process, &code),
        }
        Ok(())
    }

    fn open(&mut self, process: Process, code: String, entry: &RoomEntry) -> Result<(), Violation> {
        let number = self.number();
        let fails = self.chance(self.settings.faults.opening_fails);
        let (at, rooms_max) = (self.now + self.seconds(0.05, 1.0), self.settings.rooms_max);
        let Some(node) = self.node(process) else { return Ok(()) };
        if node.ended.get(&code).is_some_and(|epoch| *epoch >= entry.epoch) {
            return Err(self.violation(format!("{code} is opened again where it ended")));
        }
        let room = PlayedRoom {
            number,
            epoch: entry.epoch,
            held_under: entry.owner.incarnation,
            state: RoomState::Opening,
            last: 0,
        };
        let is_full = node.rooms.len() >= rooms_max;
        node.rooms.insert(code.clone(), room);
        if fails || is_full {
            let failed = NodeEvent::Opened(code, number, false);
            self.queue.push(at, Event::At(process, failed));
        } else {
            self.send(process, Request::ReadTail(code, number));
        }
        Ok(())
    }

    fn read_tail(&mut self, process: Process, code: String, number: u64, tail: Option<Tail>) {
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        let clock = node.clock(now);
        let Some(room) = node.room(&code, number) else { return };
        if tail.is_some_and(|tail| tail.epoch > room.epoch) {
            node.directory.outdated(&code, tail.map_or(0, |tail| tail.epoch), clock);
            return;
        }
        let sequence = tail.map_or(0, |tail| tail.sequence);
        let append = Request::Append(code, sequence, number, room.epoch);
        self.send(process, append);
    }

    fn appended(&mut self, process: Process, code: String, number: u64, accepted: Option<u64>) {
        let at = self.now + self.seconds(0.05, 1.0);
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        let clock = node.clock(now);
        let Some(room) = node.room(&code, number) else { return };
        let Some(sequence) = accepted else {
            return node.directory.room(&code, RoomEvent::Fenced, clock);
        };
        room.last = sequence;
        if room.state == RoomState::Opening {
            let opened = NodeEvent::Opened(code, number, true);
            self.queue.push(at, Event::At(process, opened));
        }
    }

    fn opened(
        &mut self,
        process: Process,
        code: String,
        number: u64,
        well: bool,
    ) -> Result<(), Violation> {
        let now = self.now;
        let is_over = self.ended.contains(&code);
        let Some(node) = self.node(process) else { return Ok(()) };
        let clock = node.clock(now);
        let Some(room) = node.room(&code, number) else { return Ok(()) };
        if !well {
            node.rooms.remove(&code);
            node.directory.room(&code, RoomEvent::OpenFailed, clock);
            return Ok(());
        }
        room.state = RoomState::Playing;
        node.directory.room(&code, RoomEvent::Opened, clock);
        self.playing.entry(code.clone()).or_default().insert(process.node);
        self.check_room(&code)?;
        if let Some(lost_at) = self.lost_at.remove(&code) {
            self.gaps.push(now - lost_at);
        }
        if is_over {
            self.queue.push(now + OVER_AFTER, Event::At(process, NodeEvent::Over(code, number)));
        } else {
            let record = NodeEvent::Record(code, number);
            self.queue.push(now + RECORD_EVERY, Event::At(process, record));
        }
        Ok(())
    }

    fn parted(&mut self, process: Process, code: &str, number: u64) {
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        if node.room(code, number).is_some() {
            let clock = node.clock(now);
            node.rooms.remove(code);
            node.directory.room(code, RoomEvent::Parted, clock);
            self.ceases(process.node, code);
        }
    }

    fn record(&mut self, process: Process, code: String, number: u64) {
        let (now, ignores) = (self.now, self.settings.flaws.ignores_lease);
        let Some(node) = self.node(process) else { return };
        let plays = node.plays(&code, now, ignores);
        let Some(room) = node.room(&code, number) else { return };
        let (epoch, last) = (room.epoch, room.last);
        if plays {
            self.send(process, Request::Append(code.clone(), last, number, epoch));
        }
        let next = now + RECORD_EVERY;
        self.queue.push(next, Event::At(process, NodeEvent::Record(code, number)));
    }

    fn over(&mut self, process: Process, code: &str, number: u64) {
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        if let Some(room) = node.room(code, number) {
            let epoch = room.epoch;
            let clock = node.clock(now);
            node.ended.insert(code.to_owned(), epoch);
            node.rooms.remove(code);
            node.directory.room(code, RoomEvent::Ended, clock);
            self.store.forget_records(code);
            self.ceases(process.node, code);
        }
    }

    fn stop(&mut self, process: Process, code: &str) {
        if let Some(node) = self.node(process) {
            node.rooms.remove(code);
        }
        self.ceases(process.node, code);
    }

    /// Records that a node no longer has a room open.
    pub(super) fn ceases(&mut self, node: usize, code: &str) {
        if let Some(nodes) = self.playing.get_mut(code) {
            nodes.remove(&node);
        }
    }

    /// Opens a room at some node, retrying until a room with this code exists.
    pub(super) fn place(&mut self, code: String) -> Result<(), Violation> {
        let is_there = |epoch: &u64| *epoch > 0;
        if self.epochs.get(&code).is_some_and(is_there) || self.ended.contains(&code) {
            return Ok(());
        }
        let at = self.now + self.seconds(1.0, 3.0);
        self.queue.push(at, Event::Place(code.clone()));
        let Some(process) = self.some_node(0) else { return Ok(()) };
        let facts = RoomFacts {
            scene: "arena".into(),
            number: 1,
            private: false,
            creator: None,
            guest: false,
        };
        let (now, forgot) = (self.now, self.store.forgot() > 0);
        let Some(node) = self.node(process) else { return Ok(()) };
        // A process that has just started does not know that the store may have lost a standing room.
        if forgot && now < node.born + LEASE_TTL.mul_f64(1.1) {
            return Ok(());
        }
        let clock = node.clock(now);
        // If the room cannot be placed now, another node will be tried soon.
        let _ = node.directory.place(&code, facts, clock);
        self.drive(process)
    }

    /// Ends a room at the node that plays it.
    pub(super) fn end(&mut self, code: String) -> Result<(), Violation> {
        let (now, ignores) = (self.now, self.settings.flaws.ignores_lease);
        let nodes = self.nodes.iter().flatten();
        let player = nodes.into_iter().find(|node| node.plays(&code, now, ignores));
        let Some(node) = player else {
            self.queue.push(now + Duration::from_secs(1), Event::End(code));
            return Ok(());
        };
        let (process, number) = (node.process, node.rooms[&code].number);
        self.ended.insert(code.clone());
        self.at_node(process, NodeEvent::Over(code, number))
    }
}
