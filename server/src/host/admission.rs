//! Admission to a room: seats for newcomers when the room is full, and bans on kicked players.

use crate::limits::networks::{network, widest};
use jostle_game::Seat;
use jostle_room::{Claim, Room};
use jostle_sim::TICKS_PER_SECOND;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;

/// Seats that a network keeps when newcomers from other networks arrive, as a fraction of a room's seats. Once the room
/// is full, a network with more seats loses some to newcomers. Four networks can fill a room; one network can fill it
/// only as long as no other wants to join.
const SEATS_SHARE: usize = 4;
/// Ticks of inactivity after which a player's seat is given away before the seat of the network's newest player, if the
/// network has more than its share.
const IDLE_MOMENT_TICKS: u32 = 5 * TICKS_PER_SECOND;
/// Ticks of inactivity after which a player's seat may be given to a newcomer if the room is full.
const IDLE_SEAT_TICKS: u32 = 90 * TICKS_PER_SECOND;
/// Ticks for which a kicked player, or the player's network, is shut out of the room.
const KICKED_TICKS: u32 = 5 * 60 * TICKS_PER_SECOND;
/// Maximum number of kicks that a room remembers; further ones replace the oldest.
const KICKED_MAX: usize = 64;

/// The addresses of seated players, and the players and networks that are temporarily shut out.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Admission {
    /// For each seat, the network of its last player and the name that this player asked for.
    seated: Vec<Option<(IpAddr, String)>>,
    /// Kicked players, oldest first.
    kicked: VecDeque<Kicked>,
    /// Increases with every change.
    #[serde(skip)]
    revision: u64,
}

/// A player who is temporarily shut out.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Kicked {
    network: IpAddr,
    /// The player's name; `None` if the whole network is shut out.
    name: Option<String>,
    /// Serial numbers of the player's claims, which a page presents wherever it is.
    #[serde(default)]
    claims: [Option<u64>; 2],
    tick: u32,
}

/// Whom a kick shuts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KickScope {
    /// The player, recognised by their claim, or by their name on their network.
    Player,
    /// Everyone on the player's network.
    Network,
}

impl Admission {
    /// Notes that a player at this address, who asked for this name, has taken a seat.
    pub fn seated(&mut self, seat: Seat, address: IpAddr, name: &str) {
        self.revision += 1;
        let index = usize::from(seat.0);
        if self.seated.len() <= index {
            self.seated.resize(index + 1, None);
        }
        self.seated[index] = Some((network(address), name.to_owned()));
    }

    /// Notes that the player in a seat now has this name.
    pub fn renamed(&mut self, seat: Seat, name: &str) {
        if let Some(Some((_, known))) = self.seated.get_mut(usize::from(seat.0)) {
            self.revision += 1;
            name.clone_into(known);
        }
    }

    /// Temporarily shuts out the player in a seat, who had these claims. Others on the same network are shut out only if
    /// the host wants it, since a school or a flat is one network.
    pub fn kicked(&mut self, seat: Seat, claims: [Option<u64>; 2], scope: KickScope, tick: u32) {
        let Some((network, name)) = self.of(seat).cloned() else { return };
        let name = Some(name).filter(|_| scope == KickScope::Player);
        self.revision += 1;
        self.kicked.retain(|kicked| kicked.holds(tick));
        if self.kicked.len() == KICKED_MAX {
            self.kicked.pop_front();
        }
        self.kicked.push_back(Kicked { network, name, claims, tick });
    }

    /// Increases with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns whether a player with this address and name, or with this claim, was recently kicked.
    pub fn is_shut(&self, address: IpAddr, name: &str, claim: Option<Claim>, tick: u32) -> bool {
        let (network, serial) = (network(address), claim.map(|claim| claim.serial));
        let is_it = |kicked: &Kicked| {
            let named = || kicked.name.as_deref().is_none_or(|known| known == name);
            (serial.is_some() && kicked.claims.contains(&serial))
                || (kicked.network == network && named())
        };
        self.kicked.iter().any(|kicked| is_it(kicked) && kicked.holds(tick))
    }

