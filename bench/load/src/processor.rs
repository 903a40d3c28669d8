//! Processor time used by this program. It shows whether a measurement is meaningful for the server.

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use std::fs;

/// If runnable threads had to wait for a processor during more than this share of the time, this program is short of
/// processors, and delays seen by bots are as much its own as the server's.
const WAITED_SHARE_MAX: f64 = 0.1;

/// Processor time used by a process, in seconds.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Used {
    pub spent: f64,
    /// Time during which its threads were runnable but had no processor; 0 if the system does not report it.
    pub waited: f64,
}

impl Used {
    /// The time used by this process so far, excluding threads that have ended.
    pub fn so_far() -> Used {
        let spent = clock_gettime(ClockId::ProcessCPUTime);
        let threads = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
        let waited = threads.filter_map(|thread| {
            let counts = fs::read_to_string(thread.path().join("schedstat")).ok()?;
            counts.split_ascii_whitespace().nth(1)?.parse::<f64>().ok()
        });
        Used {
            spent: spent.tv_sec as f64 + spent.tv_nsec as f64 * 1e-9,
            waited: waited.sum::<f64>() * 1e-9,
        }
    }

    /// Returns the time used since an earlier reading.
    pub fn since(self, before: Used) -> Used {
        Used { spent: self.spent - before.spent, waited: (self.waited - before.waited).max(0.0) }
    }

    /// The total time of two processes.
    pub fn plus(self, other: Used) -> Used {
        Used { spent: self.spent + other.spent, waited: self.waited + other.waited }
    }

    /// Whether the process waited for processors so long that its figures say nothing about a server.
    pub fn is_short(self) -> bool {
        self.waited > WAITED_SHARE_MAX * (self.spent + self.waited)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_waits_for_a_tenth_of_its_time_is_short() {
        assert!(!Used { spent: 9.5, waited: 0.5 }.is_short());
        assert!(Used { spent: 8.0, waited: 2.0 }.is_short());
        assert!(!Used::default().is_short());
        let before = Used::so_far();
        assert!(Used::so_far().since(before).spent >= 0.0);
    }
}
