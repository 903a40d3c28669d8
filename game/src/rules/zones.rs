//! Zones: who is in them, who came and who went, and who holds them.

use super::book::{Rules, Table};
use super::memory::ZoneState;
use crate::roster::Roster;
use crate::scene::{Levels, Need, Take, ZoneArea, ZoneSpec};
use crate::side::Side;
use glam::Vec2;
use jostle_sim::math::{clamp, max, min};
use jostle_sim::{BodyId, Shape, collide};

impl Rules {
    /// Who holds each zone.
    pub fn holders(&self) -> impl Iterator<Item = Option<Side>> {
        self.zones.iter().map(|zone| zone.holder)
    }

    /// Finds out who is in each zone.
    pub(super) fn update_zones(&mut self, table: &Table) {
        let mut changes = std::mem::take(&mut self.scratch.zones);
        changes.entered.clear();
        changes.left.clear();
        let specs = &table.scene.rules.zones;
        let mut on = Levels::default();
        for (index, spec) in (0u8..).zip(specs) {
            changes.inside.clear();
            let mut existing = 0;
            if spec.condition.all(self.levels) {
                existing = self.list_inside(spec, table, &mut changes.inside);
            }
            let count = changes.inside.len() as u32;
            let enough = match spec.need {
                Need::Count(need) => count >= need,
                Need::All => existing > 0 && count == existing,
            };
            if enough {
                on = on.or(Levels::zone(usize::from(index)));
            }
            let state = &mut self.zones[usize::from(index)];
            if let Some(take) = spec.take {
                state.update_holder(take, alone(&changes.inside, table.roster));
            }
            let came = changes.inside.iter().filter(|id| !has(&state.inside, **id));
            changes.entered.extend(came.map(|&id| (index, id)));
            let gone = state.inside.iter().filter(|id| !has(&changes.inside, **id));
            changes.left.extend(gone.map(|&id| (index, id)));
            std::mem::swap(&mut state.inside, &mut changes.inside);
        }
        self.levels.zones = on.zones;
        self.scratch.zones = changes;
    }

    /// Lists who is in a zone, and returns how many bodies of its groups exist.
    fn list_inside(&self, spec: &ZoneSpec, table: &Table, inside: &mut Vec<BodyId>) -> u32 {
        let world = &*table.world;
        let followed = match spec.follow {
            None => Some([Vec2::ZERO; 2]),
            Some(body) => table.roster.placed[body]
                .map(|id| [self.notes.position_before(id, world), world.position(id)]),
        };
        let mut existing = 0;
        for actor in table.roster.actors() {
            if spec.who >> world.group(actor.id) & 1 == 0 {
                continue;
            }
            existing += 1;
            let Some([before, now]) = followed else { continue };
            let slow = |limit| world.velocity(actor.id).length() < limit;
            if !spec.slower.is_none_or(slow) {
                continue;
            }
            let way = [
                self.notes.position_before(actor.id, world) - before,
                world.position(actor.id) - now,
            ];
            if is_in(spec, world.shape(actor.id), way) {
                inside.push(actor.id);
            }
        }
        existing
    }
}

impl ZoneState {
    fn update_holder(&mut self, take: Take, alone: Presence) {
        let side = match alone {
            Presence::One(side) => Some(side),
            Presence::Nobody | Presence::Several => None,
        };
        let before = self.taking.filter(|(taking, _)| Some(*taking) == side);
        self.taking = side.map(|side| (side, before.map_or(1, |(_, ticks)| ticks + 1)));
        if let Some((side, ticks)) = self.taking
            && ticks > take.ticks
        {
            self.holder = Some(side);
        }
        if !take.keep && self.holder != side {
            self.holder = None;
        }
    }
}

/// Whether a list in id order has a body.
fn has(inside: &[BodyId], id: BodyId) -> bool {
    let found = inside.binary_search_by_key(&id.index, |other| other.index);
    found.is_ok_and(|at| inside[at] == id)
}

/// Whose heroes are in a zone.
#[derive(Clone, Copy, PartialEq)]
enum Presence {
    Nobody,
    One(Side),
    Several,
}

fn alone(inside: &[BodyId], roster: &Roster) -> Presence {
    let owners = inside.iter().filter_map(|&id| roster.owner_of(id));
    let mut sides = owners.map(|seat| roster.side_of(seat));
    let Some(first) = sides.next() else { return Presence::Nobody };
    if sides.all(|side| side == first) { Presence::One(first) } else { Presence::Several }
}

/// Whether a body that went this way, relative to the zone, is in it at the end or came and went.
fn is_in(spec: &ZoneSpec, shape: Shape, [before, now]: [Vec2; 2]) -> bool {
    if contains(spec, shape, now) {
        return true;
    }
    // Who leaves in a tick does not count in it.
    !contains(spec, shape, before) && passes(spec, shape, before, now)
}

/// Whether a body at this position is in the zone.
fn contains(spec: &ZoneSpec, shape: Shape, position: Vec2) -> bool {
    let touches = |area, center| collide(shape, position, area, center, (0, 1)).is_some();
    match spec.area {
        ZoneArea::Everywhere => true,
        ZoneArea::Box(area) if spec.touch => {
            let half = (area.high - area.low) * 0.5;
            touches(Shape::Box { half }, area.low + half)
        }
        ZoneArea::Box(area) => area.contains(position),
        ZoneArea::Circle { center, radius } if spec.touch => {
            touches(Shape::Circle { radius }, center)
        }
        ZoneArea::Circle { center, radius } => {
            (position - center).length_squared() <= radius * radius
        }
    }
}

/// Whether a body in motion passes through the zone. Where its outline counts, the corners of a
/// rectangle count as if they were square.
fn passes(spec: &ZoneSpec, shape: Shape, from: Vec2, to: Vec2) -> bool {
    let reach = if spec.touch { shape.half_extent() } else { Vec2::ZERO };
    match spec.area {
        ZoneArea::Everywhere => true,
        ZoneArea::Box(area) => crosses(area.low - reach, area.high + reach, from, to),
        ZoneArea::Circle { center, .. } => contains(spec, shape, nearest_on(from, to, center)),
    }
}

/// Whether a way crosses a rectangle, by slabs.
fn crosses(low: Vec2, high: Vec2, from: Vec2, to: Vec2) -> bool {
    let way = to - from;
    let (mut enters, mut leaves) = (0.0, 1.0);
    for axis in 0..2 {
        let (low, high, from, way) = (low[axis], high[axis], from[axis], way[axis]);
        if way == 0.0 {
            if from < low || from > high {
                return false;
            }
            continue;
        }
        let (one, other) = ((low - from) / way, (high - from) / way);
        enters = max(enters, min(one, other));
        leaves = min(leaves, max(one, other));
    }
    enters <= leaves
}

/// The point of a way that is nearest to another point.
fn nearest_on(from: Vec2, to: Vec2, point: Vec2) -> Vec2 {
    let way = to - from;
    let length_squared = way.length_squared();
    if length_squared == 0.0 {
        return from;
    }
    from + way * clamp((point - from).dot(way) / length_squared, 0.0, 1.0)
}
