//! Rooms' records in a stream that has one subject per room. A message holds all or part of some records, in the format
//! of a room's file. Each message is written only if the subject's last message is still the one that the writer knows,
//! so a new owner's first message shuts out the previous owner.

use crate::fleet::settings::FleetSettings;
use async_nats::HeaderMap;
use async_nats::jetstream::Context;
use async_nats::jetstream::context::PublishErrorKind;
use async_nats::jetstream::message::StreamMessage;
use async_nats::jetstream::stream::{Config, LastRawMessageErrorKind, Stream};
use bytes::Bytes;
use jostle_protocol::replay::header;

/// Maximum length of a message in the stream, bytes; NATS allows 1 MiB by default.
const FLEET_MESSAGE_BYTES_MAX: usize = 512 << 10;

const STREAM: &str = "jostle_records";
/// Epoch of the room entry under which a message was written.
const EPOCH: &str = "Jostle-Epoch";
/// The number that the writer gave the message, by which it recognises the message.
const WRITER: &str = "Jostle-Writer";
/// Sequence number of the first message of the newest complete file, as of this message; 0 means this message itself.
const FROM: &str = "Jostle-From";
/// Position of the message among those that make up a file's beginning, and their count.
const PART: &str = "Jostle-Part";

/// A message's sequence number in the stream.
pub type Sequence = u64;

#[derive(Clone)]
pub struct Records {
    context: Context,
    stream: Stream,
}

/// The result of a conditional write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Published {
    /// The message was written with this sequence number.
    Done(Sequence),
    /// Another writer has written a message in the meantime.
    Refused,
    /// The outcome is unknown: NATS gave this reason, or did not answer.
    Unknown(String),
}

/// A message to be written.
#[derive(Clone, Debug)]
pub struct Message {
    /// Epoch of the room's entry.
    pub epoch: u64,
    /// The unique number that the writer gave the message.
    pub writer: u64,
    /// Sequence number of the first message of the newest complete file; 0 if this message is the first one.
    pub from: Sequence,
    /// Position of the message among the parts of a file's beginning, counted from 1, and their count.
    pub part: Option<(usize, usize)>,
    pub payload: Bytes,
}

/// A room's last message; all fields are 0 or `None` if there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tail {
    pub sequence: Sequence,
    /// The number that the writer gave the message.
    pub writer: Option<u64>,
    /// The epoch under which the message was written.
    pub epoch: u64,
}

/// Rooms' messages, as written by their owners. An error from the last two functions means that no answer came, so the
/// outcome is unknown.
pub trait RecordStream: Clone + Send + Sync + 'static {
    /// Writes a message if `last` is still the room's last message.
    fn publish(
        &self,
        code: &str,
        message: &Message,
        last: Sequence,
    ) -> impl Future<Output = Published> + Send;

    /// Reads a room's last message from the leader.
    fn tail(&self, code: &str) -> impl Future<Output = Result<Tail, String>> + Send;

    /// Removes a room's messages before a sequence number.
    fn purge(
        &self,
        code: &str,
        before: Sequence,
    ) -> impl Future<Output = Result<(), String>> + Send;
}

#[derive(Clone, Debug, Default)]
pub struct RoomRecords {
    /// The contents of the room's file; `None` if nothing was ever stored.
    pub file: Option<Vec<u8>>,
    /// Sequence number of the file's first message.
    pub from: Sequence,
    /// Sequence number of the subject's last message, or 0 if there is none.
    pub last: Sequence,
    /// Epoch of the last message, or 0 if there is none.
    pub epoch: u64,
}

impl Records {
    /// Opens the stream, creating it if it is missing.
    pub async fn open(context: &Context, settings: &FleetSettings) -> Result<Records, String> {
        let config = Config {
            name: STREAM.to_owned(),
            subjects: vec![subject("*")],
            num_replicas: settings.replicas,
            ..Config::default()
        };
        let stream = match context.get_stream(STREAM).await {
            Ok(stream) => stream,
            Err(_) => context
                .create_stream(config)
                .await
                .map_err(|error| format!("stream {STREAM}: {error}"))?,
        };
        Ok(Records { context: context.clone(), stream })
    }

    /// Reads a room's newest complete file and the records appended to it.
    pub async fn read(&self, code: &str) -> Result<RoomRecords, String> {
        let Some(last) = self.last(code).await? else { return Ok(RoomRecords::default()) };
        let (end, epoch) = (last.sequence, number(&last, EPOCH).unwrap_or(0));
        let from = match number(&last, FROM) {
            Some(0) | None => end,
            Some(from) => from,
        };
        let mut file = File::default();
        let mut message = if from == end { last } else { self.next(code, from).await? };
        loop {
            file.add(part(&message), message.sequence, &message.payload);
            if message.sequence >= end {
                break;
            }
            message = self.next(code, message.sequence + 1).await?;
        }
        Ok(RoomRecords { file: file.whole, from: file.from, last: end, epoch })
    }

    async fn last(&self, code: &str) -> Result<Option<StreamMessage>, String> {
        match self.stream.get_last_raw_message_by_subject(&subject(code)).await {
            Ok(message) => Ok(Some(message)),
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
            Err(error) => Err(error.to_string()),
        }
    }

