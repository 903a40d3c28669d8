//! A hashed grid of bodies that do not move, with one level for each size class.
//!
//! A body is stored in the cell that contains its centre, on the level whose cells are at least as wide as its box. A
//! box therefore overlaps only bodies whose cells are within half a cell of it. Cells share a table indexed by their
//! hash, and chains are linked through the slots, so insertion and removal take constant time (Teschner et al. 2003,
//! "Optimized spatial hashing"; levels as in Ericson 2005, "Real-time collision detection", 7.2). Bodies in the grid
//! are visited only if something moves close by.

use crate::shape::Aabb;

/// Marks the end of a chain.
const NONE: u32 = u32::MAX;
/// Cells of the finest level are 2^`FINEST` world units wide.
const FINEST: i32 = -8;
/// Number of levels. The last one has a single cell, for everything that is too large for the other levels.
const LEVELS: usize = 32;
/// Smallest ratio of a cell's width to that of a box in it. It leaves room for rounding.
const CELL_SHARE_MIN: f32 = 1.25;
/// Number of entries in the smallest table.
const TABLE_MIN: usize = 64;

/// A cell of a level.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    level: u8,
    x: i32,
    y: i32,
}

/// Links of a slot within the chain of its cell.
#[derive(Clone, Copy, Debug)]
struct CellLink {
    cell: Cell,
    next: u32,
    previous: u32,
    listed: bool,
}

const UNLISTED: CellLink =
    CellLink { cell: Cell { level: 0, x: 0, y: 0 }, next: NONE, previous: NONE, listed: false };

#[derive(Clone, Debug, Default)]
pub(crate) struct StaticGrid {
    /// First slot of the chain, by the cell's hash. The number of entries is a power of two.
    heads: Vec<u32>,
    links: Vec<CellLink>,
    /// Number of slots on each level.
    counts: [u32; LEVELS],
    count: usize,
}

impl StaticGrid {
    /// Inserts a body with this box. The body must not be in the grid yet.
    pub fn insert(&mut self, slot: u32, bounds: &Aabb) {
        if self.links.len() <= slot as usize {
            self.links.resize(slot as usize + 1, UNLISTED);
        }
        if self.count >= self.heads.len() {
            self.widen();
        }
        let cell = cell_of(bounds);
        self.links[slot as usize].cell = cell;
        self.link(slot);
        self.counts[usize::from(cell.level)] += 1;
        self.count += 1;
    }

    /// Removes a body; returns whether it was in the grid.
    pub fn remove(&mut self, slot: u32) -> bool {
        let Some(link) = self.links.get(slot as usize).copied().filter(|link| link.listed) else {
            return false;
        };
        if link.previous == NONE {
            let head = self.bucket(link.cell);
            self.heads[head] = link.next;
        } else {
            self.links[link.previous as usize].next = link.next;
        }
        if link.next != NONE {
            self.links[link.next as usize].previous = link.previous;
        }
        self.links[slot as usize] = UNLISTED;
        self.counts[usize::from(link.cell.level)] -= 1;
        self.count -= 1;
        true
    }

    /// Visits every slot whose box may overlap `bounds`, each once, in no particular order.
    pub fn query(&self, bounds: &Aabb, mut visit: impl FnMut(u32)) {
        for level in (0..LEVELS).filter(|&level| self.counts[level] > 0) {
            let (low, high) = cell_range(bounds, level);
            let across = i64::from(high.x) - i64::from(low.x) + 1;
            let up = i64::from(high.y) - i64::from(low.y) + 1;
            if across.saturating_mul(up) > self.heads.len() as i64 {
                self.scan(low, high, &mut visit);
                continue;
            }
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    self.visit_cell(Cell { x, y, ..low }, &mut visit);
                }
            }
        }
    }

    /// Visits the slots of a cell.
    fn visit_cell(&self, cell: Cell, visit: &mut impl FnMut(u32)) {
        let mut slot = self.heads[self.bucket(cell)];
        while slot != NONE {
            let link = &self.links[slot as usize];
            if link.cell == cell {
                visit(slot);
            }
            slot = link.next;
        }
    }

    /// Visits the slots of a range that has more cells than the table has entries.
    fn scan(&self, low: Cell, high: Cell, visit: &mut impl FnMut(u32)) {
        for &head in &self.heads {
            let mut slot = head;
            while slot != NONE {
                let CellLink { cell, next, .. } = self.links[slot as usize];
                let inside =
                    (low.x..=high.x).contains(&cell.x) && (low.y..=high.y).contains(&cell.y);
                if cell.level == low.level && inside {
                    visit(slot);
                }
                slot = next;
            }
        }
    }

    /// Links a slot at the head of its cell's chain.
    fn link(&mut self, slot: u32) {
        let head = self.bucket(self.links[slot as usize].cell);
        let next = std::mem::replace(&mut self.heads[head], slot);
        if next != NONE {
            self.links[next as usize].previous = slot;
        }
        let link = &mut self.links[slot as usize];
        (link.next, link.previous, link.listed) = (next, NONE, true);
    }

    fn widen(&mut self) {
        let entries = (self.heads.len() * 2).max(TABLE_MIN);
        self.heads.clear();
        self.heads.resize(entries, NONE);
        for slot in 0..self.links.len() as u32 {
            if self.links[slot as usize].listed {
                self.link(slot);
            }
        }
    }

    /// Returns the table entry of a cell.
    #[inline]
    fn bucket(&self, cell: Cell) -> usize {
        let mixed = (cell.x as u32).wrapping_mul(0x9E37_79B1)
            ^ (cell.y as u32).wrapping_mul(0x85EB_CA77)
            ^ u32::from(cell.level).wrapping_mul(0xC2B2_AE3D);
        (mixed ^ mixed >> 15) as usize & (self.heads.len() - 1)
    }
}

