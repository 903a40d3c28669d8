//! Broad phase: the sorted list of pairs that may come into contact, with the impulses that they
//! carry from step to step.
//!
//! The list is a pure accelerator. Every box in it is grown by a margin, so that the list stays
//! valid while bodies stay in their grown boxes; which of its pairs take part in a step is decided
//! anew each step by an exact test. When and how the list is made therefore cannot change a bit of
//! the result.
//!
//! Moving bodies are sorted along x and swept. In a world that sleeps, those that do not move are not
//! among them: they lie in a grid (`still`), which whoever moves asks who is near.

mod still;

use crate::bodies::Bodies;
use crate::body::GROUPS_MAX;
use crate::contact::{self, Contact};
use crate::features::CAN;
use crate::math::{max, min, ordered_bits};
use crate::shape::Aabb;
use glam::Vec2;
use still::Still;

/// Smallest growth of a box in the list, world units.
const MARGIN: f32 = 0.4;
/// Growth of the box of a body that lies still, beyond its reach, world units.
const STILL_MARGIN: f32 = 0.1;

/// The axis of the face of a box that pressed on the other body in the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Axis {
    /// None did, or the solver does not ask.
    #[default]
    Free,
    X,
    Y,
}

/// Two bodies that are close, `a` < `b` by slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    pub a: u32,
    pub b: u32,
    /// Normal impulse that held the two apart at rest in the last step, not negative.
    pub normal_impulse: f32,
    /// Friction impulse that went with it, along the normal turned left.
    pub tangent_impulse: f32,
    /// Kept where `normal_impulse` is positive, else free.
    pub axis: Axis,
    /// Normal along which this step's warm start pushed; scratch of a step, no state.
    pub warm_normal: Vec2,
}

impl Pair {
    fn key(&self) -> u64 {
        u64::from(self.a) << 32 | u64::from(self.b)
    }

    /// Forgets what the two gave each other.
    pub fn forget(&mut self) {
        self.normal_impulse = 0.0;
        self.tangent_impulse = 0.0;
        self.axis = Axis::Free;
    }
}

/// Which bodies may pair at all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filter<'a> {
    /// Per group, the groups that it meets.
    pub meets: &'a [u32; GROUPS_MAX],
    /// Two bodies that nothing can push also pair: contacts are only detected.
    pub immovable: bool,
}

/// The list; see the module's description.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairList {
    /// Sorted by (a, b).
    pub pairs: Vec<Pair>,
    /// By slot: the grown box for which `pairs` is complete.
    fat: Vec<Aabb>,
    /// Bodies came since the list was made, or were put elsewhere.
    stale: bool,
    /// In a world that sleeps, all that is alive and not in the moving list.
    still: Option<Still>,
    /// Scratch: slots sorted by lower edge, keys of the pairs found, the list before.
    order: Vec<u64>,
    keys: Vec<u64>,
    before: Vec<Pair>,
}

impl PairList {
    /// An empty list, of a world that sleeps or of one that never does.
    pub fn new(sleeping: bool) -> PairList {
        PairList { still: sleeping.then(Still::default), ..PairList::default() }
    }

    /// In a world that sleeps: a body left the moving list, or one came that does not move.
    pub fn lay(&mut self, slot: u32, bodies: &Bodies) {
        let Some(still) = &mut self.still else { return };
        let index = slot as usize;
        self.fat.resize(bodies.alive.len(), NOWHERE);
        let fat = bodies.bounds(index, bodies.reach[index] + STILL_MARGIN);
        // The list is complete for the box as it was.
        let within = self.fat[index].contains(fat.low) && self.fat[index].contains(fat.high);
        self.stale |= !within;
        self.fat[index] = fat;
        still.put(slot, &fat);
    }

    /// In a world that sleeps: a body that lay still moves, or goes.
    pub fn lift(&mut self, slot: u32) {
        if self.still.as_mut().is_some_and(|still| still.take(slot)) {
            self.stale = true;
        }
    }

    /// Brings pairs that were pushed to the end of the list to their places; of two the one with an
    /// impulse stays.
    pub fn merge(&mut self) {
        self.pairs.sort_by_key(|pair| (pair.key(), pair.normal_impulse <= 0.0));
        self.pairs.dedup_by_key(|pair| pair.key());
        self.stale = true;
    }

