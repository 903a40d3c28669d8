//! Real NATS servers with JetStream, as child processes on this machine. They can be killed and restarted, and a
//! [`proxy::Proxy`] in front of them can simulate a failing network.

mod monitor;
mod program;
pub mod proxy;

use crate::server::LONG;
use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// Maximum number of attempts to start, since another process may take a port before the server does.
const STARTS_MAX: usize = 8;
/// Interval between polls.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Storage limit for a server's streams, which is plenty for a test but no more than a small disk has.
const STORE_BYTES_MAX: u64 = 1 << 30;
/// Counter used to number this process's clusters.
static STARTED: AtomicU64 = AtomicU64::new(0);

/// A cluster of NATS servers, or a single server. Dropping it kills them and deletes their files, unless the test
/// failed.
pub struct Cluster {
    servers: Vec<Server>,
    dir: PathBuf,
}

struct Server {
    /// Name, unique within the cluster.
    name: String,
    ports: Ports,
    /// The running process; `None` after it has been killed.
    process: Option<Child>,
}

#[derive(Clone, Copy)]
struct Ports {
    client: u16,
    /// Port of the monitoring endpoint, which speaks HTTP.
    monitor: u16,
    /// Port used by the other servers of the cluster.
    route: u16,
}

impl Cluster {
    /// Starts `count` servers and waits until they are ready. Builds the program first if it is missing.
    pub async fn start(count: usize) -> Result<Cluster> {
        let program = program::find().await?;
        for _ in 0..STARTS_MAX {
            let mut cluster = Cluster::configure(count)?;
            for index in 0..count {
                cluster.spawn(program, index)?;
            }
            if cluster.ready_unless_one_ended().await? {
                return Ok(cluster);
            }
        }
        bail!("NATS servers did not start in {STARTS_MAX} attempts")
    }

    /// Chooses ports and writes the servers' configurations into a new directory.
    fn configure(count: usize) -> Result<Cluster> {
        let number = STARTED.fetch_add(1, Ordering::Relaxed);
        let dir = format!("jostle-nats-{}-{number}", std::process::id());
        let dir = std::env::temp_dir().join(dir);
        fs::create_dir_all(&dir).context("cannot make a directory for NATS servers")?;
        let ports = free_ports(count)?;
        let server =
            |index: usize| Server { name: format!("n{index}"), ports: ports[index], process: None };
        let cluster = Cluster { servers: (0..count).map(server).collect(), dir };
        for index in 0..count {
            let text = format!("{:#}", cluster.configuration(index));
            fs::write(cluster.file(index, "conf"), text).context("cannot configure NATS")?;
        }
        Ok(cluster)
    }

    /// A server's configuration as JSON, which NATS can also read.
    fn configuration(&self, index: usize) -> Value {
        let Server { name, ports, .. } = &self.servers[index];
        let mut configuration = json!({
            "server_name": name,
            "listen": address(ports.client).to_string(),
            "http": address(ports.monitor).to_string(),
            "jetstream": {"store_dir": self.file(index, "store"), "max_file_store": STORE_BYTES_MAX},
        });
        if self.servers.len() > 1 {
            let routes =
                self.servers.iter().map(|server| nats_url("nats-route", server.ports.route));
            configuration["cluster"] = json!({
                "name": "jostle",
                "listen": address(ports.route).to_string(),
                "routes": routes.collect::<Vec<_>>(),
                // Servers do not advertise their addresses, because clients would use them to bypass the proxy.
                "no_advertise": true,
            });
        }
        configuration
    }

    /// A file or directory of a server.
    fn file(&self, index: usize, extension: &str) -> PathBuf {
        self.dir.join(&self.servers[index].name).with_extension(extension)
    }

