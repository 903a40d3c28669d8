//! The sorted list of pairs that may come into contact, with the impulses that they carry from step
//! to step.
//!
//! The list is a pure accelerator. Every box in it is grown by a margin (a fat AABB), so the list
//! stays valid while bodies stay in their fat boxes; an exact test in each step decides which of
//! its pairs take part. When and how the list is built therefore cannot change a bit of the result.
//!
//! Moving bodies are sorted along the axis on which they are spread out further, and swept. In a
//! world that sleeps the others are kept apart in a [`StaticGrid`], which each moving body queries. Where
//! only some bodies have outgrown their boxes, the pairs that they lack are added, and what they no longer need stays until
//! the list is built again.

use super::static_grid::StaticGrid;
use crate::bodies::Bodies;
use crate::body::GROUPS_MAX;
use crate::growth::{push, reserve};
use crate::math::{max, min, ordered_bits};
use crate::shape::Aabb;
use glam::{Vec2, Vec2Swizzles};

/// Smallest margin of a fat box, world units.
const MARGIN: f32 = 0.25;
/// Margin of the fat box of a body that does not move, beyond its reach, world units.
const STATIC_MARGIN: f32 = 0.1;

/// Outgrown bodies up to which the list is extended instead of built again: this many, or this part of the moving bodies if that
/// is more. Of a crowd of 4000 at least as many would pay; the memory for them is what bounds it.
const OUTGROWN_MAX: usize = 32;
const OUTGROWN_PART: usize = 16;
/// The list is built again where this part of its pairs was added since, or of its bodies have other boxes than when they
/// were sorted: what it no longer needs, and what is compared in vain, stay few.
const ADDED_PART: usize = 8;
const ASIDE_PART: usize = 4;
/// Boxes wider than this multiple of the mean are compared with all others.
const WIDE: f32 = 4.0;
/// Boxes tested before the overlaps among them are listed.
const BESIDE: usize = 32;
/// Pairs that are moved in the time in which one is listed.
const MOVED_PER_LISTED: u64 = 8;
/// Margins of a box, left, right, below and above, relative to its body's reach, beyond which it is too large; those of a new
/// one are at most 5.4. Where more than one in [`LARGE_BOXES_PART`] is, the list is built again.
const LARGE_BOX: f32 = 12.0;
const LARGE_BOXES_PART: usize = 16;

/// Refreshes without a search after which its scratch is released.
const IDLE_REFRESHES_MAX: u32 = 128;

/// The axis of the box face that carried the contact in the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Axis {
    /// No face did, or the solver does not use it.
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
    /// Normal impulse that held the two apart at rest in the last step; not negative.
    pub normal_impulse: f32,
    /// Friction impulse that went with it, along the normal turned left.
    pub tangent_impulse: f32,
    /// Meaningful where `normal_impulse` is positive, else free.
    pub axis: Axis,
}

impl Pair {
    pub fn of(key: u64) -> Pair {
        Pair {
            a: (key >> 32) as u32,
            b: key as u32,
            normal_impulse: 0.0,
            tangent_impulse: 0.0,
            axis: Axis::Free,
        }
    }

    pub fn key(&self) -> u64 {
        u64::from(self.a) << 32 | u64::from(self.b)
    }

    /// Clears the stored impulses.
    pub fn clear_impulses(&mut self) {
        self.normal_impulse = 0.0;
        self.tangent_impulse = 0.0;
        self.axis = Axis::Free;
    }
}

/// Filter of the bodies that may pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filter<'a> {
    /// For each group, the groups that it collides with.
    pub meets: &'a [u32; GROUPS_MAX],
    /// Pairs of two immovable bodies are listed too: contacts are only detected.
    pub immovable: bool,
    /// Pairs that the list may hold.
    pub pairs_max: usize,
}

impl Filter<'_> {
    /// Whether two bodies may pair.
    // Inlined in four places it would take a kilobyte of the page's program.
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn takes(&self, bodies: &Bodies, a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        let meets = self.meets[usize::from(bodies.group[a])] >> bodies.group[b] & 1 == 1;
        meets && (self.immovable || bodies.inverse_mass[a] > 0.0 || bodies.inverse_mass[b] > 0.0)
    }
}

