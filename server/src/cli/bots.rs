//! `jostle bots`: players made of seeded dice, to see how a server holds up and what it sends.

mod canary;
mod client;
mod operators;
mod report;
mod socket;
mod tally;
mod text;
mod witness;

use super::run::json;
use super::{Failure, say};
use crate::rooms::is_code;
use canary::{Beside, Canary};
use client::{Bot, Stage};
use operators::{Operators, Scrape, ServerReport};
use report::{Around, ClientReport, Report};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;
use tokio::time::sleep;
use witness::{Newcomers, Witness};

/// Clients that one process plays.
const CLIENTS_MAX: u32 = 1024;
/// Time from the last bot's coming to the measurement, and from its end to the last look at memory.
const SETTLE: Duration = Duration::from_secs(1);
/// Each bot loses its socket so often, unless `--reconnects` says otherwise.
const LOSS_EVERY: Duration = Duration::from_secs(60);

/// Play with many clients at once, and report what they got
///
/// Each moves, launches, makes and drags at random, loses its socket now and then, and comes back with its
/// token. First a thread that does nothing looks whether the machine is quiet enough to judge. Status 1 if
/// any client met an error, came back to another seat, or was shown a wrong state.
#[derive(clap::Args)]
pub struct Bots {
    /// Where to play; of several rooms each gets its share of the clients, the first the newcomers
    #[arg(value_name = "ws://HOST/ROOM", required = true)]
    urls: Vec<String>,
    /// How many
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(CLIENTS_MAX)))]
    clients: u32,
    /// How long they play once all are there
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: u32,
    /// Seed of what they do
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Ask the server's operators' port too: its lateness and its own share of that, memory, processor time
    #[arg(long, value_name = "http://HOST:PORT")]
    ops: Option<String>,
    /// How many decode every snapshot as a page does; the others read the heads only, which is cheap
    #[arg(long, value_name = "N", default_value_t = 32)]
    decode: u32,
    /// How many sockets are lost in all, one after another; by default one a bot and minute
    #[arg(long, value_name = "N")]
    reconnects: Option<u32>,
    /// How many newcomers join the room while it is played, one after another
    #[arg(long, value_name = "N", default_value_t = 0)]
    newcomers: u32,
    /// How long an idle thread watches the machine before; 0 for not at all, and not beside the play
    #[arg(long, value_name = "S", default_value_t = 2)]
    canary: u32,
    /// End with one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// A parsed ws:// address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// `host:port`.
    pub authority: String,
    /// The word in the room's link.
    pub room: String,
}

impl Bots {
    /// Plays and reports.
    pub fn run(self) -> Result<(), Failure> {
        let targets: Result<Vec<_>, _> = self.urls.iter().map(|url| Target::parse(url)).collect();
        let targets = targets?;
        let operators = self.ops.as_deref().map(Operators::parse).transpose()?;
        let watched = Duration::from_secs(self.canary.into());
        let canary = (self.canary > 0).then(|| Canary::watch(watched));
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
        let runtime = runtime.map_err(|error| Failure::Check(format!("runtime: {error}")))?;
        let (clients, around) = runtime.block_on(self.play(&targets, operators))?;
        let decoders = self.decode.min(self.clients) as usize;
        let report = Report::new(&targets, clients, Around { canary, decoders, ..around });
        if self.json { say(json(&report)) } else { say(&report) }?;
        match report.failure() {
            None => Ok(()),
            Some(failure) => Err(Failure::Check(failure)),
        }
    }

    async fn play(
        &self,
        targets: &[Target],
        operators: Option<Operators>,
    ) -> Result<(Vec<ClientReport>, Around), Failure> {
        let length = Duration::from_secs(self.seconds.into());
        let empty = scrape(operators.clone()).await?;
        let (stage, followed) = watch::channel(Stage::Coming);
        let witness = Arc::new(Witness::default());
        let playing = self.send_in(targets, &followed, &witness).await;
        sleep(SETTLE).await;
        let full = scrape(operators.clone()).await?;
        let beside = (self.canary > 0).then(Beside::begin).flatten();
        stage.send_replace(Stage::Playing(Instant::now()));
        let newcomers = (self.newcomers > 0).then(|| {
            let target = targets[0].clone();
            tokio::spawn(Newcomers::come(self.newcomers, length, target, witness))
        });
        sleep(length).await;
        let after = scrape(operators).await?;
        stage.send_replace(Stage::Over);
        let still = beside.map(Beside::end);
        let mut clients = Vec::new();
        for client in playing {
            clients.push(client.await.expect("a bot does not panic"));
        }
        let mut around = Around { still, ..Around::default() };
        if let Some(newcomers) = newcomers {
            around.newcomers = Some(newcomers.await.expect("a newcomer does not panic"));
        }
        if let (Some(empty), Some(full), Some(after)) = (empty, full, after) {
            around.server = Some(ServerReport::between(&full, &after));
            let [few, many] = [&empty, &full].map(Scrape::resident_bytes);
            let grown = few.zip(many).map(|(few, many)| many - few);
            around.server_bytes_per_client = grown.map(|bytes| bytes / f64::from(self.clients));
        }
        Ok((clients, around))
    }

