//! Measures one node's directory in a fleet too large to simulate as a whole. The other nodes exist only as entries.

use crate::processor_time;
use anyhow::{Result, ensure};
use jostle_server::fleet::directory::{
    Action, Answer, CLAIM_STEP, Change, Directory, LEASE_TTL, Load, NodeSettings, RENEW_EVERY,
    RoomEvent,
};
use jostle_server::fleet::entry::{
    Entry, Key, NodeEntry, Owner, Revision, RoomCounts, RoomEntry, RoomFacts,
};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;
use std::collections::BTreeSet;
use std::time::Duration;

#[global_allocator]
static MEMORY: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Time between two polls.
const POLL_EVERY: Duration = Duration::from_millis(100);
/// One in this many nodes is lost.
const ZONE: usize = 3;

/// Measures the cost of the first node's directory and prints it.
pub fn run(nodes: usize, rooms: usize) -> Result<()> {
    let memory = Region::new(MEMORY);
    let mut one = One::new(nodes, rooms)?;
    let stats = memory.change();
    println!("one of {nodes} nodes with {rooms} rooms each");
    println!("  memory: {:.1} MB", (stats.bytes_allocated - stats.bytes_deallocated) as f64 / 1e6);
    let renewals: Vec<Vec<u8>> = (1..nodes).map(|node| one.renewal(node)).collect::<Result<_>>()?;
    let (parsing, hearing) = one.hear_renewals(&renewals)?;
    println!(
        "  renewals: {:.1} ms of a processor a second, and {:.1} ms to read them",
        1e3 * hearing,
        1e3 * parsing
    );
    one.lose_zone(nodes, rooms)
}

struct One {
    directory: Directory,
    rooms: usize,
    now: Duration,
    revision: Revision,
}

impl One {
    fn new(nodes: usize, rooms: usize) -> Result<One> {
        let directory = Directory::new(NodeSettings {
            name: name(0),
            url: url(0),
            capacity: 10.0,
            incarnation: 1,
            secret_mark: 0,
        });
        let mut one = One { directory, rooms, now: Duration::ZERO, revision: 0 };
        one.directory.measured(Load { used: 1.0, rooms_left: rooms, rooms: counts(0, rooms) });
        one.directory.poll(one.now);
        one.directory.answered(Key::Node(name(0)), Answer::Done(1), one.now);
        for node in 1..nodes {
            one.hear(Key::Node(name(node)), entry(node, rooms));
        }
        one.directory
            .synced_nodes(&(0..nodes).map(|node| Key::Node(name(node))).collect(), one.now);
        let mut present = BTreeSet::new();
        for (node, room) in (0..nodes).flat_map(|node| (0..rooms).map(move |room| (node, room))) {
            present.insert(Key::Room(code(node, room)));
            one.hear(Key::Room(code(node, room)), room_of(node, 1));
        }
        one.directory.synced_rooms(&present, one.now);
        for room in 0..rooms {
            one.directory.room(&code(0, room), RoomEvent::Opened, one.now);
        }
        one.directory.take_actions();
        ensure!(one.directory.holds() == rooms, "it holds its rooms");
        Ok(one)
    }

    fn hear(&mut self, key: Key, entry: Entry) {
        self.revision += 1;
        self.directory.changed(Change::Written(key, entry, self.revision), self.now);
    }

    /// Encodes a lease renewal.
    fn renewal(&self, node: usize) -> Result<Vec<u8>> {
        let Entry::Node(entry) = entry(node, self.rooms) else { unreachable!("it is a node's") };
        Ok(serde_json::to_vec(&entry)?)
    }

    /// Lets every other node renew its lease once. Returns the processor seconds per second spent decoding, and those
    /// spent in the directory.
    fn hear_renewals(&mut self, renewals: &[Vec<u8>]) -> Result<(f64, f64)> {
        let began = processor_time();
        let entries = renewals
            .iter()
            .map(|bytes| Ok(Entry::Node(serde_json::from_slice::<NodeEntry>(bytes)?)));
        let entries: Vec<Entry> = entries.collect::<Result<_>>()?;
        let read = processor_time();
        for (entry, node) in entries.into_iter().zip(1..) {
            self.hear(Key::Node(name(node)), entry);
        }
        self.poll_for(RENEW_EVERY);
        let heard = processor_time();
        let a_second = |time: Duration| time.as_secs_f64() / RENEW_EVERY.as_secs_f64();
        Ok((a_second(read - began), a_second(heard - read)))
    }