    /// A room's held seats, with their addresses.
    pub fn held(&self, room: &Room) -> HeldSeats {
        let mut count_by_address = BTreeMap::new();
        let seats = room.held().into_iter().map(|seat| (seat, self.address(seat)));
        let seats: Vec<_> = seats.collect();
        for &(_, address) in &seats {
            *count_by_address.entry(address).or_default() += 1;
        }
        HeldSeats { seats, count_by_address, share: share(room) }
    }

    /// The connected seat that a newcomer from this address may take in a full room without held seats. A network loses
    /// a seat if it has more than its share, and more than the newcomer's network would then have. It loses its most
    /// idle player's seat, if that player has been idle for a moment, and otherwise its newest player's seat. If no
    /// network has that many seats, the room's most idle player loses a seat, if idle for long enough. `seats` are the
    /// candidates.
    pub fn displaced(
        &self,
        room: &Room,
        seats: impl Iterator<Item = Seat>,
        newcomer: IpAddr,
    ) -> Option<Seat> {
        let count_by_network = self.count_by_network(room);
        let count = |network: IpAddr| count_by_network.get(&network).copied().unwrap_or(0);
        // It must have more than the newcomer's network would; otherwise two large networks would keep taking seats
        // from each other.
        let kept = share(room).max(1 + count(widest(newcomer)));
        let of_network = |seat| self.address(seat).map_or(0, |address| count(widest(address)));
        let seats = seats.filter_map(|seat| Some((room.idle_ticks(seat)?, seat)));
        let mut idle: Vec<_> = seats.collect();
        idle.sort_unstable_by_key(|&(ticks, seat)| (Reverse(ticks), seat));
        let crowd = || idle.iter().filter(|&&(_, seat)| of_network(seat) > kept);
        let idle_of_crowd = crowd().find(|&&(ticks, _)| ticks >= IDLE_MOMENT_TICKS);
        let newest_of_crowd =
            || crowd().max_by_key(|&&(_, seat)| (of_network(seat), room.joined_tick(seat), seat));
        let idle_of_all = || idle.first().filter(|&&(ticks, _)| ticks >= IDLE_SEAT_TICKS);
        let displaced = idle_of_crowd.or_else(newest_of_crowd).or_else(idle_of_all);
        displaced.map(|&(_, seat)| seat)
    }

    /// Number of seats that people occupy per network, including held seats. An address's widest network is used, since
    /// one person may control all of its addresses.
    fn count_by_network(&self, room: &Room) -> BTreeMap<IpAddr, usize> {
        let seats = (0..room.scene().players_max).map(Seat);
        let taken = seats.filter(|&seat| room.joined_tick(seat).is_some());
        let mut count_by_network = BTreeMap::new();
        for address in taken.filter_map(|seat| self.address(seat)) {
            *count_by_network.entry(widest(address)).or_default() += 1;
        }
        count_by_network
    }

    fn of(&self, seat: Seat) -> Option<&(IpAddr, String)> {
        self.seated.get(usize::from(seat.0))?.as_ref()
    }

    /// The network of the last player in a seat: an IPv4 address, or the first address of an IPv6 /64.
    pub fn address(&self, seat: Seat) -> Option<IpAddr> {
        self.of(seat).map(|(address, _)| *address)
    }
}

impl Kicked {
    fn holds(&self, tick: u32) -> bool {
        tick.saturating_sub(self.tick) < KICKED_TICKS
    }
}

/// Seats that a network keeps when newcomers from other networks arrive.
fn share(room: &Room) -> usize {
    (usize::from(room.scene().players_max) / SEATS_SHARE).max(1)
}

/// The held seats of a room, valid until a player joins, leaves or disconnects. They are counted once for all the joins
/// that a full room handles in a tick.
#[derive(Debug)]
pub struct HeldSeats {
    /// Held seats, longest absence first.
    seats: Vec<(Seat, Option<IpAddr>)>,
    count_by_address: BTreeMap<Option<IpAddr>, usize>,
    /// Seats that one address may hold before it may lose one to any newcomer.
    share: usize,
}

