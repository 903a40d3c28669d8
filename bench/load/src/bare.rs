//! A lower bound for the cost of a message: one thread that does nothing but write as many bytes to as many sockets as
//! the server does. Its peers read, and send as much as players do. Like the bots, they run in this process.

use anyhow::{Context, Result};
use jostle_server::host::ticker::schedule::Schedule;
use jostle_sim::TICKS_PER_SECOND;
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;
use std::fmt;
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::task::JoinHandle;
use tokio::time::interval;

/// Size of an input including its frame, in bytes.
const INPUT_BYTES: usize = 24;
/// Duration of each measurement.
const LENGTH: Duration = Duration::from_secs(5);

/// Processor time that a bare loop takes per message, in microseconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bare {
    /// Length of a message including its frame.
    message_bytes: usize,
    /// Time for a loop that only writes.
    pub write_us: f64,
    /// Time for a loop that also reads an input from every socket once per tick.
    pub read_and_write_us: f64,
}

impl Bare {
    /// Measures both loops with this many sockets and messages of this length, which takes ten seconds.
    pub async fn measure(clients: u32, message_bytes: usize) -> Result<Bare> {
        let write_us = measure(clients, message_bytes, false).await?;
        let read_and_write_us = measure(clients, message_bytes, true).await?;
        Ok(Bare { message_bytes, write_us, read_and_write_us })
    }
}

impl fmt::Display for Bare {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Bare { message_bytes, write_us, read_and_write_us } = self;
        write!(
            f,
            "bare loop: {write_us:.1} us of processor time a message of {message_bytes} bytes, \
             {read_and_write_us:.1} with an input read"
        )
    }
}

async fn measure(clients: u32, message_bytes: usize, reads: bool) -> Result<f64> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).context("a bare listener")?;
    let address = listener.local_addr()?;
    let (mut sockets, mut peers) = (Vec::new(), Vec::new());
    for _ in 0..clients {
        let peer = TcpStream::connect(address)?;
        let (socket, _) = listener.accept()?;
        for stream in [&peer, &socket] {
            stream.set_nodelay(true)?;
            stream.set_nonblocking(true)?;
        }
        sockets.push(socket);
        peers.push(tokio::spawn(play(tokio::net::TcpStream::from_std(peer)?, reads)));
    }
    let serving = tokio::task::spawn_blocking(move || serve(&mut sockets, message_bytes, reads));
    let cost = serving.await.context("the bare loop")?;
    peers.iter().for_each(JoinHandle::abort);
    cost
}

/// A peer that reads everything it receives and sends an input per tick if `sends` is set.
async fn play(mut stream: tokio::net::TcpStream, sends: bool) -> std::io::Result<()> {
    let mut inputs = interval(Duration::from_secs(1) / TICKS_PER_SECOND);
    let mut bytes = [0; 4096];
    loop {
        tokio::select! {
            read = stream.read(&mut bytes) => if read? == 0 { return Ok(()) },
            _ = inputs.tick(), if sends => stream.write_all(&[0; INPUT_BYTES]).await?,
        }
    }
}

/// Serves all sockets from this thread; returns its processor time per message in microseconds.
fn serve(sockets: &mut [TcpStream], message_bytes: usize, reads: bool) -> Result<f64> {
    let (mut messages, mut bytes) = (0_u64, [0; 4096]);
    let message = vec![0; message_bytes];
    let (began, before) = (Instant::now(), processor_time());
    let mut schedule = Schedule::new(began);
    while began.elapsed() < LENGTH {
        std::thread::sleep(schedule.next_at().saturating_duration_since(Instant::now()));
        if schedule.due(Instant::now()) == 0 {
            continue;
        }
        for socket in &mut *sockets {
            if reads {
                would_block_or(socket.read(&mut bytes))?;
            }
            would_block_or(socket.write(&message))?;
            messages += 1;
        }
    }
    let spent = processor_time() - before;
    Ok(spent.as_secs_f64() * 1e6 / messages.max(1) as f64)
}

/// Ignores `WouldBlock`: a socket with nothing to read, or whose buffer is full, still costs a system call.
fn would_block_or(done: std::io::Result<usize>) -> Result<()> {
    match done {
        Err(error) if error.kind() != ErrorKind::WouldBlock => Err(error.into()),
        _ => Ok(()),
    }
}

/// Processor time used by this thread.
fn processor_time() -> Duration {
    let spent = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(spent.tv_sec as u64, spent.tv_nsec as u32)
}
