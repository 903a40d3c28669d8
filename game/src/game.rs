//! The Game: a World and the rules of its scene.
//!
//! In each tick, steering changes velocities, the World steps, rules act on what it reports, tools
//! make new bodies, and particles move. The chapter instead moves its bodies kind by kind and solves
//! contacts last (B6).

use crate::event::Event;
use crate::input::{Input, Seat};
use crate::packs::PackTargets;
use crate::phase::Phase;
use crate::player::{self, Player};
use crate::rngs::{LAYOUT_STREAM, Rngs};
use crate::roster::Roster;
use crate::rules::{RoundInfo, RuleContext, Rules};
use crate::scene::{Condition, Kind, SEATS_MAX, Scene};
use crate::side::SideState;
use crate::{emitters, heroes, impacts, launchers, minions, packs, placing, platforms, tools};
use jostle_sim::Rng;
use jostle_sim::particles::quantise;
use jostle_sim::{BodyId, Shape, World};
use std::sync::Arc;

/// A body as seen by clients and traces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnapshotBody {
    /// Id of the body, whose kind, owner, group and shape never change.
    pub id: BodyId,
    /// Kind of the body, which decides who may move it.
    pub kind: Kind,
    /// The player who owns the body, if it is a hero or pack.
    pub owner: Option<Seat>,
    /// Collision group, as an index into the scene's groups.
    pub group: u8,
    /// Shape, centred on the body.
    pub shape: Shape,
    /// Centre, in quanta of the scene's world.
    pub quanta: [i32; 2],
}

/// Public facts about a player, for snapshots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayerInfo {
    /// Seat of the player.
    pub seat: Seat,
    /// The hero; `None` if the scene has no heroes or this one is about to respawn.
    pub hero: Option<BodyId>,
    /// The body selected by the player (A1.1).
    pub selected: Option<BodyId>,
    /// The body that the player holds.
    pub held: Option<BodyId>,
    /// The body that the hero carries.
    pub carried: Option<BodyId>,
    /// Number of hits scored with packs.
    pub score: u16,
    /// Pointer in quanta, which the hero's eyes follow.
    pub pointer: Option<[i32; 2]>,
}

/// A World together with the rules of its scene.
#[derive(Clone, Debug)]
pub struct Game {
    pub(crate) scene: Arc<Scene>,
    pub(crate) world: World,
    pub(crate) ticks: u32,
    pub(crate) roster: Roster,
    pub(crate) rngs: Rngs,
    /// The state of the rules, if the scene has any.
    pub(crate) rules: Option<Rules>,
    events: Vec<Event>,
    /// Joins and leaves since the previous tick.
    pub(crate) pending: Vec<Event>,
    /// Scratch memory for a tick.
    prey: PackTargets,
    hard_touches: Vec<u64>,
    nearby: Vec<BodyId>,
}

/// A function called after each phase of a tick.
type Watch<'a> = dyn FnMut(Phase, &mut World) + 'a;

impl Game {
    /// Creates a game without players at tick 0. The same scene and seed always give the same game.
    pub fn new(scene: Arc<Scene>, seed: u64) -> Game {
        let world = World::new(scene.world_settings());
        let mut layouts = Rng::new(seed, LAYOUT_STREAM);
        let rules = Rules::new(&scene, layouts.clone());
        let mut game = Game::of_parts(scene, world, Roster::default(), Rngs::new(seed), rules);
        let Game { scene, world, roster, rules, .. } = &mut game;
        match rules {
            Some(rules) => rules.place(scene, world, roster),
            None => placing::fill(world, roster, scene, &mut layouts, |_| true),
        }
        game
    }

    /// Creates a game at tick 0 from these parts.
    pub(crate) fn of_parts(
        scene: Arc<Scene>,
        world: World,
        roster: Roster,
        rngs: Rngs,
        rules: Option<Rules>,
    ) -> Game {
        Game {
            scene,
            world,
            ticks: 0,
            roster,
            rngs,
            rules,
            events: Vec::new(),
            pending: Vec::new(),
            prey: PackTargets::default(),
            hard_touches: Vec::new(),
            nearby: Vec::new(),
        }
    }

    /// The scene being played.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Whether a round began in this tick, so that everything was placed again.
    pub(crate) fn begins_round(&self) -> bool {
        self.rules.as_ref().is_some_and(Rules::begins_round)
    }

