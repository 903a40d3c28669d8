//! A sparse symmetric system with one 2 by 2 block for each body and for each pair joined by a spring or a contact,
//! solved by block elimination, as L D L^T without square roots. Bodies are eliminated in minimum-degree order
//! (Tinney and Walker 1967), so that ropes and trees cost one block per spring, and only meshes cause fill-in. For a
//! network of springs, the order and the fill-in are determined when springs change; for an island of contacts
//! (`solver::direct`), within the step.

use glam::{DMat2, DVec2};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The pattern and this step's numbers. Unknowns are identified by their index in the elimination order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Elimination {
    diagonal: Vec<DMat2>,
    /// Column j has its blocks below the diagonal at `start[j]..start[j + 1]`, in ascending row order.
    start: Vec<u32>,
    row: Vec<u32>,
    block: Vec<DMat2>,
    /// Number of block products in a factorisation.
    products: u64,
}

/// A pattern's elimination order, and scratch memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct EliminationOrder {
    /// The new index of each unknown.
    pub index_of: Vec<u32>,
    /// Unknowns in elimination order.
    pub nodes: Vec<u32>,
    /// By unknown: those with which it shares a block; once it is eliminated, those that were left at that time.
    near: Vec<Vec<u32>>,
    waiting: BinaryHeap<Reverse<(usize, u32)>>,
    is_done: Vec<bool>,
}

impl EliminationOrder {
    /// Finds the order for `count` unknowns joined by these edges.
    fn find(&mut self, count: usize, edges: &[(u32, u32)]) {
        let EliminationOrder { index_of, nodes, near, waiting, is_done } = self;
        near.iter_mut().for_each(Vec::clear);
        near.resize_with(near.len().max(count), Vec::new);
        for &(a, b) in edges {
            join(&mut near[a as usize], &[b]);
            join(&mut near[b as usize], &[a]);
        }
        // An entry with an outdated degree is skipped, since a later one follows.
        let degrees = (0u32..).zip(&near[..count]).map(|(node, near)| Reverse((near.len(), node)));
        waiting.extend(degrees);
        is_done.clear();
        is_done.resize(count, false);
        nodes.clear();
        index_of.clear();
        index_of.resize(count, 0);
        while let Some(Reverse((degree, node))) = waiting.pop() {
            if is_done[node as usize] || near[node as usize].len() != degree {
                continue;
            }
            is_done[node as usize] = true;
            let later = std::mem::take(&mut near[node as usize]);
            for &one in &later {
                let set = &mut near[one as usize];
                join(set, &later);
                set.retain(|&other| other != one && other != node);
                waiting.push(Reverse((set.len(), one)));
            }
            near[node as usize] = later;
            index_of[node as usize] = nodes.len() as u32;
            nodes.push(node);
        }
    }
}

impl Elimination {
    /// Builds the pattern for `count` unknowns joined by these edges, with the new index of each unknown in `order`.
    pub fn build(&mut self, count: usize, edges: &[(u32, u32)], order: &mut EliminationOrder) {
        order.find(count, edges);
        let Elimination { diagonal, start, row, block, products } = self;
        start.clear();
        row.clear();
        start.push(0);
        for &node in &order.nodes {
            let first = row.len();
            let later = order.near[node as usize].iter();
            row.extend(later.map(|&node| order.index_of[node as usize]));
            row[first..].sort_unstable();
            start.push(row.len() as u32);
        }
        let below = |column: &[u32]| u64::from(column[1] - column[0]);
        *products = start.windows(2).map(below).map(|rows| rows * (rows + 3) / 2).sum();
        diagonal.resize(count, DMat2::ZERO);
        block.resize(row.len(), DMat2::ZERO);
        self.clear();
    }

    /// Number of block products in a factorisation, a measure of its cost.
    pub fn products(&self) -> u64 {
        self.products
    }

    /// Number of off-diagonal blocks. Each solve reads them twice.
    pub fn blocks(&self) -> u64 {
        self.block.len() as u64
    }

    pub fn clear(&mut self) {
        self.diagonal.fill(DMat2::ZERO);
        self.block.fill(DMat2::ZERO);
    }

    pub fn add_diagonal(&mut self, at: u32, block: DMat2) {
        self.diagonal[at as usize] += block;
    }

    /// Adds a symmetric block for two unknowns joined by an edge.
    pub fn add(&mut self, a: u32, b: u32, block: DMat2) {
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        let at = self.find(high, low);
        self.block[at] += block;
    }

