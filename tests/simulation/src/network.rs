//! Messages between nodes and the store.

use super::node::{Node, PlayedRoom, RoomState};
use super::queue::{Event, NodeEvent, Process, Reply, Request};
use super::settings::Violation;
use super::store::{BUCKETS, Bucket, Written};
use super::{Simulation, TIME_LIMIT};
use jostle_server::fleet::directory::Answer;
use jostle_server::fleet::entry::{Entry, Key, Revision};
use std::collections::BTreeSet;
use std::time::Duration;

impl Simulation {
    /// Sends a node's request to the store.
    pub(super) fn send(&mut self, process: Process, request: Request) {
        let number = self.number();
        let (now, delay) = (self.now, self.delay());
        let lost = self.chance(self.settings.faults.lost);
        // A message in flight when the connection breaks may arrive once the connection is restored.
        let late = self.chance(100).then(|| self.seconds(0.0, 10.0));
        let forgot = self.store.forgot();
        let Some(node) = self.node(process) else { return };
        let (is_cut, is_connected) = (node.is_cut, node.store == forgot);
        let limit = node.after(now, TIME_LIMIT);
        node.requests.insert(number, request.clone());
        self.queue.push(limit, Event::At(process, NodeEvent::TimeLimit(number)));
        let arrives = Event::Arrives(process, number, request);
        match (is_cut || lost, late) {
            // A driver sends nothing over a broken connection.
            _ if !is_connected => {}
            (false, _) => self.queue.push(now + delay, arrives),
            (true, Some(late)) => self.queue.push(now + late, arrives),
            (true, None) => {}
        }
    }

    /// Handles a request that arrives at the store.
    pub(super) fn arrives(
        &mut self,
        process: Process,
        number: u64,
        request: Request,
    ) -> Result<(), Violation> {
        if self.now < self.store_back_at {
            if self.chance(500) {
                let at = self.store_back_at + self.delay();
                self.queue.push(at, Event::Arrives(process, number, request));
            }
            return Ok(());
        }
        let reply = self.serve(request)?;
        let lost = self.chance(self.settings.faults.lost);
        let at = self.now + self.delay();
        if !lost && self.node(process).is_some_and(|node| !node.is_cut) {
            self.queue.push(at, Event::At(process, NodeEvent::Reply(number, reply)));
        }
        Ok(())
    }

    fn serve(&mut self, request: Request) -> Result<Reply, Violation> {
        let now = self.now;
        Ok(match request {
            Request::Put(key, entry, expected) => {
                let written = entry.as_deref().cloned();
                let answer = self.store.put(&key, entry.map(|entry| *entry), expected, now);
                if let Answer::Done(_) = answer {
                    self.check_write(&key, written.as_ref())?;
                    self.wake_watchers(Bucket::of(&key));
                }
                Reply::Put(answer)
            }
            Request::Look(key) => Reply::Found(self.store.look(&key, now).map(Box::new)),
            Request::Watch(bucket, _) => {
                let (found, next) = self.store.snapshot(bucket, now);
                Reply::Watching(found, next)
            }
            Request::ReadTail(code, _) => Reply::Tail(self.store.tail(&code)),
            Request::Append(code, expected, writer, epoch) => {
                Reply::Appended(self.store.append(&code, expected, writer, epoch))
            }
        })
    }

    fn wake_watchers(&mut self, bucket: Bucket) {
        for index in 0..self.nodes.len() {
            self.wake(index, bucket);
        }
        if self.store.end(bucket).is_multiple_of(1000) {
            let next = |node: &Node| node.watch.next[bucket as usize];
            let oldest = self.nodes.iter().flatten().filter_map(next).min();
            self.store.forget(bucket, oldest.unwrap_or(0));
        }
    }

    /// Schedules the delivery of new writes to a watcher.
    pub(super) fn wake(&mut self, index: usize, bucket: Bucket) {
        let Some(node) = &mut self.nodes[index] else { return };
        let pending = &mut node.watch.pending[bucket as usize];
        if node.is_cut || node.watch.next[bucket as usize].is_none() || *pending {
            return;
        }
        *pending = true;
        let deliver = NodeEvent::Deliver(bucket, node.watch.round);
        let process = node.process;
        let at = self.now.max(self.store_back_at) + self.delay();
        self.queue.push(at, Event::At(process, deliver));
    }

