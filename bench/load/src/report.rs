//! Prints the results of one part as text.

use crate::crowds::BotShare;
use crate::jitter::Jitter;
use crate::operators::ServerReport;
use crate::processor::Used;
use crate::witness::Newcomers;
use jostle_cli::bots::report::Report;
use serde::Serialize;
use std::fmt;

/// All measurements of one part.
#[derive(Debug, Serialize)]
pub struct LoadReport {
    /// The machine's jitter before the part.
    pub before: Jitter,
    /// The machine's jitter during the part.
    pub beside: Jitter,
    pub newcomers: Option<Newcomers>,
    pub server: ServerReport,
    /// The server's physical memory per client.
    pub server_bytes_per_client: Option<f64>,
    /// The server's threads and memory with all clients connected.
    pub resources: String,
    /// Measurements from each process that plays bots, starting with this one.
    pub shares: Vec<BotShare>,
    /// Results of the individual bots in this process.
    #[serde(flatten)]
    pub play: Report,
}

impl LoadReport {
    /// The first client failure.
    pub fn failure(&self) -> Option<String> {
        let of_bots = self.shares.iter().find_map(|share| share.failure.clone());
        of_bots.or_else(|| self.newcomers.as_ref()?.failure())
    }

    /// Number of snapshots received by all clients together.
    fn snapshots(&self) -> f64 {
        self.shares.iter().map(|share| share.snapshots).sum()
    }
}

impl fmt::Display for LoadReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "idle thread: late {}", self.before.late_ms)?;
        if let Some(share) = self.before.queued_share {
            write!(f, "; {:.2} % of the time without a processor", 100.0 * share)?;
        }
        let busy = if self.before.is_too_busy() { ": machine too busy to judge" } else { "" };
        writeln!(f, "{busy}")?;
        if self.beside.queued_share.is_some() {
            let Jitter { late_own_ms, missed_ticks, .. } = &self.beside;
            writeln!(
                f,
                "idle threads beside: late by the machine alone {late_own_ms}; {missed_ticks} ticks missed"
            )?;
        }
        if let Some(newcomers) = &self.newcomers {
            writeln!(f, "{newcomers}")?;
        }
        self.show_server(f)?;
        self.show_shares(f)?;
        write!(f, "{}", self.play)
    }
}

impl LoadReport {
    /// Prints the figures of the bot processes and whether they had enough processor time.
    fn show_shares(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let used = self.shares.iter().fold(Used::default(), |sum, share| sum.plus(share.used));
        let seconds = self.play.seconds.max(1e-9);
        let (processes, processors) = (self.shares.len(), used.spent / seconds);
        let waited = used.waited / seconds;
        write!(
            f,
            "bots: {processes} processes on {processors:.2} processors, {waited:.2} s a second waiting for one"
        )?;
        let short = "; they are short of processors: pings and intervals are as much theirs as the server's";
        writeln!(f, "{}", if used.is_short() { short } else { "" })?;
        for share in self.shares.iter().skip(1) {
            let BotShare { clients, snapshots, ping_ms, interval_ms, .. } = share;
            let rate = snapshots / seconds / *clients as f64;
            writeln!(
                f,
                "  {clients} more: {rate:.1} snapshots/s, one after another {interval_ms}; {} gaps, at most {} ticks; \
                 ping {ping_ms}",
                share.gaps, share.gap_ticks_max
            )?;
        }
        Ok(())
    }

    fn show_server(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let server = &self.server;
        let [inputs, play, send] = server.phases_ms;
        writeln!(
            f,
            "server: {} ticks, {} missed, {} sockets late; inputs {inputs:.3}, play {play:.3}, send {send:.3} ms a \
             wakeup",
            server.ticks, server.ticks_missed, server.sockets_late
        )?;
        for (name, late) in [("late", server.late_ms), ("own share", server.late_own_ms)] {
            if let Some([p50, p90, p99, max]) = late {
                writeln!(f, "  {name}: p50 <= {p50}, p90 <= {p90}, p99 <= {p99}, max <= {max} ms")?;
            }
        }
        if let Some(seconds) = server.cpu_seconds {
            let share = 100.0 * seconds / self.play.seconds.max(1e-9);
            let snapshots = self.snapshots().max(1.0);
            writeln!(
                f,
                "  processor: {seconds:.1} s, {share:.0} % of one, {:.1} us a snapshot sent",
                1e6 * seconds / snapshots
            )?;
        }
        let megabytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        if let Some([before, after]) = server.resident_bytes {
            let each = self.server_bytes_per_client.unwrap_or(0.0) / f64::from(1 << 10);
            let (before, after) = (megabytes(before), megabytes(after));
            writeln!(
                f,
                "  memory: {before:.1} to {after:.1} MiB, {each:.1} KiB a client; {}",
                self.resources
            )?;
        }
        if let Some([before, after]) = server.descriptors {
            writeln!(f, "  descriptors: {before} to {after}")?;
        }
        Ok(())
    }
}
