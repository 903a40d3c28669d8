//! The report of bots as people read it.

use super::operators::ServerReport;
use super::report::{Come, Entry, Report};
use super::tally::Spread;
use std::fmt;

/// Clients that are shown one by one.
const SHOWN_MAX: usize = 16;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.clients <= SHOWN_MAX {
            self.per_client.iter().try_for_each(|entry| show_client(f, entry))?;
        }
        if let Some(canary) = &self.canary {
            write!(f, "idle thread: late {}", canary.late_ms)?;
            if let Some(queued) = canary.queued_ms {
                let share = 100.0 * queued / canary.watched_ms;
                write!(f, "; {share:.2} % of the time without a processor")?;
            }
            let verdict = if self.too_busy_to_judge { ": machine too busy to judge" } else { "" };
            writeln!(f, "{verdict}")?;
        }
        if let Some(still) = &self.still {
            let (late, missed) = (still.late_own_ms, still.missed_ticks);
            writeln!(
                f,
                "idle threads beside: late by the machine alone {late}; {missed} ticks missed"
            )?;
        }
        writeln!(f, "ping {}", self.ping_ms)?;
        writeln!(f, "jitter {}", self.jitter_ms)?;
        writeln!(
            f,
            "snapshots {:.1}/s, one after another {}; {} gaps, at most {} ticks",
            self.snapshots_per_second_mean, self.interval_ms, self.gaps, self.gap_ticks_max
        )?;
        write!(f, "bytes/s each:")?;
        for (kind, bytes) in &self.bytes_per_second {
            write!(f, " {kind} {bytes:.0}")?;
        }
        writeln!(f)?;
        if self.return_ms.count > 0 {
            let (seats, heroes) = (self.seats_lost, self.heroes_lost);
            writeln!(
                f,
                "returns {}; {seats} to another seat, {heroes} to another hero",
                self.return_ms
            )?;
        }
        self.newcomers.iter().try_for_each(|come| show_newcomers(f, come))?;
        if let Some(server) = &self.server {
            show_server(f, server, self)?;
        }
        write!(
            f,
            "{} clients in {} for {:.0} s, {} of them decode everything: {:.0} bytes/s each; {} ticks, \
             {} missed; {} failed",
            self.clients,
            self.rooms.join(", "),
            self.seconds,
            self.decoders,
            self.bytes_per_second_mean,
            self.server_ticks,
            self.server_missed_ticks,
            self.failed
        )
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Spread { count, p50, p90, p99, max } = self;
        write!(f, "p50 {p50:.2}, p90 {p90:.2}, p99 {p99:.2}, max {max:.2} ms of {count}")
    }
}

fn show_client(f: &mut fmt::Formatter, entry: &Entry) -> fmt::Result {
    write!(
        f,
        "bot {:>3}: {:>8.0} bytes/s, {:>5.1} snapshots/s, {:>3} gaps (at most {} ticks), ping {}",
        entry.client + 1,
        entry.bytes_per_second,
        entry.snapshots_per_second,
        entry.gaps,
        entry.gap_ticks_max,
        entry.ping_ms,
    )?;
    match &entry.error {
        Some(error) => writeln!(f, ", {error}"),
        None => writeln!(f),
    }
}

fn show_newcomers(f: &mut fmt::Formatter, come: &Come) -> fmt::Result {
    writeln!(
        f,
        "newcomers {}; {} shown the right state, {} a wrong one, {} one that nobody else saw, {} failed",
        come.took_ms, come.right, come.wrong, come.unseen, come.failed
    )
}

fn show_server(f: &mut fmt::Formatter, server: &ServerReport, report: &Report) -> fmt::Result {
    writeln!(
        f,
        "server: {} ticks, {} missed, {} sockets late; inputs {:.3}, play {:.3}, send {:.3} ms a wakeup",
        server.ticks,
        server.ticks_missed,
        server.sockets_late,
        server.phases_ms[0],
        server.phases_ms[1],
        server.phases_ms[2]
    )?;
    for (name, late) in [("late", server.late_ms), ("own share", server.late_own_ms)] {
        if let Some([p50, p90, p99, max]) = late {
            writeln!(f, "  {name}: p50 <= {p50}, p90 <= {p90}, p99 <= {p99}, max <= {max} ms")?;
        }
    }
    if let Some(seconds) = server.cpu_seconds {
        let share = 100.0 * seconds / report.seconds.max(1e-9);
        writeln!(f, "  processor: {seconds:.1} s, {share:.0} % of one")?;
    }
    let megabytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    if let Some([before, after]) = server.resident_bytes {
        let each = report.server_bytes_per_client.unwrap_or(0.0) / f64::from(1 << 10);
        let (before, after) = (megabytes(before), megabytes(after));
        writeln!(f, "  memory: {before:.1} to {after:.1} MiB, {each:.1} KiB a client")?;
    }
    if let Some([before, after]) = server.descriptors {
        writeln!(f, "  descriptors: {before} to {after}")?;
    }
    Ok(())
}