    fn spawn(&mut self, program: &Path, index: usize) -> Result<()> {
        let log = File::options().create(true).append(true).open(self.file(index, "log"));
        let mut command = Command::new(program);
        command.arg("--config").arg(self.file(index, "conf"));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log.context("no log for NATS")?);
        let child =
            command.spawn().with_context(|| format!("cannot start {}", program.display()))?;
        self.servers[index].process = Some(child);
        Ok(())
    }

    /// The addresses of all servers for a client, separated by commas, including servers that were killed.
    pub fn url(&self) -> String {
        let urls = self.servers.iter().map(|server| nats_url("nats", server.ports.client));
        urls.collect::<Vec<_>>().join(",")
    }

    /// Addresses of all servers for clients.
    pub fn addresses(&self) -> Vec<SocketAddr> {
        self.servers.iter().map(|server| address(server.ports.client)).collect()
    }

    /// Kills a server, as if its machine had crashed.
    pub fn kill(&mut self, index: usize) {
        self.servers[index].kill();
    }

    /// Kills a server and removes all of its data.
    pub fn lose(&mut self, index: usize) -> Result<()> {
        self.kill(index);
        fs::remove_dir_all(self.file(index, "store")).context("the files of a NATS server")
    }

    /// Restarts a killed server with its old ports and files, and waits until it responds. [`Cluster::ready`] waits for
    /// the whole cluster.
    pub async fn restart(&mut self, index: usize) -> Result<()> {
        let program = program::find().await?;
        self.kill(index);
        for _ in 0..STARTS_MAX {
            self.spawn(program, index)?;
            if self.answers_unless_it_ended(index).await? {
                return Ok(());
            }
            // Another process may temporarily use the port for a connection.
            sleep(LOOK_EVERY).await;
        }
        bail!("n{index} did not start again in {STARTS_MAX} attempts:\n{}", self.log(index))
    }

    async fn answers_unless_it_ended(&mut self, index: usize) -> Result<bool> {
        let answered = async {
            loop {
                if self.servers[index].has_ended()? {
                    return Ok(false);
                }
                // A server is healthy a moment before it accepts clients.
                let client = self.addresses()[index];
                if monitor::get(self.servers[index].monitor(), "/healthz").await.is_ok()
                    && TcpStream::connect(client).await.is_ok()
                {
                    return Ok(true);
                }
                sleep(LOOK_EVERY).await;
            }
        };
        timeout(LONG, answered).await.context("a NATS server does not answer")?
    }

    /// Waits until all running servers agree on a leader among them and are in sync with it.
    pub async fn ready(&mut self) -> Result<()> {
        match self.ready_unless_one_ended().await? {
            true => Ok(()),
            false => bail!("a NATS server ended; its log is in {}", self.dir.display()),
        }
    }

    /// Waits until the cluster is ready; returns false if a server has exited by itself.
    async fn ready_unless_one_ended(&mut self) -> Result<bool> {
        let all_ready = async {
            loop {
                for server in &mut self.servers {
                    if server.has_ended()? {
                        return Ok(false);
                    }
                }
                if self.is_ready().await {
                    return Ok(true);
                }
                sleep(LOOK_EVERY).await;
            }
        };
        let in_time = timeout(LONG, all_ready).await;
        in_time.with_context(|| format!("no cluster of NATS servers:\n{}", self.log(0)))?
    }

    async fn is_ready(&self) -> bool {
        let mut leaders = Vec::new();
        for server in self.running() {
            // Only the status matters; the text explains a failure.
            match monitor::get(server.monitor(), "/healthz").await {
                Ok((200, _)) => {}
                _ => return false,
            }
            let Ok(jetstream) = server.jetstream("").await else { return false };
            leaders
                .push(jetstream["meta_cluster"]["leader"].as_str().unwrap_or_default().to_owned());
        }
        let agreed = leaders.iter().all(|leader| *leader == leaders[0]);
        let alone = self.servers.len() == 1;
        agreed && (alone || self.running().any(|server| server.name == leaders[0]))
    }

    /// Index of the running server that leads a stream; `None` while the stream has no leader.
    pub async fn leader_of_stream(&self, stream: &str) -> Result<Option<usize>> {
        for (index, server) in self.servers.iter().enumerate() {
            if server.process.is_none() {
                continue;
            }
            let jetstream = server.jetstream("?accounts=true&streams=true").await?;
            let accounts = jetstream["account_details"].as_array().into_iter().flatten();
            let mut streams = accounts
                .flat_map(|account| account["stream_detail"].as_array().into_iter().flatten());
            let found = streams.find(|detail| detail["name"] == stream);
            // A single server does not report a leader.
            let leads = |detail: &Value| match &detail["cluster"]["leader"] {
                Value::String(leader) => *leader == server.name,
                _ => self.servers.len() == 1,
            };
            if found.is_some_and(leads) {
                return Ok(Some(index));
            }
        }
        Ok(None)
    }

    fn running(&self) -> impl Iterator<Item = &Server> {
        self.servers.iter().filter(|server| server.process.is_some())
    }

    fn log(&self, index: usize) -> String {
        fs::read_to_string(self.file(index, "log")).unwrap_or_else(|error| error.to_string())
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        self.servers.iter_mut().for_each(Server::kill);
        if std::thread::panicking() {
            eprintln!("logs of NATS servers are in {}", self.dir.display());
        } else {
            // The system takes care of leftovers in the temporary directory.
            let _ = fs::remove_dir_all(&self.dir);
        }
    }
}

impl Server {
    fn kill(&mut self) {
        if let Some(mut process) = self.process.take() {
            // The process may have exited by itself.
            let _ = process.kill();
            let _ = process.wait();
        }
    }

    /// Whether the server was started and has exited by itself.
    fn has_ended(&mut self) -> Result<bool> {
        Ok(match &mut self.process {
            Some(process) => process.try_wait()?.is_some(),
            None => false,
        })
    }

    fn monitor(&self) -> SocketAddr {
        address(self.ports.monitor)
    }

    /// Returns the server's report about JetStream.
    async fn jetstream(&self, query: &str) -> Result<Value> {
        let (status, body) = monitor::get(self.monitor(), &format!("/jsz{query}")).await?;
        if status != 200 {
            bail!("{} answers {status} of JetStream: {body}", self.name);
        }
        serde_json::from_str(&body).with_context(|| format!("{} sends no JSON", self.name))
    }
}

fn address(port: u16) -> SocketAddr {
    (Ipv4Addr::LOCALHOST, port).into()
}

fn nats_url(scheme: &str, port: u16) -> String {
    format!("{scheme}://{}", address(port))
}

/// Returns distinct ports that were free a moment ago.
fn free_ports(count: usize) -> Result<Vec<Ports>> {
    let listen = |_| TcpListener::bind(address(0));
    let listeners = (0..3 * count).map(listen).collect::<std::io::Result<Vec<_>>>()?;
    let ports = listeners.iter().map(|listener| Ok(listener.local_addr()?.port()));
    let ports = ports.collect::<Result<Vec<_>>>()?;
    let of_server = |p: &[u16]| Ports { client: p[0], monitor: p[1], route: p[2] };
    Ok(ports.chunks(3).map(of_server).collect())
}