    fn column(&self, column: u32) -> std::ops::Range<usize> {
        self.start[column as usize] as usize..self.start[column as usize + 1] as usize
    }

    fn find(&self, row: u32, column: u32) -> usize {
        let range = self.column(column);
        let at = self.row[range.clone()].binary_search(&row);
        range.start + at.expect("the pattern has every edge and all fill")
    }

    /// Factors the matrix, which must be positive definite, in place.
    pub fn factor(&mut self) {
        for j in 0..self.diagonal.len() {
            let inverse = self.diagonal[j].inverse();
            self.diagonal[j] = inverse;
            let range = self.column(j as u32);
            for p in range.clone() {
                let (i, share) = (self.row[p], self.block[p] * inverse);
                self.diagonal[i as usize] -= share * self.block[p].transpose();
                // Column i contains every later row of this one, in the same order.
                let mut at = self.start[i as usize] as usize;
                for q in p + 1..range.end {
                    while self.row[at] != self.row[q] {
                        at += 1;
                    }
                    let fill = self.block[q] * share.transpose();
                    self.block[at] -= fill;
                }
            }
        }
    }

    /// Solves in place; the matrix must have been factored.
    pub fn solve(&self, right: &mut [DVec2]) {
        for j in 0..self.diagonal.len() {
            let known = self.diagonal[j] * right[j];
            for p in self.column(j as u32) {
                right[self.row[p] as usize] -= self.block[p] * known;
            }
        }
        for j in (0..self.diagonal.len()).rev() {
            let mut sum = right[j];
            for p in self.column(j as u32) {
                sum -= self.block[p].transpose() * right[self.row[p] as usize];
            }
            right[j] = self.diagonal[j] * sum;
        }
    }
}

/// Adds sorted nodes to a sorted set.
fn join(set: &mut Vec<u32>, more: &[u32]) {
    let (mut at, mut missing) = (0, 0);
    for &node in more {
        at += set[at..].iter().take_while(|&&other| other < node).count();
        missing += usize::from(set.get(at) != Some(&node));
    }
    // Works from the back, so that each node moves once.
    let mut from = set.len();
    set.resize(from + missing, 0);
    let mut to = set.len();
    for &node in more.iter().rev() {
        while from > 0 && set[from - 1] > node {
            (from, to) = (from - 1, to - 1);
            set[to] = set[from];
        }
        from -= usize::from(from > 0 && set[from - 1] == node);
        to -= 1;
        set[to] = node;
    }
}

#[cfg(test)]
mod tests {
    use super::{Elimination, EliminationOrder};
    use crate::rng::Rng;
    use glam::{DMat2, DVec2};

    /// A mesh of 4 by 4 nodes, which has fill-in, and a tail, which has none.
    #[test]
    fn the_solution_solves_the_system() {
        let mut edges = vec![(15, 16), (16, 17)];
        for node in 0..16u32 {
            if node % 4 < 3 {
                edges.push((node, node + 1));
            }
            if node < 12 {
                edges.push((node, node + 4));
            }
        }
        let mut rng = Rng::new(1, 1);
        let mut unit = move || f64::from(rng.unit()) - 0.5;
        let (mut system, mut order) = (Elimination::default(), EliminationOrder::default());
        system.build(18, &edges, &mut order);
        let index_of = order.index_of;
        let mut full = vec![vec![DMat2::ZERO; 18]; 18];
        for node in 0..18 {
            full[node][node] = DMat2::IDENTITY;
            system.add_diagonal(index_of[node], DMat2::IDENTITY);
        }
        for &(a, b) in &edges {
            let along = DVec2::new(unit(), unit());
            let stiff = DMat2::from_cols(along * along.x, along * along.y) * 1e4;
            for (one, other) in [(a, b), (b, a)] {
                system.add_diagonal(index_of[one as usize], stiff);
                full[one as usize][one as usize] += stiff;
                full[one as usize][other as usize] -= stiff;
            }
            system.add(index_of[a as usize], index_of[b as usize], -stiff);
        }
        let wanted: Vec<DVec2> = (0..18).map(|_| DVec2::new(unit(), unit())).collect();
        let mut right = vec![DVec2::ZERO; 18];
        for row in 0..18 {
            let sum: DVec2 = (0..18).map(|column| full[row][column] * wanted[column]).sum();
            right[index_of[row] as usize] = sum;
        }
        system.factor();
        system.solve(&mut right);
        for node in 0..18 {
            let error = (right[index_of[node] as usize] - wanted[node]).length();
            assert!(error < 1e-9, "{node}: {error}");
        }
    }
}
