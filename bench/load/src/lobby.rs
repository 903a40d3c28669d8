//! Opens, lists, searches and closes rooms through the server's HTTP interface.

use crate::addresses::opener_of;
use crate::operators::Operators;
use crate::server::{OPS_TOKEN, Server};
use anyhow::{Context, Result, ensure};
use jostle_cli::bots::socket::dial;
use serde::Deserialize;
use std::net::IpAddr;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::timeout;

/// Time limit for a response, and its maximum length in bytes.
const ANSWER_WAIT: Duration = Duration::from_secs(20);
const ANSWER_BYTES_MAX: u64 = 4 << 20;

#[derive(Deserialize)]
struct Created {
    code: String,
}

#[derive(Deserialize)]
struct Listed {
    rooms: Vec<Created>,
    total: usize,
}

/// Opens rooms of a scene, each from a different address; returns their codes.
pub async fn open_rooms(server: &Server, scene: &str, count: u32) -> Result<Vec<String>> {
    let mut codes = Vec::new();
    for number in 0..count {
        let body = format!("{{\"scene\":\"{scene}\"}}");
        let (status, body) =
            request(&server.address, opener_of(number), "POST /api/rooms", "", &body).await?;
        ensure!(status == 201, "room {} of {count}: status {status}: {body}", number + 1);
        codes.push(serde_json::from_str::<Created>(&body)?.code);
    }
    Ok(codes)
}

/// Opens `count` empty rooms, lists them, searches for one and closes all; prints how long each step took.
pub async fn measure(server: &Server, scene: &str, count: u32) -> Result<()> {
    let operators = Operators(server.operators.clone());
    let few = server.resources();
    let began = Instant::now();
    let codes = open_rooms(server, scene, count).await?;
    println!("opened {count} rooms in {:.1} s", began.elapsed().as_secs_f64());
    let before = scrape(&operators).await?;
    tokio::time::sleep(Duration::from_secs(10)).await;
    let report = crate::operators::ServerReport::between(&before, &scrape(&operators).await?);
    println!("{few} before, {} with them", server.resources());
    let spent = report.cpu_seconds.unwrap_or(0.0);
    println!(
        "in 10 s {} ticks, {} missed, {spent:.2} s of processor time",
        report.ticks, report.ticks_missed
    );
    let began = Instant::now();
    let (_, body) = request(&server.address, None, "GET /api/rooms", "", "").await?;
    let listed: Listed = serde_json::from_str(&body)?;
    println!(
        "listed {} of {} in {:.1} ms, {} bytes",
        listed.rooms.len(),
        listed.total,
        1e3 * began.elapsed().as_secs_f64(),
        body.len()
    );
    let wanted = codes.last().context("at least one room")?;
    let (began, find) = (Instant::now(), format!("GET /api/rooms?find={wanted}"));
    let (_, body) = request(&server.address, None, &find, "", "").await?;
    let found: Listed = serde_json::from_str(&body)?;
    ensure!(found.rooms.iter().any(|room| room.code == *wanted), "{wanted} is not found: {body}");
    println!("found one of them in {:.1} ms", 1e3 * began.elapsed().as_secs_f64());
    let began = Instant::now();
    for code in &codes {
        let path = format!("POST /admin/rooms/{code}/close");
        let token = format!("Authorization: Bearer {OPS_TOKEN}\r\n");
        let (status, body) = request(&server.operators, None, &path, &token, "").await?;
        ensure!(status < 300, "room {code}: status {status}: {body}");
    }
    println!("closed all in {:.1} s; {} after", began.elapsed().as_secs_f64(), server.resources());
    Ok(())
}

async fn scrape(operators: &Operators) -> Result<crate::operators::Scrape> {
    let operators = operators.clone();
    tokio::task::spawn_blocking(move || operators.scrape()).await.context("a scrape")?
}

/// Sends a request; returns the status and body of the response.
async fn request(
    authority: &str,
    from: Option<IpAddr>,
    line: &str,
    headers: &str,
    body: &str,
) -> Result<(u16, String)> {
    let length = body.len();
    let text = format!(
        "{line} HTTP/1.1\r\nHost: {authority}\r\nConnection: close\r\n{headers}Content-Type: application/json\r\n\
         Content-Length: {length}\r\n\r\n{body}"
    );
    let exchange = async {
        let mut stream = dial(authority, from).await?;
        stream.write_all(text.as_bytes()).await?;
        let mut answer = String::new();
        stream.take(ANSWER_BYTES_MAX).read_to_string(&mut answer).await?;
        Ok::<_, std::io::Error>(answer)
    };
    let answer = timeout(ANSWER_WAIT, exchange).await.with_context(|| line.to_owned())??;
    let (head, body) =
        answer.split_once("\r\n\r\n").with_context(|| format!("no answer to {line}"))?;
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
    Ok((status.with_context(|| format!("no status in {head:?}"))?, body.to_owned()))
}
