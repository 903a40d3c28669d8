//! Opens random guest scenes one after another while an ordinary room is running, and compares the lateness of that
//! room's snapshots with that in a period without guests.
//!
//! Usage: `cargo run --release --package jostle-tests --example guest_scenes -- 1000`

use anyhow::{Context, Result, bail};
use futures_util::{SinkExt, StreamExt};
use jostle_protocol::{
    Appearance, ClientMessage, Role, ServerMessage, SnapshotStream, Token, VERSION,
};
use jostle_server::Config;
use jostle_sim::TICKS_PER_SECOND;
use jostle_tests::guest_scenes::random_scene;
use jostle_tests::server::Server;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{WebSocketStream, client_async};

/// Duration of the period without guests.
const QUIET: Duration = Duration::from_secs(30);
/// How long each accepted scene is played.
const PLAYED: Duration = Duration::from_millis(1500);
/// Number of scenes sent concurrently.
const AT_ONCE: usize = 4;

/// The tick and arrival time of each snapshot.
type Arrivals = Vec<(u32, Instant)>;

#[tokio::main]
async fn main() -> Result<()> {
    let count = std::env::args().nth(1).map_or(Ok(100), |count| count.parse())?;
    let server = Server::start(Config::default()).await?;
    let watch = |time| watch(server.address, time);
    report("without guests", &watch(QUIET).await?);
    let opened = tokio::spawn(open_all(server.address, count));
    let mut arrivals = Vec::new();
    let began = Instant::now();
    while !opened.is_finished() {
        arrivals.push(watch(QUIET).await?);
    }
    let [played, refused, busy] = opened.await??;
    println!(
        "{count} scenes in {:.0} s: {played} played, {refused} refused, {busy} times busy",
        began.elapsed().as_secs_f32()
    );
    report("with guests", &arrivals.concat());
    server.stop().await
}

/// Joins the ordinary room and records when each snapshot arrives.
async fn watch(server: SocketAddr, time: Duration) -> Result<Arrivals> {
    let mut socket = join(server, "arena", None).await?;
    let (until, mut arrivals, mut seq) = (Instant::now() + time, Vec::new(), 0);
    let mut stream = SnapshotStream::default();
    while Instant::now() < until {
        let message = timeout(Duration::from_secs(5), socket.next()).await?;
        let Message::Binary(bytes) = message.context("the room was closed")?? else { continue };
        if let ServerMessage::Snapshot(coded) = ServerMessage::decode(&bytes)? {
            stream.decode(&coded)?;
            let tick = stream.newest().context("no snapshot")?.tick;
            arrivals.push((tick, Instant::now()));
            seq += 1;
            let input = jostle_game::Input::default();
            let input = ClientMessage::Input { seq, ack_tick: tick as u16, input };
            socket.send(Message::Binary(input.encode().into())).await?;
        }
    }
    Ok(arrivals)
}

/// Prints how late snapshots were relative to the earliest possible time for their tick, and how many ticks were never
/// played.
fn report(name: &str, arrivals: &[(u32, Instant)]) {
    let Some(&(first, start)) = arrivals.first() else { return println!("{name}: nothing came") };
    let due = |tick: u32| f64::from(tick - first) / f64::from(TICKS_PER_SECOND);
    let offset = |&(tick, at): &(u32, Instant)| at.duration_since(start).as_secs_f64() - due(tick);
    // A missed tick makes all later ones late, so each second is measured relative to its own earliest snapshot.
    let mut late: Vec<f64> = arrivals
        .chunks(TICKS_PER_SECOND as usize)
        .flat_map(|second| {
            let earliest = second.iter().map(offset).fold(f64::INFINITY, f64::min);
            second.iter().map(move |arrival| 1000.0 * (offset(arrival) - earliest))
        })
        .collect();
    late.sort_by(f64::total_cmp);
    let at = |share: f64| late[((late.len() - 1) as f64 * share) as usize];
    let drift = arrivals.last().map_or(0.0, offset) * f64::from(TICKS_PER_SECOND);
    println!(
        "{name}: {} snapshots, late by p50 {:.1} ms, p99 {:.1}, p99.9 {:.1}, at most {:.1}; ticks missed: {:.0}",
        late.len(),
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0),
        drift.max(0.0)
    );
}

type Socket = WebSocketStream<TcpStream>;

async fn join(server: SocketAddr, room: &str, host_key: Option<Token>) -> Result<Socket> {
    let stream = TcpStream::connect(server).await?;
    let (mut socket, _) = client_async(format!("ws://{server}/{room}"), stream).await?;
    let appearance = Appearance { name: "Ann".into(), color: 1 };
    let (token, role) = (None, Role::Player);
    let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key, role };
    socket.send(Message::Binary(hello.encode().into())).await?;
    Ok(socket)
}

/// Sends all scenes; returns how many were played, how many were refused, and how often the server was busy.
async fn open_all(server: SocketAddr, count: usize) -> Result<[usize; 3]> {
    let (next, mut tasks) = (Arc::new(AtomicUsize::new(0)), Vec::new());
    for _ in 0..AT_ONCE {
        let next = Arc::clone(&next);
        tasks.push(tokio::spawn(async move {
            let mut counts = [0; 3];
            loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed >= count {
                    return anyhow::Ok(counts);
                }
                while !open(server, &random_scene(seed as u64), &mut counts).await? {
                    sleep(Duration::from_millis(200)).await;
                }
            }
        }));
    }
    let mut sum = [0; 3];
    for task in tasks {
        let counts = task.await??;
        sum.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }
    Ok(sum)
}

/// Sends one scene and plays it; `false` if the server was busy.
async fn open(server: SocketAddr, scene: &str, counts: &mut [usize; 3]) -> Result<bool> {
    let head = "POST /api/guest-rooms HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n";
    let request = format!("{head}Content-Length: {}\r\n\r\n{scene}", scene.len());
    let mut stream = TcpStream::connect(server).await?;
    stream.write_all(request.as_bytes()).await?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await?;
    let (head, body) = answer.split_once("\r\n\r\n").context("no answer")?;
    match head.split(' ').nth(1) {
        Some("201") => counts[0] += 1,
        Some("422") => {
            counts[1] += 1;
            return Ok(true);
        }
        Some("429" | "503") => {
            counts[2] += 1;
            return Ok(false);
        }
        _ => bail!("{answer}"),
    }
    let created: serde_json::Value = serde_json::from_str(body)?;
    let text = |field: &str| created[field].as_str().unwrap_or_default();
    let mut host = join(server, text("code"), Token::parse(text("host_key"))).await?;
    let played = async { while host.next().await.is_some_and(|message| message.is_ok()) {} };
    let _ = timeout(PLAYED, played).await;
    let closes = Message::Binary(ClientMessage::CloseRoom.encode().into());
    // A room that took too much time may already be closed.
    let _ = host.send(closes).await;
    let _ = timeout(PLAYED, async { while let Some(Ok(_)) = host.next().await {} }).await;
    Ok(true)
}
