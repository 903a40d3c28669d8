//! What does not move, found by place: a hashed grid with one level for each size of bodies.
//!
//! A body lies in the cell of its centre, on the level whose cells are at least as wide as its box;
//! so a box meets only bodies whose cells are within half a cell of it. Cells share a table by
//! their hash, and chains run through the slots, so putting in and taking out cost the same
//! whatever lies there (Teschner et al. 2003, "Optimized spatial hashing"; levels as in Ericson
//! 2005, "Real-time collision detection", 7.2). Nobody here is looked at unless something moves
//! close by.

use crate::shape::Aabb;

/// No slot.
const NONE: u32 = u32::MAX;
/// Cells of the finest level are 2^this wide, world units.
const FINEST: i32 = -8;
/// The last level has one cell, for all that is larger than the cells of the others.
const LEVELS: usize = 32;
/// How much wider than a box its cell is at least: room for rounding.
const ROOMY: f32 = 1.25;
/// Entries of the smallest table.
const TABLE_MIN: usize = 64;

/// A cell of a level.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    level: u8,
    x: i32,
    y: i32,
}

/// Where a slot is in its chain.
#[derive(Clone, Copy, Debug)]
struct Link {
    cell: Cell,
    next: u32,
    before: u32,
    listed: bool,
}

const UNLISTED: Link =
    Link { cell: Cell { level: 0, x: 0, y: 0 }, next: NONE, before: NONE, listed: false };

/// The grid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Still {
    /// By hash of the cell: the first slot of the chain. A power of two of entries.
    heads: Vec<u32>,
    /// By slot.
    links: Vec<Link>,
    /// Slots on each level.
    counts: [u32; LEVELS],
    count: usize,
}

impl Still {
    /// Puts a body with this box in; it must not be in.
    pub fn put(&mut self, slot: u32, bounds: &Aabb) {
        if self.links.len() <= slot as usize {
            self.links.resize(slot as usize + 1, UNLISTED);
        }
        if self.count >= self.heads.len() {
            self.widen();
        }
        let cell = cell_of(bounds);
        self.links[slot as usize].cell = cell;
        self.chain(slot);
        self.counts[usize::from(cell.level)] += 1;
        self.count += 1;
    }

    /// Takes a body out; whether it was in.
    pub fn take(&mut self, slot: u32) -> bool {
        let Some(link) = self.links.get(slot as usize).copied().filter(|link| link.listed) else {
            return false;
        };
        if link.before == NONE {
            let head = self.place(link.cell);
            self.heads[head] = link.next;
        } else {
            self.links[link.before as usize].next = link.next;
        }
        if link.next != NONE {
            self.links[link.next as usize].before = link.before;
        }
        self.links[slot as usize] = UNLISTED;
        self.counts[usize::from(link.cell.level)] -= 1;
        self.count -= 1;
        true
    }

    /// Shows every slot whose box may meet `bounds`, each once, in no particular order.
    pub fn around(&self, bounds: &Aabb, mut show: impl FnMut(u32)) {
        for level in (0..LEVELS).filter(|&level| self.counts[level] > 0) {
            let (low, high) = cells_around(bounds, level);
            let across = i64::from(high.x) - i64::from(low.x) + 1;
            let up = i64::from(high.y) - i64::from(low.y) + 1;
            if across.saturating_mul(up) > self.heads.len() as i64 {
                self.sift(low, high, &mut show);
                continue;
            }
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    self.follow(Cell { x, y, ..low }, &mut show);
                }
            }
        }
    }

    /// The slots of a cell.
    fn follow(&self, cell: Cell, show: &mut impl FnMut(u32)) {
        let mut slot = self.heads[self.place(cell)];
        while slot != NONE {
            let link = &self.links[slot as usize];
            if link.cell == cell {
                show(slot);
            }
            slot = link.next;
        }
    }

    /// The slots of a range of more cells than the table has entries.
    fn sift(&self, low: Cell, high: Cell, show: &mut impl FnMut(u32)) {
        for &head in &self.heads {
            let mut slot = head;
            while slot != NONE {
                let Link { cell, next, .. } = self.links[slot as usize];
                let inside =
                    (low.x..=high.x).contains(&cell.x) && (low.y..=high.y).contains(&cell.y);
                if cell.level == low.level && inside {
                    show(slot);
                }
                slot = next;
            }
        }
    }

    /// Puts a slot at the head of its cell's chain.
    fn chain(&mut self, slot: u32) {
        let head = self.place(self.links[slot as usize].cell);
        let next = std::mem::replace(&mut self.heads[head], slot);
        if next != NONE {
            self.links[next as usize].before = slot;
        }
        let link = &mut self.links[slot as usize];
        (link.next, link.before, link.listed) = (next, NONE, true);
    }

    /// Doubles the table.
    fn widen(&mut self) {
        let entries = (self.heads.len() * 2).max(TABLE_MIN);
        self.heads.clear();
        self.heads.resize(entries, NONE);
        for slot in 0..self.links.len() as u32 {
            if self.links[slot as usize].listed {
                self.chain(slot);
            }
        }
    }

    /// The table entry of a cell.
    #[inline]
    fn place(&self, cell: Cell) -> usize {
        let mixed = (cell.x as u32).wrapping_mul(0x9E37_79B1)
            ^ (cell.y as u32).wrapping_mul(0x85EB_CA77)
            ^ u32::from(cell.level).wrapping_mul(0xC2B2_AE3D);
        (mixed ^ mixed >> 15) as usize & (self.heads.len() - 1)
    }
}

