//! Who gets a seat when the room is full, and who gets none at all: what a room's thread knows of
//! addresses.

use crate::limits::{HELD_SHARE, KICKED_MAX, KICKED_TICKS};
use crate::peers::network;
use jostle_room::Room;
use jostle_sim::Seat;
use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;

/// The addresses behind the seats, and those that have to stay outside for a while.
#[derive(Debug, Default)]
pub struct Door {
    /// By seat, whoever sat there last.
    addresses: Vec<Option<IpAddr>>,
    /// With the tick of the kick, the oldest first.
    kicked: VecDeque<(IpAddr, u32)>,
}

impl Door {
    /// Somebody of this address took a seat.
    pub fn seated(&mut self, seat: Seat, address: IpAddr) {
        let place = usize::from(seat.0);
        if self.addresses.len() <= place {
            self.addresses.resize(place + 1, None);
        }
        self.addresses[place] = Some(network(address));
    }

    /// Nobody of the seat's address gets a seat for a while.
    pub fn kicked(&mut self, seat: Seat, tick: u32) {
        let Some(address) = self.address(seat) else { return };
        self.kicked.retain(|&(kicked, _)| kicked != address);
        if self.kicked.len() == KICKED_MAX {
            self.kicked.pop_front();
        }
        self.kicked.push_back((address, tick));
    }

    /// Whether somebody of this address was told to leave a short while ago.
    pub fn is_shut(&self, address: IpAddr, tick: u32) -> bool {
        let address = network(address);
        let shut = |&(kicked, since): &(IpAddr, u32)| {
            kicked == address && tick.saturating_sub(since) < KICKED_TICKS
        };
        self.kicked.iter().any(shut)
    }

    /// The seats of a room that are held, and for whom.
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

/// The held seats of a room, good until somebody joins, leaves or is lost: counted once for all who ask
/// in vain.
#[derive(Debug)]
pub struct Held {
    /// Who was lost first comes first.
    seats: Vec<(Seat, Option<IpAddr>)>,
    count_by_address: BTreeMap<Option<IpAddr>, usize>,
    /// Seats that one address may hold before it gives way to anybody.
    share: usize,
}

impl Held {
    /// The held seat that a newcomer of this address may have in a full room: the longest-lost of the own
    /// address, and else of one that holds more than its share. So nobody can take a seat from others
    /// who hold few, and who joins and vanishes again and again only spends seats of the own.
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
    use jostle_protocol::Appearance;
    use jostle_sim::{Input, Scene};
    use std::sync::Arc;

    fn address(last: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, last])
    }

    /// A full room whose first seats are held for these addresses, in the order of their losses.
    fn full(lost: &[u8]) -> (Room, Door) {
        let arena = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
        let mut room = Room::new("full", Arc::new(arena.expect("a shipped scene")), 1);
        let mut door = Door::default();
        while let Ok(welcome) = room.join(Appearance { name: "Ann".into(), color: 0 }, None) {
            let seat = welcome.claim.seat;
            let of = lost.get(usize::from(seat.0)).copied().unwrap_or(200);
            door.seated(seat, address(of));
            room.input(seat, 1, Input::default());
        }
        for seat in 0..lost.len() {
            room.tick();
            room.disconnect(Seat(seat as u16));
        }
        (room, door)
    }

    #[test]
    fn a_newcomer_gets_the_longest_lost_seat_of_the_own_address() {
        let (room, door) = full(&[1, 2, 2, 3]);
        assert_eq!(door.held(&room).displaced(address(2)), Some(Seat(1)));
        assert_eq!(door.held(&room).displaced(address(3)), Some(Seat(3)));
        assert_eq!(
            door.held(&room).displaced(address(4)),
            None,
            "nobody's seat is taken by others"
        );
        assert_eq!(door.held(&room).displaced(address(200)), None, "who plays keeps the seat");
    }

    #[test]
    fn an_address_with_more_than_its_share_gives_way_to_anybody() {
        let share = full(&[]).0.players() / HELD_SHARE;
        let mut lost = vec![9; share + 1];
        lost.insert(0, 1);
        let (room, door) = full(&lost);
        assert_eq!(door.held(&room).displaced(address(4)), Some(Seat(1)));
        let (room, door) = full(&lost[..=share]);
        assert_eq!(door.held(&room).displaced(address(4)), None);
    }

    #[test]
    fn who_was_kicked_stays_outside_for_a_while_and_few_are_remembered() {
        let mut door = Door::default();
        door.seated(Seat(3), address(1));
        door.kicked(Seat(3), 100);
        door.kicked(Seat(4), 100);
        assert!(door.is_shut(address(1), 99 + KICKED_TICKS) && !door.is_shut(address(2), 100));
        assert!(!door.is_shut(address(1), 100 + KICKED_TICKS));
        for other in 2..2 + KICKED_MAX as u8 {
            door.seated(Seat(3), address(other));
            door.kicked(Seat(3), 101);
        }
        assert!(!door.is_shut(address(1), 101) && door.is_shut(address(2), 101));
        assert_eq!(door.kicked.len(), KICKED_MAX);
    }
}