/// The list; see the module's description.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairList {
    /// Sorted by (a, b).
    pub pairs: Vec<Pair>,
    /// By slot: the fat box for which `pairs` is complete.
    fat: Vec<Aabb>,
    /// Bodies were added or placed elsewhere since the list was built.
    stale: bool,
    /// There were more pairs than the list may hold: it lacks some.
    is_over: bool,
    /// In a world that sleeps, all bodies outside the moving list.
    static_grid: Option<StaticGrid>,
    /// Slots that have outgrown their boxes, up to one more than are renewed.
    outgrown: Vec<u32>,
    /// Pairs that were added since the list was built.
    added: usize,
    sorted: SortedBoxes,
    /// Refreshes since pairs were last searched for.
    idle_refreshes: u32,
    /// Pairs written to the list in this step: all of them, and the bodies sorted, when it is built; those found, and a share of
    /// those moved, when it is extended.
    pub listed: u64,
    /// Scratch: keys of the pairs found.
    keys: Vec<u64>,
}

/// The boxes of the bodies as they were sorted when the list was built; none after they were released.
#[derive(Clone, Debug, Default)]
struct SortedBoxes {
    /// Slots sorted by lower edge, and their boxes in this order.
    order: Vec<u64>,
    boxes: Vec<Aabb>,
    /// Whether the boxes are turned, and the width of the widest one that is not aside.
    is_upright: bool,
    widest: f32,
    /// Slots whose boxes are not those that were sorted, or too wide to be found there.
    aside: Vec<u32>,
    /// By slot: whether it is not to be taken from the sorted ones: it is aside, or neither moves nor counts any more.
    is_left_out: Vec<bool>,
}

impl PairList {
    /// Creates an empty list; `sleeping` if bodies of the world may fall asleep.
    pub fn new(sleeping: bool) -> PairList {
        PairList { static_grid: sleeping.then(StaticGrid::default), ..PairList::default() }
    }

    /// In a world that sleeps: adds a body that has left the moving list, or that never moves.
    pub fn insert_static(&mut self, slot: u32, bodies: &Bodies) {
        let Some(grid) = &mut self.static_grid else { return };
        let index = slot as usize;
        self.fat.resize(bodies.alive.len(), EMPTY_BOX);
        let fat = bodies.bounds(index, bodies.reach[index] + STATIC_MARGIN);
        // The list is complete for the previous box.
        let within = self.fat[index].contains(fat.low) && self.fat[index].contains(fat.high);
        self.stale |= !within;
        self.fat[index] = fat;
        grid.insert(slot, &fat);
        self.sorted.leave_out(slot);
    }

    /// In a world that sleeps: removes a body that starts to move or is removed.
    pub fn remove_static(&mut self, slot: u32) {
        if self.static_grid.as_mut().is_some_and(|grid| grid.remove(slot)) {
            self.stale = true;
        }
    }

    /// Sorts pairs that were appended to the list; of two equal ones the one with an impulse stays.
    pub fn merge(&mut self) {
        // Sorts plain numbers: a sort for this type would take 3 kB of the page's program.
        let mut keys: Vec<u64> = self.pairs.iter().map(Pair::key).collect();
        keys.sort_unstable();
        keys.dedup();
        let mut sorted: Vec<Pair> = keys.iter().map(|&key| Pair::of(key)).collect();
        for pair in &self.pairs {
            let place = &mut sorted[keys.binary_search(&pair.key()).expect("every key is listed")];
            if place.normal_impulse <= 0.0 {
                *place = *pair;
            }
        }
        self.pairs = sorted;
        self.stale = true;
    }

    /// Visits the bodies near `slot` that do not move, in no particular order.
    pub fn for_each_static_near(&self, slot: u32, bodies: &Bodies, mut visit: impl FnMut(u32)) {
        let Some(grid) = &self.static_grid else { return };
        let bounds = bodies.bounds(slot as usize, bodies.reach[slot as usize] + STATIC_MARGIN);
        grid.query(&bounds, |other| {
            if other != slot && near(bodies, slot, other) {
                visit(other);
            }
        });
    }

    /// Marks the list as outdated: a body was added, or one outside the moving list was placed
    /// elsewhere.
    pub fn invalidate(&mut self) {
        self.stale = true;
    }

    /// Registers a body that is about to be removed.
    pub fn removed(&mut self, slot: u32) {
        self.remove_static(slot);
        self.sorted.leave_out(slot);
        if let Some(fat) = self.fat.get_mut(slot as usize) {
            *fat = EMPTY_BOX;
        }
    }

    /// Drops the pairs of removed bodies at once, so that new ones in their slots inherit nothing.
    pub fn keep_alive(&mut self, bodies: &Bodies) {
        let lives = |slot: u32| bodies.alive[slot as usize];
        self.pairs.retain(|pair| lives(pair.a) && lives(pair.b));
    }

