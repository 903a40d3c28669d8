//! A room's members: their seats, names and colours, the claims that give a seat back, and the bots among them.

use crate::bots::{Activity, Bots};
use crate::input_queue::InputQueue;
use jostle_game::{Game, Input, PlayerInfo, Seat};
use jostle_protocol::limits::COLORS;
use jostle_protocol::{Appearance, PlayerState, Refusal};
use jostle_sim::Vec2;
use litemap::LiteMap;
use serde::{Deserialize, Serialize};

/// Number of ticks for which a seat is held after its socket is lost.
pub const SEAT_HELD_TICKS: u32 = 45 * 60;
/// Number of ticks without a new key or pointer after which bots no longer wait for a player.
const IDLE_TICKS: u32 = 10 * 60;

/// The right to a seat. A room keeps no secrets, so the caller seals the claim in a token for the player.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// The seat that the player holds.
    pub seat: Seat,
    /// Unique among a room's claims.
    pub serial: u64,
}

/// The result of joining; [`crate::Room::welcome`] encodes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Welcome {
    /// The claim with which the player can return.
    pub claim: Claim,
    /// Whether an earlier seat was resumed. If the seat still had a socket, the new one replaces it: the caller closes
    /// the old socket and does not report it as lost.
    pub resumed: bool,
}

/// A join, a leave or an appearance change waiting for the next tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PendingChange {
    Join(Seat),
    Leave(Seat),
    Look(Seat),
}

/// Who holds each seat, and their claims.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedMembers {
    /// Number of seats that bots fill; lower than in the scene if some bots were dismissed.
    pub bots: usize,
    /// The taken seats, in order.
    pub seats: Vec<SavedSeat>,
}

/// A taken seat.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedSeat {
    /// The seat's number.
    pub seat: u16,
    /// Serial number of the claim that restores the seat.
    pub serial: u64,
    /// Serial number of the previous claim, for as long as that is valid.
    pub serial_before: Option<u64>,
    /// Tick after which the player took the seat; 0 in files from an older version.
    #[serde(default)]
    pub joined_tick: u32,
    /// Tick at which the player lost the socket.
    pub lost_tick: Option<u32>,
    /// Whether a bot holds the seat.
    pub is_bot: bool,
}

/// A player who holds a seat, with or without a socket.
#[derive(Clone, Debug)]
pub struct Member {
    /// Name and colour, distinct from other members'.
    pub appearance: Appearance,
    /// Serial number of the claim that restores the seat.
    pub serial: u64,
    /// Serial number of the claim that the newest session presented. It stays valid until an input proves that the
    /// session has received its new claim.
    pub serial_before: Option<u64>,
    /// Whether any session in the seat has sent an input.
    pub played: bool,
    /// Tick after which the player took the seat. It does not change when the player returns.
    pub joined_tick: u32,
    /// Tick at which the socket was lost; `None` while the player is connected.
    pub lost_tick: Option<u32>,
    /// The newest input, and the tick in which it changed.
    pub intent: (Input, u32),
    /// Inputs waiting to be played.
    pub inputs: InputQueue,
    /// Size of the page's view in world units, once the page has reported it.
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

    /// Returns true if a claim with this serial number restores the seat.
    pub fn answers_to(&self, serial: u64) -> bool {
        self.serial == serial || self.serial_before == Some(serial)
    }

    /// The player's recent activity.
    pub fn activity(&self, tick: u32) -> Activity {
        match self.intent.1 {
            acted if tick.saturating_sub(acted) > IDLE_TICKS => Activity::Idle,
            acted if acted == self.joined_tick => Activity::New,
            _ => Activity::Active,
        }
    }

    /// Hands the seat to a new session that presented the claim `serial_before`.
    pub fn resume(&mut self, appearance: Appearance, serial_before: u64, serial: u64) {
        let serial_before = Some(serial_before);
        let Member { played, joined_tick, .. } = *self;
        *self = Member { serial_before, played, joined_tick, ..Member::new(appearance, serial) };
    }

