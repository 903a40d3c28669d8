//! Bots in separate processes that start and stop together, because one process cannot play thousands of bots on time.
//!
//! This program starts copies of itself, each with an [`Order`]. A copy prints `seated` once its bots have seats,
//! starts measuring when it reads the line `begin`, and answers the line `end` with its [`BotShare`].

use crate::addresses::address_of;
use crate::processor::Used;
use anyhow::{Context, Result, bail};
use jostle_cli::bots::crowd::{BotCrowd, CrowdPlan, evenly};
use jostle_cli::bots::histogram::Percentiles;
use jostle_cli::bots::report::Report;
use jostle_cli::bots::target::BotTarget;
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

/// Command-line option that passes an order to a copy of this program.
pub const OPTION: &str = "--order";

/// Describes the bots that one process plays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Order {
    /// The server's address, as `host:port`.
    pub authority: String,
    pub rooms: Vec<String>,
    pub clients: u32,
    /// Number of the first bot.
    pub first: u32,
    /// Whether the bots press no keys.
    pub idle: bool,
    /// Number of sockets that the bots lose, spread evenly over `seconds`.
    pub losses: u32,
    pub seconds: u32,
}

/// Measurements from the bots of one process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BotShare {
    pub clients: usize,
    pub snapshots: f64,
    pub ping_ms: Percentiles,
    pub interval_ms: Percentiles,
    pub gaps: u64,
    pub gap_ticks_max: u32,
    pub failure: Option<String>,
    pub used: Used,
}

impl Order {
    /// The plan for the bots of this order. Only the very first bot decodes everything.
    pub fn plan(&self, decoders: u32) -> CrowdPlan {
        let target =
            |room: &String| BotTarget { authority: self.authority.clone(), room: room.clone() };
        CrowdPlan {
            targets: self.rooms.iter().map(target).collect(),
            clients: self.clients,
            first: self.first,
            address_of,
            idle: self.idle,
            seed: 0,
            decoders,
            losses: evenly(self.losses, Duration::from_secs(self.seconds.into())),
            snapshots: None,
        }
    }

    /// Divides an order among several processes. Each room is played by one process, or by all if there are fewer rooms
    /// than processes.
    pub fn divided(&self, processes: u32) -> Vec<Order> {
        let few = self.rooms.len() < processes as usize;
        let mut orders = Vec::new();
        let mut first = self.first;
        for part in 0..processes {
            let own = |(number, _): &(usize, &String)| few || *number as u32 % processes == part;
            let rooms: Vec<_> =
                self.rooms.iter().enumerate().filter(own).map(|(_, room)| room.clone()).collect();
            let clients = match few {
                true => share(self.clients, part, processes),
                false => self.clients / self.rooms.len() as u32 * rooms.len() as u32,
            };
            let losses = share(self.losses, part, processes);
            orders.push(Order { rooms, clients, first, losses, ..self.clone() });
            first += clients;
        }
        orders
    }

    /// Plays the bots of an order received from another process.
    pub fn obey(&self) -> Result<()> {
        let runtime = tokio::runtime::Runtime::new().context("a runtime for the bots")?;
        runtime.block_on(async {
            let plan = self.plan(0);
            let crowd = BotCrowd::join(&plan).await;
            say("seated")?;
            heard("begin").await?;
            let before = Used::so_far();
            crowd.begin();
            heard("end").await?;
            let used = Used::so_far().since(before);
            let report = Report::new(&plan.targets, 0, crowd.end().await);
            say(&serde_json::to_string(&BotShare::of(&report, used))?)
        })
    }
}

/// Size of part number `part` when `all` is divided into `parts` parts.
fn share(all: u32, part: u32, parts: u32) -> u32 {
    all / parts + u32::from(part < all % parts)
}

fn say(line: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{line}")?;
    Ok(stdout.flush()?)
}

/// Waits for the expected line on stdin without blocking the bots.
async fn heard(expected: &'static str) -> Result<()> {
    let read = || std::io::stdin().lines().next();
    match tokio::task::spawn_blocking(read).await.context("stdin")? {
        Some(Ok(line)) if line == expected => Ok(()),
        other => bail!("expected the line {expected}, found {other:?}"),
    }
}

impl BotShare {
    /// Creates the measurements for a process's bots from their report and the processor time used.
    pub fn of(report: &Report, used: Used) -> BotShare {
        BotShare {
            clients: report.clients,
            snapshots: report.snapshots(),
            ping_ms: report.ping_ms,
            interval_ms: report.interval_ms,
            gaps: report.gaps,
            gap_ticks_max: report.gap_ticks_max,
            failure: report.failure(),
            used,
        }
    }
}

/// A process that plays some of the bots.
pub struct BotProcess {
    process: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl BotProcess {
    /// Starts the process, whose bots then join.
    pub fn start(order: &Order) -> Result<BotProcess> {
        let program = std::env::current_exe().context("this program")?;
        let mut process = Command::new(program)
            .args([OPTION, &serde_json::to_string(order)?])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("a process for bots")?;
        let orders = process.stdin.take().context("its stdin")?;
        let answers = BufReader::new(process.stdout.take().context("its stdout")?);
        Ok(BotProcess { process, orders, answers })
    }

    /// Waits until all of the process's bots have seats or have failed to get one.
    pub fn wait(&mut self) -> Result<()> {
        let line = self.line()?;
        if line != "seated" { bail!("a process of bots said {line:?}") } else { Ok(()) }
    }

    /// Begins the measurement.
    pub fn begin(&mut self) -> Result<()> {
        writeln!(self.orders, "begin").context("a process of bots is gone")
    }

    /// Ends the measurement; call [`BotProcess::share`] next.
    pub fn end(&mut self) -> Result<()> {
        writeln!(self.orders, "end").context("a process of bots is gone")
    }

    /// Reads the measurements from the process's bots.
    pub fn share(mut self) -> Result<BotShare> {
        let share =
            serde_json::from_str(&self.line()?).context("the share of a process of bots")?;
        self.process.wait()?;
        Ok(share)
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        Ok(line.trim_end().to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bots_are_divided_by_rooms_where_there_are_enough() {
        let order = |rooms: u32, clients| Order {
            authority: "a:1".to_owned(),
            rooms: (0..rooms).map(|room| room.to_string()).collect(),
            clients,
            first: 0,
            idle: false,
            losses: 5,
            seconds: 60,
        };
        let parts = order(5, 80).divided(2);
        assert_eq!(parts[0].rooms, ["0", "2", "4"]);
        assert_eq!(parts.iter().map(|part| part.clients).collect::<Vec<_>>(), [48, 32]);
        assert_eq!((parts[1].first, parts[0].losses, parts[1].losses), (48, 3, 2));
        let parts = order(1, 501).divided(2);
        assert_eq!((parts[0].clients, parts[1].clients), (251, 250));
        assert_eq!(parts[0].rooms, parts[1].rooms);
    }
}
