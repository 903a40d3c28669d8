//! The sorted list of pairs that may come into contact, along with the impulses kept from step to step.
//!
//! The list only speeds up the search. It is built from boxes grown by a margin (fat AABBs), so it stays valid as
//! long as bodies stay inside their fat boxes, and an exact test in each step decides which pairs take part. When and
//! how the list is built therefore cannot change a single bit of the result.
//!
//! Moving bodies are sorted along the axis on which they are spread out further, and swept. In a world that sleeps,
//! all other bodies are kept in a [`StaticGrid`], which each moving body queries. If only some bodies have outgrown
//! their boxes, their missing pairs are added; pairs that are no longer needed stay until the list is rebuilt.

use super::static_grid::StaticGrid;
use crate::bodies::Bodies;
use crate::body::GROUPS_MAX;
use crate::growth::{push, reserve};
use crate::math::{max, min, ordered_bits};
use crate::shape::Aabb;
use glam::{Vec2, Vec2Swizzles};

/// Smallest margin of a fat box, world units.
const MARGIN: f32 = 0.25;
/// Margin added to the reach of a body that does not move to get its fat box, world units.
const STATIC_MARGIN: f32 = 0.1;

/// Maximum number of outgrown bodies for which the list is extended instead of rebuilt: this many, or this
/// fraction of the moving bodies if that is more. In a crowd of 4000, extending would pay off for even more
/// bodies, but memory sets the limit.
const OUTGROWN_MAX: usize = 32;
const OUTGROWN_PART: usize = 16;
/// The list is rebuilt once more than this fraction of its pairs has been added since the last build, or more than
/// this fraction of its bodies has left the sorted boxes. This limits obsolete pairs and useless comparisons.
const ADDED_PART: usize = 8;
const ASIDE_PART: usize = 4;
/// Boxes wider than this multiple of the mean are compared with all others.
const WIDE: f32 = 4.0;
/// Number of boxes tested before the overlaps among them are listed.
const BESIDE: usize = 32;
/// Number of pairs that can be moved in the time it takes to list one.
const MOVED_PER_LISTED: u64 = 8;
/// Total margin of a box on its four sides, relative to its body's reach, beyond which the box is too large. A new
/// box has at most 5.4. The list is rebuilt once more than one box in [`LARGE_BOXES_PART`] is too large.
const LARGE_BOX: f32 = 12.0;
const LARGE_BOXES_PART: usize = 16;

/// Number of refreshes without a search after which the search's scratch memory is released.
const IDLE_REFRESHES_MAX: u32 = 128;

/// The axis of the box face on which the contact was in the previous step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Axis {
    /// The contact was on no face, or the solver does not use the axis.
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
    /// Normal impulse that held the two apart at rest in the previous step; not negative.
    pub normal_impulse: f32,
    /// Friction impulse of the same contact, along the normal rotated 90 degrees to the left.
    pub tangent_impulse: f32,
    /// Meaningful only if `normal_impulse` is positive; otherwise `Free`.
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

/// Decides which bodies may pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filter<'a> {
    /// For each group, the groups with which it collides.
    pub meets: &'a [u32; GROUPS_MAX],
    /// Whether pairs of immovable bodies are listed too, because contacts are only detected.
    pub immovable: bool,
    /// Maximum number of pairs that the list may hold.
    pub pairs_max: usize,
}

impl Filter<'_> {
    /// Whether two bodies may pair.
    // Inlining it in four places would add a kilobyte to the page's program.
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn takes(&self, bodies: &Bodies, a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        let meets = self.meets[usize::from(bodies.group[a])] >> bodies.group[b] & 1 == 1;
        meets && (self.immovable || bodies.inverse_mass[a] > 0.0 || bodies.inverse_mass[b] > 0.0)
    }
}