    /// Whether there were more pairs than the list may hold.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Makes the list complete for the present positions; returns whether it was changed. It is not complete where
    /// there are too many pairs.
    pub fn refresh(&mut self, bodies: &Bodies, filter: Filter) -> bool {
        let most = OUTGROWN_MAX.max(bodies.moving.len() / OUTGROWN_PART);
        if !self.stale {
            self.find_outgrown(bodies, most + 1);
            if self.outgrown.is_empty() {
                self.idle_refreshes = self.idle_refreshes.saturating_add(1);
                if self.idle_refreshes == IDLE_REFRESHES_MAX {
                    self.release_scratch();
                }
                return false;
            }
        }
        self.idle_refreshes = 0;
        let SortedBoxes { order, aside, .. } = &self.sorted;
        let is_worn = order.is_empty()
            || self.added > self.pairs.len() / ADDED_PART
            || aside.len() > order.len() / ASIDE_PART;
        let is_extended = !(self.stale || is_worn || self.outgrown.len() > most);
        if is_extended && let Some(is_changed) = self.renew(bodies, filter) {
            return is_changed;
        }
        self.rebuild(bodies, filter);
        self.is_over |= self.pairs.len() > filter.pairs_max;
        true
    }

    /// Marks the list as outdated where many bodies have slowed down so far that their boxes are much too large: most of its
    /// pairs are then far apart. Returns whether it is. To be called between a refresh and the first impact, where reach
    /// is extended for impacts already: a box that they need in every step is not too large.
    pub fn drop_large_boxes(&mut self, bodies: &Bodies) -> bool {
        let fat = &self.fat;
        let is_large = |&&slot: &&u32| {
            let index = slot as usize;
            let margins = fat[index].high - fat[index].low - 2.0 * bodies.half[index];
            margins.x + margins.y > LARGE_BOX * (bodies.reach[index] + MARGIN)
        };
        let large = bodies.moving.iter().filter(is_large).count();
        self.stale |= large > bodies.moving.len() / LARGE_BOXES_PART;
        self.stale
    }

    /// Releases the memory that only a search needs.
    fn release_scratch(&mut self) {
        self.pairs.shrink_to_fit();
        self.sorted = SortedBoxes::default();
        self.keys = Vec::new();
    }

    /// Finds bodies whose reach has left the box for which the list is complete, `most` of them.
    fn find_outgrown(&mut self, bodies: &Bodies, most: usize) {
        let fat = &self.fat;
        let outgrown = |&slot: &u32| {
            let index = slot as usize;
            let reach = bodies.bounds(index, bodies.reach[index]);
            !(fat[index].contains(reach.low) && fat[index].contains(reach.high))
        };
        self.outgrown.clear();
        let found = bodies.moving.iter().copied().filter(outgrown);
        self.outgrown.extend(found.take(most));
    }

    /// Sorts and sweeps.
    fn rebuild(&mut self, bodies: &Bodies, filter: Filter) {
        self.fat.resize(bodies.alive.len(), EMPTY_BOX);
        let only_moving = self.static_grid.is_some();
        for slot in swept(bodies, only_moving) {
            self.fat[slot as usize] = grown(bodies, slot);
        }
        self.sorted.sort_by_edge(bodies, only_moving, &self.fat);
        self.sorted.set_aside(bodies.alive.len());
        self.sorted.sweep(bodies, filter, &mut self.keys);
        self.find_static_pairs(bodies, &bodies.moving, filter);
        self.keys.sort_unstable();
        self.carry_impulses();
        self.listed += (self.pairs.len() + self.sorted.order.len()) as u64;
        self.stale = false;
        self.added = 0;
    }

    /// Adds the missing pairs of the bodies that have outgrown their boxes; returns whether there are any, or `None` if the list
    /// may be too long for them.
    fn renew(&mut self, bodies: &Bodies, filter: Filter) -> Option<bool> {
        let outgrown = std::mem::take(&mut self.outgrown);
        for &slot in &outgrown {
            self.fat[slot as usize] = grown(bodies, slot);
            let SortedBoxes { aside, is_left_out, .. } = &mut self.sorted;
            if !std::mem::replace(&mut is_left_out[slot as usize], true) {
                push(aside, slot);
            }
        }
        self.keys.clear();
        for &slot in &outgrown {
            self.sorted.find_pairs_of(slot, bodies, &self.fat, filter, &mut self.keys);
            if self.keys.len() > filter.pairs_max {
                break;
            }
        }
        self.find_static_pairs(bodies, &outgrown, filter);
        self.outgrown = outgrown;
        self.listed += self.keys.len() as u64;
        if self.pairs.len() + self.keys.len() > filter.pairs_max {
            return None;
        }
        self.keys.sort_unstable();
        self.keys.dedup();
        Some(self.add_pairs())
    }