impl HeldSeats {
    /// The held seat that a newcomer from this address may take in a full room: the longest-held seat of the same
    /// address, or else a seat of an address that holds more than its share. Newcomers therefore never take seats from
    /// an address that holds few, and a client that keeps joining and vanishing only uses up its own address's seats.
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

    /// A full room whose first seats are held for these addresses, in the order in which the players lost them.
    fn full(lost: &[u8]) -> (Room, Admission) {
        let arena = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
        let mut room = Room::new("full", Arc::new(arena.expect("a shipped scene")), 1);
        let mut admission = Admission::default();
        while let Ok(welcome) = room.join(Appearance { name: "Ann".into(), color: 0 }, None) {
            let seat = welcome.claim.seat;
            let of = lost.get(usize::from(seat.0)).copied().unwrap_or(200);
            admission.seated(seat, address(of), "Ann");
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
        let share = full(&[]).0.players() / SEATS_SHARE;
        let mut lost = vec![9; share + 1];
        lost.insert(0, 1);
        let (room, admission) = full(&lost);
        assert_eq!(admission.held(&room).displaced(address(4)), Some(Seat(1)));
        let (room, admission) = full(&lost[..=share]);
        assert_eq!(admission.held(&room).displaced(address(4)), None);
    }

    /// Seats that can be given away: all except the host's.
    fn given_away(room: &Room) -> impl Iterator<Item = Seat> {
        (1..room.scene().players_max).map(Seat)
    }

    /// Plays a room in which everyone but one seat presses keys.
    fn play(room: &mut Room, ticks: u32, idle: Option<u16>) {
        for _ in 0..ticks {
            for seat in (0..room.scene().players_max).filter(|&seat| Some(seat) != idle) {
                let seq = room.game().tick_count() + 2;
                let buttons = jostle_game::Buttons(seq as u16 & 1);
                room.input(Seat(seat), seq, Input::new(buttons, None));
            }
            room.tick();
        }
    }

    /// A full room in which `of` gives each seat's network, and everyone is active.
    fn busy(of: impl Fn(u16) -> [u8; 4]) -> (Room, Admission) {
        let (mut room, mut admission) = full(&[]);
        for seat in 0..room.scene().players_max {
            admission.seated(Seat(seat), of(seat).into(), "Ann");
        }
        play(&mut room, 20, None);
        (room, admission)
    }

    #[test]
    fn the_most_idle_seat_of_a_network_with_many_goes_to_a_newcomer_of_another() {
        // Each seat has its own network, except for one network that has more than its share.
        let of = |seat: u16| if seat < 20 { [10, 0, 7, 1] } else { [10, 1, seat as u8, 1] };
        let (mut room, admission) = busy(of);
        play(&mut room, IDLE_MOMENT_TICKS, Some(5));
        let displaced =
            |newcomer: [u8; 4]| admission.displaced(&room, given_away(&room), newcomer.into());
        assert_eq!(displaced([10, 9, 9, 9]), Some(Seat(5)));
        assert_eq!(displaced([10, 0, 7, 200]), None, "a neighbour of theirs");
        assert_eq!(admission.displaced(&room, std::iter::empty(), [10, 9, 9, 9].into()), None);
    }

    #[test]
    fn a_network_with_many_gives_its_newest_seats_until_it_has_its_share() {
        let (mut room, mut admission) = busy(|_| [10, 0, 7, 1]);
        let (seats, mut taken) = (room.scene().players_max, Vec::new());
        // One player leaves, and later comes back to a low-numbered seat.
        room.leave(Seat(3));
        play(&mut room, 1, Some(3));
        let newest = room.join(Appearance { name: "Ann".into(), color: 0 }, None);
        assert_eq!(newest.expect("a free seat").claim.seat, Seat(3));
        for newcomer in 1..=u16::MAX {
            play(&mut room, 1, None);
            let address = [10, 1, newcomer as u8, 1].into();
            let Some(seat) = admission.displaced(&room, given_away(&room), address) else { break };
            room.leave(seat);
            room.join(Appearance { name: "Bob".into(), color: 0 }, None).expect("a free seat");
            admission.seated(seat, address, "Bob");
            taken.push(seat.0);
        }
        let newest_first: Vec<_> = [3].into_iter().chain((seats / 4..seats).rev()).collect();
        // The newcomers joined after the whole crowd, and none of them loses the seat again.
        assert_eq!(taken, newest_first[..usize::from(seats - seats / 4)]);
    }

    #[test]
    fn two_networks_with_many_take_no_seats_from_each_other_in_turn() {
        let (room, admission) = busy(|seat| [10, (seat % 2) as u8, 7, 1]);
        let displaced =
            |newcomer: [u8; 4]| admission.displaced(&room, given_away(&room), newcomer.into());
        assert_eq!(displaced([10, 0, 7, 1]), None);
        assert_eq!(displaced([10, 1, 7, 1]), None);
        assert!(displaced([10, 2, 7, 1]).is_some());
    }

    #[test]
    fn an_idle_player_gives_way_in_a_full_room() {
        let (mut room, admission) = busy(|seat| [10, 1, seat as u8, 1]);
        let idle = |room: &Room| admission.displaced(room, given_away(room), [10, 9, 9, 9].into());
        play(&mut room, IDLE_SEAT_TICKS - 10, Some(3));
        assert_eq!(idle(&room), None);
        play(&mut room, 10, Some(3));
        assert_eq!(idle(&room), Some(Seat(3)));
    }

    /// Kicks Ann, whose claim has the number 7.
    fn kick(admission: &mut Admission, of: u8, scope: KickScope, tick: u32) {
        admission.seated(Seat(3), address(of), "Ann");
        admission.kicked(Seat(3), [Some(7), None], scope, tick);
    }

    #[test]
    fn a_kicked_network_is_shut_out_for_a_while_and_few_are_remembered() {
        let mut admission = Admission::default();
        kick(&mut admission, 1, KickScope::Network, 100);
        admission.kicked(Seat(4), [None; 2], KickScope::Network, 100);
        let shut = |of: u8, tick| admission.is_shut(address(of), "Bob", None, tick);
        assert!(shut(1, 99 + KICKED_TICKS) && !shut(2, 100));
        assert!(!shut(1, 100 + KICKED_TICKS));
        for other in 2..2 + KICKED_MAX as u8 {
            kick(&mut admission, other, KickScope::Network, 101);
        }
        let shut = |of: u8| admission.is_shut(address(of), "Bob", None, 101);
        assert!(!shut(1) && shut(2));
        assert_eq!(admission.kicked.len(), KICKED_MAX);
    }

    #[test]
    fn a_kicked_player_is_known_by_claim_and_name_and_others_on_the_network_are_not_hit() {
        let mut admission = Admission::default();
        kick(&mut admission, 1, KickScope::Player, 100);
        let claim = |serial| Some(Claim { seat: Seat(9), serial });
        let shut = |of: u8, name: &str, claim| admission.is_shut(address(of), name, claim, 101);
        assert!(shut(1, "Ann", None) && shut(1, "Eve", claim(7)) && shut(2, "Eve", claim(7)));
        assert!(!shut(1, "Eve", None) && !shut(1, "Eve", claim(8)) && !shut(2, "Ann", None));
        assert!(!admission.is_shut(address(1), "Ann", claim(7), 100 + KICKED_TICKS));
        // A new name does not help.
        admission.seated(Seat(3), address(1), "Bob");
        admission.renamed(Seat(3), "Bobby");
        admission.kicked(Seat(3), [Some(8), None], KickScope::Player, 102);
        let shut = |name: &str| admission.is_shut(address(1), name, None, 103);
        assert!(shut("Bobby") && shut("Ann") && !shut("Bob"));
    }
}
