//! `cargo xtask load`: a server in one process, bots in this one, and the figures of both. Each part has a server
//! of its own.

mod bare;
mod jitter;
mod operators;
mod report;
mod server;
mod spectators;
mod witness;

use anyhow::{Context, Result, bail};
use bare::Bare;
use clap::Parser;
use jitter::{Jitter, JitterProbe};
use jostle_cli::bots::crowd::{Crowd, CrowdPlan, evenly};
use jostle_cli::bots::report::Report;
use jostle_cli::bots::target::Target;
use jostle_cli::bots::{DECODERS, SETTLE};
use operators::{Operators, Scrape, ServerReport};
use report::LoadReport;
use server::Server;
use spectators::Spectators;
use std::fs;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::time::sleep;
use witness::{Newcomers, Witness};

/// Players in each of many rooms.
const ROOM_PLAYERS: u32 = 16;
/// Lost sockets per newcomer.
const NEWCOMERS_SHARE: u32 = 3;
/// Interval at which each bot loses its socket, unless set otherwise.
const LOSS_EVERY_S: u32 = 60;
/// Time during which an idle thread watches the machine before the bots connect.
const PROBE: Duration = Duration::from_secs(2);
/// The scene of the crowd; the many rooms play a copy of the arena.
const CROWD: &str = include_str!("../crowd.toml");
const ARENA: &str = include_str!("../../../assets/scenes/arena.toml");

/// Measures a server under load: a crowd in one room, many rooms, and lost sockets and newcomers in the crowd
#[derive(Parser)]
struct Load {
    /// The program to start: `jostle`, or `counted`, which counts its allocations
    #[arg(long, value_name = "FILE")]
    server: PathBuf,
    /// Clients of the one room; 0 leaves that out
    #[arg(long, value_name = "N", default_value_t = 500)]
    clients: u32,
    /// Rooms of 16 players; 0 leaves that out
    #[arg(long, value_name = "N", default_value_t = 16)]
    rooms: u32,
    /// Seconds of each part
    #[arg(long, value_name = "S", default_value_t = 60)]
    seconds: u32,
    /// Spectators of the first of these rooms
    #[arg(long, value_name = "N", default_value_t = 0)]
    spectators: u32,
    /// Sockets lost one after another while the crowd plays; 0 leaves that part out
    #[arg(long, value_name = "N", default_value_t = 1000)]
    reconnects: u32,
    /// Lose no socket in the first two parts, since a new one allocates
    #[arg(long)]
    steady: bool,
}

/// One part: a crowd, and its losses.
struct Part {
    rooms: Vec<String>,
    clients: u32,
    losses: u32,
    newcomers: u32,
    spectators: u32,
}

fn main() -> Result<()> {
    let load = Load::parse();
    let scenes = std::env::temp_dir().join(format!("jostle-load-{}", std::process::id()));
    write_scenes(&scenes, load.rooms)?;
    let measured = load.parts().iter().try_for_each(|(what, part)| {
        println!("load: {what}");
        load.measure(part, &scenes)
    });
    fs::remove_dir_all(&scenes).context("the directory of scenes")?;
    measured
}

/// The crowd, and a copy of the arena for each of many rooms.
fn write_scenes(dir: &Path, rooms: u32) -> Result<()> {
    fs::create_dir_all(dir).context("a directory for scenes")?;
    fs::write(dir.join("crowd.toml"), CROWD)?;
    for number in 1..=rooms {
        fs::write(dir.join(format!("arena-{number}.toml")), ARENA)?;
    }
    Ok(())
}