    /// Pairs of some moving bodies with those that do not move.
    fn find_static_pairs(&mut self, bodies: &Bodies, moving: &[u32], filter: Filter) {
        let PairList { static_grid, fat, keys, .. } = self;
        let Some(grid) = static_grid else { return };
        let filter = Filter { immovable: false, ..filter };
        for &a in moving {
            let fat_a = fat[a as usize];
            grid.query(&fat_a, |b| {
                if filter.takes(bodies, a, b) && fat_a.overlaps(&fat[b as usize]) {
                    push(keys, key(a, b));
                }
            });
            if keys.len() > filter.pairs_max {
                return;
            }
        }
    }

    /// Sets `pairs` to those of the sorted keys. Listed pairs keep their impulses.
    fn carry_impulses(&mut self) {
        let PairList { pairs, keys, .. } = self;
        // A pair without an impulse has nothing to carry, and is created again: in a crowd, seven of eight.
        let has_kept =
            |pair: &Pair| pair.normal_impulse > 0.0 && keys.binary_search(&pair.key()).is_ok();
        pairs.retain(has_kept);
        let len = keys.len();
        self.merge_keys(len);
    }

    /// Adds the pairs of the sorted keys that are not listed; returns whether there are any.
    fn add_pairs(&mut self) -> bool {
        let PairList { pairs, keys, .. } = self;
        keys.retain(|key| pairs.binary_search_by_key(key, Pair::key).is_err());
        let (added, len) = (keys.len(), pairs.len() + keys.len());
        let unmoved = self.merge_keys(len);
        self.added += added;
        self.listed += (len - unmoved) as u64 / MOVED_PER_LISTED;
        added > 0
    }

    /// Merges the sorted keys with the pairs from behind, so that each pair moves once. There are `len` pairs afterwards.
    /// Returns how many did not move.
    fn merge_keys(&mut self, len: usize) -> usize {
        let PairList { pairs, keys, .. } = self;
        let (mut from, mut to) = (pairs.len(), len);
        reserve(pairs, len);
        pairs.resize(len, Pair::of(0));
        for &key in keys.iter().rev() {
            while from > 0 && pairs[from - 1].key() > key {
                (from, to) = (from - 1, to - 1);
                pairs[to] = pairs[from];
            }
            if from == 0 || pairs[from - 1].key() != key {
                to -= 1;
                pairs[to] = Pair::of(key);
            }
        }
        from
    }
}

impl SortedBoxes {
    /// Leaves a body out of renewals, until the list is built again.
    fn leave_out(&mut self, slot: u32) {
        if let Some(is_left_out) = self.is_left_out.get_mut(slot as usize) {
            *is_left_out = true;
        }
    }

    /// Finds the pairs of a body with those that were sorted, and with those aside.
    fn find_pairs_of(
        &self,
        a: u32,
        bodies: &Bodies,
        fat: &[Aabb],
        filter: Filter,
        keys: &mut Vec<u64>,
    ) {
        let SortedBoxes { order, boxes, aside, is_left_out, widest, .. } = self;
        let fat_a = fat[a as usize];
        let bounds = turned(fat_a, self.is_upright);
        // Twice the width: rounding may take as much from it far away from the origin.
        let from = boxes.partition_point(|other| other.low.x < bounds.low.x - 2.0 * *widest);
        let to = boxes.partition_point(|other| other.low.x < bounds.high.x).max(from);
        for at in 0..to - from + aside.len() {
            let (b, counts) = match order[..to].get(from + at) {
                Some(&entry) => (entry as u32, !is_left_out[entry as u32 as usize]),
                None => (aside[at - (to - from)], true),
            };
            let overlaps = counts && b != a && fat_a.overlaps(&fat[b as usize]);
            if overlaps && filter.takes(bodies, a, b) {
                push(keys, key(a, b));
            }
        }
    }

    /// Sorts by the lower edge along the axis on which the bodies are spread out further, which comes first in `boxes`.
    fn sort_by_edge(&mut self, bodies: &Bodies, only_moving: bool, fat: &[Aabb]) {
        self.is_upright = is_upright(bodies);
        let SortedBoxes { order, boxes, is_upright, .. } = self;
        order.clear();
        order.extend(swept(bodies, only_moving).map(|slot| {
            let low = turned(fat[slot as usize], *is_upright).low.x;
            u64::from(ordered_bits(low)) << 32 | u64::from(slot)
        }));
        order.sort_unstable();
        boxes.clear();
        let of = |&entry: &u64| turned(fat[entry as u32 as usize], *is_upright);
        boxes.extend(order.iter().map(of));
    }

