//! Limits how fast each address may open connections. Each address has a token bucket of its own, which is
//! dropped once it is full again, so there are few of them and one address cannot use up the share of another.

use crate::limits::networks::network;
use crate::limits::token_bucket::TokenBucket;
use crate::limits::{CONNECTING_ADDRESSES_MAX, CONNECTS_PER_SECOND_MAX};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Instant;

/// Token buckets of the addresses that connected recently. Time is passed in.
pub struct ConnectRateLimiter {
    burst: u32,
    buckets: BTreeMap<IpAddr, TokenBucket>,
}

impl ConnectRateLimiter {
    /// Creates a limiter under which `burst` connections of one address may come at once.
    pub fn new(burst: usize) -> ConnectRateLimiter {
        let burst = u32::try_from(burst).unwrap_or(u32::MAX);
        ConnectRateLimiter { burst, buckets: BTreeMap::new() }
    }

    /// Returns whether a connection of this address is accepted now. Where more addresses connect than are
    /// tracked, all of the others are: then only the total of connections is limited, and no address is shut
    /// out because of others.
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
    fn a_burst_is_accepted_and_a_flood_slows_its_own_address_only() {
        let mut now = Instant::now();
        let mut limiter = ConnectRateLimiter::new(512);
        let household = |host| IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 1, 0, 0, 0, host));
        let neighbour = IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 2, 0, 0, 0, 1));
        assert_eq!((0..1000).filter(|&host| limiter.admit(household(host), now)).count(), 512);
        assert!(limiter.admit(neighbour, now));
        now += Duration::from_secs(2);
        let later = (0..1000).filter(|&host| limiter.admit(household(host), now)).count();
        assert_eq!(later, 2 * CONNECTS_PER_SECOND_MAX as usize);
    }

    #[test]
    fn idle_addresses_are_dropped_and_untracked_ones_are_accepted() {
        let now = Instant::now();
        let mut limiter = ConnectRateLimiter::new(1);
        let addresses = 0..CONNECTING_ADDRESSES_MAX as u32 + 9;
        assert!(addresses.clone().all(|ip| limiter.admit(Ipv4Addr::from(ip).into(), now)));
        assert_eq!(limiter.buckets.len(), CONNECTING_ADDRESSES_MAX);
        assert!(!limiter.admit(Ipv4Addr::from(0).into(), now), "the first is still tracked");
        let later = now + Duration::from_secs(1);
        assert!(limiter.admit(Ipv4Addr::from(addresses.end).into(), later));
        assert_eq!(limiter.buckets.len(), 1);
    }
}