    /// Has all bots connect, and waits until each has a seat or has none to come.
    async fn send_in(
        &self,
        targets: &[Target],
        stage: &watch::Receiver<Stage>,
        witness: &Arc<Witness>,
    ) -> Vec<JoinHandle<ClientReport>> {
        let (seated, mut waiting) = mpsc::channel(self.clients as usize);
        let bots = (0..self.clients).map(|index| Bot {
            index,
            seed: self.seed,
            target: targets[index as usize % targets.len()].clone(),
            decodes: index < self.decode || index == 0,
            losses: self.losses(index),
            stage: stage.clone(),
            seated: seated.clone(),
            witness: Arc::clone(witness),
        });
        let playing = bots.map(|bot| tokio::spawn(bot.play())).collect();
        for _ in 0..self.clients {
            waiting.recv().await;
        }
        playing
    }

    /// When a bot loses its socket: all losses come one after another, evenly, to one bot after another.
    fn losses(&self, index: u32) -> Vec<Duration> {
        let length = f64::from(self.seconds);
        let usual = f64::from(self.clients) * length / LOSS_EVERY.as_secs_f64();
        let count = self.reconnects.unwrap_or(usual as u32);
        let at = |loss: u32| length * (f64::from(loss) + 0.5) / f64::from(count);
        let own = (0..count).filter(|loss| loss % self.clients == index);
        own.map(|loss| Duration::from_secs_f64(at(loss))).collect()
    }
}

/// Asks the operators' port, if there is one, without delaying bots.
async fn scrape(operators: Option<Operators>) -> Result<Option<Scrape>, Failure> {
    let Some(operators) = operators else { return Ok(None) };
    let asked = tokio::task::spawn_blocking(move || operators.scrape());
    asked.await.expect("a scrape does not panic").map(Some)
}

impl Target {
    fn parse(url: &str) -> Result<Target, Failure> {
        let parts = url.strip_prefix("ws://").and_then(|rest| rest.split_once('/'));
        match parts {
            Some((host, room)) if !host.is_empty() && is_code(room) => {
                let port = if has_port(host) { "" } else { ":80" };
                Ok(Target { authority: format!("{host}{port}"), room: room.to_owned() })
            }
            _ => {
                let text = format!("address: found {url:?}; allowed: ws://HOST/ROOM");
                Err(Failure::Usage(text))
            }
        }
    }
}

fn has_port(host: &str) -> bool {
    host.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        bots: Bots,
    }

    #[test]
    fn losses_are_shared_out_evenly() {
        let words = "x ws://h/r --clients 4 --seconds 10 --reconnects 6".split(' ');
        let bots = Line::parse_from(words).bots;
        let losses: Vec<_> = (0..4).map(|index| bots.losses(index).len()).collect();
        assert_eq!(losses, [2, 2, 1, 1]);
        assert!(bots.losses(1)[1] < Duration::from_secs(10));
    }

    #[test]
    fn addresses_are_read_or_refused() {
        for (url, authority) in [
            ("ws://127.0.0.1:8080/arena", "127.0.0.1:8080"),
            ("ws://example.org/arena", "example.org:80"),
            ("ws://[::1]:9/arena", "[::1]:9"),
        ] {
            let target = Target::parse(url).expect(url);
            assert_eq!(target, Target { authority: authority.into(), room: "arena".into() });
        }
        for url in ["wss://h/arena", "ws://h", "ws://h/", "ws:///arena", "ws://h/a/b", "arena"] {
            assert!(Target::parse(url).is_err(), "{url}");
        }
    }
}
