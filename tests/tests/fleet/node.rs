//! Nodes of a fleet as processes.

use jostle_tests::program::jostle;
use jostle_tests::server::LONG;
use std::fs::{self, File};
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// Polling interval.
pub const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Counter used to number this process's directories.
static MADE: AtomicU64 = AtomicU64::new(0);

/// A directory for the files of one test, which is deleted unless the test failed.
pub struct Dir(PathBuf);

impl Dir {
    pub fn new() -> Dir {
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        let dir =
            std::env::temp_dir().join(format!("jostle-fleet-{}-{number}", std::process::id()));
        fs::create_dir_all(&dir).expect("a directory");
        fs::write(dir.join("secret"), "a secret for the nodes of one test").expect("a file");
        Dir(dir)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Dir {
    fn drop(&mut self) {
        match std::thread::panicking() {
            true => eprintln!("logs and replays of the nodes are in {}", self.0.display()),
            // The system takes care of leftovers in the temporary directory.
            false => drop(fs::remove_dir_all(&self.0)),
        }
    }
}

/// A node. It is killed if the test fails.
pub struct Node {
    pub name: String,
    pub address: SocketAddr,
    nats: String,
    replicas: usize,
    dir: PathBuf,
    /// The running process; `None` after it has ended.
    process: Option<Child>,
}

impl Node {
    /// Creates a node at a port that was free a moment ago, without starting it. NATS keeps `replicas` replicas of its
    /// data.
    pub fn with_replicas(dir: &Dir, name: &str, nats: &str, replicas: usize) -> Node {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        let address = listener.local_addr().expect("a port");
        let (name, nats, dir) = (name.to_owned(), nats.to_owned(), dir.path().to_owned());
        Node { name, address, nats, replicas, dir, process: None }
    }

    /// Starts the node and waits until it accepts connections.
    pub async fn start(&mut self) {
        let log = File::options().create(true).append(true).open(self.log_file());
        let url = format!("http://{}", self.address);
        let mut command = Command::new(jostle());
        command.args(["--log", "info", "serve", "--listen", &self.address.to_string()]);
        let replicas = self.replicas.to_string();
        command.args(["--nats", &self.nats, "--nats-replicas", &replicas, "--node", &self.name]);
        command.args(["--public-url", &url, "--capacity", "8", "--address-sockets", "1000"]);
        command.arg("--secret").arg(self.dir.join("secret"));
        command.arg("--replays").arg(self.replays());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log.expect("a log"));
        self.process = Some(command.spawn().expect("jostle starts"));
        let accepts = async {
            while TcpStream::connect(self.address).await.is_err() {
                sleep(LOOK_EVERY).await;
            }
        };
        timeout(LONG, accepts).await.expect("a server in time");
        self.says("registered in the fleet", 1).await;
    }

    /// The directory of the node's replays.
    pub fn replays(&self) -> PathBuf {
        self.dir.join(format!("{}-replays", self.name))
    }

    fn log_file(&self) -> PathBuf {
        self.dir.join(format!("{}.log", self.name))
    }

    /// Number of times a text occurs in the log, over all processes of the node.
    pub fn count(&self, text: &str) -> usize {
        let log = fs::read_to_string(self.log_file()).expect("a log");
        log.matches(text).count()
    }

    /// Waits until a text has occurred in the log `times` times.
    pub async fn says(&self, text: &str, times: usize) {
        let said = async {
            while self.count(text) < times {
                sleep(LOOK_EVERY).await;
            }
        };
        timeout(LONG, said).await.unwrap_or_else(|_| panic!("{}: not {text:?} in time", self.name));
    }

    pub fn signal(&self, name: &str) {
        let id = self.process.as_ref().expect("a process").id().to_string();
        let sent = Command::new("kill").args([format!("-{name}"), id]).status();
        assert!(sent.expect("kill starts").success());
    }

    /// Waits for the process to exit; returns its exit status and how long that took.
    pub async fn ended(&mut self) -> (Option<i32>, Duration) {
        let began = Instant::now();
        let process = self.process.as_mut().expect("a process");
        let ended = async {
            loop {
                if let Some(status) = process.try_wait().expect("a child") {
                    return status.code();
                }
                sleep(LOOK_EVERY).await;
            }
        };
        let status = timeout(LONG, ended).await.expect("an end in time");
        self.process = None;
        (status, began.elapsed())
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        if let Some(mut process) = self.process.take() {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}
