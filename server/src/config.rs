//! The server configuration.

use crate::fleet::settings::FleetSettings;
use crate::guests::GuestScenes;
use crate::limits;
use crate::log::{self, StateSettings};
use crate::net::http::host::Hosts;
use crate::net::{assets, tls};
use crate::ops::agones;
use crate::ops::supervisor::Supervisor;
use ipnet::IpNet;
use jostle_game::Scene;
use std::path::PathBuf;
use tracing_appender::non_blocking::ErrorCounter;

/// Settings that a server starts with.
#[derive(Clone, Debug)]
pub struct Config {
    /// Files of the page, sorted by name.
    pub files: &'static [assets::AssetFile],
    /// Scenes on offer, at most [`limits::SCENES_BOUND`], each name once.
    pub scenes: Vec<Scene>,
    /// Timeouts after which the server gives up on a peer or a room.
    pub waits: limits::Timeouts,
    /// Whether guests may open rooms with their own scenes.
    pub guest_scenes: GuestScenes,
    /// Sites besides this one whose pages may play here, such as `https://play.example.org`.
    pub origins: Vec<String>,
    /// Names by which requests may address this server.
    pub hosts: Hosts,
    /// Networks of proxies whose `X-Forwarded-For` header is trusted.
    pub trusted_proxies: Vec<IpNet>,
    /// Limit on the rooms that people may have open at a time, at most [`limits::ROOMS_BOUND`]. The scenes' standing
    /// rooms do not count.
    pub rooms_max: usize,
    /// Limit on simultaneous connections, at most [`limits::CONNECTIONS_BOUND`].
    pub connections_max: usize,
    /// Limit on game sockets per address; `None` for its share of the connections ([`limits::address_sessions_max`]).
    pub address_sessions_max: Option<usize>,
    /// Megabits per second that the server may send. One address gets a part of them, and all rooms with guests' scenes
    /// share another part ([`limits::uplink`]).
    pub uplink_megabits: u32,
    /// Token that operators need for the admin paths; `None` disables these paths.
    pub ops_token: Option<String>,
    /// Certificate and key for the players' port; `None` serves it without TLS.
    pub tls: Option<tls::Tls>,
    /// Counter of dropped log lines, if the log can drop any.
    pub log_drops: Option<ErrorCounter>,
    /// Directory and limits of recordings; `None` records nothing.
    pub replays: Option<log::Settings>,
    /// Where rooms are stored so that they outlive the process; `None` lets them end with it.
    pub state: Option<StateSettings>,
    /// The server's settings as a node of a fleet; `None` for a single server. Needs the feature `nats`, and excludes
    /// `state`: where a room is stored decides which server resumes it.
    pub fleet: Option<FleetSettings>,
    /// Receives the server's status notifications.
    pub supervisor: Supervisor,
    /// The Agones sidecar, if Agones started the server.
    pub agones: Option<agones::Settings>,
}

impl Config {
    /// Maximum number of rooms at a time: those that people create, and the standing room of each scene.
    pub fn rooms_in_all(&self) -> usize {
        self.rooms_max + self.scenes.len()
    }

    /// Directory of the best runs: that of the open rooms, or else that of the replays.
    pub fn records_dir(&self) -> Option<PathBuf> {
        let state = self.state.as_ref().map(|state| &state.dir);
        let dir = state.or(self.replays.as_ref().map(|replays| &replays.dir))?;
        Some(dir.join("records"))
    }
}

impl Default for Config {
    /// The embedded page, the built-in scenes, pages of this site only, no proxies, no TLS, and nothing recorded or
    /// stored.
    fn default() -> Config {
        Config {
            files: assets::files(),
            scenes: Scene::built_in(),
            waits: limits::Timeouts::default(),
            guest_scenes: GuestScenes::default(),
            origins: Vec::new(),
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
