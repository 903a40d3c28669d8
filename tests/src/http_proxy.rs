//! Proxies that don't suit the page.

use anyhow::{Context, Result};
use std::net::{Ipv4Addr, SocketAddr};
use tokio::io::{AsyncReadExt, AsyncWriteExt, copy_bidirectional};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{JoinHandle, JoinSet};

/// The answer to an upgrade.
const REFUSED: &[u8] =
    b"HTTP/1.1 426 Upgrade Required\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
/// The answer to a request outside of the path.
const MISSING: &[u8] = b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

/// What a proxy passes on for the first request of a connection, or the answer to it.
type Change = fn(Vec<u8>) -> Result<Vec<u8>, &'static [u8]>;

/// A proxy that passes on connections, except for their first request. Dropping it closes all connections.
pub struct HttpProxy {
    pub address: SocketAddr,
    accepts: JoinHandle<()>,
}

impl HttpProxy {
    /// Starts a proxy in front of this server that lets no WebSocket through. Browsers send upgrades on connections of
    /// their own.
    pub async fn without_upgrades(server: SocketAddr) -> Result<HttpProxy> {
        HttpProxy::start(server, |head| {
            let asks = head.to_ascii_lowercase().windows(9).any(|part| part == b"\nupgrade:");
            if asks { Err(REFUSED) } else { Ok(head) }
        })
        .await
    }

    /// Starts a proxy that has this server below `/jostle/` and nothing else.
    pub async fn below_path(server: SocketAddr) -> Result<HttpProxy> {
        HttpProxy::start(server, |head| {
            let head = String::from_utf8_lossy(&head);
            let Some(rest) = head.strip_prefix("GET /jostle/") else { return Err(MISSING) };
            // Further requests of this connection would not be changed.
            Ok(format!("GET /{}", rest.replace("keep-alive", "close")).into_bytes())
        })
        .await
    }

    async fn start(server: SocketAddr, change: Change) -> Result<HttpProxy> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.context("no free port")?;
        let address = listener.local_addr()?;
        let accepts = tokio::spawn(async move {
            let mut connections = JoinSet::new();
            while let Ok((client, _)) = listener.accept().await {
                connections.spawn(pass(client, server, change));
                while connections.try_join_next().is_some() {}
            }
        });
        Ok(HttpProxy { address, accepts })
    }
}

impl Drop for HttpProxy {
    fn drop(&mut self) {
        self.accepts.abort();
    }
}

/// Passes on one connection. An error ends it.
async fn pass(mut client: TcpStream, server: SocketAddr, change: Change) -> Result<()> {
    client.set_nodelay(true)?;
    let mut head = Vec::new();
    while !head.windows(4).any(|part| part == b"\r\n\r\n") {
        if client.read_buf(&mut head).await? == 0 {
            return Ok(());
        }
    }
    let head = match change(head) {
        Ok(head) => head,
        Err(answer) => return Ok(client.write_all(answer).await?),
    };
    let mut server = TcpStream::connect(server).await?;
    server.set_nodelay(true)?;
    server.write_all(&head).await?;
    copy_bidirectional(&mut client, &mut server).await?;
    Ok(())
}