    /// Sets aside what is far wider than the others.
    fn set_aside(&mut self, slots: usize) {
        let SortedBoxes { order, boxes, aside, is_left_out, widest, .. } = self;
        let width = |bounds: &Aabb| bounds.high.x - bounds.low.x;
        let wide = WIDE * boxes.iter().map(width).sum::<f32>() / boxes.len() as f32;
        aside.clear();
        is_left_out.clear();
        is_left_out.resize(slots, false);
        *widest = 0.0;
        for (&entry, bounds) in order.iter().zip(&*boxes) {
            let (slot, width) = (entry as u32, width(bounds));
            if width <= wide {
                *widest = max(*widest, width);
            } else {
                // One that is not finite too, and then all.
                push(aside, slot);
                is_left_out[slot as usize] = true;
            }
        }
    }

    /// Finds the pairs whose boxes overlap.
    fn sweep(&self, bodies: &Bodies, filter: Filter, keys: &mut Vec<u64>) {
        let SortedBoxes { order, boxes, .. } = self;
        keys.clear();
        let mut found = [0; BESIDE];
        for (rank, (&a, bounds)) in order.iter().zip(boxes).enumerate() {
            let beside = order[rank + 1..].chunks(BESIDE).zip(boxes[rank + 1..].chunks(BESIDE));
            for (slots, boxes) in beside {
                // Without a branch on what cannot be predicted: few of the boxes beside overlap.
                let (mut count, mut is_last) = (0, false);
                for (&b, other) in slots.iter().zip(boxes) {
                    if other.low.x >= bounds.high.x {
                        is_last = true;
                        break;
                    }
                    found[count] = b as u32;
                    let overlaps = (other.low.y < bounds.high.y) & (bounds.low.y < other.high.y);
                    count += usize::from(overlaps);
                }
                for &b in &found[..count] {
                    if filter.takes(bodies, a as u32, b) {
                        push(keys, key(a as u32, b));
                    }
                }
                if is_last {
                    break;
                }
            }
            if keys.len() > filter.pairs_max {
                return;
            }
        }
    }
}

/// A box as it is, or with its axes exchanged.
fn turned(bounds: Aabb, is_upright: bool) -> Aabb {
    match is_upright {
        true => Aabb { low: bounds.low.yx(), high: bounds.high.yx() },
        false => bounds,
    }
}

/// A box that overlaps nothing, and holds nothing.
const EMPTY_BOX: Aabb = Aabb { low: Vec2::INFINITY, high: Vec2::NEG_INFINITY };

/// The key of a pair, by which the list is sorted.
pub(crate) fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// The box of a body, grown by the distance that it may travel in the next step, and ahead by that of one more.
fn grown(bodies: &Bodies, slot: u32) -> Aabb {
    let slot = slot as usize;
    let reach = bodies.reach[slot];
    let ahead = bodies.velocity[slot].normalize_or_zero() * reach;
    let Aabb { mut low, mut high } = bodies.bounds(slot, reach + MARGIN);
    for axis in 0..2 {
        low[axis] += min(ahead[axis], 0.0);
        high[axis] += max(ahead[axis], 0.0);
    }
    Aabb { low, high }
}

/// The bodies that are sorted and swept: all, or all that move.
fn swept(bodies: &Bodies, moving: bool) -> impl Iterator<Item = u32> + '_ {
    let some = if moving { bodies.moving.as_slice() } else { &[] };
    let all = (!moving).then(|| bodies.slots());
    some.iter().copied().chain(all.into_iter().flatten())
}

/// Whether the centres of the moving bodies are spread out further along y than along x.
fn is_upright(bodies: &Bodies) -> bool {
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
    spread.y > spread.x
}

/// Whether two bodies are within reach of each other: the exact test behind the list.
#[inline]
pub(crate) fn near(bodies: &Bodies, a: u32, b: u32) -> bool {
    let (a, b) = (a as usize, b as usize);
    let separation = (bodies.center[b] - bodies.center[a]).abs() - bodies.half[a] - bodies.half[b];
    let reach = bodies.reach[a] + bodies.reach[b];
    separation.x < reach && separation.y < reach
}

#[cfg(test)]
mod tests;
