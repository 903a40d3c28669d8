//! Islands are sets of constraints that share no movable body with each other. Each island is solved separately,
//! with its own search direction and its own termination, so that a body landing far away costs nothing for a body
//! at rest.
//!
//! They are found by union-find over the constraints between movable bodies, with path halving (Tarjan and van
//! Leeuwen 1984). Islands are in the order of their first constraints, and constraints keep their order, so that an
//! island's result does not depend on the rest of the world. There are three exceptions: it can depend on the number
//! of moving bodies (see `tolerances::LARGE_WORLD`, and `impact_queue` for small rooms), on how many eliminations, or
//! sweeps before them, earlier islands have used up in a step (see `direct::rounds_left` and
//! `direct::sweeps_before`), and on how many predictions bounces elsewhere have used up (see `impact_queue`).

use crate::solver::contact_constraint::ContactConstraint;

/// The islands of a step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Islands {
    /// Indices of constraints, island after island.
    pub constraints: Vec<u32>,
    /// Start of each island in `constraints`, followed by the end.
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
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Range of an island's constraints in `constraints`, whose indices ascend.
    pub fn range(&self, island: usize) -> std::ops::Range<usize> {
        self.starts[island] as usize..self.starts[island + 1] as usize
    }

    /// Finds the islands of these constraints, or of a subset of them, among `slots` bodies.
    #[inline(never)]
    pub fn find(&mut self, slots: usize, constraints: &[ContactConstraint], some: Option<&[u32]>) {
        self.parent.resize(slots, 0);
        self.number.resize(slots, NONE);
        let index_at = |at: usize| some.map_or(at, |indices| indices[at] as usize);
        let count = some.map_or(constraints.len(), <[u32]>::len);
        for constraint in (0..count).map(|at| &constraints[index_at(at)]) {
            for slot in [constraint.a, constraint.b] {
                self.parent[slot as usize] = slot;
                self.number[slot as usize] = NONE;
            }
        }
        for constraint in (0..count).map(|at| &constraints[index_at(at)]) {
            if constraint.is_free() {
                join(&mut self.parent, constraint.a, constraint.b);
            }
        }
        self.of_constraint.clear();
        self.starts.clear();
        for constraint in (0..count).map(|at| &constraints[index_at(at)]) {
            let number = self.count_constraint(constraint);
            self.of_constraint.push(number);
        }
        self.sort_constraints(some);
    }

    /// Counts a constraint towards its island in `starts`, and returns the island's number.
    #[inline]
    fn count_constraint(&mut self, constraint: &ContactConstraint) -> u32 {
        let movable = if constraint.inv_mass_a > 0.0 { constraint.a } else { constraint.b };
        let root = root(&mut self.parent, movable);
        let number = &mut self.number[root as usize];
        if *number == NONE {
            *number = self.starts.len() as u32;
            self.starts.push(0);
        }
        self.starts[*number as usize] += 1;
        *number
    }

    /// Groups the constraints by island with a counting sort.
    fn sort_constraints(&mut self, some: Option<&[u32]>) {
        let mut sum = 0;
        for start in &mut self.starts {
            let count = *start;
            *start = sum;
            sum += count;
        }
        self.constraints.clear();
        self.constraints.resize(self.of_constraint.len(), 0);
        for (at, &island) in self.of_constraint.iter().enumerate() {
            let next = &mut self.starts[island as usize];
            self.constraints[*next as usize] = some.map_or(at as u32, |indices| indices[at]);
            *next += 1;
        }
        // Each start has advanced to that of the next island.
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

/// Joins the sets that contain two slots. The lower of the two roots remains the root.
pub(crate) fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}
