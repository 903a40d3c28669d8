//! `jostle serve` configures the server from the command line, and stops it on a signal.

#[cfg(feature = "nats")]
mod fleet;
mod values;

use crate::descriptors;
use crate::output::{Failure, OrFail, say};
use crate::scenes::found_scene_file;
use crate::signals;
use crate::systemd;
use bytes::Bytes;
use ipnet::IpNet;
use jostle_game::Scene;
use jostle_server::files::read_regular;
use jostle_server::guests::GuestScenes;
use jostle_server::log::{Settings, StateSettings, Sync, days};
use jostle_server::net::http::gallery::{Gallery, PICTURE_BYTES_MAX};
use jostle_server::net::http::headers::FrameOrigin;
use jostle_server::net::http::host::Hosts;
use jostle_server::net::tls::Tls;
use jostle_server::ops::agones;
use jostle_server::ops::panic_log::log_panics;
use jostle_server::ops::supervisor::Sign;
use jostle_server::{Config, limits, run_with_ops};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::net::TcpListener;
use tracing_appender::non_blocking::ErrorCounter;
use values::{host, origin, proxies, socket_address, whole};

/// Environment variable that may contain the operators' token instead of a file.
const OPS_TOKEN_VARIABLE: &str = "JOSTLE_OPS_TOKEN";
/// Environment variable in which Agones passes its sidecar's port.
const AGONES_PORT_VARIABLE: &str = "AGONES_SDK_HTTP_PORT";
/// The sidecar's default port.
const AGONES_PORT: u16 = 9358;

