//! A network that fails on demand, between a client and NATS servers.

use anyhow::{Context, Result};
use std::net::{Ipv4Addr, SocketAddr};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::select;
use tokio::sync::watch;
use tokio::task::{JoinHandle, JoinSet};

/// Maximum number of bytes forwarded at once.
const CHUNK_BYTES: usize = 16 * 1024;

/// A proxy that forwards connections to servers and stalls on demand. Dropping it closes all connections.
pub struct Proxy {
    address: SocketAddr,
    passing: watch::Sender<bool>,
    accepts: JoinHandle<()>,
}

impl Proxy {
    /// Starts a proxy that forwards each connection to the next of the given servers that accepts it.
    pub async fn start(servers: Vec<SocketAddr>) -> Result<Proxy> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.context("no free port")?;
        let address = listener.local_addr()?;
        let (passing, followed) = watch::channel(true);
        let accepts = tokio::spawn(accept(listener, servers, followed));
        Ok(Proxy { address, passing, accepts })
    }

    /// The address for clients.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The address as a URL.
    pub fn url(&self) -> String {
        format!("nats://{}", self.address)
    }

    /// Stops forwarding both bytes and the closing of connections. New connections are accepted but stall too.
    pub fn stall(&self) {
        self.passing.send_replace(false);
    }

    /// Resumes forwarding, starting with the delayed bytes.
    pub fn resume(&self) {
        self.passing.send_replace(true);
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.accepts.abort();
    }
}

async fn accept(listener: TcpListener, servers: Vec<SocketAddr>, passing: watch::Receiver<bool>) {
    let mut connections = JoinSet::new();
    for first in (0..servers.len()).cycle() {
        let Ok((client, _)) = listener.accept().await else { return };
        let order: Vec<_> =
            (0..servers.len()).map(|n| servers[(first + n) % servers.len()]).collect();
        connections.spawn(connect(client, order, passing.clone()));
        while connections.try_join_next().is_some() {}
    }
}

/// Forwards one connection until it ends. If no server accepts it, the client's connection is closed.
async fn connect(client: TcpStream, servers: Vec<SocketAddr>, mut passing: watch::Receiver<bool>) {
    if passing.wait_for(|passing| *passing).await.is_err() {
        return;
    }
    let Ok(server) = TcpStream::connect(&*servers).await else { return };
    let ((from_client, to_client), (from_server, to_server)) =
        (client.into_split(), server.into_split());
    // When one direction ends, so does the other.
    select! {
        () = pass(from_client, to_server, passing.clone()) => {}
        () = pass(from_server, to_client, passing.clone()) => {}
    }
}

/// Forwards bytes in one direction until it is closed. Closing is also delayed while the proxy is stalled.
async fn pass(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, mut passing: watch::Receiver<bool>) {
    let mut chunk = vec![0; CHUNK_BYTES];
    loop {
        // A broken connection counts as ended.
        let count = from.read(&mut chunk).await.unwrap_or(0);
        let mut rest = &chunk[..count];
        loop {
            if passing.wait_for(|passing| *passing).await.is_err() {
                return;
            }
            if rest.is_empty() {
                break;
            }
            select! {
                biased;
                _ = passing.changed() => {}
                written = to.write(rest) => match written {
                    Ok(written) => rest = &rest[written..],
                    Err(_) => return,
                }
            }
        }
        if count == 0 {
            return;
        }
    }
}
