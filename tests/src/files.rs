//! A plain file server that serves a folder below a path and records all requests. It knows nothing about Jostle.

use anyhow::{Context, Result};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

/// The folder that `cargo xtask web --static` writes.
pub fn static_page() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    target.unwrap_or_else(|| tests.parent().unwrap_or(tests).join("target")).join("static")
}

/// Serves until it is dropped.
pub struct FileServer {
    address: SocketAddr,
    asked: Arc<Mutex<Vec<String>>>,
    task: JoinHandle<()>,
}

impl FileServer {
    /// Serves a folder at the path `below`, which starts and ends with a slash, on a free local port. The files in
    /// `more` are served too.
    pub async fn start(
        folder: PathBuf,
        below: &'static str,
        more: Vec<(String, Vec<u8>)>,
    ) -> Result<FileServer> {
        let built = folder.join("index.html").is_file();
        anyhow::ensure!(built, "no {}; `cargo xtask web --static` builds it", folder.display());
        let listener = TcpListener::bind(("127.0.0.1", 0)).await.context("cannot listen")?;
        let (address, asked) = (listener.local_addr()?, Arc::<Mutex<Vec<String>>>::default());
        let (log, site) = (Arc::clone(&asked), Arc::new((folder, below, more)));
        let task = tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let (log, site) = (Arc::clone(&log), Arc::clone(&site));
                tokio::spawn(async move {
                    let (folder, below, more) = &*site;
                    // A browser may close connections that it does not need.
                    let _ = answer(stream, &log, |path| {
                        let name = path.strip_prefix(below)?;
                        let name = if name.is_empty() { "index.html" } else { name };
                        let held = more.iter().find(|(known, _)| known == name);
                        held.map(|(_, bytes)| bytes.clone()).or_else(|| read(folder, name))
                    })
                    .await;
                });
            }
        });
        Ok(FileServer { address, asked, task })
    }

    /// Returns the URL of a path, which must start with a slash.
    pub fn link(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Returns the paths and queries of all requests so far.
    pub fn asked(&self) -> Vec<String> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for FileServer {
    fn drop(&mut self) {
        self.task.abort();
    }
}

fn read(folder: &Path, name: &str) -> Option<Vec<u8>> {
    let leads_out = name.split('/').any(|part| part.is_empty() || part == "..");
    if leads_out { None } else { std::fs::read(folder.join(name)).ok() }
}

/// Answers one request and closes the connection.
async fn answer(
    stream: TcpStream,
    log: &Mutex<Vec<String>>,
    find: impl Fn(&str) -> Option<Vec<u8>>,
) -> Result<()> {
    let mut stream = BufReader::new(stream);
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") {
        if stream.read_line(&mut head).await? == 0 {
            return Ok(());
        }
    }
    let target = head.split(' ').nth(1).context("a request names a path")?.to_owned();
    let path = target.split('?').next().unwrap_or_default();
    let found = find(path);
    log.lock().unwrap_or_else(PoisonError::into_inner).push(target.clone());
    let status = if found.is_some() { "200 OK" } else { "404 Not Found" };
    let (kind, body) = (content_type(path), found.unwrap_or_default());
    let head = format!(
        "HTTP/1.1 {status}\r\ncontent-type: {kind}\r\ncontent-length: {}\r\nconnection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes()).await?;
    stream.write_all(&body).await?;
    stream.shutdown().await.context("a connection that does not close")
}

/// Returns the content type that any file host would use.
fn content_type(path: &str) -> &'static str {
    match path.rsplit_once('.').map_or("html", |(_, ending)| ending) {
        "js" => "text/javascript",
        "css" => "text/css",
        "wasm" => "application/wasm",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "webp" => "image/webp",
        "json" => "application/json",
        ending if ending.ends_with('/') || ending == "html" => "text/html",
        _ => "application/octet-stream",
    }
}