/// Width of the cells of a level; the last level is one cell.
fn width(level: usize) -> f32 {
    f32::from_bits(((level as i32 + FINEST + 127) as u32) << 23)
}

fn cell_of(bounds: &Aabb) -> Cell {
    let size = bounds.high - bounds.low;
    let needed = if size.x > size.y { size.x } else { size.y } * ROOMY;
    let level = (0..LEVELS - 1).find(|&level| width(level) >= needed).unwrap_or(LEVELS - 1);
    let center = (bounds.low + bounds.high) * 0.5;
    Cell { level: level as u8, x: index(center.x, level), y: index(center.y, level) }
}

/// The first and the last cell of a level whose bodies may meet `bounds`.
fn cells_around(bounds: &Aabb, level: usize) -> (Cell, Cell) {
    let half = width(level) * 0.5;
    let cell = |x: f32, y: f32| Cell { level: level as u8, x: index(x, level), y: index(y, level) };
    (
        cell(bounds.low.x - half, bounds.low.y - half),
        cell(bounds.high.x + half, bounds.high.y + half),
    )
}

/// Beyond the range of cells all share the last one.
fn index(coordinate: f32, level: usize) -> i32 {
    if level == LEVELS - 1 {
        return 0;
    }
    (coordinate / width(level)).floor() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use glam::Vec2;

    fn random_box(rng: &mut Rng) -> Aabb {
        let size = [0.01, 1.0, 5.0, 300.0, 1e6][rng.below(5) as usize];
        let half = Vec2::new(rng.range(0.1, 1.0), rng.range(0.1, 1.0)) * size;
        Aabb::around(Vec2::new(rng.range(-500.0, 500.0), rng.range(-500.0, 500.0)), half)
    }

    #[test]
    fn every_box_that_meets_is_shown_once_whatever_came_and_went() {
        let mut rng = Rng::new(7, 0);
        let (mut still, mut boxes) = (Still::default(), vec![None; 300]);
        for round in 0..3000 {
            let slot = rng.below(300);
            let entry: &mut Option<Aabb> = &mut boxes[slot as usize];
            match entry.take() {
                Some(_) => assert!(still.take(slot)),
                None => {
                    let bounds = random_box(&mut rng);
                    still.put(slot, &bounds);
                    *entry = Some(bounds);
                }
            }
            let looked_at = random_box(&mut rng);
            let mut found = Vec::new();
            still.around(&looked_at, |slot| found.push(slot));
            found.sort_unstable();
            assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "round {round}: one twice");
            let meets = |slot: &u32| {
                boxes[*slot as usize].as_ref().is_some_and(|bounds| bounds.overlaps(&looked_at))
            };
            let expected: Vec<u32> = (0..300).filter(meets).collect();
            found.retain(meets);
            assert_eq!(found, expected, "round {round}");
        }
    }

    #[test]
    fn taking_out_who_is_not_in_says_so() {
        let mut still = Still::default();
        assert!(!still.take(3));
        still.put(3, &Aabb::around(Vec2::ZERO, Vec2::ONE));
        assert!(still.take(3) && !still.take(3));
    }
}
