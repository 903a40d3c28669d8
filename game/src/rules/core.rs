//! The state of the rules, the order in which a tick evaluates them, and the phases of a round: waiting for players, a
//! countdown, the game itself, and a pause that shows the result.

use super::body_notes::BodyNotes;
use super::breakage::Breakage;
use super::clock::{Round, RoundPhase};
use super::context::RuleContext;
use super::signals::{SignalState, Signals};
use super::sling::Sling;
use super::verdict::{Claims, Teams};
use super::zones::{ZoneState, Zones};
use crate::input::{Buttons, Seat};
use crate::roster::Roster;
use crate::scene::{Condition, Levels, Scene};
use crate::side::Side;
use crate::{heroes, placing, tools};
use jostle_sim::{Rng, World};

/// Minimum number of ticks for which the result is shown.
const RESULT_TICKS: u32 = 60;

/// The state of a scene's rules.
#[derive(Clone, Debug)]
pub(crate) struct Rules {
    pub round: Round,
    /// Levels of the previous tick.
    pub levels: Levels,
    pub zones: Zones,
    pub(super) signals: Signals,
    pub teams: Teams,
    pub notes: BodyNotes,
    /// State of the sling, if the scene has one.
    pub(super) sling: Option<Sling>,
    pub(super) breakage: Breakage,
    /// Winners of the round that is over, or in which the others are still on their way to the goal.
    pub winners: Vec<Side>,
    /// Ticks of the round when it was won, in a round that goes on after that; 0 before.
    pub(super) won_at: u32,
    /// Generator that places the layouts.
    pub(super) layouts: Rng,
    /// Scratch memory for a tick.
    pub(super) claims: Claims,
}

impl Rules {
    /// Creates the rules of a game that has not begun; `None` if the scene has no rules.
    pub fn new(scene: &Scene, layouts: Rng) -> Option<Rules> {
        let set = &scene.rules;
        if !scene.has_rules() {
            return None;
        }
        let bodies = scene.bodies.len();
        let mut rules = Rules {
            round: Round::new(set.round.is_some()),
            levels: Levels::default(),
            zones: Zones::new(set.zones.len()),
            signals: Signals::new(set.signals.iter().map(SignalState::new).collect()),
            teams: Teams::new(scene),
            notes: BodyNotes::new(vec![false; bodies], vec![0; bodies]),
            sling: Sling::at_start(scene),
            breakage: Breakage { is_on: scene.has_breakables(), ..Breakage::default() },
            winners: Vec::new(),
            won_at: 0,
            layouts,
            claims: Claims::default(),
        };
        rules.settle(scene);
        Some(rules)
    }

    /// Sets the levels at the start of a round, when zones are empty and signals come on without an edge.
    fn settle(&mut self, scene: &Scene) {
        let levels = Levels { teams: self.teams.levels(), ..Levels::default() };
        self.zones.states.fill(ZoneState::default());
        self.sling = Sling::at_start(scene);
        self.levels = self.signals.settle(&scene.rules.signals, levels);
        self.notes.settle(scene, self.levels);
    }

    /// Starts a tick: the clock advances, and the levels of the previous tick take effect.
    pub fn begin_tick(&mut self, table: &mut RuleContext) {
        self.advance_clock(table);
        let stands_still = self.stands_still();
        self.notes.update_presence(self.levels, self.round.clock, stands_still, table);
        self.notes.observe(table.world, table.roster);
        if self.round.phase == RoundPhase::Countdown {
            for player in &mut table.roster.players {
                player.controls.stun = player.controls.stun.max(1);
            }
        }
    }

    /// Returns whether emitters, launchers and paths with this condition run in this tick.
    pub fn allows(&self, condition: &Condition) -> bool {
        condition.all(self.levels)
    }

    /// Before the step, operates the sling, and holds bodies that rest at their starts.
    pub fn hold_bodies(&mut self, table: &mut RuleContext) {
        let scene = table.scene;
        if let (Some(spec), Some(sling)) = (&scene.sling, &mut self.sling) {
            sling.work(spec, self.levels, self.round.is_running(), &mut self.notes, table);
        }
        self.notes.hold_resting(table);
    }

    /// The tick on its path that one of the scene's bodies should reach in this tick.
    pub fn path_tick(&self, body: usize) -> u32 {
        self.round.clock - self.notes.stood[body]
    }

    /// The current tick of the round as launchers count it, from 0; `None` while nothing moves.
    pub fn launch_tick(&self) -> Option<u32> {
        (!self.stands_still()).then(|| self.round.clock - 1)
    }

    /// Returns whether nothing moves in this tick.
    pub fn stands_still(&self) -> bool {
        self.round.phase == RoundPhase::Countdown
    }

    /// Evaluates the rules of a tick, after the step.
    pub fn play(&mut self, table: &mut RuleContext) {
        self.notes.follow_touches(table.world, table.roster);
        if !self.round.is_running() {
            return;
        }
        let before = self.levels;
        self.levels.sling = self.sling.map_or(0, |sling| sling.levels().sling);
        let shooter = self.sling.and_then(|sling| sling.shooter);
        self.breakage.update(&mut self.notes, &mut self.teams, shooter, table);
        self.levels.zones = self.zones.update(self.levels, &self.notes, table);
        self.levels = self.signals.update(self.levels, &self.zones.entered, table);
        self.apply(before, table);
        self.judge(table);
    }

