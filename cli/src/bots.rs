//! `jostle bots`: seeded players on real sockets that measure a server's traffic and how well it copes with the load.
//! `bench/load` uses the same bots and measures more.

mod client;
pub mod crowd;
pub mod histogram;
pub mod report;
pub mod socket;
pub mod target;

use crate::output::{Failure, OrFail, json, say};
use crowd::{BotCrowd, CrowdPlan, evenly};
use report::{ClientReport, Report};
use std::time::Duration;
use target::BotTarget;
use tokio::time::sleep;

/// Maximum number of clients that one process runs.
const CLIENTS_MAX: u32 = 1024;
/// Number of bots that decode every snapshot. Many more would take up the processors that the server needs.
pub const DECODERS: u32 = 32;
/// Time from the last bot's arrival to the start of the measurement.
pub const SETTLE: Duration = Duration::from_secs(1);
/// Interval at which a bot loses its socket.
const LOSS_EVERY: Duration = Duration::from_secs(60);

/// Play with many clients at once, and report their measurements
///
/// Each client moves, launches, makes and drags at random, loses its socket once a minute, and comes back using its
/// token. It follows its room to another server, and asks a fleet's other servers if its own dies. The status is 1 if
/// any client had an error or came back to a different seat.
#[derive(clap::Args)]
pub struct Bots {
    /// Rooms to play in; the clients are divided among them
    #[arg(value_name = "ws://HOST/ROOM", required = true)]
    urls: Vec<BotTarget>,
    /// Number of clients
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(CLIENTS_MAX)))]
    clients: u32,
    /// Seconds of play once all clients have joined
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: u32,
    /// Seed for the clients' input
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Press nothing, and send as little as an idle player's page does
    #[arg(long)]
    idle: bool,
    /// Print one JSON object on stdout at the end
    #[arg(long)]
    json: bool,
}

impl Bots {
    /// Plays and prints the report.
    pub fn run(self) -> Result<(), Failure> {
        let length = Duration::from_secs(self.seconds.into());
        let losses = self.clients * self.seconds / LOSS_EVERY.as_secs() as u32;
        let plan = CrowdPlan {
            targets: self.urls,
            clients: self.clients,
            first: 0,
            address_of: |_| None,
            idle: self.idle,
            seed: self.seed,
            decoders: DECODERS,
            losses: evenly(losses, length),
            snapshots: None,
        };
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
        let runtime = runtime.or_check("runtime")?;
        let clients = runtime.block_on(play(&plan, length));
        let report = Report::new(&plan.targets, DECODERS.min(plan.clients), clients);
        if self.json { say(json(&report)) } else { say(&report) }?;
        match report.failure() {
            None => Ok(()),
            Some(failure) => Err(Failure::Check(failure)),
        }
    }
}

async fn play(plan: &CrowdPlan, length: Duration) -> Vec<ClientReport> {
    let crowd = BotCrowd::join(plan).await;
    sleep(SETTLE).await;
    crowd.begin();
    sleep(length).await;
    crowd.end().await
}
