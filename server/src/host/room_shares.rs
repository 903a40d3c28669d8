//! Limits on how many rooms a network may have open, both for rooms that people create and for rooms with guests'
//! scenes.

use crate::limits;
use crate::limits::networks::{LEVELS, networks, shares};
use std::net::IpAddr;

/// A limit on open rooms, and each network's share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoomShares {
    /// Maximum number of open rooms.
    max: usize,
    /// Maximum number of open rooms for one address; wider networks may have more ([`shares`]).
    address_max: usize,
    /// How many of the last rooms are reserved for networks without rooms.
    reserve: usize,
}

/// The reason why a network may not open another room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoRoomLeft {
    /// The network has used up its share; an address's share is this many.
    OfNetwork(usize),
    /// All of this many rooms are taken, except the reserved ones.
    OfAll(usize),
}

impl RoomShares {
    /// Shares of this many rooms that people create.
    pub fn of_rooms(max: usize) -> RoomShares {
        let address_max = (max / limits::ADDRESS_ROOMS_SHARE).max(limits::ADDRESS_ROOMS_MIN);
        RoomShares { max, address_max, reserve: max / limits::RESERVE_SHARE }
    }

    /// Shares of this many rooms with guests' scenes, which are few.
    pub fn of_guests(max: usize) -> RoomShares {
        let address_max = (max / limits::ADDRESS_GUEST_ROOMS_SHARE).max(1);
        RoomShares { max, address_max, reserve: limits::GUEST_ROOMS_RESERVE }
    }

    /// Checks that a creator's networks may have one more room, given who created the open rooms.
    pub fn check(
        self,
        created: impl Iterator<Item = IpAddr> + Clone,
        creator: IpAddr,
    ) -> Result<(), NoRoomLeft> {
        let of = networks(creator);
        let held: [usize; LEVELS] = std::array::from_fn(|level| {
            created.clone().filter(|&other| networks(other)[level] == of[level]).count()
        });
        if held.iter().zip(shares(self.address_max)).any(|(&held, share)| held >= share) {
            return Err(NoRoomLeft::OfNetwork(self.address_max));
        }
        let reserve = if held[LEVELS - 1] == 0 { 0 } else { self.reserve };
        match created.count() + reserve < self.max {
            true => Ok(()),
            false => Err(NoRoomLeft::OfAll(self.max)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::networks::network;

    fn ip(line: u16, household: u16) -> IpAddr {
        IpAddr::from([0x2001, 0xdb8, line, household, 0, 0, 0, 1u16])
    }

    /// Number of rooms opened by households on one line that ask for nine each.
    fn opened(
        shares: RoomShares,
        created: &mut Vec<IpAddr>,
        line: u16,
        households: std::ops::Range<u16>,
    ) -> usize {
        let before = created.len();
        for creator in households.flat_map(|household| [ip(line, household); 9]) {
            if shares.check(created.iter().copied(), creator).is_ok() {
                created.push(network(creator));
            }
        }
        created.len() - before
    }

    #[test]
    fn networks_have_shares_of_the_rooms_and_the_last_are_for_those_that_have_none() {
        let (shares, mut created) = (RoomShares::of_rooms(64), Vec::new());
        let mut opened = |line, households| opened(shares, &mut created, line, households);
        assert_eq!(opened(1, 0..1), 8, "of a household");
        assert_eq!(opened(1, 1..256), 8, "of a line with 256 networks, another eight");
        assert_eq!(opened(1, 256..1024), 16, "of an organisation, 32 in all");
        assert_eq!(opened(2, 0..1) + opened(3, 0..1) + opened(4, 0..1), 24);
        assert_eq!(opened(5, 0..1), 1, "of the reserve");
        assert_eq!(opened(6, 0..1), 1);
        let more = shares.check(created.iter().copied(), ip(5, 0));
        assert_eq!(more, Err(NoRoomLeft::OfAll(64)));
    }

    #[test]
    fn an_address_has_an_eighth_of_many_rooms() {
        let (shares, mut created) = (RoomShares::of_rooms(1000), Vec::new());
        let eighth = (0..125).all(|_| {
            created.push(network(ip(1, 0)));
            created.len() == 125 || shares.check(created.iter().copied(), ip(1, 0)).is_ok()
        });
        assert!(eighth);
        let more = shares.check(created.iter().copied(), ip(1, 0));
        assert_eq!(more, Err(NoRoomLeft::OfNetwork(125)));
    }

    #[test]
    fn an_address_has_a_quarter_of_the_guests_rooms_and_the_last_is_for_a_network_without_one() {
        for (max, quarter) in [(4, 1), (8, 2), (32, 8)] {
            let (shares, mut created) = (RoomShares::of_guests(max), Vec::new());
            for line in 0..5 {
                assert!(opened(shares, &mut created, line, 0..1) <= quarter, "of {max}");
            }
            assert_eq!(created.len(), max);
            let last = created.last();
            assert_eq!(created.iter().filter(|&of| Some(of) == last).count(), 1, "of {max}");
        }
    }
}
