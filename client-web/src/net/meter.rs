//! Measurements of the connection and of drawing over the last second.

use std::collections::VecDeque;

/// The time over which rates are measured, milliseconds.
const WINDOW_MS: f64 = 1000.0;
/// Weight of a new round trip in the displayed average.
const PING_SHARE: f64 = 0.3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Traffic {
    Snapshot,
    /// A snapshot without a baseline.
    Keyframe,
    /// Any other message from the server.
    Answer,
    /// An input sent to the server.
    Input,
    /// Any other message from the page.
    Question,
}

impl Traffic {
    /// All kinds, incoming ones first.
    pub const ALL: [Traffic; 5] =
        [Traffic::Snapshot, Traffic::Keyframe, Traffic::Answer, Traffic::Input, Traffic::Question];

    /// Whether it is the server that sends this kind.
    pub fn comes_in(self) -> bool {
        !matches!(self, Traffic::Input | Traffic::Question)
    }
}

/// Counts messages and frames.
#[derive(Debug, Default)]
pub struct Meter {
    carried: VecDeque<(f64, Traffic, usize)>,
    frames: VecDeque<f64>,
    /// Smoothed round trip, milliseconds.
    pub ping_ms: Option<f64>,
    /// Sections received so far, and in how many snapshots each occurred.
    pub sections: Vec<(&'static str, u64)>,
    /// Number of events that started emitters.
    pub emitters: u64,
}

impl Meter {
    /// Counts a message that was sent or received.
    pub fn carried(&mut self, now_ms: f64, traffic: Traffic, bytes: usize) {
        self.carried.push_back((now_ms, traffic, bytes));
        while self.carried.front().is_some_and(|(at, ..)| *at < now_ms - WINDOW_MS) {
            self.carried.pop_front();
        }
    }

    /// Counts a snapshot's sections, and those of its events that started an emitter.
    pub fn snapshot(&mut self, sections: &[&'static str], emitters: usize) {
        for &section in sections {
            match self.sections.iter_mut().find(|(name, _)| *name == section) {
                Some((_, snapshots)) => *snapshots += 1,
                None => self.sections.push((section, 1)),
            }
        }
        self.emitters += emitters as u64;
    }

    pub fn drawn(&mut self, now_ms: f64) {
        self.frames.push_back(now_ms);
        while self.frames.front().is_some_and(|at| *at < now_ms - WINDOW_MS) {
            self.frames.pop_front();
        }
    }

    /// Records the answer to a ping sent at `sent_ms`.
    pub fn ponged(&mut self, sent_ms: f64, now_ms: f64) {
        let trip = (now_ms - sent_ms).max(0.0);
        self.ping_ms = Some(self.ping_ms.map_or(trip, |old| old + (trip - old) * PING_SHARE));
    }

    /// Number of bytes received in the last second.
    pub fn bytes_a_second(&self, now_ms: f64) -> usize {
        let incoming = Traffic::ALL.into_iter().filter(|traffic| traffic.comes_in());
        incoming.map(|traffic| self.rate(traffic, now_ms).1).sum()
    }

    /// The number of messages of this kind in the last second, and their total size in bytes.
    pub fn rate(&self, traffic: Traffic, now_ms: f64) -> (usize, usize) {
        let recent = self.carried.iter().filter(|(at, ..)| *at >= now_ms - WINDOW_MS);
        let alike = recent.filter(|(_, kind, _)| *kind == traffic);
        alike.fold((0, 0), |(count, sum), (.., bytes)| (count + 1, sum + bytes))
    }

    /// Number of frames drawn in the last second.
    pub fn frames_a_second(&self, now_ms: f64) -> usize {
        self.frames.iter().filter(|at| **at >= now_ms - WINDOW_MS).count()
    }

    /// Signal bars, 0..=4, for a connection whose most recent message arrived `silence_ms` ago.
    pub fn bars(&self, silence_ms: f64) -> u8 {
        match self.ping_ms {
            _ if silence_ms > 1500.0 => 0,
            None => 4,
            Some(ping) if ping < 70.0 => 4,
            Some(ping) if ping < 130.0 => 3,
            Some(ping) if ping < 250.0 => 2,
            Some(_) => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_cover_the_last_second() {
        let mut meter = Meter::default();
        for ms in 0..3000 {
            meter.carried(f64::from(ms), Traffic::Snapshot, 10);
            meter.carried(f64::from(ms), Traffic::Input, 5);
            if ms % 20 == 0 {
                meter.drawn(f64::from(ms));
            }
        }
        assert_eq!(meter.bytes_a_second(2999.0), 10_010);
        assert_eq!(meter.rate(Traffic::Input, 2999.0), (1001, 5005));
        assert_eq!(meter.frames_a_second(2999.0), 50);
        assert_eq!(meter.bytes_a_second(9000.0), 0);
    }

    #[test]
    fn bars_fall_with_ping_and_silence() {
        let mut meter = Meter::default();
        meter.ponged(0.0, 20.0);
        assert_eq!(meter.bars(10.0), 4);
        assert_eq!(meter.bars(5000.0), 0);
        for _ in 0..40 {
            meter.ponged(0.0, 400.0);
        }
        assert_eq!(meter.bars(10.0), 1);
    }
}
