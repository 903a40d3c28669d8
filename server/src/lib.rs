//! The host: sockets, sessions, tickers (the only clocks) and files. It contains no game rules, and lets no client or
//! room delay another. A program that embeds it calls [`run`].
//!
//! A connection passes through [`net`]: [`net::listen`] accepts and counts it, one of the [`net::socket_threads`] takes
//! it from there, [`net::tls`] decrypts it if configured, [`net::http`] answers or upgrades it, and [`net::session`]
//! runs the game session, over a WebSocket or over HTTP ([`net::posts`]). A session and its room communicate through
//! two bounded queues: the inbox that the session fills and the [`host::outbox`] that it empties. [`host::ticker`] is
//! the room's thread between them; [`host::rooms`] lists the rooms. [`log`] contains the readers of rooms' logs, which
//! record games and store rooms so that they outlive the process. [`runs`] keeps the best runs. [`limits`] bounds how
//! much an address, a network or a socket may use. [`ops`] counts events, serves them to operators on a separate port,
//! and logs refusals.

pub mod config;
pub mod files;
pub mod fleet;
pub mod guests;
pub mod host;
pub mod limits;
pub mod log;
pub mod net;
pub mod ops;
pub mod runs;
pub mod state;

pub use config::Config;
pub use host::Phase;
pub use state::{Parts, ServerState};

use fleet::handle::Fleet;
use fleet::joining::Joining;
use host::rooms::Rooms;
use log::Logs;
use net::listen::accept;
use net::socket_threads::SocketThreads;
use ops::agones;
use ops::bans::Bans;
use ops::supervisor::{self, Sign};
use runs::Records;
use std::convert::Infallible;
use std::io;
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, watch};
use tokio::task::spawn_blocking;
use tokio::time::{Instant, sleep, timeout, timeout_at};
use tracing::{info, warn};

/// Serves until `shutdown` resolves, then warns the players, closes their sockets and returns
/// within [`limits::Timeouts::drain_max`].
pub async fn run(
    listener: TcpListener,
    config: Config,
    shutdown: impl Future<Output = ()>,
) -> io::Result<()> {
    run_with_ops(listener, None, config, shutdown).await
}

/// Like [`run`], with an operators' port that is served until the very end.
pub async fn run_with_ops(
    listener: TcpListener,
    ops: Option<TcpListener>,
    config: Config,
    shutdown: impl Future<Output = ()>,
) -> io::Result<()> {
    check(&config)?;
    let (supervisor, agones) = (config.supervisor.clone(), config.agones);
    let (phase, followed) = watch::channel(Phase::Running);
    let certificates = config.tls.clone().map(|tls| {
        let every = config.waits.certificate_look;
        tokio::spawn(async move { tls.keep_current(every).await })
    });
    let (state, joining) = open(config, followed).await?;
    let fleet =
        joining.map(|joining| joining.start(Arc::clone(&state.rooms), Arc::clone(&state.host)));
    let ops = ops.map(|ops| tokio::spawn(ops::port::serve(ops, Arc::clone(&state))));
    let watch = supervisor.alive_every.map(|every| {
        tokio::spawn(supervisor::watch(
            Arc::clone(&supervisor.tell),
            every,
            Arc::clone(&state.host),
        ))
    });
    (supervisor.tell)(Sign::Ready);
    // Every connection holds a clone of the sender. Once the last one is dropped, all connections have ended.
    let (alive, all_gone) = mpsc::channel::<Infallible>(1);
    let threads = SocketThreads::start(&state.host.send_queues)?;
    let agones =
        agones.map(|settings| tokio::spawn(agones::accompany(settings, Arc::clone(&state.host))));
    tokio::select! {
        () = accept(&listener, &threads, &state, &alive) => {}
        () = shutdown => {}
        () = state.drain.notified() => {}
    }
    drop((listener, alive));
    (supervisor.tell)(Sign::Stopping);
    let ends_at = Instant::now() + state.config.waits.drain_max;
    drain(&state, &phase, all_gone, ends_at).await;
    if let Some(mut agones) = agones {
        let _ = timeout_at(ends_at, &mut agones).await;
        agones.abort();
    }
    [ops, watch, certificates, fleet].into_iter().flatten().for_each(|task| task.abort());
    info!("closed");
    Ok(())
}

