//! Limits the rate at which each address may open connections or send requests. Each address has its own token bucket,
//! so one address cannot use up another's share. A bucket is dropped once it is full again, so there are only a few.

use crate::limits::TRACKED_ADDRESSES_MAX;
use crate::limits::networks::network;
use crate::limits::token_bucket::TokenBucket;
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Instant;

/// Token buckets of recently seen addresses. The time is passed in.
#[derive(Debug)]
pub struct AddressRateLimiter {
    per_second: f64,
    burst: u32,
    buckets: BTreeMap<IpAddr, TokenBucket>,
}

impl AddressRateLimiter {
    /// Creates a limiter that allows each address a burst of `burst` and a sustained rate of `per_second`.
    pub fn new(per_second: impl Into<f64>, burst: usize) -> AddressRateLimiter {
        let burst = u32::try_from(burst).unwrap_or(u32::MAX);
        AddressRateLimiter { per_second: per_second.into(), burst, buckets: BTreeMap::new() }
    }

    /// Returns whether this address is admitted now. Once the maximum number of addresses is being tracked, all other
    /// addresses are admitted. Only their total is limited then, so no address is shut out because of others.
    pub fn admit(&mut self, ip: IpAddr, now: Instant) -> bool {
        if self.buckets.len() >= TRACKED_ADDRESSES_MAX {
            self.buckets.retain(|_, bucket| !bucket.is_full(now));
        }
        let address = network(ip);
        if let Some(bucket) = self.buckets.get_mut(&address) {
            return bucket.take(now);
        }
        if self.buckets.len() < TRACKED_ADDRESSES_MAX {
            let mut bucket = TokenBucket::new(self.per_second, self.burst, now);
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
        let mut limiter = AddressRateLimiter::new(50, 512);
        let household = |host| IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 1, 0, 0, 0, host));
        let neighbour = IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 2, 0, 0, 0, 1));
        assert_eq!((0..1000).filter(|&host| limiter.admit(household(host), now)).count(), 512);
        assert!(limiter.admit(neighbour, now));
        now += Duration::from_secs(2);
        let later = (0..1000).filter(|&host| limiter.admit(household(host), now)).count();
        assert_eq!(later, 2 * 50);
    }

    #[test]
    fn idle_addresses_are_dropped_and_untracked_ones_are_accepted() {
        let now = Instant::now();
        let mut limiter = AddressRateLimiter::new(50, 1);
        let addresses = 0..TRACKED_ADDRESSES_MAX as u32 + 9;
        assert!(addresses.clone().all(|ip| limiter.admit(Ipv4Addr::from(ip).into(), now)));
        assert_eq!(limiter.buckets.len(), TRACKED_ADDRESSES_MAX);
        assert!(!limiter.admit(Ipv4Addr::from(0).into(), now), "the first is still tracked");
        let later = now + Duration::from_secs(1);
        assert!(limiter.admit(Ipv4Addr::from(addresses.end).into(), later));
        assert_eq!(limiter.buckets.len(), 1);
    }
}
