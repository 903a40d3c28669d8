//! Budgets for the bytes sent to each address, and for the bytes sent by all rooms with guests' scenes. A session that
//! exceeds a budget gets fewer snapshots per second; see `Delivery` in `host`. The time is passed in.
//!
//! When the guests' budget is used up, an address that takes no more than an equal share of it still gets everything.
//! The budget is divided equally among the widest networks, and then among the addresses of each, so many addresses on
//! one line count as one taker.

use crate::limits::networks::{LEVELS, networks};
use crate::limits::token_bucket::TokenBucket;
use crate::limits::{
    ADDRESS_UPLINK_SHARE, GUESTS_UPLINK_SHARE, TRACKED_ADDRESSES_MAX, UPLINK_BURST_SECONDS,
};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The share of a bucket that spectators leave for players.
const UPLINK_RESERVE: f64 = 0.5;
/// The fill level above which rates rise again.
const UPLINK_ROOMY: f64 = 0.75;

/// Bytes that a message takes in addition to its content: the IP, TCP and frame headers.
const ENVELOPE_BYTES: usize = 56;

#[derive(Debug)]
pub struct Uplink {
    /// Bytes per second for each address, and for all guests' rooms together.
    address_per_second: u32,
    guests_per_second: u32,
    addresses: Mutex<BTreeMap<IpAddr, Arc<Mutex<AddressBuckets>>>>,
    guests: Mutex<Guests>,
}

#[derive(Debug)]
struct AddressBuckets {
    all: TokenBucket,
    /// The address's share of the guests' budget.
    part: TokenBucket,
}

/// The budget for guests' rooms.
#[derive(Debug)]
struct Guests {
    all: TokenBucket,
    /// The rooms' sessions, counted by address within the address's widest network.
    sessions: BTreeMap<IpAddr, BTreeMap<IpAddr, u32>>,
}

/// A session's share of the budgets, given back when dropped.
#[derive(Debug)]
pub struct Allowance {
    uplink: Arc<Uplink>,
    networks: [IpAddr; LEVELS],
    address: Arc<Mutex<AddressBuckets>>,
    /// Whether the session is in a room with a guest's scene.
    guest: bool,
    /// The fraction of a bucket that the session leaves for others.
    reserve: f64,
}

fn bucket(per_second: u32, now: Instant) -> TokenBucket {
    TokenBucket::new(per_second, per_second.saturating_mul(UPLINK_BURST_SECONDS), now)
}

/// Ignores poisoning: no operation here panics halfway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Uplink {
    /// The budgets for a server that may send this many megabits per second.
    pub fn new(megabits: u32, now: Instant) -> Arc<Uplink> {
        let per_second = megabits.saturating_mul(1_000_000 / 8);
        let guests_per_second = per_second / GUESTS_UPLINK_SHARE;
        let all = bucket(guests_per_second, now);
        Arc::new(Uplink {
            address_per_second: per_second / ADDRESS_UPLINK_SHARE,
            guests_per_second,
            addresses: Mutex::default(),
            guests: Mutex::new(Guests { all, sessions: BTreeMap::new() }),
        })
    }

    /// Starts counting the bytes sent to a session from this address. `guest` says whether the room has a guest's
    /// scene, and `spectates` whether the session is a spectator.
    pub fn open(
        self: &Arc<Self>,
        ip: IpAddr,
        guest: bool,
        spectates: bool,
        now: Instant,
    ) -> Allowance {
        let networks = networks(ip);
        if guest {
            lock(&self.guests).add(networks);
        }
        let address = self.address(networks[0], now);
        let reserve = if spectates { UPLINK_RESERVE } else { 0.0 };
        Allowance { uplink: Arc::clone(self), networks, address, guest, reserve }
    }

    /// An address's buckets. When an address has no sessions left, its buckets are kept until they are full again, so
    /// that it cannot get a full bucket by reconnecting.
    fn address(&self, network: IpAddr, now: Instant) -> Arc<Mutex<AddressBuckets>> {
        let mut addresses = lock(&self.addresses);
        if addresses.len() >= TRACKED_ADDRESSES_MAX {
            addresses.retain(|_, address| {
                Arc::strong_count(address) > 1 || !lock(address).all.is_full(now)
            });
        }
        let new = || {
            let [all, part] = [self.address_per_second, self.guests_per_second];
            Arc::new(Mutex::new(AddressBuckets { all: bucket(all, now), part: bucket(part, now) }))
        };
        Arc::clone(addresses.entry(network).or_insert_with(new))
    }
}

