//! The state of the rules, and the order in which a tick plays them.

use super::clock::{Round, RoundPhase};
use super::memory::{Broken, Changes, Claims, Lap, SignalState, Sling, ZoneState};
use super::notes::BodyNotes;
use crate::event::Event;
use crate::rngs::Rngs;
use crate::roster::Roster;
use crate::scene::{Condition, Levels, Scene};
use crate::side::{Side, Standing};
use jostle_sim::{Rng, World};

/// The state of a scene's rules.
#[derive(Clone, Debug)]
pub(crate) struct Rules {
    pub round: Round,
    /// Of the last tick.
    pub levels: Levels,
    pub(super) zones: Vec<ZoneState>,
    pub(super) signals: Vec<SignalState>,
    /// Of the teams; players without a team have theirs in the roster.
    pub teams: Vec<Standing>,
    pub notes: BodyNotes,
    /// Whether each body of the scene has come since its condition holds.
    pub(super) came: Vec<bool>,
    /// Ticks for which each body of the scene stood still on its path.
    pub(super) stood: Vec<u32>,
    /// In a scene that has one.
    pub(super) sling: Option<Sling>,
    /// Whether anything can break.
    pub(super) has_breakables: bool,
    /// Whether the round began with two sides or more.
    pub(super) contested: bool,
    /// Who won the round that is over.
    pub winners: Vec<Side>,
    /// Layouts are placed by it.
    pub(super) layouts: Rng,
    /// Scratch memory of a tick.
    pub(super) scratch: Scratch,
}

/// What a tick finds out on its way to the rules.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    pub zones: Changes,
    pub laps: Vec<Lap>,
    pub claims: Claims,
    pub broken: Vec<Broken>,
    pub standings: Vec<(Side, Standing)>,
}

/// What rules act on.
pub(crate) struct Table<'a> {
    pub scene: &'a Scene,
    pub world: &'a mut World,
    pub roster: &'a mut Roster,
    pub rngs: &'a mut Rngs,
    pub events: &'a mut Vec<Event>,
}

impl Rules {
    /// The rules of a game that has not begun; `None` where the scene has none.
    pub fn new(scene: &Scene, layouts: Rng) -> Option<Rules> {
        let set = &scene.rules;
        if !scene.has_rules() {
            return None;
        }
        let mut rules = Rules {
            round: Round::new(set.round.is_some()),
            levels: Levels::default(),
            zones: vec![ZoneState::default(); set.zones.len()],
            signals: set.signals.iter().map(SignalState::new).collect(),
            teams: vec![Standing::at_start(set.lives(), set.round.is_none()); set.teams.len()],
            notes: BodyNotes::default(),
            came: vec![false; scene.bodies.len()],
            stood: vec![0; scene.bodies.len()],
            sling: Sling::at_start(scene),
            has_breakables: scene.has_breakables(),
            contested: false,
            winners: Vec::new(),
            layouts,
            scratch: Scratch::default(),
        };
        rules.update_teams();
        rules.settle(scene);
        Some(rules)
    }

    /// Levels at the start of a round: zones are empty, and signals come on without an edge.
    pub(super) fn settle(&mut self, scene: &Scene) {
        self.levels = Levels { teams: self.levels.teams, ..Levels::default() };
        self.zones.fill(ZoneState::default());
        self.sling = Sling::at_start(scene);
        let signals = scene.rules.signals.iter().zip(&mut self.signals);
        for (index, (spec, state)) in signals.enumerate() {
            *state = SignalState::new(spec);
            if state.settle(spec, self.levels) {
                self.levels = self.levels.or(Levels::signal(index));
            }
        }
        let bodies = scene.bodies.iter().zip(&mut self.came);
        bodies.for_each(|(body, came)| *came = body.presence.all(self.levels));
        self.stood.fill(0);
    }

    /// The start of a tick: the clock moves on, and the levels of the last tick act.
    pub fn begin_tick(&mut self, table: &mut Table) {
        self.advance_clock(table);
        self.update_presence(table);
        self.notes.observe(table.world, table.roster);
        if self.round.phase == RoundPhase::Countdown {
            table.roster.players.iter_mut().for_each(|player| player.stun = player.stun.max(1));
        }
    }

    /// Returns whether emitters, launchers and paths with this condition run in this tick.
    pub fn allows(&self, condition: &Condition) -> bool {
        condition.all(self.levels)
    }

    /// The tick of its path that a body of the scene is to reach in this tick.
    pub fn path_tick(&self, body: usize) -> u32 {
        self.round.clock - self.stood[body]
    }

    /// The tick of the round that launchers go by, from 0; `None` while everything stands.
    pub fn launch_tick(&self) -> Option<u32> {
        (!self.stands_still()).then(|| self.round.clock - 1)
    }

    /// Returns whether nothing moves in this tick.
    pub fn stands_still(&self) -> bool {
        self.round.phase == RoundPhase::Countdown
    }

    /// Plays the rules of a tick, after the step.
    pub fn play(&mut self, table: &mut Table) {
        self.notes.follow_touches(table.world, table.roster);
        if !self.round.is_running() {
            return;
        }
        let before = self.levels;
        self.levels.sling = self.sling.map_or(0, |sling| sling.levels().sling);
        self.break_bodies(table);
        self.update_zones(table);
        self.update_signals(table);
        self.apply(before, table);
        self.judge(table);
    }
}
