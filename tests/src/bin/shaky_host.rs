//! A server on a machine that fails on demand: `shaky_host DIR [CERTIFICATE KEY]` records into DIR, prints the
//! addresses of its two ports, and obeys one order per line of standard input. In all other respects it is the shipped
//! server; SIGTERM shuts it down cleanly.
//!
//! `disk good|full|closed`, `clock on|back` (40 days), `descriptors none|some`.

use anyhow::{Context, bail};
use jostle_game::Scene;
use jostle_server::limits::Timeouts;
use jostle_server::log::Settings;
use jostle_server::net::assets;
use jostle_server::net::http::host::Hosts;
use jostle_server::net::tls::Tls;
use jostle_server::{Config, run_with_ops};
use jostle_tests::scenes::{CROWD, RESTLESS, SMALL};
use jostle_tests::server::{OPS_TOKEN, PATIENT, PROXY};
use std::fs::File;
use std::io::{self, Write};
use std::net::IpAddr;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicI64, AtomicU8, Ordering};
use std::time::{Duration, SystemTime};
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::oneshot;

const GOOD: u8 = 0;
/// Nothing more can be written, to either open or new files.
const FULL: u8 = 1;
/// No new files can be created.
const CLOSED: u8 = 2;

static DISK: AtomicU8 = AtomicU8::new(GOOD);
/// Offset of the wall clock in days.
static CLOCK_DAYS: AtomicI64 = AtomicI64::new(0);
/// Size of a clock step in days, which is longer than replays are kept.
const STEP_DAYS: i64 = 40;

struct ShakyFile(File);

impl Write for ShakyFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match DISK.load(Ordering::Relaxed) {
            FULL => Err(io::ErrorKind::StorageFull.into()),
            _ => self.0.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

fn create(path: &Path) -> io::Result<Box<dyn Write + Send>> {
    match DISK.load(Ordering::Relaxed) {
        CLOSED => Err(io::ErrorKind::PermissionDenied.into()),
        FULL => Err(io::ErrorKind::StorageFull.into()),
        _ => Ok(Box::new(ShakyFile(File::options().write(true).create_new(true).open(path)?))),
    }
}

fn wall() -> SystemTime {
    let days = CLOCK_DAYS.load(Ordering::Relaxed);
    let step = Duration::from_secs(24 * 60 * 60) * days.unsigned_abs() as u32;
    if days < 0 { SystemTime::now() - step } else { SystemTime::now() + step }
}

/// Allows either no further descriptors or the usual number.
fn limit_descriptors(none: bool) -> anyhow::Result<()> {
    use rustix::process::{Resource, getrlimit, setrlimit};
    let mut limit = getrlimit(Resource::Nofile);
    limit.current = match none {
        // New descriptors get the lowest free number, which is the one this file has.
        true => Some(u64::try_from(File::open("/dev/null")?.as_raw_fd())?),
        false => limit.maximum,
    };
    Ok(setrlimit(Resource::Nofile, limit)?)
}

fn obey(order: &str) -> anyhow::Result<()> {
    match order {
        "disk good" => DISK.store(GOOD, Ordering::Relaxed),
        "disk full" => DISK.store(FULL, Ordering::Relaxed),
        "disk closed" => DISK.store(CLOSED, Ordering::Relaxed),
        "clock on" => CLOCK_DAYS.store(STEP_DAYS, Ordering::Relaxed),
        "clock back" => CLOCK_DAYS.store(-STEP_DAYS, Ordering::Relaxed),
        "descriptors none" => limit_descriptors(true)?,
        "descriptors some" => limit_descriptors(false)?,
        _ => bail!("unknown order {order:?}"),
    }
    Ok(())
}

/// The server's timeouts. Those that some faults have to wait for are short, but long enough for a crowd on a busy
/// machine.
fn waits() -> Timeouts {
    Timeouts {
        http_head: Duration::from_secs(15),
        http_body: Duration::from_secs(15),
        hello: Duration::from_secs(15),
        keepalive: Duration::from_secs(5),
        silence: Duration::from_secs(25),
        stall: Duration::from_secs(15),
        ..PATIENT
    }
}

/// Replaces the built page with one file that is large enough to fill every buffer along the way.
static FILES: [assets::AssetFile; 1] =
    [assets::AssetFile { name: "big.bin", etag: "\"big\"", bytes: &[7; 4 << 20] }];

fn config(dir: PathBuf) -> anyhow::Result<Config> {
    let retry = Duration::from_secs(1);
    let look_every = Duration::from_millis(200);
    let replays = Settings { create, wall, retry, look_every, ..Settings::new(dir) };
    let mut config = Config {
        files: &FILES,
        waits: waits(),
        replays: Some(replays),
        // All faults come from a few local addresses.
        address_sessions_max: Some(8192),
        trusted_proxies: vec![IpAddr::from(PROXY).into()],
        hosts: Hosts::Listed(vec!["localhost.example.org".to_owned()]),
        ops_token: Some(OPS_TOKEN.to_owned()),
        ..Config::default()
    };
    for (name, source) in [("restless", RESTLESS), ("crowd", CROWD), ("small", SMALL)] {
        config.scenes.push(Scene::parse(&format!("{name}.toml"), source)?);
    }
    // A scene whose first particle refers to a recipe that does not exist, as might result from a bug in a game.
    let mut scenes = Scene::built_in().into_iter();
    let mut cracked = scenes.find(|scene| scene.name == "particles").context("a built-in scene")?;
    cracked.name = "cracked".to_owned();
    cracked.world.recipes.clear();
    config.scenes.push(cracked);
    Ok(config)
}

/// Obeys orders until the parent process is gone.
fn obey_all() {
    for order in io::stdin().lines() {
        let Ok(order) = order else { return };
        match obey(&order) {
            Ok(()) => println!("ok"),
            Err(error) => println!("{error}"),
        }
    }
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let dir = arguments.next().context("usage: shaky_host DIR [CERTIFICATE KEY]")?;
    let mut config = config(dir)?;
    if let (Some(certificate), Some(key)) = (arguments.next(), arguments.next()) {
        config.tls = Some(Tls::read(&certificate, &key)?);
    }
    let mut term = signal(SignalKind::terminate())?;
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let ops = TcpListener::bind("127.0.0.1:0").await?;
    println!("{} {}", listener.local_addr()?, ops.local_addr()?);
    let (gone, deserted) = oneshot::channel();
    std::thread::spawn(move || {
        obey_all();
        // The receiver exists as long as the server does.
        let _ = gone.send(());
    });
    let stop = async move {
        tokio::select! {
            _ = term.recv() => {}
            _ = deserted => {}
        }
    };
    Ok(run_with_ops(listener, Some(ops), config, stop).await?)
}