    /// Shows who lies still near a body, in no particular order.
    pub fn near_still(&self, slot: u32, bodies: &Bodies, mut show: impl FnMut(u32)) {
        let Some(still) = &self.still else { return };
        let bounds = bodies.bounds(slot as usize, bodies.reach[slot as usize] + STILL_MARGIN);
        still.around(&bounds, |other| {
            if other != slot && near(bodies, slot, other) {
                show(other);
            }
        });
    }

    /// A body was added, or one outside the moving list was placed elsewhere.
    pub fn invalidate(&mut self) {
        self.stale = true;
    }

    /// A body was removed: its pairs go at once, so that a new body in the slot inherits nothing.
    pub fn removed(&mut self, slot: u32) {
        self.pairs.retain(|pair| pair.a != slot && pair.b != slot);
    }

    /// Makes the list complete for the bodies where they are now; whether it was made anew.
    pub fn refresh(&mut self, bodies: &Bodies, filter: Filter) -> bool {
        let outgrown = self.stale || self.outgrown(bodies);
        if outgrown {
            self.rebuild(bodies, filter);
        }
        outgrown
    }

    /// Whether a body's reach left the box for which the list is complete.
    fn outgrown(&self, bodies: &Bodies) -> bool {
        bodies.moving.iter().any(|&slot| {
            let slot = slot as usize;
            let reach = bodies.bounds(slot, bodies.reach[slot]);
            let fat = &self.fat[slot];
            !(fat.contains(reach.low) && fat.contains(reach.high))
        })
    }

    /// Sort and sweep along the axis on which the bodies are spread out further.
    fn rebuild(&mut self, bodies: &Bodies, filter: Filter) {
        let axis = long_axis(bodies);
        self.grow_boxes(bodies);
        self.sort_by_edge(bodies, axis);
        self.sweep(bodies, axis, filter);
        self.look_around(bodies, filter);
        self.keys.sort_unstable();
        self.carry_impulses();
        self.stale = false;
    }

    /// Grows each box by what its body may travel in a few steps.
    fn grow_boxes(&mut self, bodies: &Bodies) {
        self.fat.resize(bodies.alive.len(), NOWHERE);
        for slot in swept(bodies, CAN.sleeping && self.still.is_some()) {
            let slot = slot as usize;
            let reach = bodies.reach[slot];
            self.fat[slot] = bodies.bounds(slot, reach + max(MARGIN, 2.0 * reach));
        }
    }

    fn sort_by_edge(&mut self, bodies: &Bodies, axis: usize) {
        let fat = &self.fat;
        self.order.clear();
        self.order.extend(swept(bodies, CAN.sleeping && self.still.is_some()).map(|slot| {
            u64::from(ordered_bits(fat[slot as usize].low[axis])) << 32 | u64::from(slot)
        }));
        self.order.sort_unstable();
    }

    fn sweep(&mut self, bodies: &Bodies, axis: usize, filter: Filter) {
        let across = 1 - axis;
        self.keys.clear();
        for (rank, &entry) in self.order.iter().enumerate() {
            let a = entry as u32;
            let fat_a = self.fat[a as usize];
            let end = ordered_bits(fat_a.high[axis]);
            let meets_a = filter.meets[usize::from(bodies.group[a as usize])];
            let movable_a = filter.immovable || bodies.inverse_mass[a as usize] > 0.0;
            for &other in &self.order[rank + 1..] {
                if (other >> 32) as u32 >= end {
                    break;
                }
                let b = other as u32;
                let fat_b = &self.fat[b as usize];
                let apart = fat_b.low[across] >= fat_a.high[across]
                    || fat_a.low[across] >= fat_b.high[across];
                if apart || meets_a >> bodies.group[b as usize] & 1 == 0 {
                    continue;
                }
                if movable_a || bodies.inverse_mass[b as usize] > 0.0 {
                    let (low, high) = if a < b { (a, b) } else { (b, a) };
                    self.keys.push(u64::from(low) << 32 | u64::from(high));
                }
            }
        }
    }

