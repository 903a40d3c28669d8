//! The figures of one part, as text.

use crate::jitter::Jitter;
use crate::operators::ServerReport;
use crate::witness::Newcomers;
use jostle_cli::bots::report::Report;
use serde::Serialize;
use std::fmt;

/// All measurements of one part.
#[derive(Debug, Serialize)]
pub struct LoadReport {
    /// Jitter of the machine before the part.
    pub before: Jitter,
    /// Jitter of the machine during the part.
    pub beside: Jitter,
    pub newcomers: Option<Newcomers>,
    pub server: ServerReport,
    /// Physical memory of the server per client.
    pub server_bytes_per_client: Option<f64>,
    #[serde(flatten)]
    pub play: Report,
}

impl LoadReport {
    /// The first failure of a client.
    pub fn failure(&self) -> Option<String> {
        self.play.failure().or_else(|| self.newcomers.as_ref()?.failure())
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
        write!(f, "{}", self.play)
    }
}

impl LoadReport {
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
            let snapshots = self.play.snapshots().max(1.0);
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
            writeln!(f, "  memory: {before:.1} to {after:.1} MiB, {each:.1} KiB a client")?;
        }
        if let Some([before, after]) = server.descriptors {
            writeln!(f, "  descriptors: {before} to {after}")?;
        }
        Ok(())
    }
}
