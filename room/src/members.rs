//! Members of a room: their seats, names and colours, and the claims that give a seat back.

use crate::input_queue::InputQueue;
use jostle_game::{Input, PlayerInfo, Seat};
use jostle_protocol::limits::COLORS;
use jostle_protocol::{Appearance, PlayerState};
use jostle_sim::Vec2;
use litemap::LiteMap;

/// A player with a seat, with or without a socket.
#[derive(Clone, Debug)]
pub struct Member {
    /// Name and colour, distinct from the others'.
    pub appearance: Appearance,
    /// Serial of the claim that gives the seat back.
    pub serial: u64,
    /// Serial of the claim that the newest session came with. It stays good until an input proves that
    /// the session received its own claim.
    pub serial_before: Option<u64>,
    /// Whether any session of the seat has sent an input.
    pub played: bool,
    /// Tick after which the player took the seat. Coming back to it changes nothing.
    pub joined_tick: u32,
    /// Tick at which the socket was lost; `None` with a socket.
    pub lost_tick: Option<u32>,
    /// The newest input, and the tick in which it became so.
    pub intent: (Input, u32),
    /// Inputs that wait to be played.
    pub inputs: InputQueue,
    /// Width and height of what the page shows, world units, once it reported them.
    pub view: Option<Vec2>,
}

impl Member {
    /// Creates a member with a socket.
    pub fn new(appearance: Appearance, serial: u64) -> Member {
        let inputs = InputQueue::default();
        Member {
            appearance,
            serial,
            serial_before: None,
            played: false,
            joined_tick: 0,
            lost_tick: None,
            intent: (Input::default(), 0),
            inputs,
            view: None,
        }
    }

    /// Returns true if a claim with this serial gives the seat back.
    pub fn answers_to(&self, serial: u64) -> bool {
        self.serial == serial || self.serial_before == Some(serial)
    }

    /// Hands the seat to a new session, which came with the claim `serial_before`.
    pub fn resume(&mut self, appearance: Appearance, serial_before: u64, serial: u64) {
        let serial_before = Some(serial_before);
        let Member { played, joined_tick, .. } = *self;
        *self = Member { serial_before, played, joined_tick, ..Member::new(appearance, serial) };
    }

    /// The player as the others see it.
    pub fn state(&self, player: &PlayerInfo) -> PlayerState {
        PlayerState {
            connected: self.lost_tick.is_none(),
            input_seq: self.inputs.seq_played(),
            ..player_state(player, self.appearance.clone())
        }
    }
}

/// A connected player of whom no input was played.
pub fn player_state(player: &PlayerInfo, appearance: Appearance) -> PlayerState {
    PlayerState {
        seat: player.seat,
        appearance,
        connected: true,
        input_seq: 0,
        hero: player.hero,
        selected: player.selected,
        held: player.held,
        score: player.score,
        pointer: player.pointer,
    }
}

/// The members of a room, by seat.
#[derive(Clone, Debug)]
pub struct Members {
    /// Number of seats, taken or free.
    count: u16,
    /// Those that are taken.
    pub seats: LiteMap<Seat, Member>,
}

impl Members {
    /// Creates `count` free seats.
    pub fn new(count: u16) -> Members {
        Members { count, seats: LiteMap::new() }
    }

    /// The lowest free seat.
    pub fn free_seat(&self) -> Option<Seat> {
        (0..self.count).map(Seat).find(|seat| !self.seats.contains_key(seat))
    }

    /// Names and colours of all members, in seat order.
    pub fn appearances(&self) -> Vec<(Seat, Appearance)> {
        self.seats.iter().map(|(&seat, member)| (seat, member.appearance.clone())).collect()
    }

    /// Makes an appearance distinct from those of all members but the one at `own`: a namesake gets a
    /// number after the name, a taken colour becomes the next one that no connected player has. When all
    /// colours are taken, the wanted one is shared. Seats for which `yields` is true give up their colours. A member at
    /// `own` who comes back leaves the colours of others who are away alone, if it can: otherwise, when all come back
    /// after a restart of the server, they would swap theirs.
    pub fn distinct(
        &self,
        wanted: &Appearance,
        own: Option<Seat>,
        yields: impl Fn(Seat) -> bool,
    ) -> Appearance {
        let others = || self.seats.iter().filter(|(seat, _)| Some(**seat) != own);
        let names = || others().map(|(_, other)| &*other.appearance.name);
        let wearers = |color: u8| {
            others()
                .filter(move |(_, other)| other.appearance.color == color)
                .filter(|(seat, _)| !yields(**seat))
        };
        let colored = |color: u8| wearers(color).any(|(_, other)| other.lost_tick.is_none());
        let mut appearance = wanted.clone();
        if names().any(|name| *name == *wanted.name) {
            appearance = wanted.numbered(self.free_number(wanted, names()));
        }
        let colors = (0..COLORS).map(|step| (wanted.color + step) % COLORS);
        let back = own.and_then(|seat| self.seats.get(&seat)).filter(|own| own.lost_tick.is_some());
        let is_worn = |color: u8| wearers(color).next().is_some();
        let former = back.map(|own| own.appearance.color).filter(|_| is_worn(wanted.color));
        let unworn = colors.clone().filter(|&color| former.is_some() && !is_worn(color));
        let mut colors = former.into_iter().chain(unworn).chain(colors);
        appearance.color = colors.find(|&color| !colored(color)).unwrap_or(wanted.color);
        appearance
    }

