//! Limits on each network's sockets and on their total. Dropping a permit frees its socket.
//!
//! The last eighth of all sockets is reserved for networks that hold few, so that no visitor is shut out by networks
//! that hold many. If that is not enough, idle connections are closed.

use crate::limits::RESERVE_SHARE;
use crate::limits::networks::{LEVELS, networks, shares};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// A network with at most this many sockets may use the reserve. One browser opens this many connections.
const FEW: usize = 8;
/// The `grace` that a server uses.
const IDLE_GRACE: Duration = Duration::from_secs(3);

/// Numbers of sockets per network and in total, and their limits.
#[derive(Debug)]
pub struct ConnectionLimits {
    in_all_max: usize,
    address_max: usize,
    /// How long a connection must be idle before it can be closed, since its last response may still be on its way.
    grace: Duration,
    counts: Mutex<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    in_all: usize,
    by_network: [BTreeMap<IpAddr, usize>; LEVELS],
    /// Connections that may be closed, longest-idle first.
    idle: BTreeMap<u64, Idle>,
    /// The most recently idle connection's number.
    number: u64,
}

#[derive(Debug)]
struct Idle {
    since: Instant,
    networks: [IpAddr; LEVELS],
    gives_way: Arc<Notify>,
}

/// A counted socket. Dropping the permit frees it.
#[derive(Debug)]
pub struct Permit {
    limits: Arc<ConnectionLimits>,
    networks: [IpAddr; LEVELS],
    gives_way: Arc<Notify>,
    state: Mutex<PermitState>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PermitState {
    Busy,
    /// The connection is idle and has this number.
    Idle(u64),
    /// The connection is never closed to make room for a newcomer.
    Kept,
}

impl ConnectionLimits {
    /// Creates limits with no sockets counted yet: `in_all_max` in total, `address_max` per address, and more for the
    /// networks around an address ([`shares`]).
    pub fn new(in_all_max: usize, address_max: usize) -> Arc<ConnectionLimits> {
        ConnectionLimits::with_grace(in_all_max, address_max, IDLE_GRACE)
    }

    /// Like [`ConnectionLimits::new`], but with a different idle time before a socket can be closed.
    pub fn with_grace(
        in_all_max: usize,
        address_max: usize,
        grace: Duration,
    ) -> Arc<ConnectionLimits> {
        Arc::new(ConnectionLimits { in_all_max, address_max, grace, counts: Mutex::default() })
    }

    /// Maximum number of sockets per address.
    pub fn address_max(&self) -> usize {
        self.address_max
    }

    /// Counts a socket for `ip`; `None` if a limit is reached and no idle connection can be closed.
    pub fn admit(self: &Arc<Self>, ip: IpAddr) -> Option<Permit> {
        let networks = networks(ip);
        let mut counts = self.lock();
        let held = counts.held(networks);
        if held.iter().zip(shares(self.address_max)).any(|(&held, share)| held >= share) {
            return None;
        }
        let widest = held[LEVELS - 1];
        let reserve = if widest < FEW { 0 } else { self.in_all_max / RESERVE_SHARE };
        if counts.in_all + reserve >= self.in_all_max && !counts.make_room(widest, self.grace) {
            return None;
        }
        Some(self.count(&mut counts, networks))
    }

    /// Like [`ConnectionLimits::admit`], for a proxy's address, to which only the total limit applies.
    pub fn admit_one_of_all(self: &Arc<Self>, ip: IpAddr) -> Option<Permit> {
        let mut counts = self.lock();
        if counts.in_all >= self.in_all_max {
            return None;
        }
        Some(self.count(&mut counts, networks(ip)))
    }

    /// The narrowest networks that hold sockets, with their counts, largest first.
    pub fn holders(&self) -> Vec<(IpAddr, usize)> {
        let counts = self.lock();
        let held = counts.by_network[0].iter();
        let mut holders: Vec<_> = held.map(|(&network, &held)| (network, held)).collect();
        holders.sort_by_key(|&(network, held)| (std::cmp::Reverse(held), network));
        holders
    }

