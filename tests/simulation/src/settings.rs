//! What is simulated, and how much goes wrong.

use jostle_server::fleet::directory::LEASE_TTL;
use std::fmt;
use std::time::Duration;

#[derive(Clone, Debug)]
pub struct Settings {
    /// Start of the random numbers; one seed gives one course of events.
    pub seed: u64,
    /// Nodes of the fleet.
    pub nodes: usize,
    /// Of these, those that neither drain nor stay dead.
    pub lasting: usize,
    /// Rooms that are opened in the first half of the time of faults.
    pub rooms: usize,
    /// Of these, those that end.
    pub ending: usize,
    /// Rooms that one node may open.
    pub rooms_max: usize,
    /// Time of faults, from the start.
    pub faulty_for: Duration,
    /// How much goes wrong.
    pub faults: Faults,
    /// How the system differs from what the directory needs.
    pub flaws: Flaws,
}

/// How much goes wrong.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// Messages of a thousand that are lost.
    pub lost: u32,
    /// Times a minute that a node is cut off from the store, for up to 30 s.
    pub cuts: f32,
    /// Times a minute that the store does not answer, for 4 to 7 s.
    pub outages: f32,
    /// Times a minute that the store fails, and is back with its last writes or all of them forgotten.
    pub forgets: f32,
    /// Times a minute that a whole node stands still, for up to 30 s.
    pub freezes: f32,
    /// Times a minute that a node's directory stands still for up to 30 s, while its rooms go on.
    pub stalls: f32,
    /// Times a minute that a node dies.
    pub deaths: f32,
    /// Times a minute that a node begins to drain.
    pub drains: f32,
    /// Share by which clocks may run fast or slow.
    pub skew: f32,
    /// Attempts of a thousand to open a room that fail.
    pub opening_fails: u32,
}

impl Faults {
    /// Everything that may go wrong.
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

/// How the system differs from what the directory needs. With the default there is nothing; tests show that the
/// properties are violated by anything else.
#[derive(Clone, Debug)]
pub struct Flaws {
    /// Time after which an entry of a node that was not renewed is gone.
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
    /// A small fleet with all faults, of a size that depends on the seed.
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

/// A property that does not hold.
#[derive(Clone, Debug)]
pub struct Violation {
    /// The seed with which it happens again.
    pub seed: u64,
    pub at: Duration,
    /// The room or node, and what it does.
    pub what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "seed {}, after {:.3} s: {}", self.seed, self.at.as_secs_f64(), self.what)
    }
}

impl std::error::Error for Violation {}
