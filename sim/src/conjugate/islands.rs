//! Islands: sets of rows that share no movable body. Each is solved for itself, with its own
//! direction and its own end: a body at rest costs nothing because another one lands far away.
//!
//! Union-find over the rows whose bodies can both be pushed, with path halving (Tarjan and van
//! Leeuwen 1984). Islands are in the order of their first row, their rows in row order, so that
//! what happens in an island does not depend on the rest of the world.

use super::rows::Row;

/// The islands of a step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Islands {
    /// Rows, island after island.
    pub rows: Vec<u32>,
    /// Where each island begins in `rows`, and the end.
    pub starts: Vec<u32>,
    /// By slot: the way to the slot that stands for the island.
    parent: Vec<u32>,
    /// By slot: number of the island that it stands for.
    number: Vec<u32>,
    /// By row: number of its island.
    of_row: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Islands {
    /// Number of islands.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The rows of an island, ascending.
    pub fn range(&self, island: usize) -> std::ops::Range<usize> {
        self.starts[island] as usize..self.starts[island + 1] as usize
    }

    /// Finds the islands of the rows among `slots` bodies.
    #[inline(never)]
    pub fn find(&mut self, slots: usize, rows: &[Row]) {
        self.parent.resize(slots, 0);
        self.number.resize(slots, NONE);
        for row in rows {
            for slot in [row.a, row.b] {
                self.parent[slot as usize] = slot;
                self.number[slot as usize] = NONE;
            }
        }
        for row in rows.iter().filter(|row| row.is_free()) {
            let (a, b) = (root(&mut self.parent, row.a), root(&mut self.parent, row.b));
            // The lower slot stands for both.
            if a < b {
                self.parent[b as usize] = a;
            } else {
                self.parent[a as usize] = b;
            }
        }
        self.count_rows(rows);
        self.place_rows();
    }

    /// Numbers the islands and counts their rows into `starts`.
    fn count_rows(&mut self, rows: &[Row]) {
        self.of_row.clear();
        self.starts.clear();
        for row in rows {
            let movable = if row.weight_a > 0.0 { row.a } else { row.b };
            let root = root(&mut self.parent, movable);
            let number = &mut self.number[root as usize];
            if *number == NONE {
                *number = self.starts.len() as u32;
                self.starts.push(0);
            }
            self.starts[*number as usize] += 1;
            self.of_row.push(*number);
        }
    }

    /// A counting sort of the rows.
    fn place_rows(&mut self) {
        let mut sum = 0;
        for start in &mut self.starts {
            let count = *start;
            *start = sum;
            sum += count;
        }
        self.rows.clear();
        self.rows.resize(self.of_row.len(), 0);
        for (row, &island) in (0u32..).zip(&self.of_row) {
            let next = &mut self.starts[island as usize];
            self.rows[*next as usize] = row;
            *next += 1;
        }
        // Each start has moved on to the next one's.
        self.starts.insert(0, 0);
    }
}

/// The slot that stands for a slot's island; halves the way to it.
#[inline]
fn root(parent: &mut [u32], mut slot: u32) -> u32 {
    while parent[slot as usize] != slot {
        let grand = parent[parent[slot as usize] as usize];
        parent[slot as usize] = grand;
        slot = grand;
    }
    slot
}