impl Guests {
    fn add(&mut self, networks: [IpAddr; LEVELS]) {
        let of_widest = self.sessions.entry(networks[LEVELS - 1]).or_default();
        *of_widest.entry(networks[0]).or_default() += 1;
    }

    fn remove(&mut self, networks: [IpAddr; LEVELS]) {
        let Some(of_widest) = self.sessions.get_mut(&networks[LEVELS - 1]) else { return };
        match of_widest.get_mut(&networks[0]) {
            Some(sessions) if *sessions > 1 => *sessions -= 1,
            _ => drop(of_widest.remove(&networks[0])),
        }
        if of_widest.is_empty() {
            self.sessions.remove(&networks[LEVELS - 1]);
        }
    }

    /// Number of takers that share the budget, as seen from an address with these networks.
    fn takers(&self, networks: [IpAddr; LEVELS]) -> usize {
        let of_widest = self.sessions.get(&networks[LEVELS - 1]).map_or(1, BTreeMap::len);
        self.sessions.len() * of_widest
    }
}

impl Allowance {
    /// Counts a message of this size if it may be sent now. If a budget is used up, returns `false` without counting
    /// it. The last message may exceed a budget.
    pub fn take(&self, bytes: usize, now: Instant) -> bool {
        let allowed = self.has_some(now);
        if allowed {
            self.charge(bytes, now);
        }
        allowed
    }

    /// Returns whether a message may be sent now.
    pub fn has_some(&self, now: Instant) -> bool {
        self.holds(self.reserve, now)
    }

    /// Returns whether enough is left to send the session more per second.
    pub fn is_roomy(&self, now: Instant) -> bool {
        self.holds(UPLINK_ROOMY, now)
    }

    /// Counts a message that is sent regardless of the budgets.
    pub fn charge(&self, bytes: usize, now: Instant) {
        let bytes = bytes + ENVELOPE_BYTES;
        let mut address = lock(&self.address);
        address.all.charge(bytes, now);
        if self.guest {
            address.part.charge(bytes, now);
            lock(&self.uplink.guests).all.charge(bytes, now);
        }
    }

    /// Returns whether more than this fraction of each bucket is left.
    fn holds(&self, part: f64, now: Instant) -> bool {
        let mut address = lock(&self.address);
        if address.all.fill(now) <= part {
            return false;
        }
        if !self.guest {
            return true;
        }
        let takers = {
            let mut guests = lock(&self.uplink.guests);
            if guests.all.fill(now) > part {
                return true;
            }
            guests.takers(self.networks)
        };
        let per_second = self.uplink.guests_per_second / u32::try_from(takers.max(1)).unwrap_or(1);
        address.part.set_rate(per_second, per_second.saturating_mul(UPLINK_BURST_SECONDS), now);
        address.part.fill(now) > part
    }
}

