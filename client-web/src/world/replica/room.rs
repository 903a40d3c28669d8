//! The room at the displayed moment, according to its snapshots: bodies, players and the round.

use crate::net::timeline::{Sample, Timeline};
use jostle_game::{Kind, RoundInfo, Scene, Seat, Side, Tools};
use jostle_protocol::{Appearance, PlayerState, Snapshot};
use jostle_sim::particles::dequantise;
use jostle_sim::short_sort::sort_few;
use jostle_sim::{BodyId, TICKS_PER_SECOND, Vec2};
use std::sync::Arc;

/// Assumed age of bodies that were in the replica's first snapshot, ticks.
pub const KNOWN_TICKS: f64 = 60.0 * TICKS_PER_SECOND as f64;

/// A room at the displayed moment.
pub struct RoomView {
    /// The scene being played.
    pub scene: Arc<Scene>,
    pub seat: Seat,
    /// The seats of bots, as far as the room has told.
    pub bots: Vec<Seat>,
    /// The seats of players whom this page's host has removed, until the picture shows that they left.
    pub removed: Vec<Seat>,
    pub(super) timeline: Timeline,
    /// The fractional tick on display.
    pub display: f64,
    /// Bodies at the displayed moment with their owners, in index order.
    pub samples: Vec<Sample>,
    /// Sampled centre and velocity of the player's hero before prediction moved it.
    pub(super) led_from: Option<(Vec2, Vec2)>,
    /// For each slot, the generation of its body and the tick of its birth, if known.
    births: Vec<(u32, f64)>,
}

impl RoomView {
    pub fn new(scene: Arc<Scene>, seat: Seat) -> RoomView {
        RoomView {
            timeline: Timeline::new(scene.world.quantum, scene.world.speed_max),
            scene,
            seat,
            bots: Vec::new(),
            removed: Vec::new(),
            display: 0.0,
            samples: Vec::new(),
            led_from: None,
            births: Vec::new(),
        }
    }

    /// Samples the bodies at a fractional tick.
    pub fn sample(&mut self, tick: f64) {
        self.timeline.sample(tick, &mut self.samples);
    }

    pub fn newest(&self) -> Option<&Snapshot> {
        self.timeline.newest()
    }

    /// The two newest stored snapshots, newest first.
    pub fn newest_two(&self) -> (Option<&Snapshot>, Option<&Snapshot>) {
        self.timeline.newest_two()
    }

    /// Players at the displayed moment, in seat order.
    pub fn players(&self) -> &[PlayerState] {
        self.timeline.at_or_before(self.display).map_or(&[], |s| &s.players)
    }

    /// Whether a bot has this seat.
    pub fn is_bot(&self, seat: Seat) -> bool {
        self.bots.contains(&seat)
    }

    /// Players at the displayed moment, ordered by score, best first.
    pub fn ranking(&self) -> Vec<&PlayerState> {
        let mut order: Vec<_> = self.players().iter().collect();
        sort_few(&mut order, |one, other| one.score > other.score);
        order
    }

    /// The round in the displayed snapshot, if there is one.
    pub fn round(&self) -> Option<&RoundInfo> {
        self.timeline.at_or_before(self.display)?.round.as_ref()
    }

    /// The colour of a player; in a team game, that of the team.
    pub fn color_of(&self, player: &PlayerState) -> u8 {
        self.team_color(player.seat).unwrap_or(player.appearance.color)
    }

    pub(super) fn team_color(&self, seat: Seat) -> Option<u8> {
        let team = self.round().and_then(|round| round.player(seat)?.team)?;
        Some(self.scene.rules.teams.get(usize::from(team))?.color)
    }

    /// The page's own player, once a displayed snapshot contains it.
    pub fn own(&self) -> Option<&PlayerState> {
        self.players().iter().find(|p| p.seat == self.seat)
    }

    /// The colour of the player or the player's team, once there is a snapshot.
    pub fn own_color(&self) -> Option<u8> {
        let own = self.own_look()?;
        let team = self.round().and_then(|round| round.player(self.seat)?.team);
        Some(team.map_or(own.color, |team| self.color_of_side(Side::Team(team))))
    }