    /// Number of ticks played since the start of the game.
    pub fn tick_count(&self) -> u32 {
        self.ticks
    }

    /// Seats a player. If the scene has heroes, the player gets one, immediately if there is a clear position.
    /// Panics if the seat is taken or not below [`SEATS_MAX`].
    pub fn join(&mut self, seat: Seat) {
        assert!(usize::from(seat.0) < SEATS_MAX, "seat {} is past the last one", seat.0);
        let slot = match self.slot_of(seat) {
            Ok(_) => panic!("seat {} is taken", seat.0),
            Err(slot) => slot,
        };
        let Game { scene, world, roster, rngs, rules, .. } = self;
        if let Some(rules) = rules {
            rules.forget(seat);
        }
        let player = Player {
            seat,
            selected: roster.first_of(scene, Kind::Hero),
            team: roster.team_for(scene),
            standing: SideState::at_start(scene.rules.lives(), true),
            ..Player::default()
        };
        roster.players.insert(slot, player);
        heroes::spawn(world, roster, scene, slot, &mut rngs.spawn);
        self.pending.push(Event::Joined(seat));
    }

    /// Removes a player together with their hero and packs. Panics if the seat is empty.
    pub fn leave(&mut self, seat: Seat) {
        let slot = match self.slot_of(seat) {
            Ok(slot) => slot,
            Err(_) => panic!("seat {} is empty", seat.0),
        };
        let Game { world, roster, .. } = self;
        tools::release(world, &mut roster.players[slot]);
        roster.players[slot].drop_carried(world);
        roster.players.remove(slot);
        roster.remove_matching(world, &|actor| actor.owner == Some(seat));
        self.pending.push(Event::Left(seat));
    }

    /// The player's slot in the roster, or the slot where the player would be inserted.
    fn slot_of(&self, seat: Seat) -> Result<usize, usize> {
        self.roster.players.binary_search_by_key(&seat, |player| player.seat)
    }

    /// Plays one tick. `inputs` holds at most one entry per seat, in seat order. For a seat without an entry,
    /// no buttons are down.
    pub fn tick(&mut self, inputs: &[(Seat, Input)]) {
        self.run(inputs, &mut |_, _| {}, |world, _| world.step());
    }

    /// Plays a tick like [`Game::tick`], and calls `watch` after each phase. Changes made by `watch` are part of the
    /// tick.
    pub fn tick_watched(
        &mut self,
        inputs: &[(Seat, Input)],
        watch: &mut impl FnMut(Phase, &mut World),
    ) {
        self.run(inputs, watch, |world, watch| {
            world.step_watched(&mut |phase, world| watch(phase.into(), world));
        });
    }

    fn run(
        &mut self,
        inputs: &[(Seat, Input)],
        watch: &mut Watch,
        step: fn(&mut World, &mut Watch),
    ) {
        let ordered = inputs.windows(2).all(|pair| pair[0].0 < pair[1].0);
        debug_assert!(ordered, "inputs must be in seat order, one a seat");
        self.events.clear();
        self.roster.positions_tried = 0;
        if self.world.is_over_budget() {
            return;
        }
        self.events.append(&mut self.pending);
        self.begin_tick(inputs);
        watch(Phase::Inputs, &mut self.world);

        // Nothing moves until the round begins, and the world still lists the bodies that left it in the previous step.
        let steps = !self.rules.as_ref().is_some_and(Rules::stands_still);
        if steps {
            step(&mut self.world, watch);
        }
        if self.world.is_over_budget() {
            self.events.clear();
            return;
        }
        self.end_tick(steps);
        watch(Phase::Events, &mut self.world);
        self.world.step_particles();
        watch(Phase::Particles, &mut self.world);
        self.ticks += 1;
    }

