//! Islands: sets of constraints that share no movable body. Each is solved separately, with its own
//! search direction and its own end: a body at rest costs nothing because another one lands far
//! away.
//!
//! Union-find over the constraints between movable bodies, with path halving (Tarjan and van
//! Leeuwen 1984). Islands are in the order of their first constraint, and constraints keep their
//! order, so that the result in an island does not depend on the rest of the world, except by the number of
//! moving bodies (see `tolerances::LARGE_WORLD`) and where the islands before it have used up the eliminations of a
//! step (see `direct::STEP_VISITS`).

use crate::solver::contact_constraint::ContactConstraint;

/// The islands of a step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Islands {
    /// Indices of constraints, island after island.
    pub constraints: Vec<u32>,
    /// Start of each island in `constraints`, and the end.
    pub starts: Vec<u32>,
    /// By slot: parent in the union-find forest.
    parent: Vec<u32>,
    /// By root slot: number of its island.
    number: Vec<u32>,
    /// By constraint: number of its island.
    of_constraint: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Islands {
    /// Number of islands.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Range of an island's constraints, ascending, in `constraints`.
    pub fn range(&self, island: usize) -> std::ops::Range<usize> {
        self.starts[island] as usize..self.starts[island + 1] as usize
    }

    /// Finds the islands of the constraints among `slots` bodies.
    #[inline(never)]
    pub fn find(&mut self, slots: usize, constraints: &[ContactConstraint]) {
        self.parent.resize(slots, 0);
        self.number.resize(slots, NONE);
        for constraint in constraints {
            for slot in [constraint.a, constraint.b] {
                self.parent[slot as usize] = slot;
                self.number[slot as usize] = NONE;
            }
        }
        for constraint in constraints.iter().filter(|constraint| constraint.is_free()) {
            join(&mut self.parent, constraint.a, constraint.b);
        }
        self.count_constraints(constraints);
        self.sort_constraints();
    }

    /// Numbers the islands and counts their constraints into `starts`.
    fn count_constraints(&mut self, constraints: &[ContactConstraint]) {
        self.of_constraint.clear();
        self.starts.clear();
        for constraint in constraints {
            let movable = if constraint.inv_mass_a > 0.0 { constraint.a } else { constraint.b };
            let root = root(&mut self.parent, movable);
            let number = &mut self.number[root as usize];
            if *number == NONE {
                *number = self.starts.len() as u32;
                self.starts.push(0);
            }
            self.starts[*number as usize] += 1;
            self.of_constraint.push(*number);
        }
    }

    /// Sorts the constraints by island, by counting.
    fn sort_constraints(&mut self) {
        let mut sum = 0;
        for start in &mut self.starts {
            let count = *start;
            *start = sum;
            sum += count;
        }
        self.constraints.clear();
        self.constraints.resize(self.of_constraint.len(), 0);
        for (constraint, &island) in (0u32..).zip(&self.of_constraint) {
            let next = &mut self.starts[island as usize];
            self.constraints[*next as usize] = constraint;
            *next += 1;
        }
        // Each start has moved to that of the next island.
        self.starts.insert(0, 0);
    }
}

/// Finds the root of a slot, with path halving.
#[inline]
pub(crate) fn root(parent: &mut [u32], mut slot: u32) -> u32 {
    while parent[slot as usize] != slot {
        let grand = parent[parent[slot as usize] as usize];
        parent[slot as usize] = grand;
        slot = grand;
    }
    slot
}

/// Joins the sets of two slots; the lower root stays one.
pub(crate) fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}
