//! Everything a handler of an event may use besides its own state: the time, effects to request, the
//! address, what the browser keeps, chance, and numbers that are never used twice.

use crate::page::address::Site;
use crate::page::event::{Address, Effect};
use crate::page::storage::Storage;
use jostle_sim::Rng;

/// The context in which an event is handled.
pub struct Context {
    /// Time of the event, milliseconds since the page was opened.
    pub now_ms: f64,
    /// Effects requested so far.
    pub effects: Vec<Effect>,
    /// The own hero is shown ahead of the server.
    pub predicts: bool,
    pub site: Site,
    /// The clock itself, for work that is to end in time.
    pub clock: fn() -> f64,
    pub storage: Storage,
    rng: Rng,
    last_number: u32,
}

impl Context {
    /// A context at time zero.
    pub fn new(storage: Storage, site: Site, predicts: bool, seed: u64) -> Context {
        Context {
            now_ms: 0.0,
            effects: Vec::new(),
            predicts,
            site,
            clock: || 0.0,
            storage,
            rng: Rng::new(seed, 0),
            last_number: 0,
        }
    }

    pub fn request(&mut self, effect: Effect) {
        self.effects.push(effect);
    }

    /// All effects requested, and all values to be written.
    pub fn take_effects(&mut self) -> Vec<Effect> {
        self.effects.append(&mut self.storage.writes);
        std::mem::take(&mut self.effects)
    }

    /// Has the address name what is shown, unless it does already. Going back leads to where the player was.
    pub fn show_hash(&mut self, hash: String) {
        if self.site.address.hash != hash {
            let path = self.site.home().to_owned();
            self.request(Effect::PushAddress(format!("{path}{hash}")));
            self.site.address = Address { path, query: String::new(), hash };
        }
    }

    /// A number of its own, from 1 on.
    pub fn next_number(&mut self) -> u32 {
        self.last_number += 1;
        self.last_number
    }

    /// A random number in [0, 1).
    pub fn random(&mut self) -> f64 {
        f64::from(self.rng.range(0.0, 1.0))
    }

    pub fn random_bits(&mut self) -> u32 {
        self.rng.next_u32()
    }
}