    fn count(self: &Arc<Self>, counts: &mut Counts, networks: [IpAddr; LEVELS]) -> Permit {
        counts.add(networks);
        Permit {
            limits: Arc::clone(self),
            networks,
            gives_way: Arc::default(),
            state: Mutex::new(PermitState::Busy),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Counts> {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Counts {
    fn held(&self, networks: [IpAddr; LEVELS]) -> [usize; LEVELS] {
        let held = |level: usize| self.by_network[level].get(&networks[level]).copied();
        std::array::from_fn(|level| held(level).unwrap_or(0))
    }

    fn add(&mut self, networks: [IpAddr; LEVELS]) {
        self.in_all += 1;
        for (counts, network) in self.by_network.iter_mut().zip(networks) {
            *counts.entry(network).or_default() += 1;
        }
    }

    fn remove(&mut self, networks: [IpAddr; LEVELS]) {
        self.in_all -= 1;
        for (counts, network) in self.by_network.iter_mut().zip(networks) {
            match counts.get_mut(&network) {
                Some(held) if *held > 1 => *held -= 1,
                _ => drop(counts.remove(&network)),
            }
        }
    }

    /// Closes the longest-idle connection of a network that holds more than `held`, the newcomer's count.
    fn make_room(&mut self, held: usize, grace: Duration) -> bool {
        let widest = |idle: &Idle| self.by_network[LEVELS - 1].get(&idle.networks[LEVELS - 1]);
        let may_go = |idle: &Idle| {
            idle.since.elapsed() >= grace && widest(idle).is_some_and(|&of| of > held)
        };
        let found = self.idle.iter().find(|(_, idle)| may_go(idle));
        let Some(number) = found.map(|(&number, _)| number) else { return false };
        let Some(idle) = self.idle.remove(&number) else { return false };
        self.remove(idle.networks);
        idle.gives_way.notify_one();
        true
    }
}

impl Permit {
    /// Notes whether the connection is just waiting for the peer's next request. If so, it may be closed to make room
    /// for a newcomer.
    pub fn set_idle(&self, is_idle: bool) {
        let mut state = self.lock();
        let mut counts = self.limits.lock();
        match (*state, is_idle) {
            (PermitState::Busy, true) => {
                counts.number += 1;
                let number = counts.number;
                let gives_way = Arc::clone(&self.gives_way);
                let since = Instant::now();
                counts.idle.insert(number, Idle { since, networks: self.networks, gives_way });
                *state = PermitState::Idle(number);
            }
            // A connection that is already being closed stays that way.
            (PermitState::Idle(number), false) if counts.idle.remove(&number).is_some() => {
                *state = PermitState::Busy;
            }
            _ => {}
        }
    }

    /// Protects the connection from being closed to make room for a newcomer, because it belongs to a player.
    pub fn keep(&self) {
        self.set_idle(false);
        let mut state = self.lock();
        if *state == PermitState::Busy {
            *state = PermitState::Kept;
        }
    }

    /// Resolves when the connection must be closed to make room for a newcomer.
    pub async fn gives_way(&self) {
        self.gives_way.notified().await;
    }

    fn lock(&self) -> MutexGuard<'_, PermitState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let state = *self.lock();
        let mut counts = self.limits.lock();
        // A connection that was closed to make room for a newcomer is no longer counted.
        let is_counted = match state {
            PermitState::Idle(number) => counts.idle.remove(&number).is_some(),
            PermitState::Busy | PermitState::Kept => true,
        };
        if is_counted {
            counts.remove(self.networks);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv6Addr;
    use std::pin::pin;
    use std::task::{Context, Waker};

    fn ip(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    /// The address of this household on this line.
    fn household(line: u16, number: u16) -> IpAddr {
        Ipv6Addr::new(0x2001, 0xdb8, line, number, 0, 0, 0, 1).into()
    }

    fn admitted(limits: &Arc<ConnectionLimits>, ips: impl Iterator<Item = IpAddr>) -> Vec<Permit> {
        ips.map_while(|ip| limits.admit(ip)).collect()
    }

    fn has_to_go(permit: &Permit) -> bool {
        pin!(permit.gives_way()).poll(&mut Context::from_waker(Waker::noop())).is_ready()
    }

    #[test]
    fn both_limits_hold_and_dropped_permits_are_free_again() {
        let limits = ConnectionLimits::new(3, 2);
        let first = limits.admit(ip("10.0.0.1"));
        let _second = limits.admit(ip("10.0.0.1"));
        assert!(limits.admit(ip("10.0.0.1")).is_none(), "two of one address");
        assert!(limits.admit_one_of_all(ip("10.0.0.1")).is_some(), "and then it is free again");
        let _third = limits.admit(ip("10.0.1.2"));
        assert!(limits.admit(ip("10.0.2.3")).is_none(), "three in all");
        drop(first);
        assert!(limits.admit(ip("10.0.0.1")).is_some());
        assert_eq!(limits.holders(), [(ip("10.0.0.1"), 1), (ip("10.0.1.2"), 1)]);
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

    #[test]
    fn one_line_with_many_networks_leaves_most_to_others() {
        let limits = ConnectionLimits::new(4096, 512);
        // First all 256 networks of one line, which is a /56, and then all networks of a /48.
        let of_line = admitted(&limits, (0..4096).map(|number| household(1, number % 256)));
        assert_eq!(of_line.len(), 1024);
        let of_site = admitted(&limits, (0..4096).map(|number| household(1, 256 + number)));
        assert_eq!(of_line.len() + of_site.len(), 2048);
        assert_eq!(admitted(&limits, (0..600).map(|_| household(2, 0))).len(), 512);
    }

    #[test]
    fn the_reserve_is_for_networks_that_hold_few() {
        let limits = ConnectionLimits::new(64, 32);
        let of_many = admitted(&limits, (0..64).map(|number| household(number % 2, 0)));
        assert_eq!(of_many.len(), 64 - 64 / RESERVE_SHARE);
        assert!(limits.admit(household(1, 0)).is_none());
        let newcomer = admitted(&limits, (0..64).map(|_| household(2, 0)));
        assert_eq!(newcomer.len(), FEW, "what a browser needs");
    }

    #[test]
    fn idle_connections_of_those_that_hold_more_give_way_to_newcomers() {
        let limits = ConnectionLimits::with_grace(8, 8, Duration::ZERO);
        let mut held = admitted(&limits, (0..8).map(|_| household(1, 0)));
        assert_eq!(held.len(), 8);
        assert!(limits.admit(household(2, 0)).is_none(), "all are busy");
        held.iter().for_each(|permit| permit.set_idle(true));
        held[0].set_idle(false);
        held[1].keep();
        let newcomer = limits.admit(household(2, 0)).expect("the longest idle one gives way");
        let gone: Vec<_> = held.iter().map(has_to_go).collect();
        assert_eq!(gone, [false, false, true, false, false, false, false, false]);
        held[2].set_idle(false);
        drop(held.remove(2));
        assert_eq!(limits.holders(), [(ip("2001:db8:1::"), 7), (ip("2001:db8:2::"), 1)]);
        assert!(limits.admit(household(1, 0)).is_none(), "no other network holds more");
        drop((held, newcomer));
        assert!(limits.holders().is_empty());
    }
}
