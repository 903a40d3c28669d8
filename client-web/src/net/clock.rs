//! Clock synchronisation, which estimates the server's tick from the arrival of snapshots and paces the displayed tick,
//! which trails the server's by the interpolation delay. The current time is passed in as an argument.

use std::collections::VecDeque;

/// Duration of a tick, milliseconds.
pub const TICK_MS: f64 = 1000.0 / jostle_sim::TICKS_PER_SECOND as f64;
/// The delay on a perfect connection, ticks: the interval between two snapshots.
pub const DELAY_TICKS_MIN: f64 = 1.0;
/// Maximum delay, ticks. On worse connections stalls become visible.
pub const DELAY_TICKS_MAX: f64 = 30.0;
/// Maximum number of ticks by which the display runs past the newest known tick.
pub const AHEAD_TICKS_MAX: f64 = 2.0;
/// Arrivals older than this no longer reflect the state of the connection.
const WINDOW_MS: f64 = 1000.0;
/// A late snapshot lengthens the delay immediately. Without further late ones, the excess falls to about a third (1/e)
/// in this time, milliseconds.
const JITTER_DECAY_MS: f64 = 4000.0;
/// If the display is off by more than this, it jumps instead of catching up.
const JUMP_TICKS: f64 = 30.0;
/// Maximum deviation of the display's speed from real time.
const RATE_DEVIATION_MAX: f64 = 0.15;

/// Estimates the server's tick and paces the display.
#[derive(Debug, Default)]
pub struct Clock {
    arrivals: VecDeque<Transit>,
    /// Greatest lateness of any recent snapshot, ticks: the jitter.
    pub lateness_ticks: f64,
    measured_ms: f64,
    /// The newest known tick.
    known: Option<u32>,
    display: Option<f64>,
    updated_ms: f64,
}

/// The timing of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// The tick of the snapshot.
    pub tick: u32,
    /// The first tick about which the message brings new information.
    pub first: u32,
    /// Ticks until the next message is due: at least 1, and more while nothing moves.
    pub ticks_until_next: u32,
}

#[derive(Clone, Copy, Debug)]
struct Transit {
    at_ms: f64,
    /// The local time at which tick 0 would have arrived with the same transit time.
    origin_ms: f64,
}

impl Clock {
    /// Records a message that arrived at `now_ms`.
    pub fn arrived(&mut self, arrival: Arrival, now_ms: f64) {
        if self.arrivals.back().is_some_and(|last| last.at_ms > now_ms) {
            // The clock was set back, so earlier measurements are invalid.
            self.arrivals.clear();
            self.measured_ms = now_ms;
        }
        let origin_ms = now_ms - f64::from(arrival.tick) * TICK_MS;
        self.arrivals.push_back(Transit { at_ms: now_ms, origin_ms });
        while self.arrivals.front().is_some_and(|a| a.at_ms < now_ms - WINDOW_MS) {
            self.arrivals.pop_front();
        }
        self.measure_lateness(arrival.first, now_ms);
        self.known = Some(arrival.tick + arrival.ticks_until_next - 1);
    }

    /// Starts measuring transit times anew, because snapshots now take another route. The display waits at its current
    /// position for the first one.
    pub fn restart(&mut self, now_ms: f64) {
        self.arrivals.clear();
        self.updated_ms = now_ms;
    }

    /// Updates the peak lateness of recent snapshots (jitter), which decays exponentially. The lateness of a snapshot
    /// that skips ticks is measured from the first skipped tick, since nothing after the previous snapshot was known
    /// until it arrived.
    fn measure_lateness(&mut self, first: u32, now_ms: f64) {
        let Some(due_ms) = self.origin_ms().map(|origin| origin + f64::from(first) * TICK_MS)
        else {
            return;
        };
        let late = ((now_ms - due_ms) / TICK_MS).clamp(0.0, DELAY_TICKS_MAX);
        let left = (-(now_ms - self.measured_ms).max(0.0) / JITTER_DECAY_MS).exp();
        self.measured_ms = now_ms;
        self.lateness_ticks = late.max(late + (self.lateness_ticks - late) * left);
    }

    /// The local time of tick 0 on the fastest path seen in the window.
    fn origin_ms(&self) -> Option<f64> {
        self.arrivals.iter().map(|a| a.origin_ms).reduce(f64::min)
    }

    /// The newest tick that the server can have sent so far.
    pub fn server_tick(&self, now_ms: f64) -> Option<f64> {
        self.origin_ms().map(|origin| (now_ms - origin) / TICK_MS)
    }

    /// Ticks by which the display trails the server.
    pub fn delay_ticks(&self) -> f64 {
        (self.lateness_ticks + DELAY_TICKS_MIN).clamp(DELAY_TICKS_MIN, DELAY_TICKS_MAX)
    }

    /// The fractional tick to show at `now_ms`; it never runs backwards except in a jump, and is `None` before the
    /// first snapshot.
    pub fn display(&mut self, now_ms: f64) -> Option<f64> {
        let wanted = self.server_tick(now_ms)? - self.delay_ticks();
        let limit = f64::from(self.known?) + AHEAD_TICKS_MAX;
        let elapsed = ((now_ms - self.updated_ms) / TICK_MS).max(0.0);
        self.updated_ms = now_ms;
        let next = match self.display {
            Some(shown) if (wanted - shown).abs() < JUMP_TICKS + elapsed => {
                shown + paced(elapsed, wanted - shown)
            }
            _ => wanted,
        };
        let next = next.min(limit).max(0.0);
        self.display = Some(next);
        Some(next)
    }
}

/// The step that takes the displayed time towards a target `error` ticks ahead without a visible change of speed.
pub(crate) fn paced(elapsed: f64, error: f64) -> f64 {
    let correction = (error - elapsed) * 0.1;
    let limit = elapsed * RATE_DEVIATION_MAX;
    elapsed + correction.clamp(-limit, limit)
}

#[cfg(test)]
mod tests;
