//! The server under test, in a separate process, so that its memory and descriptors start fresh.

use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;

/// Prefix of the lines with which the program `counted` reports allocations per second.
const COUNTED: &str = "allocations: ";

/// The operators' token; the server runs on loopback and only during the measurement.
pub const OPS_TOKEN: &str = "operators-of-the-load";

/// A running `jostle serve`.
pub struct Server {
    process: Child,
    /// Address of the players' port, as `host:port`.
    pub address: String,
    /// Address of the operators' port.
    pub operators: String,
    log: JoinHandle<Vec<String>>,
}

impl Server {
    /// Starts the server with the scenes in a directory and waits until it listens. Its limits allow for `rooms` and
    /// `clients`.
    pub fn start(program: &Path, scenes: &Path, rooms: u32, clients: u32) -> Result<Server> {
        let mut command = Command::new(program);
        command.args(["serve", "--listen", "127.0.0.1:0", "--ops", "127.0.0.1:0", "--log", "warn"]);
        // More than the number of players, since a socket that has just been lost may still count.
        let connections = (2 * clients).clamp(4096, 65_536);
        command.args(["--connections-max", &connections.to_string(), "--uplink", "30000"]);
        command.args(["--address-sockets", &(2 * clients).clamp(128, 65_536).to_string()]);
        command.args(["--rooms-max", &rooms.max(8).to_string()]);
        command.arg("--scenes").arg(scenes).env("JOSTLE_OPS_TOKEN", OPS_TOKEN);
        let mut process = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let said = process.stdout.take().context("the server's stdout")?;
        let logged = process.stderr.take().context("the server's stderr")?;
        let log = std::thread::spawn(move || {
            BufReader::new(logged).lines().map_while(Result::ok).collect()
        });
        let mut server = Server { process, address: String::new(), operators: String::new(), log };
        match addresses(said) {
            Ok([address, operators]) => {
                (server.address, server.operators) = (address, operators);
                Ok(server)
            }
            Err(error) => {
                server.stop()?;
                Err(error)
            }
        }
    }

    /// The server's threads and physical memory, as Linux reports them.
    pub fn resources(&self) -> String {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id()));
        let status = status.unwrap_or_default();
        let field = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            line.map_or("unknown", |value| value.trim_start_matches(':').trim()).to_owned()
        };
        format!("{} threads, {}", field("Threads"), field("VmRSS"))
    }

    /// Stops the server and prints its log; returns the median number of allocations per second if they were counted.
    pub fn stop(mut self) -> Result<Option<u64>> {
        let ended = self.process.try_wait()?;
        self.process.kill().context("cannot end the server")?;
        self.process.wait()?;
        let Ok(lines) = self.log.join() else { bail!("the server's log could not be read") };
        let (counts, others): (Vec<_>, Vec<_>) =
            lines.iter().partition(|line| line.starts_with(COUNTED));
        others.iter().for_each(|line| println!("  server: {line}"));
        if let Some(status) = ended {
            bail!("the server ended by itself ({status})");
        }
        Ok(median(&counts))
    }
}

/// Reads the two addresses that the server prints, of the players' port and the operators' port.
fn addresses(said: ChildStdout) -> Result<[String; 2]> {
    let mut lines = BufReader::new(said).lines();
    let mut address = || -> Result<String> {
        let line = lines.next().context("the server ended before it listened")??;
        let address = line.split_once("http://").map(|(_, rest)| rest.trim_end_matches('/'));
        Ok(address.with_context(|| format!("no address in {line:?}"))?.to_owned())
    };
    Ok([address()?, address()?])
}

/// Median number of allocations per second, excluding seconds in which players joined and idle ones.
fn median(lines: &[&String]) -> Option<u64> {
    let count = |line: &&String| line[COUNTED.len()..].parse().ok();
    let mut counts: Vec<u64> = lines.iter().filter_map(count).collect();
    counts.sort_unstable();
    counts.get(counts.len() / 2).copied()
}
