//! The players' port, which accepts connections, secures them and speaks HTTP until a session takes one over.

use crate::host::Phase;
use crate::limits;
use crate::limits::address_rate_limiter::AddressRateLimiter;
use crate::limits::connection_limits::Permit;
use crate::net::game_socket::{self, GameSocket};
use crate::net::http::response::Answer;
use crate::net::http::{self, Opening, Upgrade};
use crate::net::maybe_tls_stream::{MaybeTlsStream, Socket, with_write_timeout};
use crate::net::session::{self, Caller};
use crate::net::socket_threads::SocketThreads;
use crate::ops::refusal_log::Foreign;
use crate::state::ServerState;
use hyper::Request;
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::TokioIo;
use std::convert::Infallible;
use std::error::Error;
use std::future::{pending, poll_fn};
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Poll;
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, watch};
use tokio::time::{sleep, timeout};
use tokio_util::either::Either;
use tracing::{debug, warn};

/// Sustained rate of TCP connections per address (for IPv6, per /64). The burst is the number of connections that an
/// address may hold, so that a group can open the page together, or a class can reconnect when the server restarts.
const CONNECTS_PER_SECOND_MAX: u32 = 50;
/// Number of bytes that the kernel may hold for one socket. A keyframe can no longer replace these bytes, so they limit
/// how stale a slow reader can be. They also limit the bytes in flight, so they must cover bandwidth times round trip:
/// 64 KiB allows 320 KiB/s at 200 ms, and Linux doubles it.
const SEND_BUFFER_BYTES: usize = 64 << 10;
/// Maximum lifetime of a connection that serves files, long enough to load the page on a slow phone.
const HTTP_CONNECTION_MAX: Duration = Duration::from_secs(300);

/// The response to an address that connects too often.
const CONNECTS_TOO_FAST: &[u8] = b"HTTP/1.1 429 Too Many Requests\r\nRetry-After: 1\r\n\
    Content-Length: 0\r\nConnection: close\r\n\r\n";

/// The response when all connections, or all of a network's share, are taken.
const FULL: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\nRetry-After: 5\r\n\
    Content-Type: text/plain; charset=utf-8\r\nContent-Length: 63\r\nConnection: close\r\n\r\n\
    The server, or its share for your network, is full. Try later.\n";

/// Accepts connections until the caller drops the future. Each connection holds a clone of `alive`.
pub async fn accept(
    listener: &TcpListener,
    threads: &SocketThreads,
    state: &Arc<ServerState>,
    alive: &mpsc::Sender<Infallible>,
) {
    let mut connects =
        AddressRateLimiter::new(CONNECTS_PER_SECOND_MAX, state.shares.connections.address_max());
    let mut is_failing = false;
    loop {
        let (stream, peer) = match state.spare.accept_player(listener).await {
            Ok(accepted) => accepted,
            Err(error) => {
                state.host.metrics.refused("cannot_accept");
                // This is logged only once, because it may repeat twenty times a second.
                if !is_failing {
                    warn!(%error, "cannot accept connections; retrying");
                }
                is_failing = true;
                sleep(limits::ACCEPT_RETRY).await;
                continue;
            }
        };
        is_failing = false;
        let permit = match admit(peer.ip(), &mut connects, state) {
            Ok(permit) => permit,
            Err((reason, response)) => {
                turn_back(&stream, peer.ip(), reason, response, state);
                continue;
            }
        };
        let (state, alive, permit) = (Arc::clone(state), alive.clone(), Arc::new(permit));
        // Converted so that the thread that serves the connection can register it.
        let Ok(stream) = stream.into_std() else { continue };
        threads.spawn(|send_queue| async move {
            let upgraded = tokio::select! {
                upgraded = serve(stream, peer, &permit, &state) => upgraded,
                () = permit.gives_way() => {
                    state.refused("idle_connection", peer.ip(), "an idle connection");
                    None
                }
            };
            if let Some(Upgraded { socket, code, address }) = upgraded {
                let caller = Caller { code, address, send_queue };
                session::play(socket, caller, &state).await;
            }
            drop((permit, alive));
        });
    }
}

