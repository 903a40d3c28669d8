//! Simulates delay, jitter and stalls in one direction of a bad network. Messages stay in order, as on a socket. The
//! same seed produces the same network.

use jostle_game::scene::parse_decimal;
use jostle_sim::Rng;

/// Maximum simulated round trip, milliseconds.
pub const TRIP_MS_MAX: f64 = 2000.0;
/// Mean time between stalls, milliseconds.
const STALL_EVERY_MS: f64 = 4000.0;
/// Duration of a stall, milliseconds.
const STALL_MS: std::ops::Range<f64> = 200.0..600.0;

/// The conditions of a simulated network.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NetworkConditions {
    /// Time added to the round trip, milliseconds.
    pub trip_ms: f64,
    /// Maximum variation of the added time in either direction, milliseconds.
    pub jitter_ms: f64,
    /// Whether the network occasionally delivers nothing for a while.
    pub stalls: bool,
}

impl NetworkConditions {
    pub const OFF: NetworkConditions =
        NetworkConditions { trip_ms: 0.0, jitter_ms: 0.0, stalls: false };

    /// Parses `150`, `150,30` or `300,100,stalls`; `None` if the text has a different format.
    pub fn parse(text: &str) -> Option<NetworkConditions> {
        let mut parts = text.split(',');
        let number = |part: Option<&str>| part.map_or(Some(0.0), parse_decimal);
        let trip_ms = number(Some(parts.next()?))?;
        let jitter_ms = number(parts.next())?;
        let stalls = match parts.next() {
            None => false,
            Some("stalls") => true,
            Some(_) => return None,
        };
        let sound = (0.0..=TRIP_MS_MAX).contains(&trip_ms) && (0.0..=trip_ms).contains(&jitter_ms);
        (sound && parts.next().is_none()).then_some(NetworkConditions {
            trip_ms,
            jitter_ms,
            stalls,
        })
    }

    /// A description of the conditions.
    pub fn words(&self) -> String {
        let stalls = if self.stalls { ", stalls" } else { "" };
        format!("{:.0} \u{b1} {:.0} ms{stalls}", self.trip_ms, self.jitter_ms)
    }

    /// The conditions in the format that [`NetworkConditions::parse`] reads.
    pub fn code(&self) -> String {
        let stalls = if self.stalls { ",stalls" } else { "" };
        format!("{},{}{stalls}", self.trip_ms, self.jitter_ms)
    }

    /// Whether the simulation has any effect.
    pub fn is_on(&self) -> bool {
        *self != NetworkConditions::OFF
    }
}

/// One direction of a link.
#[derive(Clone, Debug)]
pub struct SimulatedLink {
    rng: Rng,
    last_ms: f64,
    stall: std::ops::Range<f64>,
}

impl SimulatedLink {
    /// Creates a link with this random seed.
    pub fn new(seed: u64) -> SimulatedLink {
        SimulatedLink { rng: Rng::new(seed, 0), last_ms: 0.0, stall: 0.0..0.0 }
    }

    /// The arrival time of a message sent at `now_ms`: half a round trip later, and never before an earlier message.
    pub fn arrival_ms(&mut self, conditions: &NetworkConditions, now_ms: f64) -> f64 {
        let vary = f64::from(self.rng.range(-1.0, 1.0));
        let mut due = now_ms + 0.5 * (conditions.trip_ms + conditions.jitter_ms * vary);
        if conditions.stalls {
            due = due.max(self.stalled_until(now_ms));
        }
        self.last_ms = due.max(self.last_ms);
        self.last_ms
    }

    /// The end of the stall in progress at `now_ms`, or `now_ms` if there is no stall.
    fn stalled_until(&mut self, now_ms: f64) -> f64 {
        while self.stall.end <= now_ms {
            let pause = STALL_EVERY_MS * f64::from(self.rng.range(0.5, 1.5));
            let (short, long) = (STALL_MS.start as f32, STALL_MS.end as f32);
            // After a pause in the traffic, skip stalls that are already over.
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
    fn the_choices_of_the_panel_are_conditions_by_their_codes() {
        let page = include_str!("../../web/index.html");
        let choices: Vec<_> = page.split("name=\"lag\" value=\"").skip(1).collect();
        assert_eq!(choices.len(), 4);
        for choice in choices {
            let code = choice.split('"').next().expect("a value");
            let conditions = NetworkConditions::parse(code).expect("good conditions");
            assert_eq!(conditions.code(), code);
            assert!(!conditions.is_on() || choice.contains(&format!("{}<", conditions.words())));
        }
    }

    #[test]
    fn addresses_name_a_network_or_are_refused() {
        let conditions =
            |trip_ms, jitter_ms, stalls| Some(NetworkConditions { trip_ms, jitter_ms, stalls });
        assert_eq!(NetworkConditions::parse("150"), conditions(150.0, 0.0, false));
        assert_eq!(NetworkConditions::parse("150,30"), conditions(150.0, 30.0, false));
        assert_eq!(NetworkConditions::parse("300,100,stalls"), conditions(300.0, 100.0, true));
        assert!(!NetworkConditions::parse("0").is_some_and(|conditions| conditions.is_on()));
        for bad in ["", "x", "-1", "1e9", "100,200", "NaN", "150,30,", "150,30,stalls,1"] {
            assert_eq!(NetworkConditions::parse(bad), None, "{bad}");
        }
    }

    #[test]
    fn messages_take_their_time_and_stay_in_order() {
        let conditions = NetworkConditions::parse("150,30").expect("good conditions");
        let mut link = SimulatedLink::new(1);
        let mut last = 0.0;
        for tick in 0..600 {
            let now = f64::from(tick) * 17.0;
            let due = link.arrival_ms(&conditions, now);
            assert!((60.0..=90.0).contains(&(due - now)) && due >= last, "{now} to {due}");
            last = due;
        }
    }

    #[test]
    fn stalls_hold_everything_back_for_a_while_and_then_end() {
        let conditions = NetworkConditions { trip_ms: 10.0, jitter_ms: 0.0, stalls: true };
        let mut link = SimulatedLink::new(7);
        let waits: Vec<f64> = (0..6000)
            .map(|i| f64::from(i) * 10.0)
            .map(|now| link.arrival_ms(&conditions, now) - now)
            .collect();
        let longest = waits.iter().copied().fold(0.0, f64::max);
        let held = waits.iter().filter(|wait| **wait > 50.0).count();
        assert!((200.0..=600.0).contains(&longest), "longest wait {longest} ms");
        assert!((150..=1500).contains(&held), "{held} of 6000 messages were held");
    }
}