/// Opens a server's files and the rooms from the previous process. A server in a fleet has yet to join it.
async fn open(
    config: Config,
    phase: watch::Receiver<Phase>,
) -> io::Result<(Arc<ServerState>, Option<Joining>)> {
    let rooms = config.rooms_in_all();
    let mut logs = Logs::open(config.replays.as_ref(), config.state.as_ref(), rooms)?;
    let saved = logs.saved_rooms()?;
    let records = open_records(&config)?;
    let joining = match config.fleet.clone() {
        Some(settings) => {
            let (joining, stream) = Joining::new(settings).await?;
            logs.stream = Some(stream);
            Some(joining)
        }
        None => None,
    };
    let state = Arc::new(ServerState::new(
        Parts {
            phase,
            records,
            bans: Bans::open(logs.states.as_ref().map(|states| states.dir().bans())),
            key: key(&config, &logs),
            fleet: joining.as_ref().map(|joining| Arc::clone(&joining.fleet)),
            logs,
        },
        config,
    ));
    state.rooms.restore(saved);
    Ok((state, joining))
}

/// Warns the players, closes their sockets, and then ends the rooms and their files. Tasks that are late are logged and
/// abandoned.
async fn drain(
    state: &ServerState,
    phase: &watch::Sender<Phase>,
    mut all_gone: mpsc::Receiver<Infallible>,
    ends_at: Instant,
) {
    info!("draining");
    let limits::Timeouts { drain_notice, drain, .. } = state.config.waits;
    if let Some(fleet) = &state.fleet {
        hand_over(fleet, &state.rooms).await;
    }
    phase.send_replace(Phase::Draining);
    // Players who are still connected are disconnected now.
    let _ = timeout(drain_notice, all_gone.recv()).await;
    phase.send_replace(Phase::Closing);
    let closes_by = (ends_at - limits::DRAIN_FILES).min(Instant::now() + drain);
    let sockets = async {
        if timeout_at(closes_by, all_gone.recv()).await.is_err() {
            warn!("some sockets did not close in time");
        }
    };
    let rooms_and_files = async {
        let rooms = Arc::clone(&state.rooms);
        blocking(closes_by, "some rooms did not close in time", move || rooms.wait()).await;
        let host = Arc::clone(&state.host);
        let close = move || host.logs.close();
        blocking(ends_at, "some logs were not written to their end in time", close).await;
        // This is done even if a socket does not close in time; otherwise other nodes would wait for the lease to
        // expire.
        if let Some(fleet) = &state.fleet {
            fleet.leave(ends_at.min(Instant::now() + limits::FLEET_ANSWER)).await;
        }
    };
    tokio::join!(sockets, rooms_and_files);
}

/// Hands over the rooms to other nodes, and waits until their players have been told.
async fn hand_over(fleet: &Fleet, rooms: &Rooms) {
    let until = Instant::now() + limits::FLEET_DRAIN;
    fleet.hand_over(until).await;
    let left = || rooms.list().len() > fleet.ask(|directory| directory.holds());
    while left() && Instant::now() < until {
        sleep(limits::FLEET_HAND_OVER_LOOK).await;
    }
}

/// Waits for blocking work until a deadline, and logs if the work is late.
async fn blocking(until: Instant, late: &str, work: impl FnOnce() + Send + 'static) {
    if timeout_at(until, spawn_blocking(work)).await.is_err() {
        warn!("{late}");
    }
}

/// The best runs, if the server has a directory for them. From now on, their replays are verified again.
fn open_records(config: &Config) -> io::Result<Option<Arc<Records>>> {
    let Some(dir) = config.records_dir() else { return Ok(None) };
    let records = Records::open(dir, &config.scenes, config.waits.run_trial);
    records.reload()?;
    Ok(Some(records))
}

/// The key that signs tokens: the fleet's key, or else the previous process's.
fn key(config: &Config, logs: &Logs) -> Option<[u8; 32]> {
    let of_fleet = config.fleet.as_ref().map(|fleet| fleet.secret);
    of_fleet.or_else(|| logs.states.as_ref().map(|states| *states.dir().key()))
}

fn check(config: &Config) -> io::Result<()> {
    let count = config.scenes.len();
    if count > limits::SCENES_BOUND {
        let text = format!("{count} scenes; at most {} are allowed", limits::SCENES_BOUND);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    getrandom::u64().map(drop).map_err(io::Error::other)
}
