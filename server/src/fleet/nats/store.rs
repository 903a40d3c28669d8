//! The directory, in two key-value buckets: one for node entries, which expire, and one for room entries.

use crate::fleet::directory::{Answer, LEASE_TTL};
use crate::fleet::entry::{Entry, Key, Revision};
use crate::fleet::settings::FleetSettings;
use async_nats::jetstream::Context;
use async_nats::jetstream::kv::{
    Config, CreateErrorKind, Operation, Store as Bucket, UpdateErrorKind, Watch,
};
use async_nats::jetstream::stream::{self, LastRawMessageErrorKind};
use std::time::Duration;
use tracing::warn;

const NODES: &str = "jostle_nodes";
const ROOMS: &str = "jostle_rooms";
/// A key in the rooms' bucket that does not belong to a room. It ensures that a watcher always gets at least one entry.
const FORMAT: &str = "format";
const FORMAT_VALUE: &str = "1";

/// Time after which NATS forgets that a room was removed. A follower that is cut off for longer may miss the removal;
/// it looks up the room's entry when a player arrives.
const REMOVAL_TTL: Duration = Duration::from_secs(24 * 60 * 60);

/// A store error, as text.
pub type StoreError = String;

/// Creation times of the two buckets, in nanoseconds since 1970 by NATS's clock.
pub type Born = [i128; 2];

#[derive(Clone)]
pub struct Store {
    nodes: Bucket,
    rooms: Bucket,
    /// Whether records of room removals expire.
    removals_expire: bool,
}

impl Store {
    /// Opens the buckets, creating them if they are missing.
    pub async fn open(context: &Context, settings: &FleetSettings) -> Result<Store, StoreError> {
        let nodes = Config { max_age: LEASE_TTL, ..config(settings, NODES) };
        let nodes = bucket(context, nodes).await?;
        let rooms = Config { limit_markers: Some(REMOVAL_TTL), ..config(settings, ROOMS) };
        let rooms = bucket(context, rooms).await?;
        let removals_expire = let_removals_expire(context, &rooms).await;
        match rooms.create(FORMAT, FORMAT_VALUE.into()).await {
            Err(error) if error.kind() != CreateErrorKind::AlreadyExists => Err(error.to_string()),
            _ => Ok(Store { nodes, rooms, removals_expire }),
        }
    }

    /// Creation times of the buckets. If the buckets are replaced, their revisions start over.
    pub fn born(&self) -> Born {
        let born = |bucket: &Bucket| bucket.stream.cached_info().created.unix_timestamp_nanos();
        [born(&self.nodes), born(&self.rooms)]
    }

    /// Logs the consequences of keeping only one copy.
    pub fn warn_of_one_copy(&self) {
        if self.rooms.stream.cached_info().config.num_replicas == 1 {
            warn!(
                "NATS keeps one copy of the directory and of the rooms' records, on one disk: if its machine loses power, \
                 it forgets what it had not synced, which is up to two minutes unless it is configured with \
                 sync_interval: always"
            );
        }
    }

    /// Writes an entry if its revision is still `expected`.
    pub async fn write(&self, key: &Key, entry: &Entry, expected: Revision) -> Answer {
        let (bucket, name) = self.place(key);
        let value = match entry {
            Entry::Node(entry) => serde_json::to_vec(entry),
            Entry::Room(entry) => serde_json::to_vec(entry),
        };
        let value = value.expect("entries hold numbers, names and addresses").into();
        if expected == 0 {
            return match bucket.create(name, value).await {
                Ok(revision) => Answer::Done(revision),
                Err(error) if error.kind() == CreateErrorKind::AlreadyExists => Answer::Refused,
                Err(_) => Answer::Unknown,
            };
        }
        match bucket.update(name, value, expected).await {
            Ok(revision) => Answer::Done(revision),
            Err(error) if error.kind() == UpdateErrorKind::WrongLastRevision => Answer::Refused,
            Err(_) => Answer::Unknown,
        }
    }

