//! The state that all connections of a server share.

use crate::config::Config;
use crate::host::phase::Phase;
use crate::host::rooms::Rooms;
use crate::host::token_signer::TokenSigner;
use crate::limits::connection_limits::ConnectionLimits;
use crate::limits::{self, Waits};
use crate::net::{assets, tls};
use crate::ops::metrics::Metrics;
use crate::ops::refusal_log::RefusalLog;
use crate::replays::{Recording, ReplayStore};
use std::fmt::Display;
use std::net::IpAddr;
use std::sync::Arc;
use tokio::sync::{Notify, watch};
use tracing_appender::non_blocking::ErrorCounter;

/// State shared by all connections of a server.
pub struct ServerState {
    /// [`Config::files`].
    pub files: &'static [assets::File],
    /// Open rooms.
    pub rooms: Arc<Rooms>,
    /// Limits on TCP connections.
    pub connections: Arc<ConnectionLimits>,
    /// [`Config::ops_token`].
    pub ops_token: Option<String>,
    /// [`Config::tls`].
    pub tls: Option<tls::Tls>,
    /// Notified when an operator asks the server to drain.
    pub drain: Notify,
    /// Signs and verifies tokens.
    pub signer: Arc<TokenSigner>,
    /// Limits on game sockets.
    pub sessions: Arc<ConnectionLimits>,
    /// Counters, gauges and histograms.
    pub metrics: Arc<Metrics>,
    /// The rate-limited log of refusals.
    pub refusal_log: RefusalLog,
    /// [`Config::log_drops`].
    pub log_drops: Option<ErrorCounter>,
    /// [`Config::waits`].
    pub waits: Waits,
    /// [`Config::origins`].
    pub origins: Vec<String>,
    /// [`Config::trusted_proxies`].
    pub trusted_proxies: Vec<IpAddr>,
    /// The phase of the server's life.
    pub phase: watch::Receiver<Phase>,
    /// The replays, if games are recorded.
    pub replays: Option<Arc<ReplayStore>>,
}

impl ServerState {
    /// The state of a server with this configuration and no open rooms. Games are recorded if `recording`
    /// is given.
    pub fn new(
        config: Config,
        phase: watch::Receiver<Phase>,
        recording: Option<Arc<Recording>>,
    ) -> ServerState {
        let metrics = Arc::new(Metrics::default());
        let address_max = config.address_sessions_max;
        let signer = Arc::new(TokenSigner::with_random_key());
        let rooms = Rooms::new(
            config.clone(),
            phase.clone(),
            recording.clone(),
            Arc::clone(&metrics),
            Arc::clone(&signer),
        );
        ServerState {
            files: config.files,
            waits: config.waits,
            ops_token: config.ops_token,
            tls: config.tls,
            log_drops: config.log_drops,
            refusal_log: RefusalLog::default(),
            drain: Notify::new(),
            origins: config.origins,
            trusted_proxies: config.trusted_proxies,
            replays: recording.as_ref().map(|recording| Arc::clone(recording.store())),
            rooms: Arc::new(rooms),
            signer,
            metrics,
            connections: ConnectionLimits::new(
                limits::CONNECTIONS_MAX,
                limits::ADDRESS_CONNECTIONS_SPARE + address_max,
            ),
            sessions: ConnectionLimits::new(limits::CONNECTIONS_MAX, address_max),
            phase,
        }
    }

    /// Counts a refusal, and logs it unless one of the same reason was logged a moment ago.
    pub(crate) fn refused(&self, reason: &'static str, address: IpAddr, about: impl Display) {
        self.metrics.refused(reason);
        self.refusal_log.log(reason, address, about);
    }
}
