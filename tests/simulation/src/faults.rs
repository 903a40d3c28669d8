//! Faults and when they happen.

use super::Simulation;
use super::node::Standstill;
use super::queue::{Event, Fault, NodeEvent, Process};
use super::settings::Violation;
use super::store::{BUCKETS, FORGOTTEN_MAX};
use jostle_server::fleet::directory::LEASE_TTL;
use jostle_server::fleet::entry::Entry;
use std::collections::BTreeMap;
use std::time::Duration;

const FAULTS: [Fault; 7] = [
    Fault::Cut,
    Fault::Outage,
    Fault::Forget,
    Fault::Freeze,
    Fault::Stall,
    Fault::Death,
    Fault::Drain,
];

impl Simulation {
    /// Schedules starts, rooms and the first faults.
    pub(super) fn plan(&mut self) {
        for node in 0..self.settings.nodes {
            let at = self.seconds(0.0, 3.0);
            self.queue.push(at, Event::Starts(node));
        }
        let half = self.settings.faulty_for.as_secs_f32() / 2.0;
        for room in 0..self.settings.rooms {
            let code = format!("room-{room}");
            let at = self.seconds(0.0, half);
            self.queue.push(at, Event::Place(code.clone()));
            if room < self.settings.ending {
                let at = at + self.seconds(10.0, half);
                self.queue.push(at, Event::End(code));
            }
        }
        for fault in FAULTS {
            self.plan_fault(fault);
        }
    }

    fn plan_fault(&mut self, fault: Fault) {
        let faults = &self.settings.faults;
        let rate = match fault {
            Fault::Cut => faults.cuts,
            Fault::Outage => faults.outages,
            Fault::Forget => faults.forgets,
            Fault::Freeze => faults.freezes,
            Fault::Stall => faults.stalls,
            Fault::Death => faults.deaths,
            Fault::Drain => faults.drains,
        };
        if rate > 0.0 {
            let at = self.now + self.seconds(0.0, 120.0 / rate);
            self.queue.push(at, Event::Fault(fault));
        }
    }

    /// Starts a fault of the given kind, unless the period with faults is over.
    pub(super) fn fault(&mut self, fault: Fault) -> Result<(), Violation> {
        if self.now >= self.settings.faulty_for {
            return Ok(());
        }
        self.plan_fault(fault);
        if fault == Fault::Outage {
            self.store_back_at = self.now + self.seconds(4.0, 7.0);
            return Ok(());
        }
        if fault == Fault::Forget {
            self.forget();
            return Ok(());
        }
        let first = if fault == Fault::Drain { self.settings.lasting } else { 0 };
        let Some(process) = self.some_node(first) else { return Ok(()) };
        match fault {
            Fault::Cut => self.cut(process),
            Fault::Freeze => self.stand_still(process, Standstill::Whole),
            Fault::Stall => self.stand_still(process, Standstill::Directory),
            Fault::Death => self.die_for_a_while(process.node),
            Fault::Drain => return self.drain(process.node),
            Fault::Outage | Fault::Forget => {}
        }
        Ok(())
    }

    /// Ends all ongoing faults.
    pub(super) fn end_faults(&mut self) {
        let faults = &mut self.settings.faults;
        faults.lost = 0;
        faults.opening_fails = 0;
        self.store_back_at = self.store_back_at.min(self.now);
        let processes = self.nodes.iter().flatten().map(|node| node.process);
        for process in processes.collect::<Vec<_>>() {
            self.queue.push(self.now, Event::CutEnds(process));
            self.queue.push(self.now, Event::GoesOn(process));
        }
    }

    /// Picks a random running node, starting from number `first`.
    pub(super) fn some_node(&mut self, first: usize) -> Option<Process> {
        let range = first..self.nodes.len();
        if range.is_empty() {
            return None;
        }
        let index = first + self.rng.below(range.len() as u32) as usize;
        self.nodes[index].as_ref().map(|node| node.process)
    }

    fn cut(&mut self, process: Process) {
        let end = self.now + self.seconds(0.5, 30.0);
        if let Some(node) = self.node(process) {
            node.is_cut = true;
            self.queue.push(end, Event::CutEnds(process));
        }
    }

