//! Zones as they are drawn: where the scene has them, with the colour of who holds them.

use super::Replica;
use crate::view::frame::{FrameBody, FrameZone};
use jostle_game::scene::{ZoneArea, ZoneSpec};
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
            let drawn = specs.filter(|(_, spec)| spec.is_drawn());
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
                let is_it = |b: &&FrameBody| b.kind == placed.kind && b.shape == placed.def.shape;
                self.bodies.iter().find(is_it)?.center
            }
        };
        let holder = round.holders.get(index).copied().flatten();
        let color = holder.map(|side| self.color_of_side(side)).or(spec.color);
        Some(FrameZone { shape, center: center + offset, color, on: round.zones >> index & 1 == 1 })
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
