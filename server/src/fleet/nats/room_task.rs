//! The task for one room's records. It writes them to the stream one after another, and removes them when the room
//! ends.

use super::records::{Message, Published, RecordStream, Sequence, Tail, payloads};
use crate::fleet::directory::RETRY;
use crate::limits;
use crate::log::{LogReader, NextWrite, Seal};
use bytes::Bytes;
use jostle_protocol::replay::Record;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::time::{Instant, sleep, timeout};
use tracing::warn;

/// Time after which the attempt to write a batch of records is given up.
const FLEET_PUBLISH: Duration = Duration::from_secs(15);

/// A room's outcome, for the directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomOutcome {
    /// The room's final record has been written, for the node that continues the room.
    Parted,
    /// The room is over and its records have been removed.
    Ended,
    /// Another node has begun to play the room.
    Fenced,
}

/// Receives the outcome of the room with this code.
type Report = dyn Fn(&str, RoomOutcome) + Send + Sync;

/// State shared by all rooms' tasks.
pub struct RoomTaskContext {
    /// The next message number. Each process starts at a random one.
    next_writer: AtomicU64,
    report: Box<Report>,
}

impl RoomTaskContext {
    /// Numbers messages from `first_writer` upwards, and reports rooms' outcomes.
    pub fn new(
        first_writer: u64,
        report: impl Fn(&str, RoomOutcome) + Send + Sync + 'static,
    ) -> RoomTaskContext {
        RoomTaskContext { next_writer: AtomicU64::new(first_writer), report: Box::new(report) }
    }

    /// A unique message number.
    pub fn next_writer(&self) -> u64 {
        self.next_writer.fetch_add(1, Ordering::Relaxed)
    }
}

/// The task for one room.
pub struct RoomTask<S> {
    shared: Arc<RoomTaskContext>,
    stream: S,
    code: String,
    epoch: u64,
    /// The room's last message.
    last: Sequence,
    /// Numbers of the messages sent since then. An abandoned message may still be written while the connection to NATS
    /// holds it.
    sent: Vec<u64>,
    /// The first message of the newest complete file; 0 if there is no file yet.
    from: Sequence,
    /// Whether another node has begun to play the room.
    shut_out: bool,
    /// Whether the stream has forgotten part of the current file.
    forgotten: bool,
    /// The reason why the previous attempt failed.
    reason: String,
}

impl<S: RecordStream> RoomTask<S> {
    /// Creates the task for a room whose last message is `last`, on a node that writes under this epoch of the room's
    /// entry.
    pub fn new(
        shared: Arc<RoomTaskContext>,
        stream: S,
        code: &str,
        epoch: u64,
        last: Sequence,
    ) -> RoomTask<S> {
        let code = code.to_owned();
        RoomTask {
            shared,
            stream,
            code,
            epoch,
            last,
            sent: Vec::new(),
            from: 0,
            shut_out: false,
            forgotten: false,
            reason: String::new(),
        }
    }

    /// Writes this reader's output until the room has ended.
    pub async fn run(mut self, mut reader: LogReader) {
        while !reader.is_finished {
            let next = reader.next(Instant::now().into_std(), false);
            if next == NextWrite::Nothing {
                // It may be time for another attempt.
                let _ = timeout(limits::STATE_SYNC_EVERY, reader.changed()).await;
            } else if self.carry_out(&next).await {
                reader.done(&next);
            } else {
                self.give_up(&mut reader);
            }
        }
    }

    /// Performs the next write. Returns whether it is done.
    async fn carry_out(&mut self, next: &NextWrite) -> bool {
        match next {
            NextWrite::Begin(records) => self.begin(records).await,
            NextWrite::Append(records) => self.append(bytes(records).into(), None).await.is_some(),
            NextWrite::Seal(Seal::Keep) => {
                self.report(RoomOutcome::Parted);
                true
            }
            NextWrite::Seal(Seal::Remove) => {
                self.remove().await;
                true
            }
            NextWrite::Seal(Seal::Leave) | NextWrite::Nothing => true,
        }
    }

    /// Writes the beginning of a new file, and removes the previous file once the new one is complete.
    async fn begin(&mut self, records: &[Arc<Record>]) -> bool {
        let payloads = payloads(bytes(records));
        let count = payloads.len();
        let mut first = 0;
        for (part, payload) in (1..).zip(payloads) {
            // The last part completes the file.
            let from = if part == count { Some(first) } else { None };
            let Some(sequence) = self.append(payload, Some((part, count, from))).await else {
                return false;
            };
            if part == 1 {
                first = sequence;
            }
        }
        self.from = first;
        let (stream, code) = (self.stream.clone(), self.code.clone());
        tokio::spawn(async move {
            // If the purge fails, the leftover messages are removed after the next file.
            let _ = stream.purge(&code, first).await;
        });
        true
    }

