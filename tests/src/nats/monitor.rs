//! Requests to the monitoring endpoint of a NATS server.

use anyhow::{Context, Result};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// Time limit for a response. A server that is busy or about to exit may never respond, so callers try again.
const ANSWER_WITHIN: Duration = Duration::from_secs(10);

/// Sends a request and returns the status and body of the response.
pub async fn get(server: SocketAddr, path: &str) -> Result<(u16, String)> {
    timeout(ANSWER_WITHIN, exchange(server, path)).await.context("no answer in time")?
}

async fn exchange(server: SocketAddr, path: &str) -> Result<(u16, String)> {
    let mut stream = TcpStream::connect(server).await?;
    // HTTP/1.0 has no chunked encoding, so the body ends with the connection.
    stream.write_all(format!("GET {path} HTTP/1.0\r\n\r\n").as_bytes()).await?;
    let mut text = String::new();
    stream.read_to_string(&mut text).await?;
    let (head, body) =
        text.split_once("\r\n\r\n").context("an answer without an end of its head")?;
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
    Ok((status.context("an answer without a status")?, body.to_owned()))
}
