//! Limits on the sockets of each address, and of all. A permit frees its socket when it is dropped.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, PoisonError};

/// Counts of sockets per address and in total, up to two limits.
pub struct ConnectionLimits {
    in_all_max: usize,
    address_max: usize,
    counts: Mutex<Counts>,
}

#[derive(Default)]
struct Counts {
    in_all: usize,
    by_address: BTreeMap<IpAddr, usize>,
}

/// A counted socket, until it is dropped.
pub struct Permit {
    limits: Arc<ConnectionLimits>,
    address: IpAddr,
}

impl ConnectionLimits {
    /// Creates limits with no sockets counted.
    pub fn new(in_all_max: usize, address_max: usize) -> Arc<ConnectionLimits> {
        Arc::new(ConnectionLimits { in_all_max, address_max, counts: Mutex::default() })
    }

    /// Sockets of one address at a time.
    pub fn address_max(&self) -> usize {
        self.address_max
    }

    /// Counts one socket of `ip`; `None` when a limit is reached.
    pub fn admit(self: &Arc<Self>, ip: IpAddr) -> Option<Permit> {
        self.admit_up_to(self.address_max, ip)
    }

    /// The same for the address of a proxy: only the total limit counts.
    pub fn admit_one_of_all(self: &Arc<Self>, ip: IpAddr) -> Option<Permit> {
        self.admit_up_to(self.in_all_max, ip)
    }

    fn admit_up_to(self: &Arc<Self>, address_max: usize, ip: IpAddr) -> Option<Permit> {
        let address = network(ip);
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        let held = counts.by_address.get(&address).copied().unwrap_or(0);
        if counts.in_all >= self.in_all_max || held >= address_max {
            return None;
        }
        counts.in_all += 1;
        counts.by_address.insert(address, held + 1);
        Some(Permit { limits: Arc::clone(self), address })
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let mut counts = self.limits.counts.lock().unwrap_or_else(PoisonError::into_inner);
        counts.in_all -= 1;
        match counts.by_address.get_mut(&self.address) {
            Some(held) if *held > 1 => *held -= 1,
            _ => drop(counts.by_address.remove(&self.address)),
        }
    }
}

/// The network that an address counts for: one IPv4 address, or one IPv6 /64, the prefix of a household.
pub fn network(ip: IpAddr) -> IpAddr {
    match ip.to_canonical() {
        IpAddr::V4(ip) => IpAddr::V4(ip),
        IpAddr::V6(ip) => {
            let [a, b, c, d, ..] = ip.segments();
            IpAddr::V6(Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ip(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    #[test]
    fn both_limits_hold_and_dropped_permits_are_free_again() {
        let limits = ConnectionLimits::new(3, 2);
        let first = limits.admit(ip("10.0.0.1"));
        let _second = limits.admit(ip("10.0.0.1"));
        assert!(limits.admit(ip("10.0.0.1")).is_none(), "two of one address");
        assert!(limits.admit_one_of_all(ip("10.0.0.1")).is_some(), "and then it is free again");
        let _third = limits.admit(ip("10.0.0.2"));
        assert!(limits.admit(ip("10.0.0.3")).is_none(), "three in all");
        drop(first);
        assert!(limits.admit(ip("10.0.0.1")).is_some());
        assert_eq!(limits.counts.lock().expect("a lock").by_address.len(), 2);
    }

    #[test]
    fn an_ipv6_household_is_one_address() {
        let limits = ConnectionLimits::new(9, 1);
        let _first = limits.admit(ip("2001:db8:0:1::5"));
        assert!(limits.admit(ip("2001:db8:0:1:9::7")).is_none());
        assert!(limits.admit(ip("2001:db8:0:2::5")).is_some());
        let _mapped = limits.admit(ip("::ffff:10.0.0.1"));
        assert!(limits.admit(ip("10.0.0.1")).is_none());
    }
}
