//! Chains of contacts along an axis, each of which is solved exactly within a sweep.
//!
//! Constraints whose normal is exactly +-x or +-y are the edges of one graph per axis. The graph is covered by
//! edge-disjoint paths, starting first from every body that nothing supports on that axis, then from the rest. At
//! each body, a path follows the unused edge with the largest stored impulse, along which the load is transmitted.
//! A column of any height, with any mass ratio, is then solved in one exact step of the sweep, whereas solving one
//! constraint after another would need a number of sweeps that grows with the square of its height.
//!
//! A chain removes its own impulses from the velocities, pools (see `pava`), and sums the impulses from its free end,
//! where the change in each impulse is the change in the momentum beyond it.

use super::gauss_seidel::{SweepChange, solve_friction};
use crate::math::{max, without_dust};
use crate::solver::contact_constraint::ContactConstraint;
use crate::solver::pava::{ChainNode, Pool, pool};
use glam::Vec2;

/// Minimum number of constraints in a chain, and the mass ratio from which even two constraints form a chain.
const LINKS_MIN: usize = 3;
const MASS_RATIO_MIN: f32 = 20.0;

/// A chain of constraints along an axis, in the positive direction.
#[derive(Clone, Copy, Debug)]
struct Chain {
    /// Index of its first body in `bodies`. A chain has one more body than constraints.
    bodies: u32,
    /// Index of its first constraint in `links`.
    links: u32,
    count: u32,
    /// 0 for x, 1 for y.
    axis: usize,
}

/// The chains of an island, and scratch memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chains {
    chains: Vec<Chain>,
    bodies: Vec<u32>,
    masses: Vec<f32>,
    links: Vec<u32>,
    /// Constraints of the island that are in no chain, with faces before slanted normals. A body that moves from face
    /// to face is supported by the faces, so that the edge in between has nothing left to push.
    pub others: Vec<u32>,
    edges: Vec<Edge>,
    /// By slot: the last edge going up from the body, the number of unused edges going down from it, and the last
    /// path through it.
    up: Vec<u32>,
    supports: Vec<u32>,
    visited_by: Vec<u32>,
    path: u32,
    nodes: Vec<ChainNode>,
    pools: Vec<Pool>,
    changes: Vec<f32>,
}

/// A constraint, seen as an edge from the lower to the higher body.
#[derive(Clone, Copy, Debug)]
struct Edge {
    constraint: u32,
    low: u32,
    high: u32,
    /// The previous edge that goes up from `low`.
    next: u32,
    used: bool,
    in_chain: bool,
}

const NONE: u32 = u32::MAX;