    /// Polls the directory for `time`; returns the processor time of the longest poll and the resulting actions.
    fn poll_for(&mut self, time: Duration) -> (Duration, Vec<Action>) {
        let (end, mut longest, mut actions) = (self.now + time, Duration::ZERO, Vec::new());
        while self.now < end {
            self.now += POLL_EVERY;
            let began = processor_time();
            self.directory.poll(self.now);
            longest = longest.max(processor_time() - began);
            for action in self.directory.take_actions() {
                // The node's own lease is renewed the whole time.
                match action {
                    Action::Write(Key::Node(node), ..) => {
                        self.revision += 1;
                        let answer = Answer::Done(self.revision);
                        self.directory.answered(Key::Node(node), answer, self.now);
                    }
                    action => actions.push(action),
                }
            }
        }
        (longest, actions)
    }

    /// Silences one in every [`ZONE`] nodes. As in a real fleet, the nodes nearest to a lost one report it; rooms that
    /// this node does not claim are claimed by others half a second later.
    fn lose_zone(&mut self, nodes: usize, rooms: usize) -> Result<()> {
        let alive: Vec<usize> = (1..nodes).filter(|node| node % ZONE != 0).collect();
        let lost: Vec<usize> = (1..nodes).filter(|node| node % ZONE == 0).collect();
        let mut actions = Vec::new();
        // The lost nodes' final renewals arrived before the final round of renewals ended.
        let silent_at = self.now - RENEW_EVERY + LEASE_TTL;
        while self.now <= silent_at {
            for node in &alive {
                self.hear(Key::Node(name(*node)), entry(*node, rooms));
            }
            let next = (self.now + RENEW_EVERY).min(silent_at + POLL_EVERY);
            actions = self.poll_for(next - self.now).1;
        }
        let looks = actions.iter().filter(|action| matches!(action, Action::Look(_))).count();
        let began = processor_time();
        for node in &lost {
            self.revision += 1;
            self.directory.changed(Change::Gone(Key::Node(name(*node)), self.revision), self.now);
        }
        let longest = processor_time() - began;
        let (poll, mut claims) = self.poll_for(CLAIM_STEP - POLL_EVERY);
        claims.extend(self.directory.take_actions());
        let claimed =
            claims.iter().filter(|action| matches!(action, Action::Write(Key::Room(_), ..)));
        let claimed = claimed.count();
        for (node, room) in lost.iter().flat_map(|node| (0..rooms).map(move |room| (*node, room))) {
            self.hear(Key::Room(code(node, room)), room_of(alive[room % alive.len()], 2));
        }
        let (poll_after, _) = self.poll_for(RENEW_EVERY);
        println!(
            "  a third is lost: {looks} looks, {claimed} of {} rooms claimed at once, {:.0} ms of a processor in \
             3 s, {:.0} ms at most without a pause",
            lost.len() * rooms,
            1e3 * (processor_time() - began).as_secs_f64(),
            1e3 * longest.max(poll).max(poll_after).as_secs_f64(),
        );
        Ok(())
    }
}

fn name(node: usize) -> String {
    format!("node-{node}")
}

fn url(node: usize) -> String {
    format!("https://node-{node}.play.example.org")
}

fn code(node: usize, room: usize) -> String {
    format!("room-{node}-{room}")
}

fn counts(node: usize, rooms: usize) -> Vec<RoomCounts> {
    let counts =
        |room| RoomCounts { code: code(node, room), players: 16, connected: 15, spectators: 0 };
    (0..rooms).map(counts).collect()
}

fn entry(node: usize, rooms: usize) -> Entry {
    Entry::Node(NodeEntry {
        incarnation: 1,
        url: url(node),
        draining: false,
        capacity: 10.0,
        used: 1.0,
        rooms_left: rooms,
        rooms: counts(node, rooms),
        secret_mark: None,
    })
}

fn room_of(node: usize, epoch: u64) -> Entry {
    Entry::Room(RoomEntry {
        owner: Owner { node: name(node), incarnation: 1 },
        epoch,
        room: RoomFacts {
            scene: "arena".into(),
            number: 1,
            private: false,
            creator: None,
            guest: false,
        },
    })
}
