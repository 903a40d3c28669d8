//! The events to come, in the order of their times.

use super::store::{Bucket, Tail, Written};
use jostle_server::fleet::directory::Answer;
use jostle_server::fleet::entry::{Entry, Key, Revision};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::time::Duration;

/// One process of a node, from its start to its death.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Process {
    /// Number of the node.
    pub node: usize,
    /// Number of its process, from 0.
    pub life: u32,
}

#[derive(Clone, Debug)]
pub enum Event {
    /// A node does or hears something.
    At(Process, NodeEvent),
    /// A request reaches the store.
    Arrives(Process, u64, Request),
    /// A node is started.
    Starts(usize),
    /// A node is in reach of the store again.
    CutEnds(Process),
    /// A node that stood still goes on.
    GoesOn(Process),
    /// A room is to be opened, if there is none of this code.
    Place(String),
    /// A room is to end.
    End(String),
    /// A fault of this kind begins.
    Fault(Fault),
}

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A node is cut off from the store.
    Cut,
    /// The store does not answer.
    Outage,
    /// The store fails, and forgets.
    Forget,
    /// A node stands still.
    Freeze,
    /// A node's directory stands still.
    Stall,
    Death,
    /// A node begins to drain.
    Drain,
}

/// Something that a node does or hears.
#[derive(Clone, Debug)]
pub enum NodeEvent {
    /// Its directory is polled.
    Poll,
    /// It has connected to the store.
    Connected,
    /// Its watcher of a bucket is sent the writes so far.
    Deliver(Bucket, u32),
    /// The answer to a request.
    Reply(u64, Reply),
    /// The time limit of a request.
    TimeLimit(u64),
    /// A room is ready to be played, or could not be opened.
    Opened(String, u64, bool),
    /// A room has written its last record.
    Parted(String, u64),
    /// A room writes a record.
    Record(String, u64),
    /// A room is over.
    Over(String, u64),
}

/// A request to the store.
#[derive(Clone, Debug)]
pub enum Request {
    /// Writes an entry, or removes it.
    Put(Key, Option<Box<Entry>>, Revision),
    Look(Key),
    /// Reads all entries of a bucket, and watches it from there on.
    Watch(Bucket, u32),
    /// Reads the newest record of a room, which this opened room is to continue.
    ReadTail(String, u64),
    /// Appends a record: code, number of the record before, writer and its epoch.
    Append(String, u64, u64, u64),
}

/// The answer to a request.
#[derive(Clone, Debug)]
pub enum Reply {
    Put(Answer),
    Found(Option<Box<(Entry, Revision)>>),
    /// To a watch: the entries, and the number of the next write.
    Watching(Vec<Written>, u64),
    /// The newest record.
    Tail(Option<Tail>),
    /// The number of a record, if it was accepted.
    Appended(Option<u64>),
}

#[derive(Debug)]
struct Due {
    at: Duration,
    /// Of equal times, the order in which they were scheduled.
    order: u64,
    event: Event,
}

/// The events to come.
#[derive(Debug, Default)]
pub struct Queue {
    due: BinaryHeap<Due>,
    count: u64,
}

impl Queue {
    pub fn push(&mut self, at: Duration, event: Event) {
        self.count += 1;
        self.due.push(Due { at, order: self.count, event });
    }

    /// Nothing that is on its way to the store arrives.
    pub fn lose_requests(&mut self) {
        self.due.retain(|due| !matches!(due.event, Event::Arrives(..)));
    }

    /// Takes the first event that is due by this time.
    pub fn pop(&mut self, until: Duration) -> Option<(Duration, Event)> {
        let is_due = self.due.peek().is_some_and(|due| due.at <= until);
        is_due.then(|| self.due.pop().map(|due| (due.at, due.event))).flatten()
    }
}

impl PartialEq for Due {
    fn eq(&self, other: &Due) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Due {}

impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Due) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Due {
    fn cmp(&self, other: &Due) -> Ordering {
        (other.at, other.order).cmp(&(self.at, self.order))
    }
}