/// Serve the page and the rooms until SIGTERM or ctrl-c.
///
/// Prints one line with the address to open. On SIGTERM or ctrl-c, players are notified, sockets close with code 1001,
/// and the status is 0; a second signal ends the process immediately.
///
/// Each flag can also be set by an environment variable (JOSTLE_LISTEN for --listen, with commas between multiple
/// values) or in the --config file. Flags take precedence over variables, and variables over the file.
#[derive(clap::Args)]
pub struct Serve {
    /// TOML file that contains flags by name (listen = "0.0.0.0:8080"), used where neither the command line nor the
    /// environment sets a flag. Can also be set with JOSTLE_CONFIG
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    /// Check the settings and the files they name, then exit without serving
    #[arg(long)]
    check: bool,
    /// Address and port for the page and the sockets; port 0 picks a free one
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8080",
        value_parser = socket_address)]
    pub listen: SocketAddr,
    /// Address and port for operators: /healthz, /readyz and /metrics (OpenMetrics); do not expose it to the internet
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = socket_address)]
    pub ops: Option<SocketAddr>,
    /// File with a token, a line of 16 or more characters, that lets operators list and kick players, close rooms and
    /// drain the server through the --ops port. The JOSTLE_OPS_TOKEN environment variable may contain the token instead
    #[arg(long, value_name = "FILE", requires = "ops")]
    ops_token_file: Option<PathBuf>,
    /// PEM file with this server's certificate chain, starting with its own certificate; players then open https://
    /// addresses. The certificate and key are read again when they change, and on SIGHUP
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// PEM file with the unencrypted private key for the first certificate in --tls-cert
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Directory with additional scenes (*.toml); a scene with a built-in name replaces the built-in one
    #[arg(long, value_name = "DIR")]
    scenes: Option<PathBuf>,
    /// Directory with more scenes (*.toml), each with a picture of the same name (*.webp), which the lobby shows in its
    /// gallery
    #[arg(long, value_name = "DIR")]
    gallery: Option<PathBuf>,
    /// Whether players may open rooms with their own scene files: `private` for unlisted rooms only, `all` for listed
    /// ones too, `off` for none. Such a scene has a limited budget, and its room gets a limited share of a processor
    #[arg(long, value_name = "WHO", default_value = "private")]
    guest_scenes: GuestFlag,
    /// Another site whose pages may play here, as shown in its address bar: https://play.example.org. May be given more
    /// than once; this server's own pages are always allowed
    #[arg(long, value_name = "ORIGIN", value_parser = origin)]
    allow_origin: Vec<String>,
    /// Another site whose pages may show this server's page in a frame, as shown in its address bar:
    /// https://www.example.org. May be given more than once; by default, no page may
    #[arg(long, value_name = "ORIGIN", value_parser = FrameOrigin::parse)]
    allow_embed: Vec<FrameOrigin>,
    /// Name by which browsers may address this server, such as play.example.org; requests that use another name are
    /// refused. IP addresses and localhost are always allowed. May be given more than once. If not given, any name is
    /// allowed, unless --listen is a loopback address and no --trusted-proxy is given
    #[arg(long, value_name = "NAME", value_parser = host)]
    host: Vec<String>,
    /// Address of a proxy in front of this server, or a network of proxies such as 10.0.0.0/8. Its X-Forwarded-For
    /// header is trusted, so that limits apply to players' addresses rather than the proxy's. May be given more than
    /// once
    #[arg(long, value_name = "ADDRESS[/BITS]", value_parser = proxies)]
    trusted_proxy: Vec<IpNet>,
    /// Maximum number of rooms that people may have open at once, in addition to each scene's standing room; 32 per
    /// processor by default. One address may open an eighth of them, but at least 8
    #[arg(long, value_name = "N", value_parser = whole(1, limits::ROOMS_BOUND as u32))]
    rooms_max: Option<u32>,
    /// Maximum number of simultaneous connections from players, spectators and browsers loading the page; by default
    /// 2048 per processor, but at least 4096. One address may hold an eighth of them, but at least 512
    #[arg(long, value_name = "N", value_parser = whole(1, limits::CONNECTIONS_BOUND as u32))]
    connections_max: Option<u32>,
    /// Maximum number of scenes on offer, including the built-in ones
    #[arg(long, value_name = "N", default_value_t = limits::SCENES_MAX as u32,
        value_parser = whole(1, limits::SCENES_BOUND as u32))]
    scenes_max: u32,
    /// Maximum number of game sockets that one address (for IPv6, one /64) may hold at once; raise it for a party or a
    /// class behind one address, or for a load test. By default, 1/32 of the connections, but at least 128
    #[arg(long, value_name = "N", value_parser = whole(1, limits::CONNECTIONS_BOUND as u32))]
    address_sockets: Option<u32>,
    /// Megabits per second that this machine may send. Each address gets at most a quarter of this, and all rooms with
    /// players' scene files together get another quarter; beyond that, they receive fewer snapshots per second
    #[arg(long, value_name = "N", default_value_t = limits::UPLINK_MEGABITS,
        value_parser = whole(1, limits::UPLINK_MEGABITS_MAX))]
    uplink: u32,
    /// Record every room except private ones into this directory, which is created if it is missing. The page lists and
    /// plays these replays
    #[arg(long, value_name = "DIR")]
    replays: Option<PathBuf>,
    /// Total size of replays to keep, in megabytes; the oldest finished ones are deleted first
    #[arg(long, value_name = "N", default_value_t = limits::REPLAYS_MB, requires = "replays",
        value_parser = whole(1, 1 << 30))]
    replays_mb: u32,
    /// Number of days to keep a replay
    #[arg(long, value_name = "N", default_value_t = limits::REPLAYS_DAYS, requires = "replays",
        value_parser = whole(1, 36_500))]
    replays_days: u32,
    /// Keep the open rooms in this directory, which is created if it is missing. After a restart or a crash they resume
    /// where they were, and players get their seats back. Each server needs its own directory
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
    /// When the state is synced to the disk: with `second`, a power failure loses at most a second of play; `system`
    /// leaves it to the operating system. If only the server dies, at most half a second is lost either way
    #[arg(long, value_name = "WHEN", default_value = "second", requires = "state")]
    state_sync: StateSync,
    /// Report to the Agones sidecar that started this server: readiness, health, free room capacity and shutdown. The
    /// sidecar runs on this machine at the port given in AGONES_SDK_HTTP_PORT, or at 9358
    #[arg(long)]
    agones: bool,
    #[cfg(feature = "nats")]
    #[command(flatten)]
    fleet: fleet::FleetFlags,
}