impl Drop for Allowance {
    fn drop(&mut self) {
        if self.guest {
            lock(&self.uplink.guests).remove(self.networks);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// One megabyte per second for each address, and for all guests' rooms together.
    const MEGABITS: u32 = 8 * ADDRESS_UPLINK_SHARE;
    const SECONDS: usize = 20;

    /// Lets sessions send 1000-byte messages, each as many per tick as stated, and returns the kilobytes per second
    /// that each one sent.
    fn sent(sessions: &[(&Allowance, usize)], began: Instant) -> Vec<usize> {
        let mut sent = vec![0; sessions.len()];
        for tick in 0..60 * SECONDS {
            let now = began + Duration::from_secs(tick as u64) / 60;
            for index in 0..sessions.len() {
                let index = (index + tick) % sessions.len();
                let (session, messages) = sessions[index];
                let taken = (0..messages).filter(|_| session.take(1000 - ENVELOPE_BYTES, now));
                sent[index] += taken.count();
            }
        }
        sent.into_iter().map(|kilobytes| kilobytes / SECONDS).collect()
    }

    /// Checks that the rate is within a tenth of the expected one, allowing for the burst.
    fn is_about(kilobytes: usize, expected: usize) {
        let most = expected + expected * UPLINK_BURST_SECONDS as usize / SECONDS;
        let range = expected * 9 / 10..=most + expected / 10;
        assert!(range.contains(&kilobytes), "{kilobytes} kB/s instead of {expected}");
    }

    #[test]
    fn an_address_has_its_rate_and_no_other_notices() {
        let now = Instant::now();
        let uplink = Uplink::new(MEGABITS, now);
        let open = |ip: [u8; 4]| uplink.open(ip.into(), false, false, now);
        let (greedy, again, other) =
            (open([10, 0, 0, 1]), open([10, 0, 0, 1]), open([10, 0, 0, 2]));
        let sent = sent(&[(&greedy, 100), (&again, 100), (&other, 16)], now);
        is_about(sent[0] + sent[1], 1000);
        assert_eq!(sent[2], 16 * 60);
    }

    #[test]
    fn spectators_leave_a_reserve_to_players_of_their_address() {
        let now = Instant::now();
        let uplink = Uplink::new(MEGABITS, now);
        let open = |spectates| uplink.open([10, 0, 0, 1].into(), false, spectates, now);
        let (watching, playing) = (open(true), open(false));
        let sent = sent(&[(&watching, 100), (&playing, 10)], now);
        is_about(sent[0], 400);
        assert_eq!(sent[1], 600);
    }

    #[test]
    fn guests_rooms_share_a_rate_and_small_takers_get_all_they_take() {
        let now = Instant::now();
        let uplink = Uplink::new(MEGABITS, now);
        let open = |ip: [u8; 4]| uplink.open(ip.into(), true, false, now);
        let (greedy, greedy_too, small) =
            (open([10, 0, 0, 1]), open([10, 0, 0, 2]), open([10, 0, 0, 3]));
        let other = open([10, 9, 0, 1]);
        let host = uplink.open([10, 0, 0, 1].into(), false, false, now);
        let sent =
            sent(&[(&greedy, 9), (&greedy_too, 9), (&small, 1), (&other, 7), (&host, 4)], now);
        assert_eq!((sent[2], sent[3], sent[4]), (60, 7 * 60, 4 * 60));
        is_about(sent[0] + sent[1] + sent[2] + sent[3], 1000);
    }

    #[test]
    fn an_address_that_comes_back_finds_its_bucket_as_it_left_it() {
        let now = Instant::now();
        let uplink = Uplink::new(MEGABITS, now);
        let open = |now| uplink.open([10, 0, 0, 1].into(), true, false, now);
        while open(now).take(1000, now) {}
        assert!(!open(now).take(1000, now));
        assert!(lock(&uplink.guests).sessions.is_empty());
        let later = now + Duration::from_millis(2);
        assert!(open(later).take(1000, later));
        // Full buckets are dropped once there are many.
        for host in 0..TRACKED_ADDRESSES_MAX as u32 {
            let now = now + Duration::from_secs(60);
            drop(uplink.open(std::net::Ipv4Addr::from(host).into(), false, false, now));
        }
        assert!(lock(&uplink.addresses).len() <= TRACKED_ADDRESSES_MAX);
    }
}