    /// Ends the round if something decides it, and eliminates the sides that lost their last life.
    fn judge(&mut self, table: &mut RuleContext) {
        let Some(spec) = &table.scene.rules.round else { return };
        let ticks = self.round.ticks;
        // Winners who left cannot win.
        self.winners.retain(|&side| self.teams.playing(table.roster).any(|(it, _)| it == side));
        match self.claims.winners(spec, ticks, &self.teams, table.roster) {
            Some(winners) => {
                if self.winners.is_empty() {
                    self.reward_spare_shots(&winners, table);
                    (self.winners, self.won_at) = (winners, ticks);
                }
                if !self.claims.goes_on(spec, ticks, self.won_at) {
                    self.won_at = 0;
                    self.round.enter(RoundPhase::Over, 0);
                }
            }
            None => self.won_at = 0,
        }
        if spec.lives.is_some() {
            self.teams.all(table.roster).for_each(|side| side.out |= side.lives == 0);
            self.levels.teams = self.teams.levels();
        }
    }

    /// Rewards the winners for each shot left.
    fn reward_spare_shots(&mut self, winners: &[Side], table: &mut RuleContext) {
        let (Some(spec), Some(sling)) = (table.scene.sling, self.sling) else { return };
        for &side in winners {
            if let Some(standing) = self.teams.standing(side, table.roster) {
                standing.add_score(spec.spare.saturating_mul(i32::from(sling.shots)));
                standing.settle();
            }
        }
    }

    // --- Rounds ---------------------------------------------------------------------------------

    /// Advances the clock to this tick. When a new round begins, everything is placed again.
    fn advance_clock(&mut self, table: &mut RuleContext) {
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
            self.teams.count_in(table.scene, table.roster);
            self.levels.teams = self.teams.levels();
        }
    }

    /// Whether everything was placed again in this tick.
    pub fn begins_round(&self) -> bool {
        self.round.ticks == 1 && self.round.clock == 1
    }

    /// Handles the players' requests in this tick to change teams or to start the next round.
    pub fn take_wishes(&mut self, table: &mut RuleContext) {
        self.change_teams(table);
        let Some(spec) = &table.scene.rules.round else { return };
        if self.round.phase == RoundPhase::Over
            && self.round.ticks >= RESULT_TICKS
            && all_go_on(table.roster)
        {
            // The next round begins in the next tick.
            self.round.ticks = self.round.ticks.max(spec.pause);
        }
    }

    /// Moves players who press the team key to another team, along with their heroes. During a round, the new team
    /// must be one that is taking part.
    fn change_teams(&self, table: &mut RuleContext) {
        let RuleContext { scene, world, roster, .. } = table;
        if scene.rules.teams.len() < 2 {
            return;
        }
        for slot in 0..roster.players.len() {
            if !roster.players[slot].controls.pressed(Buttons::TEAM) {
                continue;
            }
            let is_open = |team: u8| {
                !self.round.is_running() || self.teams.standings[usize::from(team)].is_in()
            };
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

    /// Clears a seat's progress and zones, so that a new player does not inherit those of the previous one.
    pub fn forget(&mut self, seat: Seat) {
        self.zones.forget(Side::Player(seat));
        self.signals.forget(Side::Player(seat));
        if self.round.is_running() {
            self.winners.retain(|&side| side != Side::Player(seat));
        }
    }

    /// Removes everything except the players, and places everything anew as at the start of a game.
    fn restart(&mut self, phase: RoundPhase, table: &mut RuleContext) {
        let RuleContext { scene, world, roster, rngs, .. } = table;
        self.round.enter(phase, 1);
        self.round.clock = 1;
        self.winners.clear();
        self.won_at = 0;
        self.teams.count_in(scene, roster);
        self.settle(scene);
        roster.players.iter_mut().for_each(|player| player.begin_round());
        roster.placed.clear();
        roster.remove_matching(world, &|_| true);
        self.place(scene, world, roster);
        for slot in 0..roster.players.len() {
            heroes::spawn(world, roster, scene, slot, &mut rngs.spawn);
        }
    }

    /// Places the layouts, and those of the scene's bodies that exist from the start.
    pub fn place(&mut self, scene: &Scene, world: &mut World, roster: &mut Roster) {
        let mut rng = self.layouts.clone();
        placing::fill(world, roster, scene, &mut rng, |body| self.notes.came[body]);
        self.notes.note_placed(world, roster);
        if scene.rules.round.as_ref().is_some_and(|round| round.new_layouts) {
            self.layouts = rng;
        }
    }
}

/// Returns whether all players hold down the key for the next round, not counting players who are away.
fn all_go_on(roster: &Roster) -> bool {
    let mut present = roster.players.iter().filter(|player| !player.controls.is_away).peekable();
    present.peek().is_some() && present.all(|player| player.controls.holds(Buttons::AGAIN))
}
