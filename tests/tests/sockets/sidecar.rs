//! A fake Agones sidecar, which answers and records the REST calls that the server makes, and fails on demand.

use crate::client::LONG;
use http_body_util::{BodyExt, Full};
use hyper::body::{Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::TokioIo;
use serde_json::{Value, json};
use std::convert::Infallible;
use std::future::pending;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket};
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

const COUNTER: &str = "/v1beta1/counters/rooms";

/// How calls are answered.
#[derive(Clone, Copy, PartialEq)]
pub enum Mood {
    Well,
    /// Calls are answered with status 500.
    Failing,
    Hanging,
    /// Calls are answered as by Agones, except that the response to the next change to the counter is lost.
    LosingOne,
}

/// The game server from the point of view of Agones.
pub struct GameServer {
    pub mood: Mood,
    pub state: &'static str,
    /// Count and capacity of the counter, if the fleet's spec has one.
    pub rooms: Option<[i64; 2]>,
    /// The calls so far, as method, path and body separated by spaces.
    pub asked: Vec<String>,
}

/// An address that no sidecar is listening on yet.
pub struct Absent(TcpSocket);

impl Absent {
    pub fn new() -> Absent {
        let socket = TcpSocket::new_v4().expect("a socket");
        socket.bind(SocketAddr::from(([127, 0, 0, 1], 0))).expect("a free port");
        Absent(socket)
    }

    pub fn address(&self) -> SocketAddr {
        self.0.local_addr().expect("a bound port")
    }

    pub fn appears(self) -> Sidecar {
        Sidecar::serve(self.0.listen(64).expect("a port that is bound"))
    }
}

pub struct Sidecar {
    pub address: SocketAddr,
    game_server: Arc<Mutex<GameServer>>,
    task: JoinHandle<()>,
}

impl Drop for Sidecar {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Sidecar {
    pub fn start() -> Sidecar {
        Absent::new().appears()
    }

    fn serve(listener: TcpListener) -> Sidecar {
        let address = listener.local_addr().expect("a bound port");
        let (mood, state) = (Mood::Well, "Scheduled");
        let game_server = GameServer { mood, state, rooms: Some([0, 0]), asked: Vec::new() };
        let game_server = Arc::new(Mutex::new(game_server));
        let task = tokio::spawn(accept(listener, Arc::clone(&game_server)));
        Sidecar { address, game_server, task }
    }

    pub fn game_server(&self) -> MutexGuard<'_, GameServer> {
        lock(&self.game_server)
    }

    /// Simulates an allocation by Agones.
    pub fn allocate(&self) {
        let mut game_server = self.game_server();
        game_server.state = "Allocated";
        game_server.rooms = game_server.rooms.map(|[count, capacity]| [count + 1, capacity]);
    }

    /// Number of calls so far that start with `call`.
    pub fn count_of(&self, call: &str) -> usize {
        self.game_server().asked.iter().filter(|asked| asked.starts_with(call)).count()
    }

    /// Waits until there have been more than `known` calls that start with `call`.
    pub async fn hears_after(&self, known: usize, call: &str) {
        let heard = async {
            while self.count_of(call) <= known {
                sleep(Duration::from_millis(10)).await;
            }
        };
        let in_time = timeout(LONG, heard).await;
        in_time.unwrap_or_else(|_| panic!("no {call} in {:?}", self.game_server().asked));
    }

    pub async fn hears(&self, call: &str) {
        self.hears_after(0, call).await;
    }

    /// Waits until the server has read the counter a few more times.
    pub async fn is_read_again(&self) {
        let known = self.count_of(&format!("GET {COUNTER}"));
        self.hears_after(known + 2, &format!("GET {COUNTER}")).await;
    }
}

fn lock(game_server: &Mutex<GameServer>) -> MutexGuard<'_, GameServer> {
    game_server.lock().unwrap_or_else(PoisonError::into_inner)
}

async fn accept(listener: TcpListener, game_server: Arc<Mutex<GameServer>>) {
    loop {
        let (stream, _) = listener.accept().await.expect("a connection");
        let game_server = Arc::clone(&game_server);
        tokio::spawn(async move {
            let service = service_fn(async |request| {
                Ok::<_, Infallible>(answer(request, &game_server).await)
            });
            // The server may have given up on the call.
            let _ = http1::Builder::new().serve_connection(TokioIo::new(stream), service).await;
        });
    }
}

async fn answer(
    request: Request<Incoming>,
    game_server: &Mutex<GameServer>,
) -> Response<Full<Bytes>> {
    let (head, body) = request.into_parts();
    let body = body.collect().await.expect("a body").to_bytes();
    let path = head.uri.path().to_owned();
    let answered = {
        let mut game_server = lock(game_server);
        let text = String::from_utf8_lossy(&body);
        game_server.asked.push(format!("{} {path} {text}", head.method).trim().to_owned());
        match game_server.mood {
            Mood::Hanging => None,
            Mood::Failing => Some(Err("out of order".to_owned())),
            Mood::Well => Some(game_server.carry_out(&head.method, &path, &body)),
            Mood::LosingOne => {
                let done = game_server.carry_out(&head.method, &path, &body);
                let is_lost = head.method == Method::PATCH;
                if is_lost {
                    game_server.mood = Mood::Well;
                }
                (!is_lost).then_some(done)
            }
        }
    };
    let (status, text) = match answered {
        None => pending().await,
        Some(Ok(answer)) => (StatusCode::OK, answer.to_string()),
        Some(Err(error)) => {
            let error = json!({"code": 2, "message": error, "details": []});
            (StatusCode::INTERNAL_SERVER_ERROR, error.to_string())
        }
    };
    let answer = Response::builder().status(status).header("Content-Type", "application/json");
    answer.body(Full::new(Bytes::from(text))).expect("a response")
}

impl GameServer {
    fn carry_out(&mut self, method: &Method, path: &str, body: &[u8]) -> Result<Value, String> {
        let body: Value =
            if body.is_empty() { Value::Null } else { serde_json::from_slice(body).expect("JSON") };
        match (method.as_str(), path) {
            ("POST", "/ready" | "/health" | "/shutdown") => {
                assert_eq!(body, json!({}), "{path}");
                match path {
                    "/ready" => self.state = "Ready",
                    "/shutdown" => self.state = "Shutdown",
                    _ => {}
                }
                Ok(json!({}))
            }
            ("GET", "/gameserver") => {
                Ok(json!({"object_meta": {"name": "jostle-1"}, "status": {"state": self.state}}))
            }
            ("GET", COUNTER) => self.counter(),
            ("PATCH", COUNTER) => self.change_counter(&body),
            _ => panic!("Agones knows no {method} {path}"),
        }
    }

    /// Returns the counter as JSON, in which 64-bit numbers are strings.
    fn counter(&self) -> Result<Value, String> {
        let [count, capacity] = self.rooms.ok_or("counter not found: rooms")?;
        Ok(json!({"name": "rooms", "count": count.to_string(), "capacity": capacity.to_string()}))
    }

    fn change_counter(&mut self, body: &Value) -> Result<Value, String> {
        let field =
            |name: &str| body[name].as_str().map(|text| text.parse::<i64>().expect("a number"));
        let [count, capacity] = self.rooms.ok_or("counter not found: rooms")?;
        let capacity = field("capacity").unwrap_or(capacity);
        let count = field("count").unwrap_or(count) + field("countDiff").unwrap_or(0);
        if !(0..=capacity).contains(&count) {
            return Err(format!(
                "out of range. Count must be within range [0,Capacity]. Found Count: {count}"
            ));
        }
        self.rooms = Some([count, capacity]);
        self.counter()
    }
}
