//! The host: sockets, sessions, the ticker (the only clock), files and the command line. It holds no
//! game rules, and lets no client and no room delay another.
//!
//! A socket's way: [`listen`] accepts and counts it, [`tls`] deciphers it if asked to, [`http`] answers or upgrades it, [`session`]
//! plays it. A session meets its room at two bounded places only: the inbox that it fills and the
//! [`outbox`] that it empties. [`ticker`] is the room's thread between them; [`rooms`] lists them.
//! [`replays`] takes down what is played, on a thread of its own. [`metrics`] counts what happens, and
//! [`ops`] shows it to operators on a port of their own.

pub mod assets;
pub mod cli;
pub mod connects;
pub mod http;
pub mod lag;
pub mod limits;
pub mod listen;
pub mod metered;
pub mod metrics;
pub mod ops;
pub mod outbox;
pub mod peers;
pub mod pongs;
pub mod process;
pub mod rate;
pub mod replays;
pub mod rooms;
pub mod run_queue;
pub mod schedule;
pub mod seal;
pub mod session;
pub mod stream;
pub mod ticker;
pub mod tls;

pub use listen::{run, run_with_ops};

use jostle_sim::Scene;
use std::net::IpAddr;
use std::sync::Arc;
use tokio::sync::watch;

/// What a server is started with.
#[derive(Clone, Debug)]
pub struct Config {
    /// Scenes on offer, at most [`limits::SCENES_MAX`], each name once.
    pub scenes: Vec<Scene>,
    /// How long it waits for whom.
    pub waits: limits::Waits,
    /// Sites besides this one whose pages may play here, such as `https://play.example.org`.
    pub origins: Vec<String>,
    /// Proxies that are believed about whom they speak for, in canonical form.
    pub trusted_proxies: Vec<IpAddr>,
    /// Game sockets of one address, at most [`limits::CONNECTIONS_MAX`].
    pub address_sessions_max: usize,
    /// What operators have to know to do more than look; `None` lets nobody.
    pub ops_token: Option<String>,
    /// Certificate and key of the players' port; `None` serves it in the clear.
    pub tls: Option<tls::Tls>,
    /// Where games are recorded; `None` records nothing.
    pub replays: Option<replays::Settings>,
}

impl Default for Config {
    /// The built-in scenes, pages of this site only, no proxies, no TLS, nothing recorded.
    fn default() -> Config {
        Config {
            scenes: Scene::built_in(),
            waits: limits::Waits::default(),
            origins: Vec::new(),
            trusted_proxies: Vec::new(),
            address_sessions_max: limits::ADDRESS_SESSIONS_MAX,
            ops_token: None,
            tls: None,
            replays: None,
        }
    }
}

/// How far the server is with its own end. It only moves forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Sockets are accepted.
    Running,
    /// Players are told.
    Draining,
    /// Sockets are closed.
    Closing,
}

/// What every connection needs.
pub struct App {
    /// Open rooms.
    pub rooms: Arc<rooms::Rooms>,
    /// TCP connections.
    pub connections: Arc<peers::Peers>,
    /// [`Config::ops_token`].
    pub ops_token: Option<String>,
    /// [`Config::tls`].
    pub tls: Option<tls::Tls>,
    /// An operator asked for the server's end.
    pub drain: tokio::sync::Notify,
    /// What it gives out and believes.
    pub sealer: Arc<seal::Sealer>,
    /// Game sockets.
    pub sessions: Arc<peers::Peers>,
    /// What is counted.
    pub metrics: Arc<metrics::Metrics>,
    /// How long the server waits for whom.
    pub waits: limits::Waits,
    /// [`Config::origins`].
    pub origins: Vec<String>,
    /// [`Config::trusted_proxies`].
    pub trusted_proxies: Vec<IpAddr>,
    /// Whether the server is closing.
    pub phase: watch::Receiver<Phase>,
    /// The replays, if games are recorded.
    pub replays: Option<Arc<replays::Shelf>>,
}

impl App {
    /// What every connection of a server with this configuration needs; no room is open yet. Games are
    /// recorded if there is a way to.
    pub fn new(
        config: Config,
        phase: watch::Receiver<Phase>,
        recording: Option<Arc<replays::Recording>>,
    ) -> App {
        let metrics = Arc::new(metrics::Metrics::default());
        let address_max = config.address_sessions_max;
        let sealer = Arc::new(seal::Sealer::new(&rooms::random_key()));
        let rooms = rooms::Rooms::new(
            config.clone(),
            phase.clone(),
            recording.clone(),
            Arc::clone(&metrics),
            Arc::clone(&sealer),
        );
        App {
            waits: config.waits,
            ops_token: config.ops_token,
            tls: config.tls,
            drain: tokio::sync::Notify::new(),
            origins: config.origins,
            trusted_proxies: config.trusted_proxies,
            replays: recording.as_ref().map(|recording| Arc::clone(recording.shelf())),
            rooms,
            sealer,
            metrics,
            connections: peers::Peers::new(
                limits::CONNECTIONS_MAX,
                limits::ADDRESS_CONNECTIONS_SPARE + address_max,
            ),
            sessions: peers::Peers::new(limits::CONNECTIONS_MAX, address_max),
            phase,
        }
    }
}
