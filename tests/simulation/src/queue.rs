//! Future events, ordered by time.

use super::store::{Bucket, Tail, Written};
use jostle_server::fleet::directory::Answer;
use jostle_server::fleet::entry::{Entry, Key, Revision};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::time::Duration;

/// One process of a node, from its start to its death.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Process {
    /// The node's number.
    pub node: usize,
    /// Number of the process at this node, counted from 0.
    pub life: u32,
}

#[derive(Clone, Debug)]
pub enum Event {
    /// An event occurs at a node.
    At(Process, NodeEvent),
    /// A request reaches the store.
    Arrives(Process, u64, Request),
    /// A node is started.
    Starts(usize),
    /// A node can reach the store again.
    CutEnds(Process),
    /// A frozen node resumes.
    GoesOn(Process),
    /// A room must be opened unless one with this code exists.
    Place(String),
    /// A room must end.
    End(String),
    /// A fault of the given kind starts.
    Fault(Fault),
}

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A node is cut off from the store.
    Cut,
    /// The store does not answer.
    Outage,
    /// The store fails and loses data.
    Forget,
    /// A whole node freezes.
    Freeze,
    /// A node's directory freezes.
    Stall,
    Death,
    /// A node begins to drain.
    Drain,
}

/// An event that occurs at a node.
#[derive(Clone, Debug)]
pub enum NodeEvent {
    /// The directory is polled.
    Poll,
    /// The node has connected to the store.
    Connected,
    /// The node's watcher for a bucket receives the writes up to now.
    Deliver(Bucket, u32),
    /// A request is answered.
    Reply(u64, Reply),
    /// The time limit of a request has passed.
    TimeLimit(u64),
    /// A room is ready to be played, or could not be opened.
    Opened(String, u64, bool),
    /// A room has written its final record.
    Parted(String, u64),
    /// A room writes a record.
    Record(String, u64),
    /// A room has ended.
    Over(String, u64),
}

/// A request to the store.
#[derive(Clone, Debug)]
pub enum Request {
    /// Writes or removes an entry.
    Put(Key, Option<Box<Entry>>, Revision),
    Look(Key),
    /// Reads all entries of a bucket and watches it from then on.
    Watch(Bucket, u32),
    /// Reads a room's newest record, from which the opened room will continue.
    ReadTail(String, u64),
    /// Appends a record, given the room's code, the number of the previous record, the writer, and the writer's epoch.
    Append(String, u64, u64, u64),
}

/// The answer to a request.
#[derive(Clone, Debug)]
pub enum Reply {
    Put(Answer),
    Found(Option<Box<(Entry, Revision)>>),
    /// The response to a watch: all entries and the number of the next write.
    Watching(Vec<Written>, u64),
    /// The newest record.
    Tail(Option<Tail>),
    /// The number of the appended record, if it was accepted.
    Appended(Option<u64>),
}

#[derive(Debug)]
struct Due {
    at: Duration,
    /// Scheduling order, which breaks ties between events at the same time.
    order: u64,
    event: Event,
}

/// The events that are still to come.
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

    /// Drops all requests in flight to the store.
    pub fn lose_requests(&mut self) {
        self.due.retain(|due| !matches!(due.event, Event::Arrives(..)));
    }

    /// Takes the earliest event that is due by the given time.
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
