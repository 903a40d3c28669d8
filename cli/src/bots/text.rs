//! The report of bots as text.

use super::report::{ClientEntry, Report};
use std::fmt;

/// Clients that are shown one by one.
const SHOWN_MAX: usize = 16;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.clients <= SHOWN_MAX {
            self.per_client.iter().try_for_each(|entry| show_client(f, entry))?;
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
        if self.returns.return_ms.count > 0 {
            let (seats, heroes) = (self.returns.seats_lost, self.returns.heroes_lost);
            writeln!(
                f,
                "returns {}; {seats} to another seat, {heroes} to another hero",
                self.returns.return_ms
            )?;
            let (moves, outages) = (self.returns.moves, self.returns.outage_ms);
            writeln!(f, "moves followed {moves}; without snapshots {outages}")?;
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

fn show_client(f: &mut fmt::Formatter, entry: &ClientEntry) -> fmt::Result {
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
