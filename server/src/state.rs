//! The state that all connections of a server share.

use crate::config::Config;
use crate::durable::StateWriter;
use crate::host::phase::Phase;
use crate::host::room_handle::Host;
use crate::host::rooms::Rooms;
use crate::host::token_signer::TokenSigner;
use crate::limits;
use crate::limits::address_rate_limiter::AddressRateLimiter;
use crate::limits::connection_limits::{ConnectionLimits, Permit};
use crate::ops::bans::Bans;
use crate::ops::metrics::Metrics;
use crate::ops::refusal_log::RefusalLog;
use crate::ops::spare::SpareDescriptors;
use crate::replays::{Recording, ReplayStore};
use std::fmt::Display;
use std::net::IpAddr;
use std::num::NonZero;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::available_parallelism;
use std::time::Instant;
use tokio::sync::{Notify, watch};

/// State shared by all connections of a server.
pub struct ServerState {
    /// Its configuration.
    pub config: Config,
    /// Shared by its rooms.
    pub host: Arc<Host>,
    /// Open rooms.
    pub rooms: Arc<Rooms>,
    /// Networks that operators have banned.
    pub bans: Bans,
    /// Limits on TCP connections.
    pub connections: Arc<ConnectionLimits>,
    /// Notified when an operator asks the server to drain.
    pub drain: Notify,
    /// Limits on how fast each address may send requests.
    pub requests: Mutex<AddressRateLimiter>,
    /// Limits on responses that are being sent.
    pub responses: Arc<ConnectionLimits>,
    /// Limits on game sockets.
    pub sessions: Arc<ConnectionLimits>,
    /// The rate-limited log of refusals.
    pub refusal_log: RefusalLog,
    /// Descriptors for operators.
    pub spare: SpareDescriptors,
}

impl ServerState {
    /// The state of a server with this configuration and no open rooms. Games are recorded if `recording`
    /// is given, and rooms outlive the process if `state_writer` is.
    pub fn new(
        config: Config,
        phase: watch::Receiver<Phase>,
        recording: Option<Arc<Recording>>,
        state_writer: Option<Arc<StateWriter>>,
        bans: Bans,
    ) -> ServerState {
        let (in_all, address_max) = (config.connections_max, config.address_sessions_max);
        let connections_max = limits::ADDRESS_CONNECTIONS_SPARE + address_max;
        // With the key of the process before, its tokens go on giving seats back.
        let signer = match &state_writer {
            Some(writer) => TokenSigner::new(writer.dir().key()),
            None => TokenSigner::with_random_key(),
        };
        let threads = available_parallelism().map_or(1, NonZero::get);
        let threads = threads.min(limits::SOCKET_THREADS_MAX);
        let host = Arc::new(Host {
            waits: config.waits,
            phase,
            recording,
            state_writer,
            wakeups: (0..threads).map(|_| Arc::default()).collect(),
            metrics: Arc::new(Metrics::default()),
            signer,
            open: Mutex::default(),
        });
        ServerState {
            rooms: Arc::new(Rooms::new(&config.scenes, Arc::clone(&host))),
            config,
            host,
            bans,
            connections: ConnectionLimits::new(in_all, connections_max),
            requests: Mutex::new(AddressRateLimiter::new(
                limits::REQUESTS_PER_SECOND_MAX,
                limits::REQUESTS_BURST_MAX,
            )),
            responses: ConnectionLimits::new(in_all, limits::ADDRESS_RESPONSES_MAX),
            sessions: ConnectionLimits::new(in_all, address_max),
            refusal_log: RefusalLog::default(),
            spare: SpareDescriptors::default(),
            drain: Notify::new(),
        }
    }

    /// The replays, if games are recorded.
    pub fn replays(&self) -> Option<&ReplayStore> {
        self.host.recording.as_deref().map(Recording::store)
    }

    /// Admits a request of an address, or names the reason why not. The permit is held until the response was sent.
    pub(crate) fn admit_request(&self, address: IpAddr) -> Result<Permit, &'static str> {
        let mut requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
        if !requests.admit(address, Instant::now()) {
            return Err("requests_too_fast");
        }
        self.responses.admit(address).ok_or("too_many_responses")
    }

    /// Counts a refusal, and logs it unless one of the same reason was logged a moment ago.
    pub(crate) fn refused(&self, reason: &'static str, address: IpAddr, about: impl Display) {
        self.host.metrics.refused(reason);
        self.refusal_log.log(reason, address, about);
    }
}
