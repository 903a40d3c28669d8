//! The part of a snapshot that describes the rules.

use super::clock::RoundPhase;
use super::core::Rules;
use super::sling::Sling;
use crate::input::{Buttons, Seat};
use crate::player::Player;
use crate::roster::Roster;
use crate::scene::{Scene, ZoneSpec};
use crate::side::{Side, SideState};

/// The state of the rules that players can see.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RoundInfo {
    /// Phase of the round.
    pub phase: RoundPhase,
    /// Number of ticks played before this phase began.
    pub since: u32,
    /// The teams, in file order.
    pub teams: Vec<SideInfo>,
    /// The players, in seat order.
    pub players: Vec<RoundPlayer>,
    /// The winners, once the round is won, which may be before it is over.
    pub winners: Vec<Side>,
    /// Holder of each zone, in file order.
    pub holders: Vec<Option<Side>>,
    /// Zones that are in force and drawn, one bit each.
    pub zones: u64,
    /// Zones that are drawn but not in force, one bit each.
    pub resting: u64,
    /// Sides that are about to take a zone, in zone order.
    pub takings: Vec<Taking>,
    /// The players' progress in the orders, in file order.
    pub orders: Vec<OrderProgress>,
    /// State of the sling, if the scene has one.
    pub sling: Option<SlingInfo>,
    /// Indices of the cracked bodies, ascending.
    pub cracked: Vec<u32>,
}

/// A side that is alone in a zone which it does not hold yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taking {
    /// Index of the zone.
    pub zone: u8,
    /// The player or team that is taking the zone.
    pub side: Side,
    /// Number of ticks played before the side was alone in the zone.
    pub since: u32,
}

/// Completed steps in an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderProgress {
    /// Index of the signal.
    pub signal: u8,
    /// The side that completed them; `None` for all players together.
    pub side: Option<Side>,
    /// Number of steps, at least 1.
    pub steps: u8,
}

/// State of a sling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlingInfo {
    /// Shots left, including the one in the sling.
    pub shots: u8,
    /// Whether the ball is flying.
    pub is_flying: bool,
}

/// A side's standing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SideInfo {
    /// Points in this round.
    pub score: i32,
    /// Lives left; 0 in a scene without lives.
    pub lives: i32,
    /// Whether the side is taking part and can still win.
    pub is_in: bool,
}

/// A player's state in the round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoundPlayer {
    /// Seat of the player.
    pub seat: Seat,
    /// The team, in a scene with teams.
    pub team: Option<u8>,
    /// The player's standing, in a scene without teams.
    pub side: SideInfo,
    /// Whether the player's keys do nothing.
    pub is_stunned: bool,
    /// Whether the player has dismissed the result and waits for the next round.
    pub goes_on: bool,
}

fn refill<T>(list: &mut Vec<T>, with: impl Iterator<Item = T>) {
    list.clear();
    list.extend(with);
}

impl RoundInfo {
    /// Fills in what players see of the rules after this many ticks.
    pub(crate) fn capture(&mut self, rules: &Rules, scene: &Scene, roster: &Roster, ticks: u32) {
        let Rules { round, levels, .. } = rules;
        let zones = (0..64u64).zip(&scene.rules.zones);
        let drawn = zones.filter(|(_, zone)| zone.is_drawn());
        let mask = |all: u64, (index, _): (u64, &ZoneSpec)| all | 1 << index;
        let resting = drawn.clone().filter(|(_, zone)| !zone.condition.all(*levels));
        self.phase = round.phase;
        self.since = ticks - round.ticks.min(ticks);
        self.zones = levels.zones & drawn.fold(0, mask);
        self.resting = resting.fold(0, mask);
        refill(&mut self.teams, rules.teams.standings.iter().map(SideInfo::of));
        let is_over = round.phase == RoundPhase::Over;
        let players = roster.players.iter();
        refill(&mut self.players, players.map(|player| RoundPlayer::of(player, is_over)));
        refill(&mut self.winners, rules.winners.iter().copied());
        refill(&mut self.holders, rules.zones.holders());
        // Zones are inactive except while a round is running.
        let takings = rules.zones.takings().filter(|_| round.is_running());
        let since = |alone: u32| ticks - alone.min(ticks);
        let taking = |(zone, side, alone)| Taking { zone, side, since: since(alone) };
        refill(&mut self.takings, takings.map(taking));
        let orders = rules.signals.progress();
        let progress = |(signal, side, steps)| OrderProgress { signal, side, steps };
        refill(&mut self.orders, orders.map(progress));
        let sling = |sling: Sling| SlingInfo { shots: sling.shots, is_flying: sling.flight > 0 };
        self.sling = rules.sling.map(sling);
        let is_cracked = |id| rules.notes.get(id).is_some_and(|note| note.is_cracked);
        let bodies = roster.actors().map(|actor| actor.id);
        let cracked = bodies.filter(|&id| rules.breakage.is_on && is_cracked(id));
        refill(&mut self.cracked, cracked.map(|id| id.index));
    }

    /// Steps of an order that a side has completed; `None` for all players together.
    pub fn steps(&self, signal: u8, side: Option<Side>) -> u8 {
        let found = self.orders.iter().find(|order| (order.signal, order.side) == (signal, side));
        found.map_or(0, |order| order.steps)
    }

    /// A side's standing, if the side exists.
    pub fn side(&self, side: Side) -> Option<SideInfo> {
        match side {
            Side::Team(team) => self.teams.get(usize::from(team)).copied(),
            Side::Player(seat) => self.player(seat).map(|player| player.side),
        }
    }

    /// A player's state in the round.
    pub fn player(&self, seat: Seat) -> Option<&RoundPlayer> {
        let index = self.players.binary_search_by_key(&seat, |player| player.seat).ok()?;
        Some(&self.players[index])
    }

    /// The side of a player.
    pub fn side_of(&self, seat: Seat) -> Side {
        let team = self.player(seat).and_then(|player| player.team);
        team.map_or(Side::Player(seat), Side::Team)
    }
}

impl RoundPlayer {
    fn of(player: &Player, is_over: bool) -> RoundPlayer {
        RoundPlayer {
            seat: player.seat,
            team: player.team,
            side: SideInfo::of(&player.standing),
            is_stunned: player.controls.stun > 0,
            goes_on: is_over && player.controls.holds(Buttons::AGAIN),
        }
    }
}

impl SideInfo {
    fn of(standing: &SideState) -> SideInfo {
        let SideState { score, lives, .. } = *standing;
        SideInfo { score, lives, is_in: standing.is_in() }
    }
}
