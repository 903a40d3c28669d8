//! The state shared by all of a server's connections.

use crate::config::Config;
use crate::fleet::handle::Fleet;
use crate::host::Phase;
use crate::host::peer_nodes::PeerNodes;
use crate::host::room_handle::Host;
use crate::host::rooms::Rooms;
use crate::host::successors::Successors;
use crate::host::token_signer::TokenSigner;
use crate::limits;
use crate::limits::address_rate_limiter::AddressRateLimiter;
use crate::limits::connection_limits::{ConnectionLimits, Permit};
use crate::limits::trial_queue::TrialQueue;
use crate::limits::uplink::Uplink;
use crate::log::{Logs, ReplayStore};
use crate::net::http::headers::Protection;
use crate::net::posts::PostStreams;
use crate::ops::bans::Bans;
use crate::ops::metrics::Metrics;
use crate::ops::refusal_log::RefusalLog;
use crate::ops::reserve_descriptors::SpareDescriptors;
use crate::runs::Records;
use std::fmt::Display;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use tokio::sync::{Notify, watch};

/// State shared by all of a server's connections.
pub struct ServerState {
    pub config: Config,
    /// State shared by the server's rooms.
    pub host: Arc<Host>,
    pub rooms: Arc<Rooms>,
    /// This server's role in a fleet.
    pub fleet: Option<Arc<Fleet>>,
    /// The best runs, if the server keeps them.
    pub records: Option<Arc<Records>>,
    /// Networks that operators have banned.
    pub bans: Bans,
    /// Limits on what each address may do.
    pub shares: AddressShares,
    /// The sessions over HTTP.
    pub streams: Arc<PostStreams>,
    /// Notified when an operator asks the server to drain.
    pub drain: Notify,
    /// Guests' scenes that are being tried or waiting for their trial.
    pub trials: Arc<TrialQueue>,
    /// The rate-limited log of refusals.
    pub refusal_log: RefusalLog,
    pub spare: SpareDescriptors,
    /// Headers of every response on the players' port.
    pub protection: Protection,
}

/// Limits on what each address may do, so that no address uses up what all share.
pub struct AddressShares {
    /// The number of concurrent TCP connections.
    pub connections: Arc<ConnectionLimits>,
    /// The number of concurrent game sockets.
    pub sessions: Arc<ConnectionLimits>,
    /// Long bodies being received.
    pub long_bodies: Arc<ConnectionLimits>,
    /// How fast requests arrive.
    requests: Mutex<AddressRateLimiter>,
    responses: Arc<ConnectionLimits>,
}

impl AddressShares {
    fn new(connections: usize, address_sessions: usize) -> AddressShares {
        let of_address = |sessions| limits::address_connections_max(connections, sessions);
        let (rate, burst) = (limits::REQUESTS_PER_SECOND_MAX, limits::REQUESTS_BURST_MAX);
        AddressShares {
            connections: ConnectionLimits::new(connections, of_address(address_sessions)),
            sessions: ConnectionLimits::new(connections, address_sessions),
            long_bodies: ConnectionLimits::with_grace(
                limits::LONG_BODIES_MAX,
                limits::ADDRESS_LONG_BODIES_MAX,
                limits::LONG_BODY_GRACE,
            ),
            requests: Mutex::new(AddressRateLimiter::new(rate, burst)),
            responses: ConnectionLimits::new(connections, of_address(0)),
        }
    }

    /// Admits a request from an address; the error is the reason for a refusal. The permit must be held until the
    /// response has been sent.
    pub fn admit_request(&self, address: IpAddr) -> Result<Permit, &'static str> {
        let mut requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
        if !requests.admit(address, Instant::now()) {
            return Err("requests_too_fast");
        }
        self.responses.admit(address).ok_or("too_many_responses")
    }
}

/// The parts that a server starts with, in addition to its configuration.
pub struct Parts {
    /// The server's current phase.
    pub phase: watch::Receiver<Phase>,
    /// The writers of rooms' logs.
    pub logs: Logs,
    /// The best runs; if `None`, they are disabled.
    pub records: Option<Arc<Records>>,
    /// The server's role in a fleet.
    pub fleet: Option<Arc<Fleet>>,
    /// Key that signs tokens; if `None`, a random one is used.
    pub key: Option<[u8; 32]>,
    /// Networks that operators have banned.
    pub bans: Bans,
}

impl Parts {
    /// The parts of a server that has no storage and no fleet.
    pub fn new(phase: watch::Receiver<Phase>) -> Parts {
        let (logs, bans) = (Logs::default(), Bans::default());
        Parts { phase, logs, records: None, fleet: None, key: None, bans }
    }
}

impl ServerState {
    /// The state of a server with this configuration and no open rooms.
    pub fn new(parts: Parts, config: Config) -> ServerState {
        let in_all = config.connections_max;
        let usual = || limits::address_sessions_max(in_all);
        let address_max = config.address_sessions_max.unwrap_or_else(usual);
        let Parts { phase, logs, records, fleet, key, bans } = parts;
        // With the previous process's or the fleet's key, existing tokens still restore seats.
        let signer = key.map_or_else(TokenSigner::with_random_key, |key| TokenSigner::new(&key));
        let threads = limits::processors().min(limits::SOCKET_THREADS_MAX);
        let host = Arc::new(Host {
            waits: config.waits,
            phase,
            logs,
            neighbours: PeerNodes::default(),
            send_queues: (0..threads).map(|_| Arc::default()).collect(),
            // As many as the sockets that an address may have in total.
            address_spectators_max: address_max,
            uplink: Uplink::new(config.uplink_megabits, Instant::now()),
            metrics: Arc::new(Metrics::default()),
            successors: Successors::default(),
            signer,
            open: Mutex::default(),
        });
        let protection = Protection::new(fleet.is_some(), config.tls.is_some(), &config.embedders);
        ServerState {
            protection,
            rooms: Arc::new(Rooms::new(
                &config.scenes,
                Arc::clone(&host),
                fleet.is_some(),
                config.rooms_max,
            )),
            fleet,
            config,
            host,
            records,
            bans,
            shares: AddressShares::new(in_all, address_max),
            streams: Arc::default(),
            trials: TrialQueue::new(limits::GUEST_TRIALS_MAX, limits::ADDRESS_GUEST_TRIALS_MAX),
            refusal_log: RefusalLog::default(),
            spare: SpareDescriptors::default(),
            drain: Notify::new(),
        }
    }

    /// Returns whether a room with this code exists, as far as this server knows.
    pub fn knows_room(&self, code: &str) -> bool {
        let elsewhere = |fleet: &Arc<Fleet>| fleet.ask(|directory| directory.has_room(code));
        self.rooms.knows(code) || self.fleet.as_ref().is_some_and(elsewhere)
    }

    /// The replays, if games are recorded.
    pub fn replays(&self) -> Option<&ReplayStore> {
        self.host.logs.recording.as_ref().map(|recording| &**recording.store())
    }

    /// Counts a refusal, and logs it unless one for the same reason was just logged.
    pub(crate) fn refused(&self, reason: &'static str, address: IpAddr, about: impl Display) {
        self.host.metrics.refused(reason);
        self.refusal_log.log(reason, address, about);
    }
}