impl Load {
    fn parts(&self) -> Vec<(String, Part)> {
        let usual = |clients: u32| {
            if self.steady { 0 } else { clients * self.seconds / LOSS_EVERY_S }
        };
        let crowd = |losses, newcomers| Part {
            rooms: vec!["crowd".to_owned()],
            clients: self.clients,
            losses,
            newcomers,
            spectators: 0,
        };
        let mut parts = Vec::new();
        if self.clients > 0 {
            let what = format!("{} clients in one room", self.clients);
            parts.push((what, crowd(usual(self.clients), 0)));
        }
        if self.rooms > 0 {
            let clients = self.rooms * ROOM_PLAYERS;
            let rooms = (1..=self.rooms).map(|number| format!("arena-{number}")).collect();
            let part = Part {
                rooms,
                clients,
                losses: usual(clients),
                newcomers: 0,
                spectators: self.spectators,
            };
            parts.push((format!("{} rooms of {ROOM_PLAYERS}", self.rooms), part));
        }
        if self.reconnects > 0 && self.clients > 0 {
            let newcomers = self.reconnects.div_ceil(NEWCOMERS_SHARE);
            let what = format!("{} lost sockets and {newcomers} newcomers", self.reconnects);
            let what = format!("{what} among {} clients", self.clients);
            parts.push((what, crowd(self.reconnects, newcomers)));
        }
        parts
    }

    /// Fails if a client fails; figures are only printed.
    fn measure(&self, part: &Part, scenes: &Path) -> Result<()> {
        let probe = JitterProbe::start(1);
        std::thread::sleep(PROBE);
        let before = probe.stop();
        let server = Server::start(&self.server, scenes, part.clients + part.spectators)?;
        let runtime = tokio::runtime::Runtime::new().context("a runtime for the bots")?;
        println!("{}", runtime.block_on(Bare::measure(part.clients))?);
        let length = Duration::from_secs(self.seconds.into());
        let played = runtime.block_on(play(part, &server, length, before));
        if let Some(count) = server.stop()? {
            println!("load: allocations: {count} a second, {:.1} a tick", count as f64 / 60.0);
        }
        let report = played?;
        println!("{report}");
        report.failure().map_or(Ok(()), |failure| bail!(failure))
    }
}

async fn play(
    part: &Part,
    server: &Server,
    length: Duration,
    before: Jitter,
) -> Result<LoadReport> {
    let operators = Operators(server.operators.clone());
    let empty = scrape(&operators).await?;
    let (witness, snapshots) = Witness::new();
    let plan = CrowdPlan {
        targets: part.rooms.iter().map(|room| target(server, room)).collect(),
        clients: part.clients,
        seed: 0,
        decoders: DECODERS,
        losses: evenly(part.losses, length),
        snapshots: Some(snapshots),
    };
    let crowd = Crowd::join(&plan).await;
    let spectators = Spectators::come(part.spectators, &plan.targets[0]).await?;
    sleep(SETTLE).await;
    let full = scrape(&operators).await?;
    let probe = JitterProbe::start(std::thread::available_parallelism().map_or(1, NonZero::get));
    crowd.begin();
    let newcomers = (part.newcomers > 0).then(|| {
        let (target, witness) = (plan.targets[0].clone(), Arc::clone(&witness));
        tokio::spawn(Newcomers::come(part.newcomers, length, target, witness))
    });
    sleep(length).await;
    let after = scrape(&operators).await?;
    let beside = probe.stop();
    spectators.go().await?;
    let clients = crowd.end().await;
    let newcomers = match newcomers {
        Some(newcomers) => Some(newcomers.await.context("newcomers")?),
        None => None,
    };
    let grown = |few: f64, many: f64| (many - few) / f64::from(part.clients);
    Ok(LoadReport {
        before,
        beside,
        newcomers,
        server: ServerReport::between(&full, &after),
        server_bytes_per_client: empty
            .resident_bytes()
            .zip(full.resident_bytes())
            .map(|(few, many)| grown(few, many)),
        play: Report::new(&plan.targets, DECODERS.min(part.clients), clients),
    })
}

fn target(server: &Server, room: &str) -> Target {
    Target { authority: server.address.clone(), room: room.to_owned() }
}

/// Reads the operators' port without delaying the bots.
async fn scrape(operators: &Operators) -> Result<Scrape> {
    let operators = operators.clone();
    tokio::task::spawn_blocking(move || operators.scrape()).await.context("a scrape")?
}
