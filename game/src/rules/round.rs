//! Rounds: waiting for players, a countdown, the game, and a pause with the result.

use super::book::{Rules, Table};
use super::clock::RoundPhase;
use super::memory::SignalState;
use crate::heroes;
use crate::input::{Buttons, Seat};
use crate::placing;
use crate::roster::Roster;
use crate::scene::Scene;
use crate::side::{Side, Standing};
use crate::tools;
use jostle_sim::World;

/// Ticks for which a result stands at least.
const RESULT_TICKS: u32 = 60;

impl Rules {
    /// Moves the clock on to this tick. A new round places everything again.
    pub fn advance_clock(&mut self, table: &mut Table) {
        self.round.ticks += 1;
        self.round.clock += u32::from(!self.stands_still());
        let Some(spec) = &table.scene.rules.round else { return };
        let players = table.roster.players.len();
        let enough = players >= usize::from(spec.players_min);
        let next = if enough { RoundPhase::Countdown } else { RoundPhase::Waiting };
        match self.round.phase {
            RoundPhase::Waiting if !enough => return,
            RoundPhase::Waiting => self.restart(next, table),
            _ if players == 0 => return self.restart(next, table),
            RoundPhase::Over if self.round.ticks > spec.pause => self.restart(next, table),
            _ => {}
        }
        if self.round.phase == RoundPhase::Countdown && self.round.ticks > spec.countdown {
            self.round.enter(RoundPhase::Running, 1);
            self.count_in(table.scene, table.roster);
        }
    }

    /// Whether everything was placed again in this tick.
    pub fn begins_round(&self) -> bool {
        self.round.ticks == 1 && self.round.clock == 1
    }

    /// Carries out the requests of players in this tick: for another team, or for the next round.
    pub fn take_wishes(&mut self, table: &mut Table) {
        self.change_teams(table);
        let Some(spec) = &table.scene.rules.round else { return };
        if self.round.phase == RoundPhase::Over
            && self.round.ticks >= RESULT_TICKS
            && all_go_on(table.roster)
        {
            // The next tick begins the next round.
            self.round.ticks = self.round.ticks.max(spec.pause);
        }
    }

    /// Players who press the key for it change over to another team, while a round is on to one that is in it.
    /// Their heroes come back there.
    fn change_teams(&self, table: &mut Table) {
        let Table { scene, world, roster, .. } = table;
        if scene.rules.teams.len() < 2 {
            return;
        }
        for slot in 0..roster.players.len() {
            if !roster.players[slot].pressed(Buttons::TEAM) {
                continue;
            }
            let is_open =
                |team: u8| !self.round.is_running() || self.teams[usize::from(team)].is_in();
            let Some(team) = roster.team_after(scene, slot, is_open) else { continue };
            let player = &mut roster.players[slot];
            tools::release(world, player);
            player.drop_carried(world);
            let seat = player.seat;
            roster.remove_matching(world, &|actor| actor.owner == Some(seat));
            let player = &mut roster.players[slot];
            (player.team, player.checkpoint) = (Some(team), None);
            player.hero_wait = heroes::RESPAWN_TICKS;
        }
    }

    /// A player who joins inherits no progress and no zone from the one who had the seat before.
    pub fn forget(&mut self, seat: Seat) {
        let own = Side::Player(seat);
        for zone in &mut self.zones {
            zone.holder.take_if(|holder| *holder == own);
            zone.taking.take_if(|(side, _)| *side == own);
        }
        for signal in &mut self.signals {
            if let SignalState::Order(order) = signal {
                order.done.retain(|(walker, _)| walker.side() != Some(own));
            }
        }
    }

    /// Removes all but the players and places everything as at the start of a game.
    fn restart(&mut self, phase: RoundPhase, table: &mut Table) {
        let Table { scene, world, roster, rngs, .. } = table;
        self.round.enter(phase, 1);
        self.round.clock = 1;
        self.winners.clear();
        self.count_in(scene, roster);
        self.settle(scene);
        roster.players.iter_mut().for_each(|player| player.begin_round());
        roster.placed.clear();
        roster.remove_matching(world, &|_| true);
        self.place(scene, world, roster);
        for slot in 0..roster.players.len() {
            heroes::spawn(world, roster, scene, slot, &mut rngs.spawn);
        }
    }

    /// Places the bodies of the scene that are there from the start, and the layouts.
    pub fn place(&mut self, scene: &Scene, world: &mut World, roster: &mut Roster) {
        let mut rng = self.layouts.clone();
        placing::fill(world, roster, scene, &mut rng, |body| self.came[body]);
        for (body, &id) in roster.placed.iter().enumerate() {
            if let Some(id) = id {
                self.notes.of(id, world).placed = Some(body);
            }
        }
        if scene.rules.round.as_ref().is_some_and(|round| round.new_layouts) {
            self.layouts = rng;
        }
    }

    /// Sides that have players now take part in the round that begins, without points.
    fn count_in(&mut self, scene: &Scene, roster: &mut Roster) {
        let lives = scene.rules.lives();
        let has_players = |team| roster.players.iter().any(|player| player.team == Some(team));
        for (index, team) in (0u8..).zip(&mut self.teams) {
            *team = Standing::at_start(lives, has_players(index));
        }
        self.update_teams();
        for player in &mut roster.players {
            player.standing = Standing::at_start(lives, true);
        }
        let sides = self.teams.iter().filter(|team| team.plays).count();
        self.contested = if self.teams.is_empty() { roster.players.len() } else { sides } > 1;
    }

    /// Notes which teams are in.
    pub(super) fn update_teams(&mut self) {
        let teams = self.teams.iter().enumerate().filter(|(_, team)| team.is_in());
        self.levels.teams = teams.fold(0, |all, (index, _)| all | 1 << index);
    }
}

/// Returns whether all players hold the key for the next round. Those who are away are not waited for.
fn all_go_on(roster: &Roster) -> bool {
    let mut present = roster.players.iter().filter(|player| !player.is_away).peekable();
    present.peek().is_some() && present.all(|player| player.holds(Buttons::AGAIN))
}