    /// Pairs of one that moves and one that lies still.
    fn look_around(&mut self, bodies: &Bodies, filter: Filter) {
        let Some(still) = self.still.as_ref().filter(|_| CAN.sleeping) else { return };
        for &a in &bodies.moving {
            let fat_a = self.fat[a as usize];
            let meets_a = filter.meets[usize::from(bodies.group[a as usize])];
            let movable_a = bodies.inverse_mass[a as usize] > 0.0;
            still.around(&fat_a, |b| {
                let meets = meets_a >> bodies.group[b as usize] & 1 == 1;
                let movable = movable_a || bodies.inverse_mass[b as usize] > 0.0;
                if meets && movable && fat_a.overlaps(&self.fat[b as usize]) {
                    let (low, high) = if a < b { (a, b) } else { (b, a) };
                    self.keys.push(u64::from(low) << 32 | u64::from(high));
                }
            });
        }
    }

    /// Makes `pairs` from the sorted keys; a merge with the list before keeps the impulses.
    fn carry_impulses(&mut self) {
        std::mem::swap(&mut self.pairs, &mut self.before);
        self.pairs.clear();
        let mut old = self.before.iter().peekable();
        for &key in &self.keys {
            while old.next_if(|pair| pair.key() < key).is_some() {}
            let fresh = Pair {
                a: (key >> 32) as u32,
                b: key as u32,
                normal_impulse: 0.0,
                tangent_impulse: 0.0,
                axis: Axis::Free,
                warm_normal: Vec2::ZERO,
            };
            self.pairs.push(old.next_if(|pair| pair.key() == key).copied().unwrap_or(fresh));
        }
    }
}

const NOWHERE: Aabb = Aabb { low: Vec2::ZERO, high: Vec2::ZERO };

/// Who is sorted and swept: all, or all that move.
fn swept(bodies: &Bodies, moving: bool) -> impl Iterator<Item = u32> + '_ {
    let some = if moving { bodies.moving.as_slice() } else { &[] };
    let all = (!moving).then(|| bodies.slots());
    some.iter().copied().chain(all.into_iter().flatten())
}

/// The axis along which the centres of the moving bodies are spread out further.
fn long_axis(bodies: &Bodies) -> usize {
    let mut low = Vec2::splat(f32::INFINITY);
    let mut high = Vec2::splat(f32::NEG_INFINITY);
    for &slot in &bodies.moving {
        let center = bodies.center[slot as usize];
        for axis in 0..2 {
            low[axis] = min(low[axis], center[axis]);
            high[axis] = max(high[axis], center[axis]);
        }
    }
    let spread = high - low;
    usize::from(spread.y > spread.x)
}

/// Whether two bodies are within reach of each other: the exact test that the list serves.
#[inline]
pub(crate) fn near(bodies: &Bodies, a: u32, b: u32) -> bool {
    let (a, b) = (a as usize, b as usize);
    let gap = (bodies.center[b] - bodies.center[a]).abs() - bodies.half[a] - bodies.half[b];
    let reach = bodies.reach[a] + bodies.reach[b];
    gap.x < reach && gap.y < reach
}

/// The overlap of a pair where its bodies are now.
#[inline]
pub(crate) fn overlap(bodies: &Bodies, a: u32, b: u32) -> Option<Contact> {
    let (index_a, index_b) = (a as usize, b as usize);
    contact::collide(
        bodies.shape[index_a],
        bodies.center[index_a],
        bodies.shape[index_b],
        bodies.center[index_b],
        (a, b),
    )
}

/// Shapes that a world has; where there is one only, nothing asks a body for its shape.
pub(crate) mod shapes {
    pub const BOTH: u8 = 0;
    pub const CIRCLES: u8 = 1;
    pub const BOXES: u8 = 2;
}

/// [`overlap`] in a world with these [`shapes`] only.
#[inline]
pub(crate) fn overlap_of<const SHAPES: u8>(bodies: &Bodies, a: u32, b: u32) -> Option<Contact> {
    let (index_a, index_b) = (a as usize, b as usize);
    let offset = bodies.center[index_b] - bodies.center[index_a];
    let (half_a, half_b) = (bodies.half[index_a], bodies.half[index_b]);
    match SHAPES {
        shapes::CIRCLES => contact::circle_circle(offset, half_a.x, half_b.x, (a, b)),
        shapes::BOXES => contact::box_box(offset, half_a + half_b),
        _ => overlap(bodies, a, b),
    }
}

#[cfg(test)]
mod tests;