/// Width of a level's cells; the last level is a single cell.
fn width(level: usize) -> f32 {
    f32::from_bits(((level as i32 + FINEST + 127) as u32) << 23)
}

fn cell_of(bounds: &Aabb) -> Cell {
    let size = bounds.high - bounds.low;
    let needed = if size.x > size.y { size.x } else { size.y } * CELL_SHARE_MIN;
    let level = (0..LEVELS - 1).find(|&level| width(level) >= needed).unwrap_or(LEVELS - 1);
    let center = (bounds.low + bounds.high) * 0.5;
    Cell { level: level as u8, x: index(center.x, level), y: index(center.y, level) }
}

/// Returns the first and the last cell of a level whose bodies may overlap `bounds`.
fn cell_range(bounds: &Aabb, level: usize) -> (Cell, Cell) {
    let half = width(level) * 0.5;
    let cell = |x: f32, y: f32| Cell { level: level as u8, x: index(x, level), y: index(y, level) };
    (
        cell(bounds.low.x - half, bounds.low.y - half),
        cell(bounds.high.x + half, bounds.high.y + half),
    )
}

/// Index of the cell at a coordinate. Coordinates beyond the range share the last cell.
fn index(coordinate: f32, level: usize) -> i32 {
    if level == LEVELS - 1 {
        return 0;
    }
    (coordinate / width(level)).floor() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use glam::Vec2;

    fn random_box(rng: &mut Rng) -> Aabb {
        let size = [0.01, 1.0, 5.0, 300.0, 1e6][rng.below(5) as usize];
        let half = Vec2::new(rng.range(0.1, 1.0), rng.range(0.1, 1.0)) * size;
        Aabb::around(Vec2::new(rng.range(-500.0, 500.0), rng.range(-500.0, 500.0)), half)
    }

    #[test]
    fn every_overlapping_box_is_visited_once_after_any_insertions_and_removals() {
        let mut rng = Rng::new(7, 0);
        let (mut grid, mut boxes) = (StaticGrid::default(), vec![None; 300]);
        for round in 0..3000 {
            let slot = rng.below(300);
            let entry: &mut Option<Aabb> = &mut boxes[slot as usize];
            match entry.take() {
                Some(_) => assert!(grid.remove(slot)),
                None => {
                    let bounds = random_box(&mut rng);
                    grid.insert(slot, &bounds);
                    *entry = Some(bounds);
                }
            }
            let queried = random_box(&mut rng);
            let mut found = Vec::new();
            grid.query(&queried, |slot| found.push(slot));
            found.sort_unstable();
            assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "round {round}: one twice");
            let meets = |slot: &u32| {
                boxes[*slot as usize].as_ref().is_some_and(|bounds| bounds.overlaps(&queried))
            };
            let expected: Vec<u32> = (0..300).filter(meets).collect();
            found.retain(meets);
            assert_eq!(found, expected, "round {round}");
        }
    }

    #[test]
    fn removing_an_absent_body_returns_false() {
        let mut grid = StaticGrid::default();
        assert!(!grid.remove(3));
        grid.insert(3, &Aabb::around(Vec2::ZERO, Vec2::ONE));
        assert!(grid.remove(3) && !grid.remove(3));
    }
}