/// The list of pairs; see the module documentation.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairList {
    /// Pairs, sorted by (a, b).
    pub pairs: Vec<Pair>,
    /// Fat boxes by slot; `pairs` is complete for them.
    fat: Vec<Aabb>,
    /// Whether bodies were added or repositioned since the list was built.
    stale: bool,
    /// Whether there were more pairs than the list may hold, so that some are missing.
    is_over: bool,
    /// All bodies outside the moving list, in a world that sleeps.
    static_grid: Option<StaticGrid>,
    /// Slots of bodies that have outgrown their boxes, up to one more than the list would be extended for.
    outgrown: Vec<u32>,
    /// Number of pairs added since the list was built.
    added: usize,
    sorted: SortedBoxes,
    /// Number of refreshes since pairs were last searched for.
    idle_refreshes: u32,
    /// Work done on the list in this step. A build counts all pairs and sorted bodies; an extension counts the pairs
    /// found and a share of the pairs moved.
    pub listed: u64,
    /// Scratch for the keys of the pairs found.
    keys: Vec<u64>,
}

/// The bodies' boxes as they were sorted when the list was built; empty once they have been released.
#[derive(Clone, Debug, Default)]
struct SortedBoxes {
    /// Slots sorted by lower edge, and their boxes in the same order.
    order: Vec<u64>,
    boxes: Vec<Aabb>,
    /// Whether the boxes have their axes swapped, and the width of the widest one that is not aside.
    is_upright: bool,
    widest: f32,
    /// Slots that the sorted boxes do not cover, because their boxes have changed or are too wide to be found by the
    /// sweep.
    aside: Vec<u32>,
    /// By slot: whether its sorted entry must be ignored, because the body is in `aside`, stopped moving or was
    /// removed.
    is_left_out: Vec<bool>,
}

impl PairList {
    /// Creates an empty list; `sleeping` says whether bodies of the world may fall asleep.
    pub fn new(sleeping: bool) -> PairList {
        PairList { static_grid: sleeping.then(StaticGrid::default), ..PairList::default() }
    }

    /// In a world that sleeps, adds a body that has left the moving list or never moves.
    pub fn insert_static(&mut self, slot: u32, bodies: &Bodies) {
        let Some(grid) = &mut self.static_grid else { return };
        let index = slot as usize;
        self.fat.resize(bodies.alive.len(), EMPTY_BOX);
        let fat = bodies.bounds(index, bodies.reach[index] + STATIC_MARGIN);
        // The list was complete for the previous box.
        let within = self.fat[index].contains(fat.low) && self.fat[index].contains(fat.high);
        self.stale |= !within;
        self.fat[index] = fat;
        grid.insert(slot, &fat);
        self.sorted.leave_out(slot);
    }

    /// In a world that sleeps, removes a body that starts to move or is removed.
    pub fn remove_static(&mut self, slot: u32) {
        if self.static_grid.as_mut().is_some_and(|grid| grid.remove(slot)) {
            self.stale = true;
        }
    }