/// When the state directory is synced to the disk.
#[derive(Clone, Copy, clap::ValueEnum)]
enum StateSync {
    Second,
    System,
}

/// Rooms that guests may open with their own scenes.
#[derive(Clone, Copy, clap::ValueEnum)]
enum GuestFlag {
    Off,
    Private,
    All,
}

impl Serve {
    /// Serves until a signal arrives. `log_drops` counts the lines that the log drops.
    pub fn run(self, log_drops: ErrorCounter) -> Result<(), Failure> {
        log_panics();
        let config = self.config()?;
        if self.check {
            let file = self.config.as_deref().map_or("settings".into(), Path::to_string_lossy);
            return say(format_args!("{file}: ok"));
        }
        let connections_max =
            descriptors::connections_max(config.connections_max, config.rooms_in_all());
        let config = Config { log_drops: Some(log_drops), connections_max, ..config };
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
        let runtime = runtime.or_check("runtime")?;
        let served = runtime.block_on(serve(self.listen, self.ops, config));
        // Tasks that did not end in time have been logged, and end with the process.
        runtime.shutdown_background();
        served
    }

    /// The server's configuration, including the files that the flags name.
    pub fn config(&self) -> Result<Config, Failure> {
        let mut config = Config::default();
        if let Some(dir) = &self.scenes {
            add_scenes(&mut config.scenes, "--scenes", dir, self.scenes_max as usize)?;
        }
        if let Some(dir) = &self.gallery {
            let names = add_scenes(&mut config.scenes, "--gallery", dir, self.scenes_max as usize)?;
            config.gallery = gallery(dir, names)?;
        }
        config.ops_token = ops_token(self.ops_token_file.as_deref())?;
        if let (Some(certificates), Some(key)) = (&self.tls_cert, &self.tls_key) {
            let tls = Tls::read(certificates, key);
            config.tls = Some(tls.map_err(|error| Failure::Usage(error.to_string()))?);
        }
        config.guest_scenes = match self.guest_scenes {
            GuestFlag::Off => GuestScenes::Off,
            GuestFlag::Private => GuestScenes::Private,
            GuestFlag::All => GuestScenes::All,
        };
        config.origins = self.allow_origin.clone();
        config.embedders = self.allow_embed.clone();
        config.hosts = hosts(self.host.clone(), self.listen, !self.trusted_proxy.is_empty());
        config.trusted_proxies = self.trusted_proxy.clone();
        config.rooms_max = self.rooms_max.map_or(config.rooms_max, |rooms| rooms as usize);
        let connections = self.connections_max.map(|connections| connections as usize);
        config.connections_max = connections.unwrap_or(config.connections_max);
        config.address_sessions_max = self.address_sockets.map(|sockets| sockets as usize);
        config.uplink_megabits = self.uplink;
        config.supervisor = systemd::supervisor();
        check_directory("--replays", self.replays.as_deref())?;
        check_directory("--state", self.state.as_deref())?;
        config.replays = self.replays.clone().map(|dir| Settings {
            bytes_max: u64::from(self.replays_mb) << 20,
            age_max: days(self.replays_days),
            ..Settings::new(dir)
        });
        let sync = match self.state_sync {
            StateSync::Second => Sync::Second,
            StateSync::System => Sync::System,
        };
        config.state = self.state.clone().map(|dir| StateSettings { dir, sync });
        config.agones = self.agones.then(|| agones(config.rooms_max)).transpose()?;
        #[cfg(feature = "nats")]
        {
            config.fleet = self.fleet.settings(self.state.is_some())?;
        }
        Ok(config)
    }
}