    /// The player, as others see them.
    pub fn state(&self, player: &PlayerInfo) -> PlayerState {
        PlayerState {
            connected: self.lost_tick.is_none(),
            input_seq: self.inputs.seq_played(),
            ..player_state(player, self.appearance.clone())
        }
    }
}

/// A connected player of whom no input has been played yet.
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

/// A room's members, by seat.
pub struct Members {
    /// Number of seats, taken or free.
    count: u16,
    /// The taken seats.
    pub seats: LiteMap<Seat, Member>,
    /// The bots, if the scene has any.
    pub bots: Option<Bots>,
    /// Serial number of the newest claim; each of a room's claims has its own.
    pub serial: u64,
    /// Joins, leaves and appearance changes since the last tick, of which there are at most three per seat.
    pub changes: Vec<PendingChange>,
    /// Increases with every change to the part of the members that is saved.
    pub revision: u64,
}

impl Members {
    /// Creates `count` free seats.
    pub fn new(count: u16, bots: Option<Bots>) -> Members {
        let (seats, changes) = (LiteMap::new(), Vec::new());
        Members { count, seats, bots, serial: 0, changes, revision: 0 }
    }

    pub fn join(
        &mut self,
        appearance: Appearance,
        claim: Option<Claim>,
        game: &Game,
    ) -> Result<Welcome, Refusal> {
        let seat = match claim {
            Some(claim) if self.is_good(claim) => claim.seat,
            Some(_) => return Err(Refusal::BadToken),
            None => {
                self.dismiss_bots(self.people() + 1, game);
                self.free_seat().ok_or(Refusal::RoomFull)?
            }
        };
        let appearance = self.distinct(&appearance, Some(seat), |seat| self.is_bot(seat));
        self.recolor_bot(appearance.color);
        self.revision += 1;
        self.serial += 1;
        match (claim, self.seats.get_mut(&seat)) {
            (Some(claim), Some(member)) => {
                member.resume(appearance, claim.serial, self.serial);
                self.note_look(seat);
            }
            _ => {
                let joined_tick = game.tick_count();
                let member = Member { joined_tick, ..Member::new(appearance, self.serial) };
                self.seats.insert(seat, member);
                self.changes.push(PendingChange::Join(seat));
            }
        }
        if let Some(member) = self.seats.get_mut(&seat) {
            member.intent.1 = game.tick_count();
        }
        Ok(Welcome { claim: Claim { seat, serial: self.serial }, resumed: claim.is_some() })
    }

    /// Changes a person's name and colour, made distinct as for a join. Does nothing if the seat is free or a bot's.
    pub fn change_look(&mut self, seat: Seat, wanted: &Appearance) {
        if self.is_bot(seat) || !self.seats.contains_key(&seat) {
            return;
        }
        let appearance = self.distinct(wanted, Some(seat), |other| self.is_bot(other));
        self.recolor_bot(appearance.color);
        if let Some(member) = self.seats.get_mut(&seat)
            && member.appearance != appearance
        {
            member.appearance = appearance;
            self.note_look(seat);
        }
    }

    pub fn is_bot(&self, seat: Seat) -> bool {
        self.bots.as_ref().is_some_and(|bots| bots.has(seat))
    }

    /// If a bot has this colour, gives the bot another one, so that people keep the colours they chose.
    fn recolor_bot(&mut self, color: u8) {
        let seats = self.seats.iter();
        let mut bots = seats.filter(|(seat, _)| self.is_bot(**seat));
        let Some((&seat, bot)) = bots.find(|(_, bot)| bot.appearance.color == color) else {
            return;
        };
        let next = Appearance { color: (color + 1) % COLORS, ..bot.appearance.clone() };
        let appearance = self.distinct(&next, Some(seat), |_| false);
        if let Some(bot) = self.seats.get_mut(&seat) {
            bot.appearance = appearance;
            self.note_look(seat);
        }
    }

    /// Announces a changed appearance in the next tick, once only.
    fn note_look(&mut self, seat: Seat) {
        if !self.changes.contains(&PendingChange::Look(seat)) {
            self.changes.push(PendingChange::Look(seat));
        }
    }

    fn is_good(&self, claim: Claim) -> bool {
        self.seats.get(&claim.seat).is_some_and(|member| member.answers_to(claim.serial))
    }