    async fn next(&self, code: &str, sequence: Sequence) -> Result<StreamMessage, String> {
        let builder = self.stream.raw_message_builder().sequence(sequence);
        builder.next_by_subject(subject(code)).send().await.map_err(|error| error.to_string())
    }
}

impl RecordStream for Records {
    async fn publish(&self, code: &str, message: &Message, last: Sequence) -> Published {
        let mut headers = HeaderMap::new();
        headers.insert(EPOCH, message.epoch.to_string());
        headers.insert(WRITER, message.writer.to_string());
        headers.insert(FROM, message.from.to_string());
        if let Some((number, count)) = message.part {
            headers.insert(PART, format!("{number}/{count}"));
        }
        headers.insert("Nats-Expected-Last-Subject-Sequence", last.to_string());
        let payload = message.payload.clone();
        let sent = self.context.publish_with_headers(subject(code), headers, payload).await;
        let acknowledged = match sent {
            Ok(acknowledgement) => acknowledgement.await,
            Err(error) => Err(error),
        };
        match acknowledged {
            Ok(acknowledgement) => Published::Done(acknowledgement.sequence),
            Err(error) if error.kind() == PublishErrorKind::WrongLastSequence => Published::Refused,
            Err(error) => Published::Unknown(error.to_string()),
        }
    }

    async fn tail(&self, code: &str) -> Result<Tail, String> {
        let last = self.last(code).await?;
        let tail = |last: StreamMessage| Tail {
            sequence: last.sequence,
            writer: number(&last, WRITER),
            epoch: number(&last, EPOCH).unwrap_or(0),
        };
        Ok(last.map_or(Tail::default(), tail))
    }

    async fn purge(&self, code: &str, before: Sequence) -> Result<(), String> {
        let purge = self.stream.purge().filter(subject(code)).sequence(before);
        purge.await.map(drop).map_err(|error| error.to_string())
    }
}

/// A file being assembled from messages.
#[derive(Default)]
struct File {
    whole: Option<Vec<u8>>,
    from: Sequence,
    /// The parts of an incomplete beginning read so far, and the sequence number of the first one.
    begun: (Vec<u8>, Sequence),
}

impl File {
    fn add(&mut self, part: Option<(usize, usize)>, sequence: Sequence, payload: &[u8]) {
        let Some((part, count)) = part else {
            if let Some(whole) = &mut self.whole {
                whole.extend_from_slice(payload);
            }
            return;
        };
        if part == 1 {
            self.begun = (header().to_vec(), sequence);
        }
        self.begun.0.extend_from_slice(payload);
        if part == count {
            let (bytes, from) = std::mem::take(&mut self.begun);
            (self.whole, self.from) = (Some(bytes), from);
        }
    }
}

fn number(message: &StreamMessage, name: &str) -> Option<u64> {
    message.headers.get(name)?.as_str().parse().ok()
}

fn part(message: &StreamMessage) -> Option<(usize, usize)> {
    let (number, count) = message.headers.get(PART)?.as_str().split_once('/')?;
    Some((number.parse().ok()?, count.parse().ok()?))
}

fn subject(code: &str) -> String {
    format!("jostle.records.{code}")
}

/// Splits bytes into payloads of a size that NATS accepts.
pub fn payloads(bytes: Vec<u8>) -> Vec<Bytes> {
    let mut rest = Bytes::from(bytes);
    let mut payloads = Vec::new();
    while rest.len() > FLEET_MESSAGE_BYTES_MAX {
        payloads.push(rest.split_to(FLEET_MESSAGE_BYTES_MAX));
    }
    payloads.push(rest);
    payloads
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_whole_file_counts_with_all_that_was_appended_to_it() {
        let mut file = File::default();
        file.add(None, 1, b"of a file that is gone");
        assert_eq!(file.whole, None);
        file.add(Some((1, 1)), 2, b"a");
        file.add(None, 3, b"b");
        // Only part of this beginning was written before another node took over.
        file.add(Some((1, 3)), 4, b"x");
        file.add(Some((2, 3)), 5, b"y");
        file.add(None, 6, b"c");
        let bytes = |text: &[u8]| Some([&header()[..], text].concat());
        assert_eq!((file.whole.clone(), file.from), (bytes(b"abc"), 2));
        file.add(Some((1, 2)), 7, b"d");
        file.add(Some((2, 2)), 8, b"e");
        file.add(None, 9, b"f");
        assert_eq!((file.whole, file.from), (bytes(b"def"), 7));
    }

    #[test]
    fn payloads_are_cut_where_nats_would_refuse_them_and_lose_nothing() {
        for bytes in [0, 1, FLEET_MESSAGE_BYTES_MAX, 3 * FLEET_MESSAGE_BYTES_MAX + 7] {
            let whole: Vec<u8> = (0..bytes).map(|n| n as u8).collect();
            let cut = payloads(whole.clone());
            assert!(cut.iter().all(|payload| payload.len() <= FLEET_MESSAGE_BYTES_MAX));
            assert_eq!(cut.concat(), whole);
        }
    }
}