    /// Handles a node that can reach the store again: either its watchers continue, or it reconnects.
    pub(super) fn cut_ends(&mut self, process: Process) {
        let again = self.rng.below(2) == 0;
        let forgot = self.store.forgot();
        let Some(node) = self.node(process) else { return };
        if !std::mem::replace(&mut node.is_cut, false) {
            return;
        }
        if again || node.store != forgot {
            self.queue.push(self.now, Event::At(process, NodeEvent::Connected));
        } else {
            for bucket in BUCKETS {
                self.wake(process.node, bucket);
            }
        }
    }

    /// Makes the store fail, along with all connections, and return without its most recent writes or without any of
    /// its data.
    fn forget(&mut self) {
        if self.chance(300) {
            self.store.lose_all();
        } else {
            let mut count = || self.rng.below(FORGOTTEN_MAX as u32) as usize;
            let (writes, records) = ([count(), count() / 5], count());
            self.store.lose(writes, records);
        }
        self.store_back_at = self.now + self.seconds(0.1, 8.0);
        self.queue.lose_requests();
        for index in 0..self.nodes.len() {
            let back_at = self.store_back_at + self.seconds(0.0, 3.0);
            let Some(node) = &mut self.nodes[index] else { continue };
            node.is_cut = true;
            node.watch.next = [None; 2];
            // Rooms that had ended may exist again.
            node.ended.clear();
            self.queue.push(back_at, Event::CutEnds(node.process));
        }
        self.epochs_are_forgotten();
    }

    /// Places rooms again whose entries the store has lost, unless a node writes them back.
    fn epochs_are_forgotten(&mut self) {
        let rooms = self.store.rooms().filter_map(|(code, entry)| match entry {
            Entry::Room(entry) => Some((code.to_owned(), entry.epoch)),
            Entry::Node(_) => None,
        });
        let known: BTreeMap<String, u64> = rooms.collect();
        for (code, epoch) in &mut self.epochs {
            let before = std::mem::replace(epoch, known.get(code).copied().unwrap_or(0));
            // The epoch may also be higher, because the store may have lost a removal and the epochs before it.
            if *epoch != before {
                self.forgotten.insert(code.clone());
            }
            if *epoch == 0 {
                self.queue.push(self.now + LEASE_TTL, Event::Place(code.clone()));
            }
        }
    }

    fn stand_still(&mut self, process: Process, standstill: Standstill) {
        let end = self.now + self.seconds(0.5, 30.0);
        if let Some(node) = self.node(process)
            && node.standstill.is_none()
        {
            node.standstill = Some(standstill);
            self.queue.push(end, Event::GoesOn(process));
        }
    }

    /// Lets a frozen node resume and handle its backlog all at once.
    pub(super) fn goes_on(&mut self, process: Process) -> Result<(), Violation> {
        let Some(node) = self.node(process) else { return Ok(()) };
        if node.standstill.take().is_none() {
            return Ok(());
        }
        let backlog = std::mem::take(&mut node.backlog);
        self.check_rooms_of(process.node)?;
        for event in backlog {
            self.at_node(process, event)?;
        }
        Ok(())
    }

    fn die_for_a_while(&mut self, node: usize) {
        let returns = node < self.settings.lasting || self.chance(600);
        let back_at = self.now + self.seconds(1.0, 30.0);
        self.die(node);
        if returns {
            self.queue.push(back_at.min(self.settings.faulty_for), Event::Starts(node));
        }
    }

    pub fn die(&mut self, node: usize) {
        let Some(dead) = self.nodes[node].take() else { return };
        for code in dead.rooms.keys() {
            self.ceases(node, code);
            self.lost_at.entry(code.clone()).or_insert(self.now);
        }
    }

    /// Makes a node start to drain.
    pub fn drain(&mut self, node: usize) -> Result<(), Violation> {
        let now = self.now;
        let Some(node) = &mut self.nodes[node] else { return Ok(()) };
        node.draining = true;
        let process = node.process;
        node.directory.drain(node.clock(now));
        self.drive(process)
    }

    /// Restarts a stopped node under its old name.
    pub fn revive(&mut self, node: usize) {
        self.queue.push(self.now, Event::Starts(node));
    }

    /// Makes the store unresponsive for `time`.
    pub fn lose_leader(&mut self, time: Duration) {
        self.store_back_at = self.now + time;
    }
}