    /// The player's appearance in the room, once there is a snapshot.
    pub fn own_look(&self) -> Option<&Appearance> {
        let own = self.players().iter().find(|player| player.seat == self.seat)?;
        Some(&own.appearance)
    }

    /// The colour of a side.
    pub fn color_of_side(&self, side: Side) -> u8 {
        match side {
            Side::Team(team) => {
                self.scene.rules.teams.get(usize::from(team)).map_or(0, |team| team.color)
            }
            Side::Player(seat) => {
                let player = self.players().iter().find(|player| player.seat == seat);
                player.map_or(0, |player| player.appearance.color)
            }
        }
    }

    /// The kind of the body that the player selected, in scenes with selection.
    pub fn selected_kind(&self) -> Option<Kind> {
        let selecting = self.scene.tools.contains(Tools::SELECT);
        let id = self.own()?.selected.filter(|_| selecting)?;
        self.sampled(id).map(|sample| sample.kind)
    }

    /// Centre and velocity of a player's hero at the displayed moment.
    pub fn hero_of(&self, seat: Seat) -> Option<(Vec2, Vec2)> {
        let hero = self.players().iter().find(|player| player.seat == seat)?.hero?;
        let sample = self.samples.iter().find(|sample| sample.id == hero)?;
        Some((sample.center, sample.velocity))
    }

    /// Position of the player's hero in the newest snapshot, regardless of the displayed moment.
    pub fn told_place(&self) -> Option<Vec2> {
        let newest = self.newest()?;
        let hero = newest.players.iter().find(|p| p.seat == self.seat)?.hero?;
        let body = newest.bodies.iter().find(|body| body.id == hero)?;
        Some(dequantise(body.quanta, self.scene.world.quantum))
    }

    /// The displayed position of a body.
    pub fn place(&self, id: BodyId) -> Option<Vec2> {
        self.sampled(id).map(|sample| sample.center)
    }

    /// The sample of a body at the most recently sampled moment.
    pub(super) fn sampled(&self, id: BodyId) -> Option<&Sample> {
        let place = self.samples.binary_search_by_key(&id.index, |s| s.id.index).ok()?;
        Some(&self.samples[place]).filter(|s| s.id == id)
    }

    pub(super) fn is_hero(&self, id: BodyId) -> bool {
        self.sampled(id).is_some_and(|s| s.kind == Kind::Hero)
    }

    pub(super) fn owner(&self, id: BodyId) -> Option<Seat> {
        self.sampled(id).and_then(|s| s.owner)
    }

    /// The position of one of the scene's bodies. Snapshots do not identify these, so this is the first body that looks
    /// like it.
    pub(super) fn find_placed(&self, body: usize) -> Option<Vec2> {
        let placed = &self.scene.bodies[body];
        let is_it = |sample: &&Sample| {
            (sample.kind, sample.group, sample.shape)
                == (placed.kind, placed.def.group, placed.def.shape)
        };
        self.samples.iter().find(is_it).map(|sample| sample.center)
    }

    /// Whether a body did not exist when births were last recorded.
    pub(super) fn is_new(&self, id: BodyId) -> bool {
        self.births.get(id.index as usize).is_none_or(|birth| birth.0 != id.generation)
    }

    /// Records this tick as the birth of every sampled body whose birth is not known yet; a new generation in a slot
    /// starts over.
    pub(super) fn note_births(&mut self, tick: f64) {
        for sample in &self.samples {
            let (slot, generation) = (sample.id.index as usize, sample.id.generation);
            if self.births.len() <= slot {
                self.births.resize(slot + 1, (u32::MAX, 0.0));
            }
            if self.births[slot].0 != generation {
                self.births[slot] = (generation, tick);
            }
        }
    }

    /// Seconds from a body's birth to the displayed tick, or an assumed age if its birth is unknown.
    pub(super) fn age(&self, id: BodyId) -> f32 {
        let birth = self.births.get(id.index as usize).filter(|birth| birth.0 == id.generation);
        let born = birth.map_or(self.display - KNOWN_TICKS, |birth| birth.1);
        ((self.display - born).max(0.0) / f64::from(TICKS_PER_SECOND)) as f32
    }
}
