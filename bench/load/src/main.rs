//! `cargo xtask load`: measures a server in one process with bots in this one. Each part starts a new server.

mod addresses;
mod bare;
mod crowds;
mod jitter;
mod lobby;
mod operators;
mod processor;
mod report;
mod server;
mod spectators;
mod witness;

use anyhow::{Context, Result, bail};
use bare::Bare;
use clap::Parser;
use crowds::{BotProcess, BotShare, Order};
use jitter::{Jitter, JitterProbe};
use jostle_cli::bots::crowd::BotCrowd;
use jostle_cli::bots::report::Report;
use jostle_cli::bots::{DECODERS, SETTLE};
use operators::{Operators, Scrape, ServerReport};
use processor::Used;
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

/// Number of players per room in the part with many rooms.
const ROOM_PLAYERS: u32 = 16;
/// Number of lost sockets per newcomer.
const NEWCOMERS_SHARE: u32 = 3;
/// Default interval at which each bot loses its socket.
const LOSS_EVERY_S: u32 = 60;
/// How long an idle thread measures the machine's jitter before the bots connect.
const PROBE: Duration = Duration::from_secs(2);
/// The room of the crowd.
const CROWD_ROOM: &str = "crowd";
/// Scenes for load tests, beside those of the server.
const SCENES: [(&str, &str); 2] =
    [(CROWD_ROOM, include_str!("../crowd.toml")), ("still", include_str!("../still.toml"))];

/// Measures a server under load: a crowd in one room, many rooms, and a crowd with lost sockets and newcomers
#[derive(Parser)]
struct Load {
    /// The program to start: `jostle`, or `counted`, which counts its allocations
    #[arg(long, value_name = "FILE", required_unless_present = "order")]
    server: Option<PathBuf>,
    /// The bots that this process plays for another one, as JSON
    #[arg(long, hide = true, value_parser = parse_order)]
    order: Option<Order>,
    /// Number of processes that play bots; one can keep a few hundred on time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=64))]
    processes: u32,
    /// Let bots press no keys and send as little as an idle player's page
    #[arg(long)]
    idle: bool,
    /// Scene to play in the part with many rooms: one of the server's, or `still`, in which nothing moves by itself
    #[arg(long, value_name = "NAME", default_value = "arena")]
    scene: String,
    /// Number of empty rooms to open, list, search and close; 0 skips this part
    #[arg(long, value_name = "N", default_value_t = 0)]
    empty_rooms: u32,
    /// Number of clients in the single room; 0 skips this part
    #[arg(long, value_name = "N", default_value_t = 500)]
    clients: u32,
    /// Number of rooms with 16 players each; 0 skips this part
    #[arg(long, value_name = "N", default_value_t = 16)]
    rooms: u32,
    /// Length of each part in seconds
    #[arg(long, value_name = "S", default_value_t = 60)]
    seconds: u32,
    /// Number of spectators in the first of these rooms
    #[arg(long, value_name = "N", default_value_t = 0)]
    spectators: u32,
    /// Number of sockets lost one after another while the crowd plays; 0 skips this part
    #[arg(long, value_name = "N", default_value_t = 1000)]
    reconnects: u32,
    /// Lose no sockets in the first two parts, because reconnecting allocates
    #[arg(long)]
    steady: bool,
}

fn parse_order(text: &str) -> Result<Order, serde_json::Error> {
    serde_json::from_str(text)
}

/// One part of the load test: a crowd and the sockets it loses.
struct Part {
    /// Number of rooms to open; 0 means the crowd's room.
    rooms: u32,
    clients: u32,
    losses: u32,
    newcomers: u32,
    spectators: u32,
}

fn main() -> Result<()> {
    let load = Load::parse();
    if let Some(order) = &load.order {
        return order.obey();
    }
    let scenes = std::env::temp_dir().join(format!("jostle-load-{}", std::process::id()));
    write_scenes(&scenes)?;
    let measured = load.parts().iter().try_for_each(|(what, part)| {
        println!("load: {what}");
        load.measure(part, &scenes)
    });
    let measured = measured.and_then(|()| load.measure_lobby(&scenes));
    fs::remove_dir_all(&scenes).context("the directory of scenes")?;
    measured
}

/// Writes the scenes for load tests to a directory.
fn write_scenes(dir: &Path) -> Result<()> {
    fs::create_dir_all(dir).context("a directory for scenes")?;
    Ok(SCENES
        .iter()
        .try_for_each(|(name, text)| fs::write(dir.join(format!("{name}.toml")), text))?)
}