    pub fn disconnect(&mut self, seat: Seat, tick: u32) {
        let Some(member) = self.seats.get_mut(&seat) else { return };
        if !member.played {
            return self.leave(seat);
        }
        self.revision += 1;
        member.lost_tick.get_or_insert(tick);
        member.inputs.rest();
    }

    pub fn leave(&mut self, seat: Seat) {
        if !self.is_bot(seat) {
            self.remove(seat);
        }
    }

    pub fn dismiss_bot(&mut self, seat: Seat) -> bool {
        let people = self.people();
        let is_gone = self.bots.as_mut().is_some_and(|bots| bots.dismiss(seat, people));
        if is_gone {
            self.remove(seat);
        }
        is_gone
    }

    fn remove(&mut self, seat: Seat) {
        if self.seats.remove(&seat).is_none() {
            return;
        }
        self.revision += 1;
        self.changes.retain(|&change| change != PendingChange::Look(seat));
        // A player who leaves before the tick in which they would join was never in the game.
        match self.changes.iter().position(|&change| change == PendingChange::Join(seat)) {
            Some(index) => drop(self.changes.remove(index)),
            None => self.changes.push(PendingChange::Leave(seat)),
        }
    }

    pub fn input(&mut self, seat: Seat, seq: u32, input: Input, tick: u32) -> bool {
        let member = self.seats.get_mut(&seat).filter(|member| member.lost_tick.is_none());
        member.is_some_and(|member| {
            if member.serial_before.is_some() || !member.played {
                self.revision += 1;
            }
            member.serial_before = None;
            member.played = true;
            if member.intent.0 != input {
                member.intent = (input, tick);
            }
            member.inputs.push(seq, input)
        })
    }

    /// Seats whose players have been away for too long.
    pub fn abandoned(&self, tick: u32) -> Vec<Seat> {
        let is_over = |lost_tick| tick - lost_tick >= SEAT_HELD_TICKS;
        let members = self.seats.iter();
        let abandoned = members.filter(|(_, member)| member.lost_tick.is_some_and(is_over));
        abandoned.map(|(seat, _)| *seat).collect()
    }

    /// Removes bots that are not needed when there are this many people. Bots on the largest team leave first, so that
    /// the next player takes their place. A bot never keeps a person from a seat.
    fn dismiss_bots(&mut self, people: usize, game: &Game) {
        loop {
            let Some(bots) = &mut self.bots else { return };
            let is_full = people + bots.count() > usize::from(self.count);
            if !is_full && bots.count() <= bots.wanted(people) {
                return;
            }
            let Some(seat) = bots.remove(game) else { return };
            self.remove(seat);
        }
    }

    /// Makes bots join and leave to match the number that the scene wants.
    pub fn seat_bots(&mut self, game: &Game) {
        let people = self.people();
        self.dismiss_bots(people, game);
        let some_lack = |bots: &Bots| bots.count() < bots.wanted(people);
        while self.bots.as_ref().is_some_and(some_lack)
            && let Some(seat) = self.free_seat()
            && let Some(bots) = &mut self.bots
        {
            let look = bots.look();
            bots.add(seat);
            let appearance = self.distinct(&look, None, |_| false);
            self.revision += 1;
            self.serial += 1;
            self.seats.insert(seat, Member::new(appearance, self.serial));
            self.changes.push(PendingChange::Join(seat));
        }
    }

    /// Number of seats that people have taken, including held ones.
    pub fn people(&self) -> usize {
        self.seats.len() - self.bots.as_ref().map_or(0, Bots::count)
    }

    /// The players in the game. A player who joins in the next tick is recorded with that tick.
    pub fn looks(&self) -> Vec<(Seat, Appearance)> {
        let joins = |seat| self.changes.contains(&PendingChange::Join(seat));
        let mut looks = self.appearances();
        looks.retain(|&(seat, _)| !joins(seat));
        looks
    }

