//! The server configuration.

use crate::fleet::settings::FleetSettings;
use crate::guests::GuestScenes;
use crate::limits;
use crate::log::{self, StateSettings};
use crate::net::http::gallery::Gallery;
use crate::net::http::headers::FrameOrigin;
use crate::net::http::host::Hosts;
use crate::net::{assets, tls};
use crate::ops::agones;
use crate::ops::supervisor::Supervisor;
use ipnet::IpNet;
use jostle_game::Scene;
use std::path::PathBuf;
use tracing_appender::non_blocking::ErrorCounter;

/// Settings with which a server starts.
#[derive(Clone, Debug)]
pub struct Config {
    /// The page's files, sorted by name.
    pub files: &'static [assets::AssetFile],
    /// Scenes on offer: at most [`limits::SCENES_BOUND`], with unique names.
    pub scenes: Vec<Scene>,
    /// Which of these the lobby shows in its gallery, and their pictures.
    pub gallery: Gallery,
    /// Timeouts after which the server gives up on a peer or a room.
    pub waits: limits::Timeouts,
    /// Whether guests may open rooms with their own scenes.
    pub guest_scenes: GuestScenes,
    /// Sites besides this one whose pages may play here, such as `https://play.example.org`.
    pub origins: Vec<String>,
    /// Sites whose pages may show this server's page in a frame.
    pub embedders: Vec<FrameOrigin>,
    /// Names by which requests may address this server.
    pub hosts: Hosts,
    /// Proxy networks whose `X-Forwarded-For` header is trusted.
    pub trusted_proxies: Vec<IpNet>,
    /// Maximum number of rooms that people may have open at once, at most [`limits::ROOMS_BOUND`]. The scenes' standing
    /// rooms do not count.
    pub rooms_max: usize,
    /// Maximum number of simultaneous connections, at most [`limits::CONNECTIONS_BOUND`].
    pub connections_max: usize,
    /// Maximum number of game sockets per address; `None` for the address's share of the connections
    /// ([`limits::address_sessions_max`]).
    pub address_sessions_max: Option<usize>,
    /// Megabits per second that the server may send. Each address gets a fraction of this, and all rooms with guests'
    /// scenes share another fraction ([`limits::uplink`]).
    pub uplink_megabits: u32,
    /// Token that operators need to use the admin paths; `None` disables these paths.
    pub ops_token: Option<String>,
    /// Certificate and key for the players' port; if `None`, the port is served without TLS.
    pub tls: Option<tls::Tls>,
    /// Counter for dropped log lines, if the log can drop any.
    pub log_drops: Option<ErrorCounter>,
    /// Directory and limits for recordings; `None` to record nothing.
    pub replays: Option<log::Settings>,
    /// Where rooms are stored so that they outlive the process; `None` if they end with it.
    pub state: Option<StateSettings>,
    /// The server's settings as a node of a fleet; `None` for a single server. Requires the `nats` feature and cannot
    /// be combined with `state`: where a room is stored decides which server resumes it.
    pub fleet: Option<FleetSettings>,
    /// Receives the server's status notifications.
    pub supervisor: Supervisor,
    /// The Agones sidecar, if Agones started the server.
    pub agones: Option<agones::Settings>,
}

impl Config {
    /// Maximum number of open rooms: those that people create, plus each scene's standing room.
    pub fn rooms_in_all(&self) -> usize {
        self.rooms_max + self.scenes.len()
    }

    /// Directory for the best runs: the one for open rooms, or else the one for replays.
    pub fn records_dir(&self) -> Option<PathBuf> {
        let state = self.state.as_ref().map(|state| &state.dir);
        let dir = state.or(self.replays.as_ref().map(|replays| &replays.dir))?;
        Some(dir.join("records"))
    }
}

impl Default for Config {
    /// Serves the embedded page and the built-in scenes, accepts only this site's pages, trusts no proxies, uses no
    /// TLS, and records and stores nothing.
    fn default() -> Config {
        Config {
            files: assets::files(),
            scenes: Scene::built_in(),
            gallery: Gallery::default(),
            waits: limits::Timeouts::default(),
            guest_scenes: GuestScenes::default(),
            origins: Vec::new(),
            embedders: Vec::new(),
            hosts: Hosts::Any,
            trusted_proxies: Vec::new(),
            rooms_max: limits::rooms_max(),
            connections_max: limits::connections_max(),
            address_sessions_max: None,
            uplink_megabits: limits::UPLINK_MEGABITS,
            ops_token: None,
            tls: None,
            log_drops: None,
            replays: None,
            state: None,
            fleet: None,
            supervisor: Supervisor::default(),
            agones: None,
        }
    }
}