    /// Sends a watcher all writes up to now.
    pub(super) fn deliver(&mut self, process: Process, bucket: Bucket, round: u32) {
        let end = self.store.end(bucket);
        let skip = self.rng.below(2) == 0;
        let Some(node) = &mut self.nodes[process.node] else { return };
        if node.watch.round != round {
            return;
        }
        node.watch.pending[bucket as usize] = false;
        if node.is_cut {
            return;
        }
        let Some(next) = node.watch.next[bucket as usize].replace(end) else { return };
        for number in next..end {
            let (written, is_outdated) = self.store.written(bucket, number);
            if is_outdated && skip {
                continue;
            }
            let change = written.change();
            let sent = [written.clone()];
            self.store.deliver(bucket, &sent);
            node.directory.changed(change, node.clock(self.now));
        }
    }

    /// Handles a node's reconnection to the store by repeating the requests that its rooms are waiting for.
    pub(super) fn connected(&mut self, process: Process) {
        let (now, forgot) = (self.now, self.store.forgot());
        let Some(node) = self.node(process) else { return };
        let unanswered = std::mem::take(&mut node.requests);
        let is_other = std::mem::replace(&mut node.store, forgot) != forgot;
        node.directory.connected(is_other, node.clock(now));
        self.watch(process);
        for request in unanswered.into_values() {
            if matches!(request, Request::ReadTail(..) | Request::Append(..)) {
                self.timed_out(process, request);
            }
        }
    }

    /// Starts new watchers for a node.
    fn watch(&mut self, process: Process) {
        let Some(node) = self.node(process) else { return };
        node.watch.round += 1;
        node.watch.next = [None; 2];
        node.watch.pending = [false; 2];
        let round = node.watch.round;
        for bucket in BUCKETS {
            self.send(process, Request::Watch(bucket, round));
        }
    }

    /// Handles the start of a watcher, which sends the node all entries.
    pub(super) fn watching(
        &mut self,
        process: Process,
        bucket: Bucket,
        found: Vec<Written>,
        next: u64,
    ) {
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        let clock = node.clock(now);
        let is_there = |written: &&Written| written.entry.is_some();
        let present = found.iter().filter(is_there).map(|written| written.key.clone());
        let present: BTreeSet<Key> = present.collect();
        for written in found {
            node.directory.changed(written.change(), clock);
        }
        node.watch.next[bucket as usize] = Some(next);
        match bucket {
            Bucket::Nodes => node.directory.synced_nodes(&present, clock),
            Bucket::Rooms => node.directory.synced_rooms(&present, clock),
        }
        // More writes may have arrived in the meantime.
        self.wake(process.node, bucket);
    }

    /// Handles a request that was not answered in time.
    pub(super) fn timed_out(&mut self, process: Process, request: Request) {
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        let clock = node.clock(now);
        match request {
            Request::Put(key, ..) => node.directory.answered(key, Answer::Unknown, clock),
            Request::Look(key) => node.directory.look_failed(&key, clock),
            Request::Watch(bucket, round) if round == node.watch.round => {
                self.send(process, Request::Watch(bucket, round));
            }
            // A lost record is superseded by the next one, so only a room that is still opening tries again.
            Request::ReadTail(code, number) => {
                if node.room(&code, number).is_some() {
                    self.send(process, Request::ReadTail(code, number));
                }
            }
            Request::Append(code, expected, writer, epoch) => {
                let opening = |room: &&mut PlayedRoom| room.state == RoomState::Opening;
                if node.room(&code, writer).filter(opening).is_some() {
                    self.send(process, Request::Append(code, expected, writer, epoch));
                }
            }
            Request::Watch(..) => {}
        }
    }

    /// Handles the response to a look.
    pub(super) fn found(
        &mut self,
        process: Process,
        key: Key,
        found: Option<Box<(Entry, Revision)>>,
    ) {
        let now = self.now;
        let Some(node) = self.node(process) else { return };
        node.directory.looked(key, found.map(|found| *found), node.clock(now));
    }

    /// Returns a random message latency, usually milliseconds and rarely seconds.
    pub(super) fn delay(&mut self) -> Duration {
        match self.rng.below(200) {
            0 => self.seconds(0.3, 3.0),
            1..10 => self.seconds(0.02, 0.3),
            _ => self.seconds(0.0002, 0.02),
        }
    }
}