    /// Who holds which seat now.
    pub fn saved(&self) -> SavedMembers {
        let seats = self.seats.iter().map(|(&seat, member)| SavedSeat {
            seat: seat.0,
            serial: member.serial,
            serial_before: member.serial_before,
            joined_tick: member.joined_tick,
            lost_tick: member.lost_tick,
            is_bot: self.is_bot(seat),
        });
        SavedMembers {
            bots: self.bots.as_ref().map_or(0, |bots| bots.fill()),
            seats: seats.collect(),
        }
    }

    /// The lowest free seat.
    pub fn free_seat(&self) -> Option<Seat> {
        (0..self.count).map(Seat).find(|seat| !self.seats.contains_key(seat))
    }

    /// All members' names and colours, in seat order.
    pub fn appearances(&self) -> Vec<(Seat, Appearance)> {
        self.seats.iter().map(|(&seat, member)| (seat, member.appearance.clone())).collect()
    }

    /// Makes an appearance distinct from those of all members except the one at `own`. If the name is taken, a number
    /// is added to it. If the colour is taken, it becomes the next one that no connected player has; if all colours are
    /// taken, the requested one is shared. Seats for which `yields` is true give up their colours. A returning member
    /// at `own` avoids other absent members' colours where possible; otherwise members who all return after a server
    /// restart would swap colours.
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

    /// The lowest number, starting at 2, that is free for this name. It is found in a single pass over the names.
    fn free_number<'a>(&self, wanted: &Appearance, names: impl Iterator<Item = &'a str>) -> usize {
        // There is one more number than there are names, so they cannot all be taken; 0 and 1 are never used.
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
        let mut members = Members::new(12, None);
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
        let mut members = Members::new(40, None);
        let long = look("Twenty characters ab", 0);
        for seat in 0..40 {
            let look = members.distinct(&long, None, |_| false);
            let name = if seat == 0 { long.name.clone() } else { long.numbered(seat + 1).name };
            assert_eq!(look.name, name);
            members.seats.insert(Seat(seat as u16), Member::new(look, 0));
        }
    }

    #[test]
    fn a_player_who_takes_a_name_of_another_gets_a_number_too() {
        let mut members = members(&[(0, "Ann", 0), (1, "Bob", 1)]);
        members.change_look(Seat(1), &look("Ann", 0));
        members.change_look(Seat(1), &look("Ann", 0));
        members.change_look(Seat(5), &look("Eve", 4));
        let looks: Vec<_> = members.appearances().into_iter().map(|(_, look)| look).collect();
        assert_eq!(looks, [look("Ann", 0), look("Ann 2", 1)]);
        assert_eq!(members.changes, [PendingChange::Look(Seat(1))], "announced once");
    }

    #[test]
    fn a_taken_colour_gives_the_next_free_one() {
        let mut seated = members(&[(0, "A", 6), (1, "B", 7), (2, "C", 0)]);
        assert_eq!(seated.distinct(&look("D", 6), None, |_| false).color, 1);
        assert_eq!(seated.distinct(&look("A", 6), Some(Seat(0)), |_| false).color, 6);
        // A player without a socket does not keep newcomers from using the colour.
        seated.seats.get_mut(&Seat(1)).unwrap().lost_tick = Some(0);
        assert_eq!(seated.distinct(&look("D", 6), None, |_| false).color, 7);
    }

    #[test]
    fn players_who_all_come_back_keep_their_colours() {
        // All of them chose colour 6.
        let mut seated = members(&[(0, "A", 6), (1, "B", 7), (2, "C", 0)]);
        for (_, member) in seated.seats.iter_mut() {
            member.lost_tick = Some(0);
        }
        for (seat, color) in [(2, 0), (1, 7), (0, 6)] {
            let own = Seat(seat);
            assert_eq!(seated.distinct(&look("N", 6), Some(own), |_| false).color, color);
            seated.seats.get_mut(&own).unwrap().lost_tick = None;
        }
        // A player who picks a different, free colour gets it.
        seated.seats.get_mut(&Seat(1)).unwrap().lost_tick = Some(0);
        assert_eq!(seated.distinct(&look("N", 3), Some(Seat(1)), |_| false).color, 3);
        // A newcomer took the player's former colour. The colour of another absent player is avoided too.
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
