//! A bad network, simulated: delay, jitter and stalls of one direction. Messages stay in order, as
//! on a socket. The same seed gives the same network.

use jostle_sim::math::Rng;

/// Longest round trip that is simulated, milliseconds.
pub const TRIP_MS_MAX: f64 = 2000.0;
/// A stall begins on average so often, milliseconds.
const STALL_EVERY_MS: f64 = 4000.0;
/// How long a stall lasts, milliseconds.
const STALL_MS: std::ops::Range<f64> = 200.0..600.0;

/// What the network is made to be like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lag {
    /// Added to the round trip, milliseconds.
    pub trip_ms: f64,
    /// By how much that varies either way, milliseconds.
    pub jitter_ms: f64,
    /// Whether now and then nothing comes through for a while.
    pub stalls: bool,
}

/// A choice of the panel: its name, and what it does.
pub struct Preset {
    /// For people.
    pub name: &'static str,
    /// What it does.
    pub lag: Lag,
}

/// What can be chosen; the first is no lag at all.
pub const PRESETS: [Preset; 4] = [
    Preset { name: "Off", lag: Lag::OFF },
    Preset { name: "60 \u{b1} 10 ms", lag: Lag { trip_ms: 60.0, jitter_ms: 10.0, stalls: false } },
    Preset {
        name: "150 \u{b1} 30 ms",
        lag: Lag { trip_ms: 150.0, jitter_ms: 30.0, stalls: false },
    },
    Preset {
        name: "300 \u{b1} 100 ms, stalls",
        lag: Lag { trip_ms: 300.0, jitter_ms: 100.0, stalls: true },
    },
];

impl Lag {
    /// The network as it is.
    pub const OFF: Lag = Lag { trip_ms: 0.0, jitter_ms: 0.0, stalls: false };

    /// Reads `150`, `150,30` or `300,100,stalls`; `None` if it is none of these.
    pub fn parse(text: &str) -> Option<Lag> {
        let mut parts = text.split(',');
        let number = |part: Option<&str>| part.map_or(Some(0.0), |part| part.parse::<f64>().ok());
        let trip_ms = number(Some(parts.next()?))?;
        let jitter_ms = number(parts.next())?;
        let stalls = match parts.next() {
            None => false,
            Some("stalls") => true,
            Some(_) => return None,
        };
        let sound = (0.0..=TRIP_MS_MAX).contains(&trip_ms) && (0.0..=trip_ms).contains(&jitter_ms);
        (sound && parts.next().is_none()).then_some(Lag { trip_ms, jitter_ms, stalls })
    }

    /// What it does, for people.
    pub fn words(&self) -> String {
        let stalls = if self.stalls { ", stalls" } else { "" };
        format!("{:.0} \u{b1} {:.0} ms{stalls}", self.trip_ms, self.jitter_ms)
    }

    /// Whether it does anything.
    pub fn is_on(&self) -> bool {
        *self != Lag::OFF
    }
}

/// One direction of a link.
#[derive(Clone, Debug)]
pub struct Lane {
    rng: Rng,
    last_ms: f64,
    stall: std::ops::Range<f64>,
}

impl Lane {
    /// A lane whose chance is that of a seed.
    pub fn new(seed: u64) -> Lane {
        Lane { rng: Rng::new(seed, 0), last_ms: 0.0, stall: 0.0..0.0 }
    }

    /// When a message that is sent at `now_ms` arrives: half of the round trip later, and never
    /// before one that was sent earlier.
    pub fn arrival_ms(&mut self, lag: &Lag, now_ms: f64) -> f64 {
        let vary = f64::from(self.rng.range(-1.0, 1.0));
        let mut due = now_ms + 0.5 * (lag.trip_ms + lag.jitter_ms * vary);
        if lag.stalls {
            due = due.max(self.stalled_until(now_ms));
        }
        self.last_ms = due.max(self.last_ms);
        self.last_ms
    }

    /// The end of the stall that is on at `now_ms`, or that moment.
    fn stalled_until(&mut self, now_ms: f64) -> f64 {
        while self.stall.end <= now_ms {
            let pause = STALL_EVERY_MS * f64::from(self.rng.range(0.5, 1.5));
            let (short, long) = (STALL_MS.start as f32, STALL_MS.end as f32);
            // After an absence the next one is not one of long ago.
            let start = (self.stall.end + pause).max(now_ms - STALL_MS.end);
            self.stall = start..start + f64::from(self.rng.range(short, long));
        }
        if self.stall.start <= now_ms { self.stall.end } else { now_ms }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_name_a_network_or_are_refused() {
        let lag = |trip_ms, jitter_ms, stalls| Some(Lag { trip_ms, jitter_ms, stalls });
        assert_eq!(Lag::parse("150"), lag(150.0, 0.0, false));
        assert_eq!(Lag::parse("150,30"), lag(150.0, 30.0, false));
        assert_eq!(Lag::parse("300,100,stalls"), lag(300.0, 100.0, true));
        assert!(!Lag::parse("0").is_some_and(|lag| lag.is_on()));
        for bad in ["", "x", "-1", "1e9", "100,200", "NaN", "150,30,", "150,30,stalls,1"] {
            assert_eq!(Lag::parse(bad), None, "{bad}");
        }
    }

    #[test]
    fn messages_take_their_time_and_stay_in_order() {
        let lag = PRESETS[2].lag;
        let mut lane = Lane::new(1);
        let mut last = 0.0;
        for tick in 0..600 {
            let now = f64::from(tick) * 17.0;
            let due = lane.arrival_ms(&lag, now);
            assert!((60.0..=90.0).contains(&(due - now)) && due >= last, "{now} to {due}");
            last = due;
        }
    }

    #[test]
    fn stalls_hold_everything_back_for_a_while_and_then_end() {
        let lag = Lag { trip_ms: 10.0, jitter_ms: 0.0, stalls: true };
        let mut lane = Lane::new(7);
        let waits: Vec<f64> = (0..6000)
            .map(|i| f64::from(i) * 10.0)
            .map(|now| lane.arrival_ms(&lag, now) - now)
            .collect();
        let longest = waits.iter().copied().fold(0.0, f64::max);
        let held = waits.iter().filter(|wait| **wait > 50.0).count();
        assert!((200.0..=600.0).contains(&longest), "longest wait {longest} ms");
        assert!((150..=1500).contains(&held), "{held} of 6000 messages were held");
    }
}