async fn serve(
    listen: SocketAddr,
    ops: Option<SocketAddr>,
    mut config: Config,
) -> Result<(), Failure> {
    let stop = signals::stop().or_check("signals")?;
    signals::read_again_on_hangup(config.tls.clone()).or_check("signals")?;
    let (listener, bound) = bind("--listen", listen).await?;
    let ops = match ops {
        Some(ops) => Some(bind("--ops", ops).await?),
        None => None,
    };
    let scheme = if config.tls.is_some() { "https" } else { "http" };
    let mut ready = format!("Jostle is at {}", url(scheme, bound));
    if let Some((_, bound)) = &ops {
        ready += &format!("\nOperators are at {}", url("http", *bound));
    }
    let ops = ops.map(|(listener, _)| listener);
    let tell = Arc::clone(&config.supervisor.tell);
    config.supervisor.tell = Arc::new(move |sign| {
        if sign == Sign::Ready {
            // The server keeps running even if its stdout is gone.
            let _ = say(&ready);
        }
        tell(sign);
    });
    run_with_ops(listener, ops, config, stop)
        .await
        .map_err(|error| Failure::Check(error.to_string()))
}

/// The operators' token, from the file or else from the environment. Either way, it does not appear in the process
/// list.
fn ops_token(file: Option<&Path>) -> Result<Option<String>, Failure> {
    let (place, text) = match file {
        Some(file) => {
            let place = format!("--ops-token-file {}", file.display());
            let bytes = read_regular(file, limits::SETTINGS_FILE_BYTES_MAX).or_usage(&place)?;
            (place, String::from_utf8_lossy(&bytes).into_owned())
        }
        None => match std::env::var(OPS_TOKEN_VARIABLE) {
            Ok(text) => (OPS_TOKEN_VARIABLE.to_owned(), text),
            Err(std::env::VarError::NotPresent) => return Ok(None),
            Err(error) => return Err(error).or_usage(OPS_TOKEN_VARIABLE),
        },
    };
    let token = text.trim();
    let printable = token.bytes().all(|byte| byte.is_ascii_graphic());
    if token.len() < limits::OPS_TOKEN_CHARS_MIN || !printable {
        let (found, allowed) = (token.len(), limits::OPS_TOKEN_CHARS_MIN);
        let text = format!(
            "{place}: found {found} characters; allowed: {allowed} or more, printable ASCII without spaces"
        );
        return Err(Failure::Usage(text));
    }
    Ok(Some(token.to_owned()))
}

/// The Agones sidecar, at the port that Agones passes to every game server.
fn agones(rooms_max: usize) -> Result<agones::Settings, Failure> {
    let port = match std::env::var(AGONES_PORT_VARIABLE) {
        Err(std::env::VarError::NotPresent) => AGONES_PORT,
        found => {
            let found = found.or_usage(AGONES_PORT_VARIABLE)?;
            let port = found.parse().ok().filter(|port| *port > 0);
            let text =
                format!("{AGONES_PORT_VARIABLE}: found {found:?}; allowed: a port from 1 to 65535");
            port.ok_or(Failure::Usage(text))?
        }
    };
    Ok(agones::Settings::new((Ipv4Addr::LOCALHOST, port).into(), rooms_max))
}

async fn bind(option: &str, address: SocketAddr) -> Result<(TcpListener, SocketAddr), Failure> {
    let what = format!("{option} {address}");
    let listener = TcpListener::bind(address).await.or_check(&what)?;
    let bound = listener.local_addr().or_check(what)?;
    Ok((listener, bound))
}

/// An address that a browser on this machine can open.
fn url(scheme: &str, bound: SocketAddr) -> String {
    let shown = match bound.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
        IpAddr::V6(ip) if ip.is_unspecified() => IpAddr::V6(Ipv6Addr::LOCALHOST),
        ip => ip,
    };
    format!("{scheme}://{}/", SocketAddr::new(shown, bound.port()))
}

/// The names by which the server may be addressed. By default, a server on a loopback address accepts none: otherwise,
/// a page opened on this machine could reach it under its own site's name (DNS rebinding).
fn hosts(names: Vec<String>, listen: SocketAddr, has_proxy: bool) -> Hosts {
    match names.is_empty() && (has_proxy || !listen.ip().is_loopback()) {
        true => Hosts::Any,
        false => Hosts::Listed(names),
    }
}