    /// Does everything that comes before the step.
    fn begin_tick(&mut self, inputs: &[(Seat, Input)]) {
        let Game { scene, world, roster, rngs, events, prey, rules, .. } = self;
        let tick = self.ticks;
        if let Some(rules) = rules {
            rules.begin_tick(&mut RuleContext { scene, world, roster, rngs, events });
        }
        if let Some(listed) = &scene.listed {
            world.set_listed(rules.as_ref().is_none_or(|rules| rules.allows(listed)));
        }
        player::take_inputs(&mut roster.players, inputs, scene.size);
        if let Some(rules) = rules {
            rules.take_wishes(&mut RuleContext { scene, world, roster, rngs, events });
        }
        let path_tick = |body| rules.as_ref().map_or(tick + 1, |rules| rules.path_tick(body));
        platforms::drive(world, &roster.placed, scene, path_tick);
        minions::steer(world, &roster.actors, scene.minion_recovery);
        let teams = rules.as_ref().map_or(&[][..], |rules| &rules.teams.standings);
        heroes::spawn_due(world, roster, scene, teams, &mut rngs.spawn);
        heroes::thrust(world, &roster.players, scene);
        packs::steer(world, roster, scene, prey);
        tools::act_on_bodies(world, roster, scene, &mut rngs.agitate);
        if let Some(rules) = rules {
            heroes::keep_lanes(world, &roster.players, scene);
            rules.hold_bodies(&mut RuleContext { scene, world, roster, rngs, events });
        }
    }

    /// Does everything that comes after the step, if there was one.
    fn end_tick(&mut self, steps: bool) {
        let Game { scene, world, roster, rngs, events, prey, rules, .. } = self;
        let tick = self.ticks;
        impacts::report(world, scene, &mut self.hard_touches, events);
        if steps {
            heroes::report_departed(world, roster, events);
        }
        minions::turn(world, &mut roster.actors, scene.minion_recovery);
        packs::take_drift(world, &mut roster.actors, scene);
        packs::burst(world, roster, scene, prey, &mut rngs.emit, events);
        if let Some(rules) = rules {
            rules.play(&mut RuleContext { scene, world, roster, rngs, events });
        }
        tools::make(world, roster, scene, rngs, events, &mut self.nearby);
        let allows = |of: &Condition| rules.as_ref().is_none_or(|rules| rules.allows(of));
        if let Some(tick) = rules.as_ref().map_or(Some(tick), Rules::launch_tick) {
            launchers::work(world, roster, scene, prey, tick, allows);
        }
        emitters::start_due(world, scene, &roster.placed, tick, allows, &mut rngs.emit, events);
    }

    /// Whether a tick needed more than the scene's [`StepBudget`](jostle_sim::StepBudget). That tick was aborted,
    /// and no more ticks are played.
    pub fn is_over_budget(&self) -> bool {
        self.world.is_over_budget()
    }

    /// Events of the latest tick, preceded by the joins and leaves since the tick before it, in order.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Bodies in index order.
    pub fn bodies(&self) -> impl Iterator<Item = SnapshotBody> + '_ {
        self.roster.actors().map(|actor| SnapshotBody {
            id: actor.id,
            kind: actor.kind,
            owner: actor.owner,
            group: self.world.group(actor.id),
            shape: self.world.shape(actor.id),
            quanta: quantise(self.world.position(actor.id), self.scene.world.quantum),
        })
    }

    /// Publicly visible state of the rules; `None` in a scene without rules.
    pub fn round(&self) -> Option<RoundInfo> {
        let mut round = None;
        self.capture_round(&mut round);
        round
    }

    /// Stores [`Game::round`] in `round`, reusing its memory.
    pub fn capture_round(&self, round: &mut Option<RoundInfo>) {
        match &self.rules {
            Some(rules) => {
                let info = round.get_or_insert_default();
                info.capture(rules, &self.scene, &self.roster, self.ticks);
            }
            None => *round = None,
        }
    }

    /// The player's score: pack hits in a playground, or the points of the player's side (0 if negative) where there
    /// is a round or something is worth points.
    fn score_of(&self, player: &Player) -> u16 {
        let is_game = self.scene.rules.round.is_some() || self.scene.counts_points();
        let Some(rules) = self.rules.as_ref().filter(|_| is_game) else { return player.score };
        let team = player.team.map(|team| rules.teams.standings[usize::from(team)]);
        team.unwrap_or(player.standing).score.clamp(0, i32::from(u16::MAX)) as u16
    }

    /// Players in seat order.
    pub fn players(&self) -> impl Iterator<Item = PlayerInfo> + '_ {
        self.roster.players.iter().map(|player| PlayerInfo {
            seat: player.seat,
            hero: player.hero,
            selected: player.selected,
            held: player.held.map(|held| held.body),
            carried: player.carried.map(|carried| carried.body),
            score: self.score_of(player),
            pointer: player
                .controls
                .pointer
                .map(|pointer| quantise(pointer, self.scene.world.quantum)),
        })
    }
}
