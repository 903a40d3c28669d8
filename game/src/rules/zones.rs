//! Keeps track of which bodies are inside zones, which entered and left, and who holds each zone.

use super::body_notes::BodyNotes;
use super::context::RuleContext;
use crate::roster::Roster;
use crate::scene::{Levels, Need, Take, ZoneArea, ZoneSpec};
use crate::side::Side;
use glam::Vec2;
use jostle_sim::math::{clamp, max, min};
use jostle_sim::{BodyId, Shape, collide};

/// The zones of a scene, and who entered and left them in this tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct Zones {
    pub(super) states: Vec<ZoneState>,
    /// Zones in file order, bodies in id order.
    pub(super) entered: Vec<(u8, BodyId)>,
    pub(super) left: Vec<(u8, BodyId)>,
    /// Scratch memory for the bodies that are currently in a zone.
    inside: Vec<BodyId>,
}

/// State of a zone.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ZoneState {
    /// Bodies that were inside in the previous tick, in id order.
    pub inside: Vec<BodyId>,
    pub holder: Option<Side>,
    /// The side that is alone in the zone, and the number of ticks for which it has been.
    pub taking: Option<(Side, u32)>,
}

impl Zones {
    /// Creates this many empty zones.
    pub fn new(count: usize) -> Zones {
        Zones { states: vec![ZoneState::default(); count], ..Zones::default() }
    }

    /// The holder of each zone.
    pub fn holders(&self) -> impl Iterator<Item = Option<Side>> {
        self.states.iter().map(|zone| zone.holder)
    }

    /// Each zone that a side is about to take, with that side and the number of ticks for which it has been alone
    /// there.
    pub fn takings(&self) -> impl Iterator<Item = (u8, Side, u32)> {
        (0..).zip(&self.states).filter_map(|(zone, state)| {
            let (side, alone) = state.taking?;
            (state.holder != Some(side)).then_some((zone, side, alone))
        })
    }

    /// Removes a side from the zones that it holds or is about to take.
    pub fn forget(&mut self, side: Side) {
        for zone in &mut self.states {
            zone.holder.take_if(|holder| *holder == side);
            zone.taking.take_if(|(taking, _)| *taking == side);
        }
    }

    /// Finds out who is in each zone, and returns one bit for each zone that is on.
    pub fn update(&mut self, levels: Levels, notes: &BodyNotes, table: &RuleContext) -> u64 {
        let Zones { states, entered, left, inside } = self;
        entered.clear();
        left.clear();
        let mut on = 0;
        for ((index, spec), state) in (0u8..).zip(&table.scene.rules.zones).zip(states) {
            inside.clear();
            let mut existing = 0;
            if spec.condition.all(levels) {
                existing = list_inside(spec, notes, table, inside);
            }
            let count = inside.len() as u32;
            let enough = match spec.need {
                Need::Count(need) => count >= need,
                Need::All => existing > 0 && count == existing,
            };
            on |= u64::from(enough) << index;
            if let Some(take) = spec.take {
                state.update_holder(take, alone(inside, table.roster));
            }
            let came = inside.iter().filter(|id| !has(&state.inside, **id));
            entered.extend(came.map(|&id| (index, id)));
            let gone = state.inside.iter().filter(|id| !has(inside, **id));
            left.extend(gone.map(|&id| (index, id)));
            std::mem::swap(&mut state.inside, inside);
        }
        on
    }
}

/// Lists the bodies in a zone, and returns how many bodies of its groups exist.
// When inlined into its caller, the loop compiles to slower code.
#[inline(never)]
fn list_inside(
    spec: &ZoneSpec,
    notes: &BodyNotes,
    table: &RuleContext,
    inside: &mut Vec<BodyId>,
) -> u32 {
    let world = &*table.world;
    let way = |id| [notes.position_before(id, world), world.position(id)];
    let followed = match spec.follow {
        None => Some([Vec2::ZERO; 2]),
        Some(body) => table.roster.placed[body].map(way),
    };
    let mut existing = 0;
    for actor in table.roster.actors() {
        if spec.who >> world.group(actor.id) & 1 == 0 {
            continue;
        }
        existing += 1;
        let Some(followed) = followed else { continue };
        let slow = |limit| world.velocity(actor.id).length() < limit;
        if !spec.slower.is_none_or(slow) {
            continue;
        }
        let [before, now] = way(actor.id);
        if is_in(spec, world.shape(actor.id), [before - followed[0], now - followed[1]]) {
            inside.push(actor.id);
        }
    }
    existing
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

/// Whether a list sorted by id contains a body.
fn has(inside: &[BodyId], id: BodyId) -> bool {
    let found = inside.binary_search_by_key(&id.index, |other| other.index);
    found.is_ok_and(|at| inside[at] == id)
}

/// The sides whose heroes are in a zone.
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

/// Whether a body that moved from `before` to `now`, relative to the zone, ended up inside it or passed through it.
#[inline(never)]
fn is_in(spec: &ZoneSpec, shape: Shape, [before, now]: [Vec2; 2]) -> bool {
    if contains(spec, shape, now) {
        return true;
    }
    // A body that leaves does not count as inside in the same tick.
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

/// Whether a moving body passes through the zone. If its outline counts, the corners of a rectangle are treated as
/// square.
fn passes(spec: &ZoneSpec, shape: Shape, from: Vec2, to: Vec2) -> bool {
    let reach = if spec.touch { shape.half_extent() } else { Vec2::ZERO };
    match spec.area {
        ZoneArea::Everywhere => true,
        ZoneArea::Box(area) => crosses(area.low - reach, area.high + reach, from, to),
        ZoneArea::Circle { center, .. } => contains(spec, shape, nearest_on(from, to, center)),
    }
}

/// Whether a path crosses a rectangle, determined by the slab test.
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

/// The point on a path nearest to another point.
fn nearest_on(from: Vec2, to: Vec2, point: Vec2) -> Vec2 {
    let way = to - from;
    let length_squared = way.length_squared();
    if length_squared == 0.0 {
        return from;
    }
    from + way * clamp((point - from).dot(way) / length_squared, 0.0, 1.0)
}
