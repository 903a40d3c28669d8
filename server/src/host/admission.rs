//! Admission to a room: seats for newcomers in a full room, and the addresses of kicked players.

use crate::limits::connection_limits::network;
use crate::limits::{HELD_SHARE, KICKED_MAX, KICKED_TICKS};
use jostle_game::Seat;
use jostle_room::Room;
use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;

/// The addresses of the seats, and those that get no seat for a while.
#[derive(Debug, Default)]
pub struct Admission {
    /// By seat, the network of its last player.
    addresses: Vec<Option<IpAddr>>,
    /// With the tick of the kick, the oldest first.
    kicked: VecDeque<(IpAddr, u32)>,
}

impl Admission {
    /// Notes that a player of this address took a seat.
    pub fn seated(&mut self, seat: Seat, address: IpAddr) {
        let index = usize::from(seat.0);
        if self.addresses.len() <= index {
            self.addresses.resize(index + 1, None);
        }
        self.addresses[index] = Some(network(address));
    }

    /// Shuts out the seat's address for a while.
    pub fn kicked(&mut self, seat: Seat, tick: u32) {
        let Some(address) = self.address(seat) else { return };
        self.kicked.retain(|&(kicked, _)| kicked != address);
        if self.kicked.len() == KICKED_MAX {
            self.kicked.pop_front();
        }
        self.kicked.push_back((address, tick));
    }

    /// Returns whether a player of this address was kicked a short while ago.
    pub fn is_shut(&self, address: IpAddr, tick: u32) -> bool {
        let address = network(address);
        let shut = |&(kicked, since): &(IpAddr, u32)| {
            kicked == address && tick.saturating_sub(since) < KICKED_TICKS
        };
        self.kicked.iter().any(shut)
    }

    /// The held seats of a room, with their addresses.
    pub fn held(&self, room: &Room) -> Held {
        let mut count_by_address = BTreeMap::new();
        let seats = room.held().into_iter().map(|seat| (seat, self.address(seat)));
        let seats: Vec<_> = seats.collect();
        for &(_, address) in &seats {
            *count_by_address.entry(address).or_default() += 1;
        }
        let share = (usize::from(room.scene().players_max) / HELD_SHARE).max(1);
        Held { seats, count_by_address, share }
    }

    fn address(&self, seat: Seat) -> Option<IpAddr> {
        self.addresses.get(usize::from(seat.0)).copied().flatten()
    }
}

/// The held seats of a room, valid until a player joins, leaves or is lost. Counted once for all
/// joins that a full room refuses in a tick.
#[derive(Debug)]
pub struct Held {
    /// The longest-lost comes first.
    seats: Vec<(Seat, Option<IpAddr>)>,
    count_by_address: BTreeMap<Option<IpAddr>, usize>,
    /// Seats that one address may hold before it has to give way to any newcomer.
    share: usize,
}

impl Held {
    /// The held seat that a newcomer of this address may have in a full room: the longest-lost of the own
    /// address, and else of one that holds more than its share. So no newcomer takes a seat from an address
    /// that holds few, and a client that joins and vanishes again and again only uses up seats of its own address.
    pub fn displaced(&self, newcomer: IpAddr) -> Option<Seat> {
        let newcomer = Some(network(newcomer));
        let own = self.seats.iter().find(|&&(_, address)| address == newcomer);
        let many =
            || self.seats.iter().find(|(_, address)| self.count_by_address[address] > self.share);
        own.or_else(many).map(|&(seat, _)| seat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_game::{Input, Scene};
    use jostle_protocol::Appearance;
    use std::sync::Arc;

    fn address(last: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, last])
    }

    /// A full room whose first seats are held for these addresses, in the order of their losses.
    fn full(lost: &[u8]) -> (Room, Admission) {
        let arena = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
        let mut room = Room::new("full", Arc::new(arena.expect("a shipped scene")), 1);
        let mut admission = Admission::default();
        while let Ok(welcome) = room.join(Appearance { name: "Ann".into(), color: 0 }, None) {
            let seat = welcome.claim.seat;
            let of = lost.get(usize::from(seat.0)).copied().unwrap_or(200);
            admission.seated(seat, address(of));
            room.input(seat, 1, Input::default());
        }
        for seat in 0..lost.len() {
            room.tick();
            room.disconnect(Seat(seat as u16));
        }
        (room, admission)
    }

    #[test]
    fn a_newcomer_gets_the_longest_lost_seat_of_its_own_address() {
        let (room, admission) = full(&[1, 2, 2, 3]);
        assert_eq!(admission.held(&room).displaced(address(2)), Some(Seat(1)));
        assert_eq!(admission.held(&room).displaced(address(3)), Some(Seat(3)));
        assert_eq!(admission.held(&room).displaced(address(4)), None, "no seat of another address");
        assert_eq!(
            admission.held(&room).displaced(address(200)),
            None,
            "a connected player keeps the seat"
        );
    }

    #[test]
    fn an_address_with_more_than_its_share_gives_way_to_any_newcomer() {
        let share = full(&[]).0.players() / HELD_SHARE;
        let mut lost = vec![9; share + 1];
        lost.insert(0, 1);
        let (room, admission) = full(&lost);
        assert_eq!(admission.held(&room).displaced(address(4)), Some(Seat(1)));
        let (room, admission) = full(&lost[..=share]);
        assert_eq!(admission.held(&room).displaced(address(4)), None);
    }

    #[test]
    fn a_kicked_address_is_shut_out_for_a_while_and_few_are_remembered() {
        let mut admission = Admission::default();
        admission.seated(Seat(3), address(1));
        admission.kicked(Seat(3), 100);
        admission.kicked(Seat(4), 100);
        assert!(
            admission.is_shut(address(1), 99 + KICKED_TICKS) && !admission.is_shut(address(2), 100)
        );
        assert!(!admission.is_shut(address(1), 100 + KICKED_TICKS));
        for other in 2..2 + KICKED_MAX as u8 {
            admission.seated(Seat(3), address(other));
            admission.kicked(Seat(3), 101);
        }
        assert!(!admission.is_shut(address(1), 101) && admission.is_shut(address(2), 101));
        assert_eq!(admission.kicked.len(), KICKED_MAX);
    }
}
