//! Everything an event handler may use besides its own state: the time, requests for effects, the address, the
//! browser's storage, random numbers, and unique numbers.

use crate::page::address::Site;
use crate::page::event::{Address, Effect};
use crate::page::storage::Storage;
use jostle_sim::Rng;

/// The context in which an event is handled.
pub struct Context {
    /// Time of the event, milliseconds since the page opened.
    pub now_ms: f64,
    /// Effects requested so far.
    pub effects: Vec<Effect>,
    /// Whether prediction shows the player's hero ahead of the server.
    pub predicts: bool,
    pub site: Site,
    /// The clock, for work with a time limit.
    pub clock: fn() -> f64,
    /// The time of day, seconds since 1970.
    pub unix_s: fn() -> f64,
    pub storage: Storage,
    /// Host key of the room that the player closed last, if none was opened since.
    pub closed: Option<String>,
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
            unix_s: || 0.0,
            storage,
            closed: None,
            rng: Rng::new(seed, 0),
            last_number: 0,
        }
    }

    pub fn request(&mut self, effect: Effect) {
        self.effects.push(effect);
    }

    /// The current day, counted from 1970 (UTC).
    pub fn day(&self) -> u32 {
        ((self.unix_s)() / 86_400.0) as u32
    }

    /// Takes all requested effects and pending storage writes.
    pub fn take_effects(&mut self) -> Vec<Effect> {
        self.effects.append(&mut self.storage.writes);
        std::mem::take(&mut self.effects)
    }

    /// Updates the address to match the current content, if necessary. The back button then returns to the previous
    /// screen.
    pub fn show_hash(&mut self, hash: String) {
        if self.site.address.hash != hash {
            let path = self.site.home().to_owned();
            self.request(Effect::PushAddress(format!("{path}{hash}")));
            self.site.address = Address { path, query: String::new(), hash };
        }
    }

    /// A unique number, starting from 1.
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
