//! Reconnection timing: exponential backoff with jitter, so that clients do not all reach a restarted server at the
//! same instant.

/// Delay before the first attempt, milliseconds.
const FIRST_MS: f64 = 250.0;
/// Maximum delay, milliseconds.
pub const LONGEST_MS: f64 = 8000.0;
/// Maximum delay while another server has not been tried yet, milliseconds.
pub const UNTRIED_MS: f64 = 2000.0;

/// Counts attempts and determines when the next one is due.
#[derive(Debug, Default)]
pub struct Backoff {
    /// Number of attempts since the last good connection.
    pub attempts: u32,
    due_ms: Option<f64>,
}

impl Backoff {
    /// Records that the connection was lost, or that an attempt failed, at `now_ms`. `random` is uniform in [0, 1). The
    /// next attempt is due after at most `longest_ms`.
    pub fn lost(&mut self, now_ms: f64, random: f64, longest_ms: f64) {
        let ceiling = (FIRST_MS * 2f64.powi(self.attempts.min(16) as i32)).min(longest_ms);
        self.attempts += 1;
        self.due_ms = Some(now_ms + ceiling * (0.5 + 0.5 * random));
    }

    /// Whether an attempt is due; returns `true` once per attempt.
    pub fn due(&mut self, now_ms: f64) -> bool {
        self.due_ms.take_if(|due| now_ms >= *due).is_some()
    }

    /// Makes the next attempt due immediately, because the network is back.
    pub fn hurry(&mut self) {
        if let Some(due) = &mut self.due_ms {
            *due = 0.0;
        }
    }

    /// Resets the delays, because the connection is good again.
    pub fn reset(&mut self) {
        *self = Backoff::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_a_limit() {
        let mut backoff = Backoff::default();
        let mut waits = Vec::new();
        for _ in 0..8 {
            backoff.lost(0.0, 1.0, LONGEST_MS);
            waits.push(backoff.due_ms.expect("an attempt is due"));
        }
        assert_eq!(waits, [250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 8000.0, 8000.0]);
        backoff.lost(0.0, 1.0, UNTRIED_MS);
        assert_eq!(backoff.due_ms, Some(2000.0));
    }

    #[test]
    fn jitter_halves_at_most() {
        let mut backoff = Backoff::default();
        backoff.lost(1000.0, 0.0, LONGEST_MS);
        assert!(!backoff.due(1124.0));
        assert!(backoff.due(1125.0));
        assert!(!backoff.due(9999.0), "an attempt is due once");
    }

    #[test]
    fn a_network_that_is_back_is_used_at_once() {
        let mut backoff = Backoff::default();
        backoff.hurry();
        assert!(!backoff.due(1.0), "nothing was lost");
        backoff.lost(1000.0, 0.5, LONGEST_MS);
        backoff.hurry();
        assert!(backoff.due(1001.0));
    }
}
