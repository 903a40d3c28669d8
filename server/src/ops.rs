//! The operators' port: whether the server lives, whether it takes players, and its metrics. It is a
//! port of its own, so that it can be closed to the world, and has its own few connections, so that
//! scraping it hard costs players nothing. What changes anything is in [`admin`], behind a token.

mod admin;

use crate::metrics::Moment;
use crate::peers::Peers;
use crate::{App, Phase, limits};
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{sleep, timeout};
use tracing::{debug, warn};

const TEXT: &str = "text/plain; charset=utf-8";
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Serves until it is dropped.
pub async fn serve(listener: TcpListener, app: Arc<App>) {
    let places = Peers::new(limits::OPS_CONNECTIONS_MAX, limits::OPS_CONNECTIONS_MAX);
    loop {
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                warn!(%error, "cannot accept on the operators' port");
                sleep(limits::ACCEPT_RETRY).await;
                continue;
            }
        };
        let Some(permit) = places.admit_one_of_all(peer.ip()) else {
            app.metrics.turned_away("ops_busy");
            continue;
        };
        let app = Arc::clone(&app);
        tokio::spawn(async move {
            let served = timeout(limits::OPS_CONNECTION_MAX, speak(stream, &app)).await;
            if let Ok(Err(error)) = served {
                debug!(%error, "connection to the operators' port ended");
            }
            drop(permit);
        });
    }
}

async fn speak(stream: TcpStream, app: &App) -> hyper::Result<()> {
    let service =
        service_fn(|request| async move { Ok::<_, Infallible>(answer(&request, app).await) });
    http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(app.waits.http_head)
        .max_headers(limits::HTTP_HEADERS_MAX)
        .max_buf_size(limits::HTTP_BUFFER_BYTES_MAX)
        .serve_connection(TokioIo::new(stream), service)
        .await
}

async fn answer(request: &Request<Incoming>, app: &App) -> Response<Full<Bytes>> {
    if let Some(rest) = request.uri().path().strip_prefix("/admin/") {
        return admin::answer(request, rest, app).await;
    }
    if !matches!(*request.method(), Method::GET | Method::HEAD) {
        return respond(StatusCode::METHOD_NOT_ALLOWED, TEXT, "only GET and HEAD\n".into());
    }
    match request.uri().path() {
        "/healthz" => respond(StatusCode::OK, TEXT, "alive\n".into()),
        "/readyz" if *app.phase.borrow() == Phase::Running => {
            respond(StatusCode::OK, TEXT, "ready\n".into())
        }
        "/readyz" => respond(StatusCode::SERVICE_UNAVAILABLE, TEXT, "closing\n".into()),
        "/metrics" => respond(StatusCode::OK, OPEN_METRICS, app.metrics.text(moment(app))),
        _ => respond(StatusCode::NOT_FOUND, TEXT, "/healthz, /readyz or /metrics\n".into()),
    }
}

fn moment(app: &App) -> Moment {
    let rooms = app.rooms.list();
    let sum = |count: fn(&crate::rooms::Facts) -> usize| {
        rooms.iter().map(|facts| count(facts) as i64).sum()
    };
    let replays = app.replays.as_ref().map(|shelf| {
        let counters = shelf.counters();
        [&counters.bytes, &counters.errors].map(|count| count.load(Ordering::Relaxed))
    });
    Moment {
        rooms: rooms.len() as i64,
        players: sum(|facts| facts.players.load(Ordering::Relaxed)),
        bodies: sum(|facts| facts.bodies.load(Ordering::Relaxed)),
        replays,
    }
}

fn respond(status: StatusCode, content_type: &'static str, body: String) -> Response<Full<Bytes>> {
    let mut answer = Response::new(Full::new(body.into()));
    *answer.status_mut() = status;
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}
