//! The server under test, on a free port.

use crate::client::LONG;
use crate::http::get_at_last;
use jostle_game::Scene;
use jostle_server::limits::Timeouts;
use jostle_server::{Config, run_with_ops};
use jostle_tests::server::patient;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tokio::time::{sleep, timeout};

/// A running server, which is stopped when dropped.
pub struct Server {
    pub address: SocketAddr,
    pub ops: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    task: JoinHandle<io::Result<()>>,
}

impl Server {
    /// Starts a server with the built-in scenes and long timeouts, for clients on a slow machine.
    pub async fn start() -> Server {
        Server::start_with(patient()).await
    }

    /// Starts a server with one additional scene.
    pub async fn start_with_scene(name: &str, source: &str) -> Server {
        let mut config = patient();
        let scene = Scene::parse(&format!("{name}.toml"), source);
        config.scenes.push(scene.unwrap_or_else(|error| panic!("{error}")));
        Server::start_with(config).await
    }

    /// Starts a server with the built-in scenes and the given timeouts.
    pub async fn start_with_waits(waits: Timeouts) -> Server {
        Server::start_with(Config { waits, ..patient() }).await
    }

    pub async fn start_with(config: Config) -> Server {
        let bind = || TcpListener::bind("127.0.0.1:0");
        let listener = bind().await.expect("a free port");
        let ops_listener = bind().await.expect("a free port");
        let address = listener.local_addr().expect("a bound port");
        let ops = ops_listener.local_addr().expect("a bound port");
        let (stop, stopped) = oneshot::channel();
        let shutdown = async {
            // Dropping the sender stops the server as well.
            let _ = stopped.await;
        };
        let task = tokio::spawn(run_with_ops(listener, Some(ops_listener), config, shutdown));
        Server { address, ops, stop: Some(stop), task }
    }

    /// The value of a counter; 0 if it is missing.
    pub async fn count(&self, series: &str) -> u64 {
        count(self.ops, series).await
    }

    /// Waits until a counter reaches a value, and checks that it does not exceed it.
    pub async fn counts(&self, series: &str, expected: u64) {
        until_count(self.ops, series, expected).await;
        assert_eq!(self.count(series).await, expected, "{series}");
    }

    /// Tells the server to stop without waiting for it.
    pub fn stop(&mut self) {
        self.stop.take();
    }

    /// Waits until the server has stopped.
    pub async fn ended(self) {
        self.task.await.expect("the server does not panic").expect("the server ends well");
    }
}

/// The value of a counter on an operators' port.
pub async fn count(ops: SocketAddr, series: &str) -> u64 {
    let text = String::from_utf8(get_at_last(ops, "/metrics").await.body).expect("text");
    let mut lines = text.lines().filter_map(|line| line.strip_prefix(series)?.strip_prefix(' '));
    lines.next().map_or(0, |value| value.parse::<f64>().expect("a number") as u64)
}

/// Waits until a counter has reached a value, since rooms update their counters only with the next tick.
pub async fn until_count(ops: SocketAddr, series: &str, at_least: u64) {
    let reached = async {
        while count(ops, series).await < at_least {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, reached).await.unwrap_or_else(|_| panic!("{series} did not reach {at_least}"));
}