/// Admits a connection, or returns the reason why it is not admitted and the response.
fn admit(
    peer: IpAddr,
    connects: &mut AddressRateLimiter,
    state: &ServerState,
) -> Result<Permit, (&'static str, &'static [u8])> {
    let is_proxy = http::is_proxy(peer, &state.config.trusted_proxies);
    // A proxy represents many clients, and limits their rate itself.
    if !is_proxy && !connects.admit(peer, Instant::now()) {
        return Err(("connects_too_fast", CONNECTS_TOO_FAST));
    }
    let connections = &state.shares.connections;
    let permit = match is_proxy {
        // The proxy's clients are counted when they play.
        true => connections.admit_one_of_all(peer).inspect(Permit::keep),
        false => connections.admit(peer),
    };
    permit.ok_or(("too_many_connections", FULL))
}

/// Counts a refused connection, and sends the response if that is cheap. Under TLS it would take a handshake.
fn turn_back(
    stream: &TcpStream,
    peer: IpAddr,
    reason: &'static str,
    response: &[u8],
    state: &ServerState,
) {
    state.refused(reason, peer, "a connection");
    if state.config.tls.is_none() {
        // A new socket accepts these few bytes immediately. If it does not, it is closed without them.
        let _ = socket2::SockRef::from(stream).send(response);
    }
}

/// A connection that will carry a session.
struct Upgraded {
    socket: GameSocket,
    code: String,
    /// Address to which the session counts.
    address: IpAddr,
}

/// Serves HTTP on one connection. Returns the connection if it will carry a session.
async fn serve(
    stream: std::net::TcpStream,
    peer: SocketAddr,
    permit: &Arc<Permit>,
    state: &Arc<ServerState>,
) -> Option<Upgraded> {
    permit.set_idle(true);
    let stream = match tune(&stream).and_then(|()| TcpStream::from_std(stream)) {
        Ok(stream) => stream,
        Err(error) => {
            debug!(address = %peer.ip(), %error, "socket lost before it was served");
            return None;
        }
    };
    let stream = with_write_timeout(Either::Left(stream), state.config.waits.http_stall);
    let stream = secured(stream, peer.ip(), state).await?;
    let spoken = speak_http(stream, peer.ip(), permit, state);
    let Taken { upgrade, head, stream, read } =
        timeout(HTTP_CONNECTION_MAX, spoken).await.ok()??;
    permit.keep();
    let Upgrade { code, address, opening } = upgrade;
    let socket = match opening {
        Opening::WebSocket => game_socket::accept(stream, read),
        Opening::Stream(posts) => game_socket::accept_posts(stream, &head, posts).await.ok()?,
    };
    Some(Upgraded { socket, code, address })
}

/// Makes small messages go out immediately, and keeps the buffer small, because its bytes can no longer be replaced by
/// a keyframe.
fn tune(stream: &std::net::TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    socket2::SockRef::from(stream).set_send_buffer_size(SEND_BUFFER_BYTES)
}

/// Performs the TLS handshake if TLS is configured. A peer that does not speak TLS, is too slow, or rejects the
/// certificate is counted and disconnected; a peer that just closes is not counted.
async fn secured(stream: Socket, peer: IpAddr, state: &ServerState) -> Option<MaybeTlsStream> {
    let Some(tls) = &state.config.tls else {
        return Some(MaybeTlsStream::Left(stream));
    };
    let mut phase = state.host.phase.clone();
    let no_posts = AtomicBool::new(false);
    let shaken = tokio::select! {
        shaken = timeout(state.config.waits.http_head, tls.accept(stream)) => shaken,
        () = draining(&mut phase, &no_posts) => return None,
    };
    match shaken {
        Ok(Ok(stream)) => return Some(stream),
        Ok(Err(error)) if error.kind() == io::ErrorKind::InvalidData => {
            state.refused("bad_tls", peer, Foreign(error.to_string().as_bytes()));
        }
        Ok(Err(error)) => debug!(address = %peer, %error, "socket lost in the handshake"),
        Err(_late) => state.refused("slow_tls", peer, "a handshake"),
    }
    None
}

/// A connection after the request that makes it the socket of a session.
pub struct Taken<S> {
    pub upgrade: Upgrade,
    /// The beginning of the response, unless it was sent.
    head: Vec<u8>,
    stream: S,
    /// Bytes that arrived with the request.
    read: Vec<u8>,
}

