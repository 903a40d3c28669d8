//! Zones as they are drawn: where the scene has them, with the colour of who holds them.

use super::Replica;
use crate::net::timeline::Sample;
use crate::view::frame::{FrameZone, ZoneLabel};
use jostle_game::scene::{Each, Need, Step, ZoneArea, ZoneSpec};
use jostle_game::{RoundInfo, Side};
use jostle_protocol::Appearance;
use jostle_sim::{Shape, Vec2};

impl Replica {
    /// Lists the zones of the displayed moment.
    pub(super) fn lay_out_zones(&mut self) {
        let mut zones = std::mem::take(&mut self.zones);
        zones.clear();
        if let Some(round) = self.round() {
            let specs = self.scene.rules.zones.iter().enumerate();
            let drawn =
                specs.filter(|(index, spec)| spec.is_drawn() && round.resting >> index & 1 == 0);
            zones.extend(drawn.filter_map(|(index, spec)| self.zone(index, spec, round)));
        }
        self.zones = zones;
    }

    fn zone(&self, index: usize, spec: &ZoneSpec, round: &RoundInfo) -> Option<FrameZone> {
        let (shape, center) = outline(spec.area)?;
        // Where a zone follows a body, its place is relative to it.
        let offset = match spec.follow {
            None => Vec2::ZERO,
            Some(body) => {
                let placed = &self.scene.bodies[body];
                let is_it = |sample: &&Sample| {
                    (sample.kind, sample.group) == (placed.kind, placed.def.group)
                        && sample.shape == placed.def.shape
                };
                self.samples.iter().find(is_it)?.center
            }
        };
        let holder = round.holders.get(index).copied().flatten();
        let mut color = holder.map(|side| self.color_of_side(side)).or(spec.color);
        let mut on = round.zones >> index & 1 == 1;
        if self.is_next(index as u8, round) {
            (color, on) = (self.own_color().or(color), true);
        }
        let taken = self.taken(index as u8, spec, round);
        Some(FrameZone { index: index as u8, shape, center: center + offset, color, on, taken })
    }

    /// The labels of the zones of the displayed moment: their text, and how many of how many are in, where a
    /// zone needs several.
    pub fn zone_labels(&self) -> impl Iterator<Item = ZoneLabel> {
        self.zones.iter().filter_map(|zone| {
            let spec = &self.scene.rules.zones[usize::from(zone.index)];
            let (mut text, count) = (spec.label.clone(), self.count_in(spec));
            if let Some((inside, needed)) = count {
                text = format!("{text} {inside} / {needed}");
            }
            let half = zone.shape.half_extent();
            let color = zone.color;
            (!text.is_empty()).then_some(ZoneLabel { text, center: zone.center, half, color })
        })
    }

    /// How many bodies are in a zone, and how many it needs, where that is more than one.
    fn count_in(&self, spec: &ZoneSpec) -> Option<(usize, usize)> {
        let counted = self.samples.iter().filter(|sample| spec.who >> sample.group & 1 == 1);
        let needed = match spec.need {
            Need::All => counted.clone().count(),
            Need::Count(needed) => needed as usize,
        };
        let inside = counted.filter(|sample| spec.follow.is_none() && spec.holds(sample.center));
        (needed > 1).then(|| (inside.count(), needed))
    }

    /// Returns whether a zone is the next step of the own player, or of the player's team, in an order such as
    /// a lap. An order that all take together may be there to be found out.
    fn is_next(&self, zone: u8, round: &RoundInfo) -> bool {
        let signals = (0..).zip(&self.scene.rules.signals);
        signals.filter_map(|(index, signal)| signal.order().map(|order| (index, order))).any(
            |(index, order)| {
                let side = match order.each {
                    Each::All => return false,
                    Each::Side => round.side_of(self.seat),
                    Each::Player => Side::Player(self.seat),
                };
                let next = order.steps.get(usize::from(round.steps(index, Some(side))));
                next == Some(&Step::Zone(zone))
            },
        )
    }

    /// Who is taking a zone, and how much of the time for that has passed.
    fn taken(&self, zone: u8, spec: &ZoneSpec, round: &RoundInfo) -> Option<(u8, f32)> {
        let taking = round.takings.iter().find(|taking| taking.zone == zone)?;
        let ticks = self.display - f64::from(taking.since);
        let share = ticks / f64::from(spec.take?.ticks.max(1));
        Some((self.color_of_side(taking.side), share.clamp(0.0, 1.0) as f32))
    }

    /// The colour of the own player, or of the player's team, once there is a snapshot.
    pub fn own_color(&self) -> Option<u8> {
        let own = self.own_look()?;
        let team = self.round().and_then(|round| round.player(self.seat)?.team);
        Some(team.map_or(own.color, |team| self.color_of_side(Side::Team(team))))
    }

    /// How the room has the own player look, once there is a snapshot.
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
}

/// Shape and centre of an area; nothing if it is everywhere.
fn outline(area: ZoneArea) -> Option<(Shape, Vec2)> {
    match area {
        ZoneArea::Everywhere => None,
        ZoneArea::Box(area) => {
            let half = (area.high - area.low) * 0.5;
            Some((Shape::Box { half }, area.low + half))
        }
        ZoneArea::Circle { center, radius } => Some((Shape::Circle { radius }, center)),
    }
}