    /// Sorts pairs that were appended to the list. Of two equal pairs, the one with an impulse is kept.
    pub fn merge(&mut self) {
        // This sorts plain numbers, since sorting this type would add 3 kB to the page's program.
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

    /// Visits the non-moving bodies near `slot`, in no particular order.
    pub fn for_each_static_near(&self, slot: u32, bodies: &Bodies, mut visit: impl FnMut(u32)) {
        let Some(grid) = &self.static_grid else { return };
        let bounds = bodies.bounds(slot as usize, bodies.reach[slot as usize] + STATIC_MARGIN);
        grid.query(&bounds, |other| {
            if other != slot && near(bodies, slot, other) {
                visit(other);
            }
        });
    }

    /// Marks the list as outdated because a body was added, or one outside the moving list was repositioned.
    pub fn invalidate(&mut self) {
        self.stale = true;
    }

    /// Prepares the list for the removal of a body.
    pub fn removed(&mut self, slot: u32) {
        self.remove_static(slot);
        self.sorted.leave_out(slot);
        if let Some(fat) = self.fat.get_mut(slot as usize) {
            *fat = EMPTY_BOX;
        }
    }

    /// Immediately drops the pairs of removed bodies, so that new bodies in their slots inherit nothing.
    pub fn keep_alive(&mut self, bodies: &Bodies) {
        let lives = |slot: u32| bodies.alive[slot as usize];
        self.pairs.retain(|pair| lives(pair.a) && lives(pair.b));
    }

    /// Whether there were more pairs than the list may hold.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Completes the list for the current positions, unless there are too many pairs. Returns whether the list
    /// changed.
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

    /// Marks the list as outdated if many bodies have slowed down so much that their boxes are far too large, since
    /// most of its pairs are then far apart. Returns whether the list is outdated. Must be called between a refresh
    /// and the first impact, when reach has already been extended for impacts, so that a box which needs this
    /// extension in every step does not count as too large.
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

    /// Releases the memory that only searches need.
    fn release_scratch(&mut self) {
        self.pairs.shrink_to_fit();
        self.sorted = SortedBoxes::default();
        self.keys = Vec::new();
    }

    /// Finds up to `most` bodies whose reach has left the box for which the list is complete.
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

    /// Rebuilds the list by sorting and sweeping.
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

    /// Adds the missing pairs of bodies that have outgrown their boxes. Returns whether there were any, or `None` if
    /// the list could become too long.
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

    /// Finds the pairs that some moving bodies form with bodies that do not move.
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

    /// Replaces `pairs` with those of the sorted keys. Pairs that were listed before keep their impulses.
    fn carry_impulses(&mut self) {
        let PairList { pairs, keys, .. } = self;
        // A pair without an impulse has nothing to carry over and is simply recreated. In a crowd, these are seven of
        // eight pairs.
        let has_kept =
            |pair: &Pair| pair.normal_impulse > 0.0 && keys.binary_search(&pair.key()).is_ok();
        pairs.retain(has_kept);
        let len = keys.len();
        self.merge_keys(len);
    }

    /// Adds those pairs of the sorted keys that are not listed yet. Returns whether there were any.
    fn add_pairs(&mut self) -> bool {
        let PairList { pairs, keys, .. } = self;
        keys.retain(|key| pairs.binary_search_by_key(key, Pair::key).is_err());
        let (added, len) = (keys.len(), pairs.len() + keys.len());
        let unmoved = self.merge_keys(len);
        self.added += added;
        self.listed += (len - unmoved) as u64 / MOVED_PER_LISTED;
        added > 0
    }

    /// Merges the sorted keys into the pairs from the back, so that each pair moves once. Afterwards there are `len`
    /// pairs. Returns how many pairs did not move.
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
    /// Makes extensions ignore a body's sorted entry until the list is rebuilt.
    fn leave_out(&mut self, slot: u32) {
        if let Some(is_left_out) = self.is_left_out.get_mut(slot as usize) {
            *is_left_out = true;
        }
    }

    /// Finds the pairs that a body forms with the sorted bodies and with those in `aside`.
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
        // Twice the width, since rounding may lose that much far away from the origin.
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

    /// Sorts by the lower edge along the axis on which the bodies are spread out further. This axis comes first in
    /// `boxes`.
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

    /// Moves boxes that are far wider than the others to `aside`.
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
                // If any box is not finite, all boxes end up here.
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
                // This avoids an unpredictable branch, since few of the neighbouring boxes overlap.
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

/// A box as it is, or with its axes swapped.
fn turned(bounds: Aabb, is_upright: bool) -> Aabb {
    match is_upright {
        true => Aabb { low: bounds.low.yx(), high: bounds.high.yx() },
        false => bounds,
    }
}

/// A box that neither overlaps nor contains anything.
const EMPTY_BOX: Aabb = Aabb { low: Vec2::INFINITY, high: Vec2::NEG_INFINITY };

/// The key of a pair, by which the list is sorted.
pub(crate) fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// A body's box, grown by the distance that the body may travel in the next step, and in its direction of motion by one
/// more step.
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

/// The bodies that are sorted and swept, which are all of them or only the moving ones.
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

/// Whether two bodies are within reach of each other. This is the exact test behind the list.
#[inline]
pub(crate) fn near(bodies: &Bodies, a: u32, b: u32) -> bool {
    let (a, b) = (a as usize, b as usize);
    let separation = (bodies.center[b] - bodies.center[a]).abs() - bodies.half[a] - bodies.half[b];
    let reach = bodies.reach[a] + bodies.reach[b];
    separation.x < reach && separation.y < reach
}

#[cfg(test)]
mod tests;
