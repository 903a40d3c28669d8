//! The server under test, on a port of its own.

use jostle_server::limits::Waits;
use jostle_server::{Config, run_with_ops};
use jostle_sim::Scene;
use std::io;
use std::net::SocketAddr;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

/// A running server; it is told to stop when this is dropped.
pub struct Server {
    pub address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    task: JoinHandle<io::Result<()>>,
}

impl Server {
    /// With the built-in scenes.
    pub async fn start() -> Server {
        Server::start_with(Config::default()).await
    }

    /// With one more scene.
    pub async fn start_with_scene(name: &str, source: &str) -> Server {
        let mut config = Config::default();
        let scene = Scene::parse(&format!("{name}.toml"), source);
        config.scenes.push(scene.unwrap_or_else(|error| panic!("{error}")));
        Server::start_with(config).await
    }

    /// With the built-in scenes and other waits.
    pub async fn start_with_waits(waits: Waits) -> Server {
        Server::start_with(Config { waits, ..Config::default() }).await
    }

    pub async fn start_with(config: Config) -> Server {
        Server::launch(config, None).await
    }

    /// With the built-in scenes and a port for operators.
    pub async fn start_with_ops() -> (Server, SocketAddr) {
        let ops = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = ops.local_addr().expect("a bound port");
        (Server::launch(Config::default(), Some(ops)).await, address)
    }

    async fn launch(config: Config, ops: Option<TcpListener>) -> Server {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("a bound port");
        let (stop, stopped) = oneshot::channel();
        let shutdown = async {
            // Dropping the sender stops the server as well.
            let _ = stopped.await;
        };
        let task = tokio::spawn(run_with_ops(listener, ops, config, shutdown));
        Server { address, stop: Some(stop), task }
    }

    /// Tells it to stop, without waiting.
    pub fn stop(&mut self) {
        self.stop.take();
    }

    /// Waits for its end.
    pub async fn ended(self) {
        self.task.await.expect("the server does not panic").expect("the server ends well");
    }
}