/// Answers requests until the peer sends no more, or until one makes the connection the socket of a session. Works on
/// any stream. A peer that sends nothing is disconnected after a while.
pub async fn speak_http<S>(
    stream: S,
    peer: IpAddr,
    permit: &Arc<Permit>,
    state: &Arc<ServerState>,
) -> Option<Taken<S>>
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let upgraded = TakenBy::default();
    let (asked, posts) = (AtomicBool::new(false), AtomicBool::new(false));
    let service = service_fn(|request| {
        asked.store(true, Ordering::Relaxed);
        posts.fetch_or(http::posts::is_post(&request), Ordering::Relaxed);
        permit.set_idle(false);
        upgraded.answer(request, peer, permit, state)
    });
    let mut connection =
        http::builder(&state.config.waits).serve_connection(TokioIo::new(stream), service);
    let mut phase = state.host.phase.clone();
    let served = tokio::select! {
        served = upgraded.until_taken(&mut connection) => served,
        () = draining(&mut phase, &posts) => {
            // Without this check, hyper would wait for the rest of a request's head.
            if !asked.load(Ordering::Relaxed) {
                return None;
            }
            Pin::new(&mut connection).graceful_shutdown();
            upgraded.until_taken(&mut connection).await
        }
    };
    if let Err(error) = served {
        match refusal_reason(&error, asked.load(Ordering::Relaxed)) {
            Some(reason) => state.refused(reason, peer, &error),
            None => debug!(address = %peer, %error, "connection ended"),
        }
    }
    let (upgrade, head) = upgraded.lock().take()?;
    let parts = connection.into_parts();
    Some(Taken { upgrade, head, stream: parts.io.into_inner(), read: parts.read_buf.to_vec() })
}

/// The request that makes a connection the socket of a session, once it has arrived, and the beginning of its response,
/// unless hyper sends that.
#[derive(Default)]
struct TakenBy(Mutex<Option<(Upgrade, Vec<u8>)>>);

impl TakenBy {
    /// Answers a request. A stream is answered by its session, so hyper never gets that response.
    async fn answer(
        &self,
        request: Request<Incoming>,
        peer: IpAddr,
        permit: &Arc<Permit>,
        state: &ServerState,
    ) -> Result<Answer, Infallible> {
        let (mut answer, upgrade) = http::answer(request, peer, state).await;
        answer.body_mut().frees(permit);
        let Some(upgrade) = upgrade else { return Ok(answer) };
        if let Opening::Stream(posts) = &upgrade.opening {
            let head = http::posts::head(answer.headers(), &posts.id());
            drop(answer);
            *self.lock() = Some((upgrade, head));
            return pending().await;
        }
        *self.lock() = Some((upgrade, Vec::new()));
        Ok(answer)
    }

    /// Serves a connection until it ends or a stream takes it. A WebSocket takes it once its response has been sent.
    async fn until_taken<C>(&self, connection: &mut C) -> hyper::Result<()>
    where
        C: Future<Output = hyper::Result<()>> + Unpin,
    {
        poll_fn(|cx| {
            let served = Pin::new(&mut *connection).poll(cx);
            let is_stream =
                |(upgrade, _): &(Upgrade, _)| matches!(upgrade.opening, Opening::Stream(_));
            if self.lock().as_ref().is_some_and(is_stream) { Poll::Ready(Ok(())) } else { served }
        })
        .await
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn lock(&self) -> MutexGuard<'_, Option<(Upgrade, Vec<u8>)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The reason why a connection was refused: it was not HTTP, its first request did not arrive in time, or it stalled
/// during a response. A connection between requests was merely idle, which is no reason.
fn refusal_reason(error: &hyper::Error, asked: bool) -> Option<&'static str> {
    if error.is_parse() {
        Some("bad_request")
    } else if error.is_timeout() && !asked {
        Some("slow_request")
    } else {
        is_stalled(error).then_some("stalled_response")
    }
}

/// Returns whether the peer accepted no bytes of a response for too long.
fn is_stalled(error: &hyper::Error) -> bool {
    let cause = error.source().and_then(|cause| cause.downcast_ref::<io::Error>());
    cause.is_some_and(|cause| cause.kind() == io::ErrorKind::TimedOut)
}

/// Resolves when the server starts to drain, or on a connection that carries posts when the sessions end.
async fn draining(phase: &mut watch::Receiver<Phase>, posts: &AtomicBool) {
    let ends = |phase: &Phase| match phase {
        Phase::Running => false,
        Phase::Draining => !posts.load(Ordering::Relaxed),
        Phase::Closing => true,
    };
    // An error means that the server is gone, which has the same effect.
    let _ = phase.wait_for(ends).await;
}

#[cfg(test)]
mod tests;
