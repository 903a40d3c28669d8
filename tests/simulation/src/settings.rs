//! Settings for a simulation: the fleet and its faults.

use jostle_server::fleet::directory::LEASE_TTL;
use std::fmt;
use std::time::Duration;

#[derive(Clone, Debug)]
pub struct Settings {
    /// Seed of the random numbers; it determines the whole course of events.
    pub seed: u64,
    /// Number of nodes in the fleet.
    pub nodes: usize,
    /// Number of nodes that neither drain nor stay dead.
    pub lasting: usize,
    /// Number of rooms opened in the first half of the period with faults.
    pub rooms: usize,
    /// Number of these rooms that end.
    pub ending: usize,
    /// Maximum number of rooms per node.
    pub rooms_max: usize,
    /// Duration of the period with faults, which begins at the start.
    pub faulty_for: Duration,
    /// How often faults occur.
    pub faults: Faults,
    /// Deliberate violations of the directory's assumptions.
    pub flaws: Flaws,
}

/// How often each fault occurs.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// Number of lost messages per thousand.
    pub lost: u32,
    /// How often per minute a node is cut off from the store, for up to 30 s.
    pub cuts: f32,
    /// How often per minute the store stops answering, for 4 to 7 s.
    pub outages: f32,
    /// How often per minute the store fails and loses its most recent writes or all of its data.
    pub forgets: f32,
    /// How often per minute a whole node freezes, for up to 30 s.
    pub freezes: f32,
    /// How often per minute a node's directory freezes for up to 30 s while its rooms keep running.
    pub stalls: f32,
    /// How often per minute a node dies.
    pub deaths: f32,
    /// How often per minute a node starts to drain.
    pub drains: f32,
    /// Maximum relative error of the clocks' rates.
    pub skew: f32,
    /// Number of failed attempts to open a room, per thousand.
    pub opening_fails: u32,
}

impl Faults {
    /// Returns all faults, at their usual rates.
    pub fn all() -> Faults {
        Faults {
            lost: 10,
            cuts: 2.0,
            outages: 0.5,
            forgets: 0.5,
            freezes: 1.0,
            stalls: 1.0,
            deaths: 1.0,
            drains: 0.7,
            skew: 0.01,
            opening_fails: 50,
        }
    }
}

/// Violations of the directory's assumptions. There are none by default; tests show that each of them leads to violated
/// properties.
#[derive(Clone, Debug)]
pub struct Flaws {
    /// Time after which a node's entry expires unless it is renewed.
    pub lease_ttl: Duration,
    /// Whether rooms are played without a lease.
    pub ignores_lease: bool,
    /// Whether the store ignores the revision that a write expects.
    pub ignores_revisions: bool,
}

impl Default for Flaws {
    fn default() -> Flaws {
        Flaws { lease_ttl: LEASE_TTL, ignores_lease: false, ignores_revisions: false }
    }
}

impl Settings {
    /// Returns settings for a small fleet with all faults, whose size depends on the seed.
    pub fn small(seed: u64) -> Settings {
        let nodes = 3 + (seed % 6) as usize;
        let rooms = 20 + (seed * 7 % 41) as usize;
        let lasting = nodes.div_ceil(2);
        Settings {
            seed,
            nodes,
            lasting,
            rooms,
            ending: rooms / 5,
            rooms_max: rooms.div_ceil(lasting) + 3,
            faulty_for: Duration::from_secs(180),
            faults: Faults::all(),
            flaws: Flaws::default(),
        }
    }
}

/// A violated property.
#[derive(Clone, Debug)]
pub struct Violation {
    /// The seed that reproduces the violation.
    pub seed: u64,
    pub at: Duration,
    /// What happened, and to which room or node.
    pub what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "seed {}, after {:.3} s: {}", self.seed, self.at.as_secs_f64(), self.what)
    }
}

impl std::error::Error for Violation {}
