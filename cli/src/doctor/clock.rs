//! The wall clock, which is used to date replays, bans and certificates. Ticks follow a monotonic clock.

use super::finding::Finding;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// Maximum drift between the wall clock and the monotonic clock within a few seconds; anything more counts as a step.
const STEP_MAX: Duration = Duration::from_millis(50);

/// Readings of both clocks at the same instant.
pub struct Clocks {
    steady: Instant,
    wall: SystemTime,
}

impl Clocks {
    pub fn now() -> Clocks {
        Clocks { steady: Instant::now(), wall: SystemTime::now() }
    }

    /// How far the wall clock has drifted from the monotonic clock since then.
    fn step(&self) -> Duration {
        let now = Clocks::now();
        let expected = self.wall + (now.steady - self.steady);
        let ahead = now.wall.duration_since(expected);
        ahead.unwrap_or_else(|behind| behind.duration())
    }
}

/// Checks whether the clock is synchronised, and whether it has been set since `before`.
pub fn look(before: &Clocks) -> Finding {
    judge(is_synchronised(), before.step())
}

/// Judges the clock; `None` on systems that do not report synchronisation.
fn judge(is_synchronised: Option<bool>, step: Duration) -> Finding {
    let step_ms = step.as_secs_f64() * 1e3;
    if step > STEP_MAX {
        let found = format!("it was set by {step_ms:.0} ms while this looked");
        return Finding::change(
            "clock",
            found,
            "have one service set it, slowly (chrony, systemd-timesyncd)",
        );
    }
    match is_synchronised {
        Some(true) => Finding::fine("clock", "synchronised"),
        None => {
            Finding::fine("clock", "steady; this system does not tell whether it is synchronised")
        }
        Some(false) => Finding::change(
            "clock",
            "not synchronised: dates of replays, bans and certificates may be wrong",
            "timedatectl set-ntp true, or install chrony",
        ),
    }
}

/// Asks the system's own tool, which knows about every time service.
fn is_synchronised() -> Option<bool> {
    let asked = Command::new("timedatectl")
        .args(["show", "--property=NTPSynchronized", "--value"])
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output();
    said(&asked.ok()?.stdout)
}

fn said(answer: &[u8]) -> Option<bool> {
    match answer.trim_ascii() {
        b"yes" => Some(true),
        b"no" => Some(false),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_synchronised_and_not_set() {
        assert!(judge(Some(true), Duration::ZERO).is_fine());
        assert!(judge(None, STEP_MAX).is_fine());
        assert!(!judge(Some(false), Duration::ZERO).is_fine());
        let set = judge(Some(true), Duration::from_secs(2));
        assert!(!set.is_fine() && set.found.contains("2000 ms"), "{set}");
    }

    #[test]
    fn a_step_is_measured_in_both_directions() {
        for wall in [Duration::from_secs(3600), Duration::ZERO] {
            let shifted = SystemTime::now() - Duration::from_secs(1800) + wall;
            let step = Clocks { steady: Instant::now(), wall: shifted }.step();
            assert!(step.as_secs().abs_diff(1800) <= 60, "{step:?}");
        }
    }

    #[test]
    fn the_answer_of_the_tool_is_yes_or_no() {
        assert_eq!([said(b"yes\n"), said(b"no\n"), said(b"")], [Some(true), Some(false), None]);
    }
}
