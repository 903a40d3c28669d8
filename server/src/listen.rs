//! The port: accepts connections until it is told to stop, then drains them.

use crate::connects::Connects;
use crate::http::{self, Upgrade};
use crate::peers::Permit;
use crate::replays::Recording;
use crate::stream::Stream;
use crate::{App, Config, Phase, limits, ops, session};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::pin::pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};
use tracing::{debug, info, warn};

/// The answer to who connects too fast.
const CONNECTS_TOO_FAST: &[u8] = b"HTTP/1.1 429 Too Many Requests\r\nRetry-After: 1\r\n\
    Content-Length: 0\r\nConnection: close\r\n\r\n";

/// Serves until `shutdown` resolves, then tells the players, closes their sockets and returns
/// within [`limits::DRAIN_NOTICE`] + 3 x [`limits::DRAIN_MAX`].
pub async fn run(
    listener: TcpListener,
    config: Config,
    shutdown: impl Future<Output = ()>,
) -> io::Result<()> {
    run_with_ops(listener, None, config, shutdown).await
}

/// [`run`] with an operators' port, which is served to the very end.
pub async fn run_with_ops(
    listener: TcpListener,
    ops: Option<TcpListener>,
    config: Config,
    shutdown: impl Future<Output = ()>,
) -> io::Result<()> {
    check(&config)?;
    let (phase, followed) = watch::channel(Phase::Running);
    let recording = config.replays.clone().map(Recording::start).transpose()?;
    let app = Arc::new(App::new(config, followed, recording.clone()));
    let ops = ops.map(|ops| tokio::spawn(ops::serve(ops, Arc::clone(&app))));
    // Every connection holds a sender; when the last is dropped, nobody is connected.
    let (alive, mut all_gone) = mpsc::channel::<Infallible>(1);
    tokio::select! {
        () = accept(&listener, &app, &alive) => {}
        () = shutdown => {}
        () = app.drain.notified() => {}
    }
    drop((listener, alive));
    info!("draining");
    phase.send_replace(Phase::Draining);
    if timeout(limits::DRAIN_NOTICE, all_gone.recv()).await.is_err() {
        phase.send_replace(Phase::Closing);
        if timeout(limits::DRAIN_MAX, all_gone.recv()).await.is_err() {
            warn!("some sockets did not close in time");
        }
    }
    phase.send_replace(Phase::Closing);
    let rooms = Arc::clone(&app.rooms);
    let waited = tokio::task::spawn_blocking(move || rooms.wait());
    if timeout(limits::DRAIN_MAX, waited).await.is_err() {
        warn!("some rooms did not close in time");
    }
    if let Some(recording) = recording {
        let closed = tokio::task::spawn_blocking(move || recording.close());
        if timeout(limits::DRAIN_MAX, closed).await.is_err() {
            warn!("some replays were not written to their end in time");
        }
    }
    ops.inspect(JoinHandle::abort);
    info!("closed");
    Ok(())
}

fn check(config: &Config) -> io::Result<()> {
    let count = config.scenes.len();
    if count > limits::SCENES_MAX {
        let text = format!("{count} scenes; at most {} are allowed", limits::SCENES_MAX);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    getrandom::u64().map(drop).map_err(io::Error::other)
}

async fn accept(listener: &TcpListener, app: &Arc<App>, alive: &mpsc::Sender<Infallible>) {
    let mut connects = Connects::new(app.connections.address_max());
    let mut is_failing = false;
    loop {
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                app.metrics.turned_away("cannot_accept");
                // Told once, for this may go on twenty times a second.
                if !is_failing {
                    warn!(%error, "cannot accept; trying again and again");
                }
                is_failing = true;
                sleep(limits::ACCEPT_RETRY).await;
                continue;
            }
        };
        is_failing = false;
        let is_proxy = app.trusted_proxies.contains(&peer.ip().to_canonical());
        // A proxy speaks for many, and slows them itself.
        if !is_proxy && !connects.admit(peer.ip(), Instant::now()) {
            turn_back(&stream, app);
            debug!(address = %peer.ip(), "connects too fast");
            continue;
        }
        let permit = match is_proxy {
            // It speaks for many; they are counted when they play.
            true => app.connections.admit_one_of_all(peer.ip()),
            false => app.connections.admit(peer.ip()),
        };
        let Some(permit) = permit else {
            app.metrics.turned_away("too_many_connections");
            debug!(address = %peer.ip(), "too many connections");
            continue;
        };
        let (app, alive) = (Arc::clone(app), alive.clone());
        tokio::spawn(async move {
            serve(stream, peer, permit, &app).await;
            drop(alive);
        });
    }
}