impl Chains {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.up.resize(slots, NONE);
        self.supports.resize(slots, 0);
        self.visited_by.resize(slots, 0);
    }

    /// Finds the chains of an island.
    pub fn find(&mut self, constraints: &[ContactConstraint], island: &[u32]) {
        if island.len() < 2 {
            self.find_none(island);
            return;
        }
        self.clear();
        for axis in 0..2 {
            self.find_along(axis, constraints, island);
        }
        let slanted = |constraint: &ContactConstraint| {
            constraint.normal.x != 0.0 && constraint.normal.y != 0.0
        };
        self.others.extend(island.iter().filter(|&&index| slanted(&constraints[index as usize])));
    }

    /// Leaves every constraint of an island outside chains.
    pub fn find_none(&mut self, island: &[u32]) {
        self.clear();
        self.others.extend(island);
    }

    fn clear(&mut self) {
        self.chains.clear();
        self.bodies.clear();
        self.masses.clear();
        self.links.clear();
        self.others.clear();
    }

    fn find_along(&mut self, axis: usize, constraints: &[ContactConstraint], island: &[u32]) {
        self.list_edges(axis, constraints, island);
        for edge in 0..self.edges.len() {
            if !self.edges[edge].used && self.supports[self.edges[edge].low as usize] == 0 {
                self.follow_load(edge, axis, constraints);
            }
        }
        for edge in 0..self.edges.len() {
            if !self.edges[edge].used {
                self.follow_load(edge, axis, constraints);
            }
        }
        for edge in &self.edges {
            self.up[edge.low as usize] = NONE;
            self.supports[edge.high as usize] = 0;
            if !edge.in_chain {
                self.others.push(edge.constraint);
            }
        }
    }

    fn list_edges(&mut self, axis: usize, constraints: &[ContactConstraint], island: &[u32]) {
        self.edges.clear();
        for &index in island {
            let constraint = &constraints[index as usize];
            if constraint.normal[1 - axis] != 0.0 {
                continue;
            }
            let upward = constraint.normal[axis] > 0.0;
            let (low, high) =
                if upward { (constraint.a, constraint.b) } else { (constraint.b, constraint.a) };
            let next = self.up[low as usize];
            self.up[low as usize] = self.edges.len() as u32;
            self.supports[high as usize] += 1;
            self.edges.push(Edge {
                constraint: index,
                low,
                high,
                next,
                used: false,
                in_chain: false,
            });
        }
    }

    /// Follows the load upwards from an edge, and keeps the path if it is long enough for a chain.
    fn follow_load(&mut self, first: usize, axis: usize, constraints: &[ContactConstraint]) {
        self.path = self.path.wrapping_add(1);
        if self.path == 0 {
            self.visited_by.fill(0);
            self.path = 1;
        }
        let (bodies, links) = (self.bodies.len(), self.links.len());
        self.push_body(self.edges[first].low, &constraints[self.edges[first].constraint as usize]);
        let mut next = Some(first);
        while let Some(at) = next {
            let edge = &mut self.edges[at];
            edge.used = true;
            self.links.push(at as u32);
            let Edge { high, constraint, .. } = *edge;
            self.supports[high as usize] -= 1;
            self.push_body(high, &constraints[constraint as usize]);
            next = self.next_link(high, constraints);
        }
        let count = self.links.len() - links;
        if count >= LINKS_MIN || count == 2 && self.mass_ratio(bodies) >= MASS_RATIO_MIN {
            for link in &mut self.links[links..] {
                let edge = &mut self.edges[*link as usize];
                edge.in_chain = true;
                *link = edge.constraint;
            }
            let (bodies, links, count) = (bodies as u32, links as u32, count as u32);
            self.chains.push(Chain { bodies, links, count, axis });
        } else {
            self.bodies.truncate(bodies);
            self.masses.truncate(bodies);
            self.links.truncate(links);
        }
    }

    /// Adds a body of `constraint` to the path.
    fn push_body(&mut self, slot: u32, constraint: &ContactConstraint) {
        let inv_mass =
            if slot == constraint.a { constraint.inv_mass_a } else { constraint.inv_mass_b };
        self.bodies.push(slot);
        self.masses.push(1.0 / inv_mass);
        self.visited_by[slot as usize] = self.path;
    }

    /// Returns the unused edge with the largest impulse going up from a body. Edges from an immovable body, which
    /// ends a chain, edges to a body that is already on the path, and edges that would give the chain an immovable
    /// body at both ends are excluded.
    fn next_link(&self, slot: u32, constraints: &[ContactConstraint]) -> Option<usize> {
        if self.masses.last() == Some(&f32::INFINITY) {
            return None;
        }
        let from_fixed = self.masses[self.bodies.len() - self.path_links() - 1] == f32::INFINITY;
        let mut best: Option<(usize, f32)> = None;
        let mut at = self.up[slot as usize];
        while at != NONE {
            let edge = &self.edges[at as usize];
            let constraint = &constraints[edge.constraint as usize];
            let inv_mass = if edge.high == constraint.a {
                constraint.inv_mass_a
            } else {
                constraint.inv_mass_b
            };
            let open = !edge.used && self.visited_by[edge.high as usize] != self.path;
            if open && !(from_fixed && inv_mass == 0.0) {
                // The list runs from high constraints to low ones, so among equals the lowest wins.
                if best.is_none_or(|(_, largest)| constraint.normal_impulse >= largest) {
                    best = Some((at as usize, constraint.normal_impulse));
                }
            }
            at = edge.next;
        }
        best.map(|(at, _)| at)
    }

    /// Number of constraints on the path under construction.
    fn path_links(&self) -> usize {
        let done = self.chains.last().map_or(0, |chain| chain.links + chain.count);
        self.links.len() - done as usize
    }

    fn mass_ratio(&self, first: usize) -> f32 {
        let movable = self.masses[first..].iter().filter(|mass| mass.is_finite());
        let (mut lightest, mut heaviest) = (f32::INFINITY, 0.0);
        for &mass in movable {
            lightest = if mass < lightest { mass } else { lightest };
            heaviest = if mass > heaviest { mass } else { heaviest };
        }
        heaviest / lightest
    }

    /// The constraints in chains.
    pub fn links(&self) -> &[u32] {
        &self.links
    }

    /// Solves every chain once.
    #[inline(never)]
    pub fn sweep<const FRICTION: bool>(
        &mut self,
        constraints: &mut [ContactConstraint],
        velocity: &mut [Vec2],
    ) -> SweepChange {
        let mut change = SweepChange::default();
        for index in 0..self.chains.len() {
            self.solve::<FRICTION>(self.chains[index], constraints, velocity, &mut change);
        }
        change
    }

    fn solve<const FRICTION: bool>(
        &mut self,
        chain: Chain,
        constraints: &mut [ContactConstraint],
        velocity: &mut [Vec2],
        change: &mut SweepChange,
    ) {
        let (first, count) = (chain.bodies as usize, chain.count as usize);
        let bodies = &self.bodies[first..=first + count];
        let masses = &self.masses[first..=first + count];
        let links = &self.links[chain.links as usize..][..count];
        self.nodes.clear();
        let mut below = 0.0;
        for (index, (&body, &mass)) in bodies.iter().zip(masses).enumerate() {
            let link = links.get(index).map(|&link| &constraints[link as usize]);
            let above = link.map_or(0.0, |constraint| constraint.normal_impulse);
            let closing_max = link.map_or(0.0, |constraint| -constraint.min_normal_velocity);
            // The speed without the chain's own impulses.
            let speed = without_dust(velocity[body as usize][chain.axis] + (above - below) / mass);
            self.nodes.push(ChainNode { speed, mass, closing_max });
            below = above;
        }
        pool(&mut self.nodes, &mut self.pools);
        self.changes.clear();
        self.changes.resize(count, 0.0);
        for pool in &self.pools {
            // From here on `speed` holds the change.
            let nodes = &mut self.nodes[pool.first..pool.end];
            for (node, &body) in nodes.iter_mut().zip(&bodies[pool.first..]) {
                if node.mass == f32::INFINITY {
                    // The node's speed was summed along the pool and may be off by rounding.
                    node.speed = 0.0;
                    continue;
                }
                let speed = &mut velocity[body as usize][chain.axis];
                let change = node.speed - *speed;
                *speed = node.speed;
                node.speed = change;
            }
            sum_impulses(*pool, &self.nodes, links, constraints, &mut self.changes);
        }
        for (link, &index) in links.iter().enumerate() {
            let constraint = &mut constraints[index as usize];
            let before = constraint.normal_impulse;
            constraint.normal_impulse = max(before + self.changes[link], 0.0);
            let mut speed_change = 0.0;
            if before > 0.0 || constraint.normal_impulse > 0.0 {
                speed_change = (self.nodes[link + 1].speed - self.nodes[link].speed).abs();
            }
            if FRICTION {
                speed_change = max(speed_change, solve_friction(constraint, velocity));
            }
            change.count::<FRICTION>(constraint, speed_change);
        }
    }
}

/// Sums the changes in the impulses around a pool. No impulse acts between two pools. Inside a pool, consecutive
/// changes differ by the change in a body's momentum, summed from the end that can move.
#[inline]
fn sum_impulses(
    pool: Pool,
    nodes: &[ChainNode],
    links: &[u32],
    constraints: &[ContactConstraint],
    changes: &mut [f32],
) {
    let Pool { first, end, .. } = pool;
    let fixed_above = nodes[end - 1].mass == f32::INFINITY && end - first > 1;
    let released = |link: usize| -constraints[links[link] as usize].normal_impulse;
    if end - 1 < links.len() {
        changes[end - 1] = released(end - 1);
    }
    if fixed_above {
        let mut change = if first > 0 { released(first - 1) } else { 0.0 };
        for index in first..end - 1 {
            change -= nodes[index].mass * nodes[index].speed;
            changes[index] = change;
        }
    } else {
        let mut change = if end - 1 < links.len() { released(end - 1) } else { 0.0 };
        for index in (first + 1..end).rev() {
            change += nodes[index].mass * nodes[index].speed;
            changes[index - 1] = change;
        }
    }
}
