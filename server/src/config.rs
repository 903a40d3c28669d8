//! The configuration of a server.

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
    /// How long the server waits before it gives up a peer or a room.
    pub waits: limits::Waits,
    /// Whether guests may open rooms with scenes of their own.
    pub guest_scenes: GuestScenes,
    /// Sites besides this one whose pages may play here, such as `https://play.example.org`.
    pub origins: Vec<String>,
    /// Names by which requests may address this server.
    pub hosts: Hosts,
    /// Networks of proxies whose `X-Forwarded-For` header is trusted.
    pub trusted_proxies: Vec<IpNet>,
    /// Rooms that people create, at a time, at most [`limits::ROOMS_BOUND`]; the scenes' standing rooms do not count.
    pub rooms_max: usize,
    /// Connections at a time, at most [`limits::CONNECTIONS_BOUND`].
    pub connections_max: usize,
    /// Game sockets of one address; `None` for its share of the connections ([`limits::address_sessions_max`]).
    pub address_sessions_max: Option<usize>,
    /// Megabits a second that the server may send: of these one address is sent a part, and rooms with scenes of guests
    /// together send one ([`limits::uplink`]).
    pub uplink_megabits: u32,
    /// Token that operators need for the admin paths; `None` closes these.
    pub ops_token: Option<String>,
    /// Certificate and key of the players' port; `None` serves it without TLS.
    pub tls: Option<tls::Tls>,
    /// Counter of dropped log lines, if the log drops any.
    pub log_drops: Option<ErrorCounter>,
    /// Directory and limits of recordings; `None` records nothing.
    pub replays: Option<log::Settings>,
    /// Where rooms are kept, so that they outlive the process; `None` lets them end with it.
    pub state: Option<StateSettings>,
    /// How the server takes part in a fleet; `None` for a server of its own. Needs the feature `nats`, and excludes
    /// `state`: where a room is kept decides which server goes on with it.
    pub fleet: Option<FleetSettings>,
    /// Told of the server's signs of life.
    pub supervisor: Supervisor,
    /// Agones' sidecar, if Agones started the server.
    pub agones: Option<agones::Settings>,
}

impl Config {
    /// Rooms at a time: those that people create, and the standing room of each scene.
    pub fn rooms_in_all(&self) -> usize {
        self.rooms_max + self.scenes.len()
    }

    /// Where the best runs are kept: beside the open rooms, or else beside the replays.
    pub fn records_dir(&self) -> Option<PathBuf> {
        let state = self.state.as_ref().map(|state| &state.dir);
        let dir = state.or(self.replays.as_ref().map(|replays| &replays.dir))?;
        Some(dir.join("records"))
    }
}

impl Default for Config {
    /// The embedded page, the built-in scenes, pages of this site only, no proxies, no TLS, nothing recorded or
    /// kept.
    fn default() -> Config {
        Config {
            files: assets::files(),
            scenes: Scene::built_in(),
            waits: limits::Waits::default(),
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
