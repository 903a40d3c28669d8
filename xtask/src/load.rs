//! `cargo xtask load`: the server in one process, bots in another, and what both of them say. Each part
//! has a server of its own, so that memory and descriptors begin anew.

use crate::shell::{build_server, root, run, say, target_dir};
use anyhow::{Context, Result, bail};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;

/// Players of each of many rooms.
const ROOM_PLAYERS: u32 = 16;
/// The scene of the crowd, and the one that the many rooms play.
const CROWD: &str = "tests/crowd/crowd.toml";
/// See there.
const ARENA: &str = "assets/scenes/arena.toml";
/// Newcomers for each lost socket.
const NEWCOMERS_SHARE: u32 = 3;

/// What to measure.
pub struct Load {
    /// Clients of the one room.
    pub clients: u32,
    /// Rooms of [`ROOM_PLAYERS`].
    pub rooms: u32,
    /// Seconds of each part.
    pub seconds: u32,
    /// Sockets that are lost.
    pub reconnects: u32,
    /// Whether allocations are counted.
    pub allocations: bool,
}

/// Measures one part after another. A client that failed is an error; figures are only printed.
pub fn load(load: &Load) -> Result<()> {
    build(load.allocations)?;
    let scenes = scenes(load.rooms)?;
    let crowd = ["crowd".to_owned()];
    // A socket that comes allocates what it keeps; steady play is to be told apart from that.
    let steady: &[&str] = if load.allocations { &["--reconnects", "0"] } else { &[] };
    if load.clients > 0 {
        say("load", &format!("{} clients in one room", load.clients));
        part(load, &scenes, &crowd, load.clients, steady)?;
    }
    if load.rooms > 0 {
        say("load", &format!("{} rooms of {ROOM_PLAYERS}", load.rooms));
        let rooms: Vec<_> = (1..=load.rooms).map(|number| format!("arena-{number}")).collect();
        part(load, &scenes, &rooms, load.rooms * ROOM_PLAYERS, steady)?;
    }
    if load.reconnects > 0 && load.clients > 0 {
        let newcomers = load.reconnects.div_ceil(NEWCOMERS_SHARE);
        let what = format!("{} lost sockets and {newcomers} newcomers", load.reconnects);
        say("load", &format!("{what} among {} clients", load.clients));
        let counts = [load.reconnects, newcomers].map(|count| count.to_string());
        let more = ["--reconnects", &counts[0], "--newcomers", &counts[1]];
        part(load, &scenes, &crowd, load.clients, &more)?;
    }
    Ok(())
}

fn build(allocations: bool) -> Result<()> {
    say("load", "build the server and the bots, optimised");
    build_server(&["--bin", "jostle"])?;
    if allocations { build_server(&["--example", "counted"]) } else { Ok(()) }
}

/// A directory with the crowd and a copy of the arena for each of many rooms.
fn scenes(rooms: u32) -> Result<PathBuf> {
    let dir = target_dir().join("load/scenes");
    if dir.exists() {
        fs::remove_dir_all(&dir).context("the scenes of the last time")?;
    }
    fs::create_dir_all(&dir).context("a directory for scenes")?;
    fs::copy(root().join(CROWD), dir.join("crowd.toml")).context(CROWD)?;
    for number in 1..=rooms {
        fs::copy(root().join(ARENA), dir.join(format!("arena-{number}.toml"))).context(ARENA)?;
    }
    Ok(dir)
}

fn part(load: &Load, scenes: &Path, rooms: &[String], clients: u32, more: &[&str]) -> Result<()> {
    let server = Server::start(scenes, clients, load.allocations)?;
    let mut bots = Command::new(target_dir().join("release/jostle"));
    bots.arg("bots").args(rooms.iter().map(|room| format!("ws://{}/{room}", server.address)));
    bots.args(["--clients", &clients.to_string(), "--seconds", &load.seconds.to_string()]);
    bots.args(["--ops", &format!("http://{}", server.operators)]).args(more);
    let played = run(&mut bots);
    if let Some(counts) = server.stop()? {
        say("load", &counts);
    }
    played
}

/// A server under test.
struct Server {
    process: Child,
    address: String,
    operators: String,
    /// What it wrote to stderr.
    log: JoinHandle<Vec<String>>,
}

impl Server {
    fn start(scenes: &Path, clients: u32, counted: bool) -> Result<Server> {
        let program = if counted { "release/examples/counted" } else { "release/jostle" };
        let mut command = Command::new(target_dir().join(program));
        command.args(["serve", "--listen", "127.0.0.1:0", "--ops", "127.0.0.1:0", "--log", "warn"]);
        // Some more than play: a socket that was just lost may still count.
        command.args(["--address-sockets", &(2 * clients).to_string(), "--scenes"]).arg(scenes);
        let mut process = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .context("cannot start the server")?;
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

    /// Ends it, shows what it logged, and says how much it allocated, if that was counted.
    fn stop(mut self) -> Result<Option<String>> {
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

/// Where a server says that it listens: to players, and to its operators.
fn addresses(said: ChildStdout) -> Result<[String; 2]> {
    let mut lines = BufReader::new(said).lines();
    let mut address = || -> Result<String> {
        let line = lines.next().context("the server ended before it listened")??;
        let address = line.split_once("http://").map(|(_, rest)| rest.trim_end_matches('/'));
        Ok(address.with_context(|| format!("no address in {line:?}"))?.to_owned())
    };
    Ok([address()?, address()?])
}

/// How lines of `server/examples/counted.rs` begin; allocations of a second follow.
const COUNTED: &str = "allocations: ";

/// Of the second with as many above it as below: neither one in which players came nor an idle one.
fn median(lines: &[&String]) -> Option<String> {
    let count = |line: &&String| line[COUNTED.len()..].parse().ok();
    let mut counts: Vec<u64> = lines.iter().filter_map(count).collect();
    counts.sort_unstable();
    let middle = counts.get(counts.len() / 2)?;
    Some(format!("allocations: {middle} a second, {:.1} a tick", *middle as f64 / 60.0))
}