    /// The smallest number from 2 on that no namesake has, found in one pass over the names.
    fn free_number<'a>(&self, wanted: &Appearance, names: impl Iterator<Item = &'a str>) -> usize {
        // One number more than there are names cannot all be taken, and 0 and 1 are never given.
        let mut taken = vec![false; self.seats.len() + 3];
        for name in names {
            let number = name.rsplit_once(' ').and_then(|(_, number)| number.parse::<usize>().ok());
            let flag = number.and_then(|number| Some((number, taken.get_mut(number)?)));
            if let Some((number, is_taken)) = flag {
                *is_taken |= &*wanted.numbered(number).name == name;
            }
        }
        let free = (2..taken.len()).find(|&number| !taken[number]);
        free.expect("there are more numbers than names")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(name: &str, color: u8) -> Appearance {
        Appearance::new(name, color).unwrap()
    }

    fn members(seated: &[(u16, &str, u8)]) -> Members {
        let mut members = Members::new(12);
        for &(seat, name, color) in seated {
            members.seats.insert(Seat(seat), Member::new(look(name, color), u64::from(seat)));
        }
        members
    }

    #[test]
    fn the_lowest_seat_is_given_first() {
        let mut members = members(&[(0, "Ann", 0), (1, "Bob", 1), (3, "Cid", 2)]);
        assert_eq!(members.free_seat(), Some(Seat(2)));
        assert!(members.seats.remove(&Seat(0)).is_some());
        assert!(members.seats.remove(&Seat(200)).is_none());
        assert_eq!(members.free_seat(), Some(Seat(0)));
    }

    #[test]
    fn namesakes_get_a_number() {
        let members = members(&[(0, "Ann", 0), (1, "Ann 2", 1), (2, "Bob", 2)]);
        assert_eq!(members.distinct(&look("Ann", 5), None, |_| false), look("Ann 3", 5));
        assert_eq!(members.distinct(&look("Ann 2", 5), None, |_| false), look("Ann 2 2", 5));
        assert_eq!(members.distinct(&look("Bob", 5), Some(Seat(2)), |_| false), look("Bob", 5));
        let mut members = Members::new(40);
        let long = look("Twenty characters ab", 0);
        for seat in 0..40 {
            let look = members.distinct(&long, None, |_| false);
            let name = if seat == 0 { long.name.clone() } else { long.numbered(seat + 1).name };
            assert_eq!(look.name, name);
            members.seats.insert(Seat(seat as u16), Member::new(look, 0));
        }
    }

    #[test]
    fn a_taken_colour_gives_the_next_free_one() {
        let mut seated = members(&[(0, "A", 6), (1, "B", 7), (2, "C", 0)]);
        assert_eq!(seated.distinct(&look("D", 6), None, |_| false).color, 1);
        assert_eq!(seated.distinct(&look("A", 6), Some(Seat(0)), |_| false).color, 6);
        // A player without a socket does not hold the colour against newcomers.
        seated.seats.get_mut(&Seat(1)).unwrap().lost_tick = Some(0);
        assert_eq!(seated.distinct(&look("D", 6), None, |_| false).color, 7);
    }

    #[test]
    fn players_who_all_come_back_keep_their_colours() {
        // All chose colour 6.
        let mut seated = members(&[(0, "A", 6), (1, "B", 7), (2, "C", 0)]);
        for (_, member) in seated.seats.iter_mut() {
            member.lost_tick = Some(0);
        }
        for (seat, color) in [(2, 0), (1, 7), (0, 6)] {
            let own = Seat(seat);
            assert_eq!(seated.distinct(&look("N", 6), Some(own), |_| false).color, color);
            seated.seats.get_mut(&own).unwrap().lost_tick = None;
        }
        // A colour of one's own choice that no other has is given.
        seated.seats.get_mut(&Seat(1)).unwrap().lost_tick = Some(0);
        assert_eq!(seated.distinct(&look("N", 3), Some(Seat(1)), |_| false).color, 3);
        // A newcomer has the former one. The colour of another absent player is not taken either.
        seated.seats.get_mut(&Seat(0)).unwrap().lost_tick = Some(0);
        seated.seats.insert(Seat(3), Member::new(look("D", 7), 3));
        assert_eq!(seated.distinct(&look("N", 6), Some(Seat(1)), |_| false).color, 1);
    }

    #[test]
    fn when_all_colours_are_taken_the_wanted_one_is_shared() {
        let names = ["A", "B", "C", "D", "E", "F", "G", "H"];
        let seated: Vec<_> =
            (0..COLORS).map(|c| (u16::from(c), names[usize::from(c)], c)).collect();
        assert_eq!(members(&seated).distinct(&look("I", 3), None, |_| false), look("I", 3));
    }

    #[test]
    fn the_serial_before_is_good_until_it_is_given_up() {
        let mut member = Member::new(look("B", 1), 1);
        member.resume(look("B", 1), 1, 77);
        assert!(member.answers_to(77) && member.answers_to(1));
        member.serial_before = None;
        assert!(member.answers_to(77) && !member.answers_to(1) && !member.answers_to(5));
    }
}
