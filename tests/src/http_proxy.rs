//! A proxy that lets no WebSocket through.

use anyhow::{Context, Result};
use std::net::{Ipv4Addr, SocketAddr};
use tokio::io::{AsyncReadExt, AsyncWriteExt, copy_bidirectional};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{JoinHandle, JoinSet};

/// The answer to an upgrade.
const REFUSED: &[u8] =
    b"HTTP/1.1 426 Upgrade Required\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

/// A proxy that passes on connections, unless their first request asks for an upgrade. Browsers send upgrades on
/// connections of their own. Dropping it closes all connections.
pub struct UpgradeProxy {
    pub address: SocketAddr,
    accepts: JoinHandle<()>,
}

impl UpgradeProxy {
    /// Starts a proxy in front of this server.
    pub async fn start(server: SocketAddr) -> Result<UpgradeProxy> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.context("no free port")?;
        let address = listener.local_addr()?;
        let accepts = tokio::spawn(async move {
            let mut connections = JoinSet::new();
            while let Ok((client, _)) = listener.accept().await {
                connections.spawn(pass(client, server));
                while connections.try_join_next().is_some() {}
            }
        });
        Ok(UpgradeProxy { address, accepts })
    }
}

impl Drop for UpgradeProxy {
    fn drop(&mut self) {
        self.accepts.abort();
    }
}

/// Passes on one connection. An error ends it.
async fn pass(mut client: TcpStream, server: SocketAddr) -> Result<()> {
    client.set_nodelay(true)?;
    let mut head = Vec::new();
    while !head.windows(4).any(|part| part == b"\r\n\r\n") {
        if client.read_buf(&mut head).await? == 0 {
            return Ok(());
        }
    }
    if head.to_ascii_lowercase().windows(9).any(|part| part == b"\nupgrade:") {
        return Ok(client.write_all(REFUSED).await?);
    }
    let mut server = TcpStream::connect(server).await?;
    server.set_nodelay(true)?;
    server.write_all(&head).await?;
    copy_bidirectional(&mut client, &mut server).await?;
    Ok(())
}
