//! A server in this process on a free port, for one test.

use anyhow::{Context, Result};
use jostle_server::Config;
use jostle_server::limits::Timeouts;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

/// Time limit when waiting for something that should happen. Tests never measure against it: one machine may be a
/// hundred times slower than another and leave a test without a processor for seconds.
pub const LONG: Duration = Duration::from_secs(300);

/// Timeouts for a server whose clients may be that slow. A test of a particular timeout shortens only that timeout.
pub const PATIENT: Timeouts = Timeouts {
    http_head: LONG,
    http_body: LONG,
    http_stall: LONG,
    hello: LONG,
    silence: LONG,
    stall: LONG,
    hearing: LONG,
    room_empty: LONG,
    guest_room_empty: LONG,
    command: LONG,
    drain: LONG,
    drain_max: LONG,
    guest_tick: LONG,
    guest_trial_later: Duration::ZERO,
    ..Timeouts::USUAL
};

/// Address of the proxy trusted by `shaky_host`, on Linux.
pub const PROXY: Ipv4Addr = Ipv4Addr::new(127, 9, 0, 1);
/// The operators' token of `shaky_host`.
pub const OPS_TOKEN: &str = "correct-horse-battery";

/// A timeout that a test can afford to wait for, yet long enough for a well-behaved client on a slow machine.
pub const BRIEF: Duration = Duration::from_secs(5);

/// A timeout that well-behaved clients need not meet, since they may miss it on a busy machine.
pub const SOON: Duration = Duration::from_millis(500);

/// The shipped configuration, but with long timeouts.
pub fn patient() -> Config {
    Config { waits: PATIENT, rooms_max: 64, ..Config::default() }
}

/// A server that runs until it is stopped or dropped.
pub struct Server {
    pub address: SocketAddr,
    stop: oneshot::Sender<()>,
    served: JoinHandle<std::io::Result<()>>,
}

impl Server {
    /// Starts a server on a free local port.
    pub async fn start(config: Config) -> Result<Server> {
        Server::start_at(SocketAddr::from(([127, 0, 0, 1], 0)), config).await
    }

    /// Starts a server at a given address, like a server that is restarted.
    pub async fn start_at(address: SocketAddr, config: Config) -> Result<Server> {
        let listener = TcpListener::bind(address).await.context("cannot listen")?;
        let address = listener.local_addr()?;
        let (stop, stopped) = oneshot::channel::<()>();
        let served = tokio::spawn(jostle_server::run(listener, config, async move {
            // Dropping the sender stops the server too.
            let _ = stopped.await;
        }));
        Ok(Server { address, stop, served })
    }

    /// Returns the URL of a page; `path` starts with a slash.
    pub fn link(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Stops the server as SIGTERM would, and waits until it has stopped.
    pub async fn stop(self) -> Result<()> {
        // The server may have stopped by itself; its result then shows why.
        let _ = self.stop.send(());
        self.served.await.context("the server panicked")?.context("the server failed")
    }
}