/// Counts who connects too fast, and says so where that is free: under TLS it would cost a handshake.
fn turn_back(stream: &TcpStream, app: &App) {
    app.metrics.turned_away("connects_too_fast");
    if app.tls.is_none() {
        // A new socket takes so few bytes at once; if this one does not, it is closed without them.
        let _ = socket2::SockRef::from(stream).send(CONNECTS_TOO_FAST);
    }
}

/// One connection: HTTP first, then perhaps a session on the same socket.
async fn serve(stream: TcpStream, peer: SocketAddr, _permit: Permit, app: &Arc<App>) {
    if let Err(error) = tune(&stream) {
        debug!(address = %peer.ip(), %error, "socket lost before it was served");
        return;
    }
    let Some(stream) = secured(stream, peer.ip(), app).await else {
        return;
    };
    let spoken = speak_http(stream, peer.ip(), app);
    let Ok(Some(upgrade)) = timeout(limits::HTTP_CONNECTION_MAX, spoken).await else {
        return;
    };
    let Ok(connection) = upgrade.connection.await else {
        return;
    };
    let parts = connection
        .downcast::<TokioIo<Stream>>()
        .expect("every connection is served on a TokioIo<Stream>");
    let (stream, read) = (parts.io.into_inner(), parts.read_buf.to_vec());
    session::play(stream, read, &upgrade.code, upgrade.address, app).await;
}

/// Small messages go out at once, and little of what a keyframe would replace is buffered.
fn tune(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    socket2::SockRef::from(stream).set_send_buffer_size(limits::SEND_BUFFER_BYTES)
}

/// The stream as the configuration wants it. A peer that speaks no TLS, too slowly, or refuses our
/// certificate, is counted and let go; one that just goes is not counted.
async fn secured(stream: TcpStream, peer: IpAddr, app: &App) -> Option<Stream> {
    let Some(tls) = &app.tls else {
        return Some(Stream::Plain(stream));
    };
    let mut phase = app.phase.clone();
    let shaken = tokio::select! {
        shaken = timeout(app.waits.http_head, tls.accept(stream)) => shaken,
        () = draining(&mut phase) => return None,
    };
    match shaken {
        Ok(Ok(stream)) => return Some(stream),
        Ok(Err(error)) => {
            debug!(address = %peer, %error, "no TLS");
            if error.kind() == io::ErrorKind::InvalidData {
                app.metrics.turned_away("bad_tls");
            }
        }
        Err(_late) => app.metrics.turned_away("slow_tls"),
    }
    None
}

/// Answers requests until the peer has no more, or one asks for an upgrade: that one is returned. Any
/// stream will do; a peer that sends nothing is left after a while.
pub async fn speak_http<S>(stream: S, peer: IpAddr, app: &Arc<App>) -> Option<Upgrade>
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let upgraded = Arc::new(Mutex::new(None));
    let asked = Arc::new(AtomicBool::new(false));
    let service = service_fn(|request| {
        let (app, upgraded) = (Arc::clone(app), Arc::clone(&upgraded));
        asked.store(true, Ordering::Relaxed);
        async move {
            let (answer, upgrade) = http::answer(request, peer, &app).await;
            if upgrade.is_some() {
                *upgraded.lock().unwrap_or_else(PoisonError::into_inner) = upgrade;
            }
            Ok::<_, Infallible>(answer)
        }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(app.waits.http_head)
        .max_headers(limits::HTTP_HEADERS_MAX)
        .max_buf_size(limits::HTTP_BUFFER_BYTES_MAX)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    let mut connection = pin!(connection);
    let mut phase = app.phase.clone();
    let served = tokio::select! {
        served = connection.as_mut() => served,
        () = draining(&mut phase) => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = served {
        debug!(address = %peer, %error, "connection ended");
        count_refused(&error, asked.load(Ordering::Relaxed), app);
    }
    upgraded.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Counts a connection that was no HTTP, or whose first request did not come in time. One that asked
/// before has only been idle.
fn count_refused(error: &hyper::Error, asked: bool, app: &App) {
    if error.is_parse() {
        app.metrics.turned_away("bad_request");
    } else if error.is_timeout() && !asked {
        app.metrics.turned_away("slow_request");
    }
}

/// Resolves when the server begins to close.
async fn draining(phase: &mut watch::Receiver<Phase>) {
    // An error means that the server is gone, which is the same to a connection.
    let _ = phase.wait_for(|phase| *phase != Phase::Running).await;
}
