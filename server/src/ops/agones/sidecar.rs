//! Calls to the sidecar's REST API. Each has a time limit and uses a new connection, since calls are made only every
//! two seconds.

use crate::ops::metrics::Metrics;
use bytes::Bytes;
use http_body_util::{BodyExt, Full, Limited};
use hyper::client::conn::http1::handshake;
use hyper::header::{CONTENT_TYPE, HOST};
use hyper::{Method, Request, StatusCode};
use hyper_util::rt::TokioIo;
use serde_json::{Value, json};
use std::error::Error;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tracing::{info, warn};

/// Maximum length of an answer, bytes. A game server's answer contains its labels and annotations, which Kubernetes
/// limits to 256 KiB.
const AGONES_ANSWER_BYTES_MAX: usize = 1 << 20;

/// Path of the room counter. It contains the counter's name from the fleet's spec.
const COUNTER: &str = "/v1beta1/counters/rooms";

/// The reason why a call failed.
#[derive(Debug, thiserror::Error)]
pub enum CallError {
    /// No answer arrived in time.
    #[error("no answer in time")]
    Late,
    /// The connection failed, or the answer was invalid.
    #[error(transparent)]
    Broken(#[from] Box<dyn Error + Send + Sync>),
    /// The answer has a status other than 200; holds the sidecar's text.
    #[error("{0}: {1}")]
    Status(StatusCode, String),
}

pub struct Sidecar {
    address: SocketAddr,
    answer: Duration,
    metrics: Arc<Metrics>,
    /// Whether the previous call went unanswered.
    is_silent: AtomicBool,
    /// Whether a call has been refused.
    has_refused: AtomicBool,
}

impl Sidecar {
    /// Creates a client that gives the sidecar this long to answer.
    pub fn new(address: SocketAddr, answer: Duration, metrics: Arc<Metrics>) -> Sidecar {
        let (is_silent, has_refused) = Default::default();
        Sidecar { address, answer, metrics, is_silent, has_refused }
    }

    /// Reports that the server accepts players.
    pub async fn ready(&self) -> Result<(), CallError> {
        self.call(Method::POST, "/ready", &json!({})).await.map(drop)
    }

    pub async fn health(&self) -> Result<(), CallError> {
        self.call(Method::POST, "/health", &json!({})).await.map(drop)
    }

    /// Reports that the server has ended or is about to end.
    pub async fn shutdown(&self) -> Result<(), CallError> {
        self.call(Method::POST, "/shutdown", &json!({})).await.map(drop)
    }

    /// Returns whether the allocator has sent players to this server.
    pub async fn is_allocated(&self) -> Result<bool, CallError> {
        let game_server = self.call(Method::GET, "/gameserver", &Value::Null).await?;
        Ok(game_server["status"]["state"] == "Allocated")
    }

    /// The current number of rooms in the counter.
    pub async fn count(&self) -> Result<usize, CallError> {
        let counter = self.call(Method::GET, COUNTER, &Value::Null).await?;
        // 64-bit numbers are sent as strings. A field that is zero may be omitted.
        match &counter["count"] {
            Value::Null => Ok(0),
            Value::String(count) => {
                count.parse().map_err(|error| CallError::Broken(Box::new(error)))
            }
            _ => Err(CallError::Broken(format!("no count in {counter}").into())),
        }
    }

    /// Sets the counter's count and capacity.
    pub async fn set_counter(&self, count: usize, capacity: usize) -> Result<(), CallError> {
        let counter = json!({"count": count.to_string(), "capacity": capacity.to_string()});
        self.exchange_in_time(Method::PATCH, COUNTER, &counter).await.map(drop)
    }

    /// Subtracts rooms from the count.
    pub async fn count_down(&self, rooms: usize) -> Result<(), CallError> {
        let change = json!({"countDiff": format!("-{rooms}")});
        self.call(Method::PATCH, COUNTER, &change).await.map(drop)
    }

    /// Makes a call; if it fails, counts and logs the failure.
    async fn call(&self, method: Method, path: &str, body: &Value) -> Result<Value, CallError> {
        let result = self.exchange_in_time(method, path, body).await;
        if let Err(CallError::Status(status, text)) = &result
            && !self.has_refused.swap(true, Ordering::Relaxed)
        {
            warn!(path, %status, text, "Agones' sidecar refuses a call; it is tried again");
        }
        result
    }

    async fn exchange_in_time(
        &self,
        method: Method,
        path: &str,
        body: &Value,
    ) -> Result<Value, CallError> {
        let exchange = timeout(self.answer, self.exchange(method, path, body)).await;
        let result = exchange.unwrap_or(Err(CallError::Late));
        if result.is_err() {
            self.metrics.agones_errors.inc();
        }
        let is_silent = matches!(&result, Err(CallError::Late | CallError::Broken(_)));
        let was_silent = self.is_silent.swap(is_silent, Ordering::Relaxed);
        match &result {
            Err(error) if is_silent && !was_silent => warn!(
                sidecar = %self.address, path, %error,
                "Agones' sidecar does not answer; games go on, and it is tried again"
            ),
            _ if was_silent && !is_silent => info!("Agones' sidecar answers again"),
            _ => {}
        }
        result
    }

    async fn exchange(&self, method: Method, path: &str, body: &Value) -> Result<Value, CallError> {
        let stream = TcpStream::connect(self.address).await.map_err(broken)?;
        let (mut sender, connection) = handshake(TokioIo::new(stream)).await.map_err(broken)?;
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let request = Request::builder()
            .method(method)
            .uri(path)
            .header(HOST, self.address.to_string())
            .header(CONTENT_TYPE, "application/json")
            .body(Full::new(Bytes::from(body)))
            .map_err(broken)?;
        let answer = async move {
            let (head, body) = sender.send_request(request).await.map_err(broken)?.into_parts();
            let body = Limited::new(body, AGONES_ANSWER_BYTES_MAX);
            let bytes = body.collect().await.map_err(CallError::Broken)?.to_bytes();
            match head.status {
                StatusCode::OK => serde_json::from_slice(&bytes).map_err(broken),
                status => {
                    let text = String::from_utf8_lossy(&bytes);
                    Err(CallError::Status(status, text.trim().to_owned()))
                }
            }
        };
        // The connection ends after its only request; if it failed, the answer says why.
        let (answer, _) = tokio::join!(answer, connection);
        answer
    }
}

fn broken(error: impl Error + Send + Sync + 'static) -> CallError {
    CallError::Broken(Box::new(error))
}