    /// Removes an entry if its revision is still `expected`. Any answer other than "done" leaves the outcome unknown.
    pub async fn remove(&self, key: &Key, expected: Revision) -> Answer {
        let (bucket, name) = self.place(key);
        let removed = match key {
            Key::Room(_) if self.removals_expire => {
                let removed = bucket.purge_expect_revision_with_ttl(name, expected, REMOVAL_TTL);
                removed.await.is_ok()
            }
            _ => bucket.delete_expect_revision(name, Some(expected)).await.is_ok(),
        };
        if removed { Answer::Done(0) } else { Answer::Unknown }
    }

    /// Reads an entry from the leader, since a follower's copy may be older than a lease.
    pub async fn look(&self, key: &Key) -> Result<Option<(Entry, Revision)>, StoreError> {
        let (bucket, name) = self.place(key);
        let subject = format!("$KV.{}.{name}", bucket.name);
        let message = match bucket.stream.get_last_raw_message_by_subject(&subject).await {
            Ok(message) => message,
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => {
                return Ok(None);
            }
            Err(error) => return Err(error.to_string()),
        };
        if message.headers.get("KV-Operation").is_some() {
            return Ok(None);
        }
        let entry = parse(key, &message.payload)?;
        Ok(Some((entry, message.sequence)))
    }

    /// Follows a bucket, starting with all existing entries.
    pub async fn watch(&self, kind: BucketKind) -> Result<Watch, StoreError> {
        let bucket = match kind {
            BucketKind::Nodes => &self.nodes,
            BucketKind::Rooms => &self.rooms,
        };
        bucket.watch_with_history(">").await.map_err(|error| error.to_string())
    }

    fn place<'a>(&self, key: &'a Key) -> (&Bucket, &'a str) {
        match key {
            Key::Node(name) => (&self.nodes, name),
            Key::Room(code) => (&self.rooms, code),
        }
    }
}

/// One of the two buckets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BucketKind {
    Nodes,
    Rooms,
}

impl BucketKind {
    /// The key of an entry in this bucket; `None` if the name does not belong to a directory entry.
    pub fn key(self, name: &str) -> Option<Key> {
        match self {
            BucketKind::Nodes => Some(Key::Node(name.to_owned())),
            BucketKind::Rooms => (name != FORMAT).then(|| Key::Room(name.to_owned())),
        }
    }
}

/// Reads the value of a watched entry; `None` if the entry was removed.
pub fn watched(key: &Key, operation: Operation, value: &[u8]) -> Result<Option<Entry>, StoreError> {
    match operation {
        Operation::Put => parse(key, value).map(Some),
        Operation::Delete | Operation::Purge => Ok(None),
    }
}

fn parse(key: &Key, value: &[u8]) -> Result<Entry, StoreError> {
    match key {
        Key::Node(_) => serde_json::from_slice(value).map(Entry::Node),
        Key::Room(_) => serde_json::from_slice(value).map(Entry::Room),
    }
    .map_err(|error| format!("{key:?}: {error}"))
}

fn config(settings: &FleetSettings, name: &str) -> Config {
    let (bucket, num_replicas) = (name.to_owned(), settings.replicas);
    Config { bucket, history: 1, num_replicas, ..Config::default() }
}

async fn bucket(context: &Context, config: Config) -> Result<Bucket, StoreError> {
    if let Ok(bucket) = context.get_key_value(&config.bucket).await {
        return Ok(bucket);
    }
    let name = config.bucket.clone();
    context.create_key_value(config).await.map_err(|error| format!("bucket {name}: {error}"))
}

/// Lets a bucket's messages expire, which buckets created by earlier versions do not allow. Returns whether they can.
async fn let_removals_expire(context: &Context, bucket: &Bucket) -> bool {
    let before = &bucket.stream.cached_info().config;
    if before.allow_message_ttl {
        return true;
    }
    let config = stream::Config {
        allow_message_ttl: true,
        subject_delete_marker_ttl: Some(REMOVAL_TTL),
        ..before.clone()
    };
    let updated = context.update_stream(config).await;
    if let Err(error) = &updated {
        warn!(bucket = %bucket.name, %error, "NATS will keep an entry of each room that is over");
    }
    updated.is_ok()
}