/// Checks that a path does not exist yet, or that it is a directory that this user may read and write.
fn check_directory(flag: &str, dir: Option<&Path>) -> Result<(), Failure> {
    let Some(dir) = dir.filter(|dir| dir.exists()) else { return Ok(()) };
    let place = format!("{flag} {}", dir.display());
    if !dir.is_dir() {
        return Err(Failure::Usage(format!("{place}: found a file; allowed: a directory")));
    }
    #[cfg(unix)]
    {
        use rustix::fs::{Access, access};
        access(dir, Access::READ_OK | Access::WRITE_OK | Access::EXEC_OK).or_usage(place)?;
    }
    Ok(())
}

/// The pictures beside the scenes with these names.
fn gallery(dir: &Path, names: Vec<String>) -> Result<Gallery, Failure> {
    let pictures = names.into_iter().map(|name| {
        let path = dir.join(&name).with_extension("webp");
        let picture = path.exists().then(|| read_regular(&path, PICTURE_BYTES_MAX)).transpose();
        Ok((name, picture.or_usage(path.display())?.map(Bytes::from)))
    });
    Ok(Gallery(pictures.collect::<Result<_, Failure>>()?))
}

/// Adds a directory's scenes, sorted by file name, and returns their names.
fn add_scenes(
    scenes: &mut Vec<Scene>,
    flag: &str,
    dir: &Path,
    allowed: usize,
) -> Result<Vec<String>, Failure> {
    let mut names = Vec::new();
    for path in scene_paths(flag, dir)? {
        let scene = found_scene_file(&path)?;
        names.push(scene.name.clone());
        match scenes.iter_mut().find(|known| known.name == scene.name) {
            Some(known) => *known = scene,
            None => scenes.push(scene),
        }
    }
    if scenes.len() > allowed {
        let found = scenes.len();
        let text = format!(
            "{}: scenes: found {found} in all; allowed: {allowed}, unless --scenes-max says more",
            dir.display()
        );
        return Err(Failure::Check(text));
    }
    Ok(names)
}

fn scene_paths(flag: &str, dir: &Path) -> Result<Vec<PathBuf>, Failure> {
    let paths = std::fs::read_dir(dir)
        .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, _>>());
    let mut paths = paths.or_usage(format_args!("{flag} {}", dir.display()))?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    Ok(paths)
}

#[cfg(test)]
mod tests {
    use super::values::host;
    use super::{Failure, Hosts, check_directory, hosts};
    use std::path::Path;

    #[test]
    fn directories_are_free_paths_or_ones_that_can_be_used() {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let check = |name: &str| check_directory("--state", Some(&package.join(name)));
        assert!(check("src").is_ok() && check("none").is_ok());
        assert!(check_directory("--state", None).is_ok());
        let Err(Failure::Usage(text)) = check("Cargo.toml") else { panic!("a file was accepted") };
        assert!(text.starts_with("--state ") && text.contains("found a file"), "{text}");
    }

    #[test]
    fn a_server_for_this_machine_alone_goes_by_no_name_of_another_site() {
        let [local, open] = ["127.0.0.1:80", "0.0.0.0:80"].map(|text| text.parse().unwrap());
        let names = || vec![host("Play.Example.org").unwrap()];
        let listed = Hosts::Listed(vec!["play.example.org".to_owned()]);
        assert_eq!(hosts(Vec::new(), local, false), Hosts::Listed(Vec::new()));
        assert_eq!(hosts(Vec::new(), open, false), Hosts::Any);
        assert_eq!(hosts(Vec::new(), local, true), Hosts::Any, "the proxy knows the names");
        assert_eq!(
            [hosts(names(), local, true), hosts(names(), open, false)],
            [listed.clone(), listed]
        );
        for text in ["https://a.example", "a.example:80", "a b", ""] {
            assert!(host(text).is_err_and(|error| error.contains("play.example.org")), "{text:?}");
        }
    }
}
