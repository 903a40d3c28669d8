//! The connection to NATS, which is re-established in the background. Each time, missing buckets and streams are
//! created, and the directory starts over from all entries, because NATS may be a different server or may have
//! forgotten acknowledged writes.

use super::follower::Follower;
use super::records::Records;
use super::store::{Born, BucketKind, Store};
use crate::fleet::directory::RETRY;
use crate::fleet::entry::Key;
use crate::fleet::handle::Fleet;
use crate::fleet::settings::FleetSettings;
use async_nats::connection::State;
use async_nats::jetstream::Context;
use async_nats::{Client, Statistics};
use futures_util::StreamExt;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::Notify;
use tokio::time::sleep;
use tracing::warn;

/// Interval at which to check whether the connection is still the same.
const LINK_LOOK: Duration = Duration::from_millis(50);

pub struct NatsLink {
    context: Context,
    client: Client,
    statistics: Arc<Statistics>,
    settings: FleetSettings,
    fleet: Arc<Fleet>,
    /// The number of connections that had been made when the directory last started over.
    begun_at: AtomicU64,
    /// Triggers a check of the buckets because one of them could not be followed.
    failed: Notify,
}

impl NatsLink {
    /// Creates the link that uses this context's connection.
    pub fn new(context: Context, settings: FleetSettings, fleet: Arc<Fleet>) -> NatsLink {
        let client = context.client();
        let (statistics, failed) = (client.statistics(), Notify::new());
        NatsLink {
            context,
            client,
            statistics,
            settings,
            fleet,
            begun_at: AtomicU64::new(0),
            failed,
        }
    }

    /// Opens the buckets and the stream as soon as NATS allows it, creating any that are missing.
    pub async fn open(&self) -> (Store, Records) {
        let mut said = false;
        loop {
            let opened = async {
                let store = Store::open(&self.context, &self.settings).await?;
                Ok::<_, String>((store, Records::open(&self.context, &self.settings).await?))
            };
            match opened.await {
                Ok(opened) => return opened,
                Err(reason) if !std::mem::replace(&mut said, true) => {
                    let version = self.client.server_info().version;
                    warn!(
                        nats = %self.settings.nats, version, reason,
                        "NATS cannot be used yet, of which version 2.11 or newer is needed; trying again"
                    );
                }
                Err(_) => {}
            }
            sleep(RETRY).await;
        }
    }

    /// Returns whether the connection with this number, as counted by the directory, is still open. After it closes, a
    /// message would wait in the client for the next connection, and might reach a NATS server that has forgotten the
    /// state to which the message refers.
    pub fn is_current(&self, number: u64) -> bool {
        self.fleet.ask(|directory| directory.connection()) == number
            && self.connects() == self.begun_at.load(Ordering::Relaxed)
            && self.client.connection_state() == State::Connected
    }

    /// Follows this store's buckets, over one connection after another.
    pub async fn follow(&self, store: &Store) {
        let (mut known_server, mut known_born) = (String::new(), store.born());
        loop {
            while self.client.connection_state() != State::Connected {
                sleep(LINK_LOOK).await;
            }
            let (connects, server) = (self.connects(), self.client.server_info().server_id);
            let is_other_server = server != known_server;
            known_server = server;
            self.begin(connects, is_other_server);
            loop {
                tokio::select! {
                    () = self.ended(connects) => break,
                    born = self.other_buckets(known_born) => {
                        known_born = born;
                        self.begin(connects, true);
                    }
                    () = self.follow_bucket(store, BucketKind::Nodes) => {}
                    () = self.follow_bucket(store, BucketKind::Rooms) => {}
                }
            }
        }
    }

    fn connects(&self) -> u64 {
        self.statistics.connects.load(Ordering::Relaxed)
    }

    fn begin(&self, connects: u64, may_have_forgotten: bool) {
        self.fleet.tell(|directory, now| directory.connected(may_have_forgotten, now));
        self.begun_at.store(connects, Ordering::Relaxed);
    }

    async fn ended(&self, connects: u64) {
        while self.connects() == connects && self.client.connection_state() == State::Connected {
            sleep(LINK_LOOK).await;
        }
    }

    /// Creates any missing buckets, now and whenever a bucket cannot be followed. Returns once the buckets have been
    /// replaced.
    async fn other_buckets(&self, known: Born) -> Born {
        loop {
            let born = self.open().await.0.born();
            if born != known {
                return born;
            }
            self.failed.notified().await;
        }
    }

    /// Follows a bucket. If the watcher ends, starts over from all entries.
    async fn follow_bucket(&self, store: &Store, kind: BucketKind) {
        let mut follower = Follower::default();
        loop {
            follower.begin();
            if let Err(reason) = self.follow_once(store, kind, &mut follower).await {
                warn!(?kind, reason, "the directory is followed from its beginning again");
            }
            self.failed.notify_one();
            sleep(RETRY).await;
        }
    }

    async fn follow_once(
        &self,
        store: &Store,
        kind: BucketKind,
        follower: &mut Follower,
    ) -> Result<(), String> {
        let mut watch = store.watch(kind).await?;
        while let Some(heard) = watch.next().await {
            let heard = heard.map_err(|error| error.to_string())?;
            let change = kind
                .key(&heard.key)
                .and_then(|key| follower.hear(key, heard.operation, &heard.value, heard.revision));
            change.into_iter().for_each(|change| self.fleet.heard(change));
            if heard.seen_current
                && let Some(present) = follower.take_initial()
            {
                self.synced(kind, &present);
            }
        }
        Err("the watcher ended".to_owned())
    }

    fn synced(&self, kind: BucketKind, present: &BTreeSet<Key>) {
        self.fleet.tell(|directory, now| match kind {
            BucketKind::Nodes => directory.synced_nodes(present, now),
            BucketKind::Rooms => directory.synced_rooms(present, now),
        });
    }
}
