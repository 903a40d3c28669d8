//! How many sockets each address holds. Permits give their place back when they are dropped.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Arc, Mutex, PoisonError};

/// Counts per address, and in all, up to two limits.
pub struct Peers {
    in_all_max: usize,
    address_max: usize,
    counts: Mutex<Counts>,
}

#[derive(Default)]
struct Counts {
    in_all: usize,
    by_address: BTreeMap<IpAddr, usize>,
}

/// A counted socket.
pub struct Permit {
    peers: Arc<Peers>,
    address: IpAddr,
}

impl Peers {
    /// No sockets yet.
    pub fn new(in_all_max: usize, address_max: usize) -> Arc<Peers> {
        Arc::new(Peers { in_all_max, address_max, counts: Mutex::default() })
    }

    /// Sockets of one address at a time.
    pub fn address_max(&self) -> usize {
        self.address_max
    }

    /// A place for one socket of `ip`, or `None` when a limit is reached.
    pub fn admit(self: &Arc<Self>, ip: IpAddr) -> Option<Permit> {
        self.admit_up_to(self.address_max, ip)
    }

    /// The same for an address that stands for many: only the limit of all counts.
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
        Some(Permit { peers: Arc::clone(self), address })
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let mut counts = self.peers.counts.lock().unwrap_or_else(PoisonError::into_inner);
        counts.in_all -= 1;
        match counts.by_address.get_mut(&self.address) {
            Some(held) if *held > 1 => *held -= 1,
            _ => drop(counts.by_address.remove(&self.address)),
        }
    }
}

/// Whom an address counts for: one IPv4 address, or one IPv6 /64, which is what a household gets.
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
    fn both_limits_hold_and_places_come_back() {
        let peers = Peers::new(3, 2);
        let first = peers.admit(ip("10.0.0.1"));
        let _second = peers.admit(ip("10.0.0.1"));
        assert!(peers.admit(ip("10.0.0.1")).is_none(), "two of one address");
        assert!(peers.admit_one_of_all(ip("10.0.0.1")).is_some(), "and then it is free again");
        let _third = peers.admit(ip("10.0.0.2"));
        assert!(peers.admit(ip("10.0.0.3")).is_none(), "three in all");
        drop(first);
        assert!(peers.admit(ip("10.0.0.1")).is_some());
        assert_eq!(peers.counts.lock().expect("a lock").by_address.len(), 2);
    }

    #[test]
    fn an_ipv6_household_is_one_address() {
        let peers = Peers::new(9, 1);
        let _first = peers.admit(ip("2001:db8:0:1::5"));
        assert!(peers.admit(ip("2001:db8:0:1:9::7")).is_none());
        assert!(peers.admit(ip("2001:db8:0:2::5")).is_some());
        let _mapped = peers.admit(ip("::ffff:10.0.0.1"));
        assert!(peers.admit(ip("10.0.0.1")).is_none());
    }
}
