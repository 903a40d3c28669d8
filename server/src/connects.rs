//! How fast each address connects. An address has a bucket of its own, which is forgotten once it is
//! full again: so there are few, and a flood of one address costs no other anything.

use crate::limits::{CONNECTING_ADDRESSES_MAX, CONNECTS_PER_SECOND_MAX};
use crate::peers::network;
use crate::rate::TokenBucket;
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Instant;

/// The buckets of those who connected lately. Time is passed in.
pub struct Connects {
    burst: u32,
    buckets: BTreeMap<IpAddr, TokenBucket>,
}

impl Connects {
    /// Nobody came yet; `burst` connections of one address may come at once.
    pub fn new(burst: usize) -> Connects {
        let burst = u32::try_from(burst).unwrap_or(u32::MAX);
        Connects { burst, buckets: BTreeMap::new() }
    }

    /// Whether this one may come now. Where too many addresses connect to tell them apart, all may: then
    /// only the connections in all are limited, and nobody is shut out for others.
    pub fn admit(&mut self, ip: IpAddr, now: Instant) -> bool {
        if self.buckets.len() >= CONNECTING_ADDRESSES_MAX {
            self.buckets.retain(|_, bucket| !bucket.is_full(now));
        }
        let address = network(ip);
        if let Some(bucket) = self.buckets.get_mut(&address) {
            return bucket.take(now);
        }
        if self.buckets.len() < CONNECTING_ADDRESSES_MAX {
            let mut bucket = TokenBucket::new(CONNECTS_PER_SECOND_MAX, self.burst, now);
            bucket.take(now);
            self.buckets.insert(address, bucket);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::{Ipv4Addr, Ipv6Addr};
    use std::time::Duration;

    #[test]
    fn a_party_comes_at_once_and_a_flood_is_slowed_for_its_own_address() {
        let mut now = Instant::now();
        let mut connects = Connects::new(512);
        let household = |host| IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 1, 0, 0, 0, host));
        let neighbour = IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 2, 0, 0, 0, 1));
        assert_eq!((0..1000).filter(|&host| connects.admit(household(host), now)).count(), 512);
        assert!(connects.admit(neighbour, now));
        now += Duration::from_secs(2);
        let later = (0..1000).filter(|&host| connects.admit(household(host), now)).count();
        assert_eq!(later, 2 * CONNECTS_PER_SECOND_MAX as usize);
    }

    #[test]
    fn addresses_are_forgotten_and_more_than_can_be_told_apart_are_let_in() {
        let now = Instant::now();
        let mut connects = Connects::new(1);
        let addresses = 0..CONNECTING_ADDRESSES_MAX as u32 + 9;
        assert!(addresses.clone().all(|ip| connects.admit(Ipv4Addr::from(ip).into(), now)));
        assert_eq!(connects.buckets.len(), CONNECTING_ADDRESSES_MAX);
        assert!(!connects.admit(Ipv4Addr::from(0).into(), now), "the first is still known");
        let later = now + Duration::from_secs(1);
        assert!(connects.admit(Ipv4Addr::from(addresses.end).into(), later));
        assert_eq!(connects.buckets.len(), 1);
    }
}