    /// Writes a message, and retries until it is known to be written or the room belongs to another node.
    async fn append(
        &mut self,
        payload: Bytes,
        part: Option<(usize, usize, Option<Sequence>)>,
    ) -> Option<Sequence> {
        let writer = self.shared.next_writer();
        self.sent.push(writer);
        let message = Message {
            epoch: self.epoch,
            writer,
            from: part.and_then(|(_, _, from)| from).unwrap_or(self.from),
            part: part.map(|(number, count, _)| (number, count)),
            payload,
        };
        let give_up_at = Instant::now() + FLEET_PUBLISH;
        while !self.shut_out && Instant::now() < give_up_at {
            match self.stream.publish(&self.code, &message, self.last).await {
                Published::Done(sequence) => return Some(self.written(sequence)),
                Published::Unknown(reason) => {
                    self.reason = reason;
                    sleep(RETRY).await;
                }
                Published::Refused => match self.stream.tail(&self.code).await {
                    // An earlier attempt turned out to have been written after all.
                    Ok(tail) if tail.writer == Some(writer) => {
                        return Some(self.written(tail.sequence));
                    }
                    // The earlier attempt may still be on its way to the stream's replicas.
                    Ok(tail) if tail.sequence == self.last => sleep(RETRY).await,
                    Ok(tail) if self.is_own(tail) => self.last = tail.sequence,
                    Ok(tail) if self.is_forgotten(tail) => {
                        self.last = tail.sequence;
                        // The first message of a file does not depend on any earlier ones.
                        if part.is_none_or(|(number, ..)| number > 1) {
                            self.forgotten = true;
                            return None;
                        }
                    }
                    Ok(_) => self.is_shut_out(),
                    Err(_) => sleep(RETRY).await,
                },
            }
        }
        None
    }

    /// Called when a message is known to have been written. All earlier ones have been written by now, or never will
    /// be.
    fn written(&mut self, sequence: Sequence) -> Sequence {
        self.sent.clear();
        self.last = sequence;
        sequence
    }

    fn is_shut_out(&mut self) {
        self.shut_out = true;
        warn!(room = %self.code, epoch = self.epoch, "records were refused: another node plays the room");
        self.report(RoomOutcome::Fenced);
    }

    fn report(&self, outcome: RoomOutcome) {
        (self.shared.report)(&self.code, outcome);
    }

    /// Removes the records, retrying until none are left. Leftover records would shut out a later room with the same
    /// code.
    async fn remove(&mut self) {
        while !self.shut_out {
            if self.try_remove().await.is_ok() {
                return;
            }
            sleep(RETRY).await;
        }
    }

    async fn try_remove(&mut self) -> Result<(), String> {
        let tail = self.stream.tail(&self.code).await?;
        if tail.sequence != 0 && !self.is_own(tail) && !self.is_forgotten(tail) {
            self.is_shut_out();
            return Ok(());
        }
        // The request may arrive late, so it must spare any messages that another node has written since.
        self.stream.purge(&self.code, tail.sequence + 1).await?;
        self.report(RoomOutcome::Ended);
        Ok(())
    }

    /// Returns whether this is the last known message or an abandoned one that arrived late.
    fn is_own(&self, tail: Tail) -> bool {
        let was_sent = |writer| self.sent.contains(&writer);
        tail.sequence == self.last || tail.writer.is_some_and(was_sent)
    }

    /// Returns whether the stream has forgotten this task's messages because its disk or unsynced data was lost.
    /// Messages written by another node in the meantime would have a later epoch, or would come after the last message.
    fn is_forgotten(&self, tail: Tail) -> bool {
        tail.sequence < self.last && tail.epoch <= self.epoch
    }

    /// Gives up the file after an error.
    fn give_up(&mut self, reader: &mut LogReader) {
        let now = Instant::now().into_std();
        if std::mem::take(&mut self.forgotten) {
            warn!(room = %self.code, "NATS has forgotten records of a room; they are written again");
        } else if !self.shut_out {
            return reader.failed(&self.reason, now);
        }
        reader.policy.count();
        reader.give_up(now);
    }
}

fn bytes(records: &[Arc<Record>]) -> Vec<u8> {
    records.iter().flat_map(|record| record.seal()).collect()
}

#[cfg(test)]
mod tests;