impl Load {
    fn parts(&self) -> Vec<(String, Part)> {
        let usual = |clients: u32| {
            if self.steady { 0 } else { clients * self.seconds / LOSS_EVERY_S }
        };
        let crowd = |losses, newcomers| Part {
            rooms: 0,
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
            let part = Part {
                rooms: self.rooms,
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

    fn program(&self) -> Result<&Path> {
        self.server.as_deref().context("--server is missing")
    }

    /// Measures one part and prints the results. Fails only if a client fails.
    fn measure(&self, part: &Part, scenes: &Path) -> Result<()> {
        let probe = JitterProbe::start(1);
        std::thread::sleep(PROBE);
        let before = probe.stop();
        let clients = part.clients + part.spectators;
        let server = Server::start(self.program()?, scenes, part.rooms, clients)?;
        let runtime = tokio::runtime::Runtime::new().context("a runtime for the bots")?;
        let played = runtime.block_on(self.play(part, &server, before));
        if let Some(count) = server.stop()? {
            println!("load: allocations: {count} a second, {:.1} a tick", count as f64 / 60.0);
        }
        let report = played?;
        println!("{report}");
        if self.processes == 1 && part.clients > 0 {
            println!(
                "{}",
                runtime.block_on(Bare::measure(part.clients, report.play.message_bytes()))?
            );
        }
        report.failure().map_or(Ok(()), |failure| bail!(failure))
    }

    /// Measures the lobby with many empty rooms.
    fn measure_lobby(&self, scenes: &Path) -> Result<()> {
        if self.empty_rooms == 0 {
            return Ok(());
        }
        println!("load: {} empty rooms", self.empty_rooms);
        let server = Server::start(self.program()?, scenes, self.empty_rooms, 0)?;
        let runtime = tokio::runtime::Runtime::new().context("a runtime")?;
        let measured = runtime.block_on(lobby::measure(&server, &self.scene, self.empty_rooms));
        server.stop()?;
        measured
    }

    async fn play(&self, part: &Part, server: &Server, before: Jitter) -> Result<LoadReport> {
        let (operators, length) =
            (Operators(server.operators.clone()), Duration::from_secs(self.seconds.into()));
        let empty = scrape(&operators).await?;
        let rooms = match part.rooms {
            0 => vec![CROWD_ROOM.to_owned()],
            rooms => lobby::open_rooms(server, &self.scene, rooms).await?,
        };
        let order = Order {
            authority: server.address.clone(),
            rooms,
            clients: part.clients,
            first: 0,
            idle: self.idle,
            losses: part.losses,
            seconds: self.seconds,
        };
        let orders = order.divided(self.processes);
        let mut others =
            orders[1..].iter().map(BotProcess::start).collect::<Result<Vec<BotProcess>>>()?;
        let (witness, snapshots) = Witness::new();
        let mut plan = orders[0].plan(DECODERS);
        plan.snapshots = Some(snapshots);
        let crowd = BotCrowd::join(&plan).await;
        others.iter_mut().try_for_each(BotProcess::wait)?;
        let spectators = Spectators::come(part.spectators, &plan.targets[0]).await?;
        sleep(SETTLE).await;
        let full = scrape(&operators).await?;
        let probe =
            JitterProbe::start(std::thread::available_parallelism().map_or(1, NonZero::get));
        let used = Used::so_far();
        others.iter_mut().try_for_each(BotProcess::begin)?;
        crowd.begin();
        let newcomers = (part.newcomers > 0).then(|| {
            let (target, witness) = (plan.targets[0].clone(), Arc::clone(&witness));
            tokio::spawn(Newcomers::come(part.newcomers, length, target, witness))
        });
        sleep(length).await;
        let after = scrape(&operators).await?;
        let (used, resources) = (Used::so_far().since(used), server.resources());
        let beside = probe.stop();
        spectators.go().await?;
        others.iter_mut().try_for_each(BotProcess::end)?;
        let report = Report::new(&plan.targets, DECODERS.min(plan.clients), crowd.end().await);
        let mut shares = vec![BotShare::of(&report, used)];
        for other in others {
            shares.push(other.share()?);
        }
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
            resources,
            shares,
            play: report,
        })
    }
}

/// Scrapes the operators' port without holding up the bots.
async fn scrape(operators: &Operators) -> Result<Scrape> {
    let operators = operators.clone();
    tokio::task::spawn_blocking(move || operators.scrape()).await.context("a scrape")?
}
