//! The operators' port: liveness, readiness and metrics. It is a separate port so that it can be kept off the internet.
//! It has a small connection limit of its own, so that heavy scraping costs players nothing. Everything that changes
//! state is in [`admin`], behind a token.

use crate::host::Phase;
use crate::host::room_handle::RoomInfo;
use crate::limits;
use crate::limits::connection_limits::ConnectionLimits;
use crate::net::http::builder;
use crate::net::http::host::{self, Hosts};
use crate::net::http::response::{Answer, TEXT, uncached};
use crate::ops::admin;
use crate::ops::metrics::{FleetGauges, Gauges};
use crate::state::ServerState;
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper::{Method, Request, StatusCode};
use hyper_util::rt::TokioIo;
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tokio::net::TcpListener;
use tokio::time::{sleep, timeout};
use tracing::{debug, warn};

/// Maximum lifetime of a connection to the operators' port.
const OPS_CONNECTION_MAX: Duration = Duration::from_secs(60);

const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Serves until the future is dropped.
pub async fn serve(listener: TcpListener, state: Arc<ServerState>) {
    let connections =
        ConnectionLimits::new(limits::OPS_CONNECTIONS_MAX, limits::OPS_CONNECTIONS_MAX);
    loop {
        state.spare.refill();
        let (stream, peer) = match state.spare.accept(&listener).await {
            Ok(accepted) => accepted,
            Err(error) => {
                warn!(%error, "cannot accept on the operators' port");
                sleep(limits::ACCEPT_RETRY).await;
                continue;
            }
        };
        let Some(permit) = connections.admit_one_of_all(peer.ip()) else {
            state.refused("ops_busy", peer.ip(), "a connection");
            state.spare.take_back(stream);
            continue;
        };
        let state = Arc::clone(&state);
        tokio::spawn(async move {
            let service =
                service_fn(async |request| Ok::<_, Infallible>(answer(&request, &state).await));
            let connection =
                builder(&state.config.waits).serve_connection(TokioIo::new(stream), service);
            let mut connection = Box::pin(connection);
            let served = timeout(OPS_CONNECTION_MAX, connection.as_mut()).await;
            state.spare.take_back(connection);
            if let Ok(Err(error)) = served {
                debug!(%error, "connection to the operators' port ended");
            }
            drop(permit);
        });
    }
}

async fn answer(request: &Request<Incoming>, state: &ServerState) -> Answer {
    // Prevents other sites' pages from making a browser address this port by their site's name.
    let hosts = match &state.config.hosts {
        Hosts::Any => &Hosts::Listed(Vec::new()),
        listed => listed,
    };
    let checked = host::check_once(request.headers()).and_then(|()| host::check(request, hosts));
    if let Err(error) = checked {
        return uncached(StatusCode::BAD_REQUEST, TEXT, format!("{error}\n"));
    }
    if let Some(rest) = request.uri().path().strip_prefix("/admin/") {
        return admin::answer(request, rest, state).await;
    }
    if !matches!(*request.method(), Method::GET | Method::HEAD) {
        return uncached(StatusCode::METHOD_NOT_ALLOWED, TEXT, "only GET and HEAD\n");
    }
    match request.uri().path() {
        "/healthz" => uncached(StatusCode::OK, TEXT, "alive\n"),
        "/readyz" => match readiness(state) {
            Ok(()) => uncached(StatusCode::OK, TEXT, "ready\n"),
            Err(why) => uncached(StatusCode::SERVICE_UNAVAILABLE, TEXT, why),
        },
        "/metrics" => {
            uncached(StatusCode::OK, OPEN_METRICS, state.host.metrics.text(gauges(state)))
        }
        _ => uncached(StatusCode::NOT_FOUND, TEXT, "/healthz, /readyz or /metrics\n"),
    }
}

/// Returns whether players can be sent here; the error is the reason why they cannot.
fn readiness(state: &ServerState) -> Result<(), &'static str> {
    if *state.host.phase.borrow() != Phase::Running {
        return Err("closing\n");
    }
    match &state.fleet {
        Some(fleet) if fleet.lease_left().is_zero() => Err("no lease: NATS does not answer\n"),
        _ => Ok(()),
    }
}

fn gauges(state: &ServerState) -> Gauges {
    let rooms = state.rooms.list();
    let sum = |count: fn(&RoomInfo) -> usize| rooms.iter().map(|info| count(info) as i64).sum();
    let now = Instant::now();
    let oldest = rooms.iter().map(|info| info.last_tick.age(now)).max();
    let replays = state.replays().map(|store| {
        let [_, bytes, errors] = store.counts();
        [bytes, errors]
    });
    Gauges {
        rooms: rooms.len() as i64,
        players: sum(|info| info.players.load(Ordering::Relaxed)),
        spectators: sum(|info| info.spectators.load(Ordering::Relaxed)),
        bodies: sum(|info| info.bodies.load(Ordering::Relaxed)),
        room_tick_age: oldest.unwrap_or_default().as_secs_f64(),
        replays,
        state_errors: state.host.logs.state_errors(),
        log_drops: state.config.log_drops.as_ref().map_or(0, |drops| drops.dropped_lines() as u64),
        fleet: state.fleet.as_ref().map(|fleet| FleetGauges {
            nodes: fleet.ask(|directory| directory.nodes()) as i64,
            rooms: fleet.ask(|directory| directory.holds()) as i64,
            lease_left: fleet.lease_left().as_secs_f64(),
        }),
    }
}
