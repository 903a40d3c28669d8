//! Lines: chains of contacts along an axis, each solved exactly within a sweep.
//!
//! Rows whose normal is exactly +-x or +-y are the edges of a graph for each axis. It is covered by
//! paths that share no edge: first from every body that nothing supports on that axis, then from
//! what is left; each climbs along the unused edge with the largest stored impulse, which is where
//! the load goes. A column of any height, with masses of any ratio, is then one exact step of the
//! sweep, where one row after another would need as many sweeps as the square of its height.
//!
//! A line takes its own impulses out of the speeds, pools (see `pools`) and sums the impulses from
//! its free end: the change in each is that of the momentum beyond it.

use super::pools::{Node, Pool, pool};
use super::rows::Row;
use super::sweep::{Change, rub};
use crate::math::max;
use glam::Vec2;

/// Shortest line, in rows, and the ratio of masses from which on two rows are one too.
const LINKS_MIN: usize = 3;
const MASS_RATIO_MIN: f32 = 20.0;

/// A chain of rows along an axis, in the plus direction.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// First of its bodies in `bodies`; one more than rows.
    bodies: u32,
    /// First of its rows in `links`.
    links: u32,
    /// Rows.
    count: u32,
    /// 0 for x, 1 for y.
    axis: usize,
}

/// The lines of an island, and scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lines {
    lines: Vec<Line>,
    bodies: Vec<u32>,
    masses: Vec<f32>,
    links: Vec<u32>,
    /// Rows of the island that are in no line; faces before what is slanted: a body that crosses
    /// from face to face is carried by them, and the edge between has nothing left to push. Those that
    /// pass each other are in neither: they carry nothing.
    pub others: Vec<u32>,
    edges: Vec<Edge>,
    /// By slot: last edge up from it, edges down from it that are unused, and the path that came by.
    up: Vec<u32>,
    supports: Vec<u32>,
    seen: Vec<u32>,
    path: u32,
    nodes: Vec<Node>,
    pools: Vec<Pool>,
    changes: Vec<f32>,
}

/// A row as an edge from the lower to the higher body.
#[derive(Clone, Copy, Debug)]
struct Edge {
    row: u32,
    low: u32,
    high: u32,
    /// The edge before it that goes up from `low`.
    next: u32,
    used: bool,
    in_line: bool,
}

const NONE: u32 = u32::MAX;

impl Lines {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.up.resize(slots, NONE);
        self.supports.resize(slots, 0);
        self.seen.resize(slots, 0);
    }

    /// Finds the lines of an island.
    pub fn find(&mut self, rows: &[Row], island: &[u32]) {
        self.lines.clear();
        self.bodies.clear();
        self.masses.clear();
        self.links.clear();
        self.others.clear();
        if island.len() < 2 {
            self.others.extend(island);
            return;
        }
        for axis in 0..2 {
            self.find_along(axis, rows, island);
        }
        let slanted = |row: &Row| row.normal.x != 0.0 && row.normal.y != 0.0 && !row.passes();
        self.others.extend(island.iter().filter(|&&place| slanted(&rows[place as usize])));
    }

    fn find_along(&mut self, axis: usize, rows: &[Row], island: &[u32]) {
        self.list_edges(axis, rows, island);
        for edge in 0..self.edges.len() {
            if !self.edges[edge].used && self.supports[self.edges[edge].low as usize] == 0 {
                self.climb(edge, axis, rows);
            }
        }
        for edge in 0..self.edges.len() {
            if !self.edges[edge].used {
                self.climb(edge, axis, rows);
            }
        }
        for edge in &self.edges {
            self.up[edge.low as usize] = NONE;
            self.supports[edge.high as usize] = 0;
            if !edge.in_line {
                self.others.push(edge.row);
            }
        }
    }

    fn list_edges(&mut self, axis: usize, rows: &[Row], island: &[u32]) {
        self.edges.clear();
        for &place in island {
            let row = &rows[place as usize];
            if row.normal[1 - axis] != 0.0 || row.passes() {
                continue;
            }
            let upward = row.normal[axis] > 0.0;
            let (low, high) = if upward { (row.a, row.b) } else { (row.b, row.a) };
            let next = self.up[low as usize];
            self.up[low as usize] = self.edges.len() as u32;
            self.supports[high as usize] += 1;
            self.edges.push(Edge { row: place, low, high, next, used: false, in_line: false });
        }
    }

    /// Follows the load from an edge up, and keeps the path if it is worth being a line.
    fn climb(&mut self, first: usize, axis: usize, rows: &[Row]) {
        self.path = self.path.wrapping_add(1);
        let (bodies, links) = (self.bodies.len(), self.links.len());
        self.pass(self.edges[first].low, &rows[self.edges[first].row as usize]);
        let mut next = Some(first);
        while let Some(at) = next {
            let edge = &mut self.edges[at];
            edge.used = true;
            self.links.push(at as u32);
            let Edge { high, row, .. } = *edge;
            self.supports[high as usize] -= 1;
            self.pass(high, &rows[row as usize]);
            next = self.steepest(high, rows);
        }
        let count = self.links.len() - links;
        if count >= LINKS_MIN || count == 2 && self.mass_ratio(bodies) >= MASS_RATIO_MIN {
            for link in &mut self.links[links..] {
                let edge = &mut self.edges[*link as usize];
                edge.in_line = true;
                *link = edge.row;
            }
            let (bodies, links, count) = (bodies as u32, links as u32, count as u32);
            self.lines.push(Line { bodies, links, count, axis });
        } else {
            self.bodies.truncate(bodies);
            self.masses.truncate(bodies);
            self.links.truncate(links);
        }
    }

    /// Adds a body of `row` to the path.
    fn pass(&mut self, slot: u32, row: &Row) {
        let weight = if slot == row.a { row.weight_a } else { row.weight_b };
        self.bodies.push(slot);
        self.masses.push(1.0 / weight);
        self.seen[slot as usize] = self.path;
    }

    /// The unused edge up from a body with the largest impulse; none from a body that cannot be
    /// pushed, which ends a line, and none to a body that ends it at both ends or was passed.
    fn steepest(&self, slot: u32, rows: &[Row]) -> Option<usize> {
        if self.masses.last() == Some(&f32::INFINITY) {
            return None;
        }
        let from_fixed = self.masses[self.bodies.len() - self.links_of_path() - 1] == f32::INFINITY;
        let mut best: Option<(usize, f32)> = None;
        let mut at = self.up[slot as usize];
        while at != NONE {
            let edge = &self.edges[at as usize];
            let row = &rows[edge.row as usize];
            let weight = if edge.high == row.a { row.weight_a } else { row.weight_b };
            let open = !edge.used && self.seen[edge.high as usize] != self.path;
            if open && !(from_fixed && weight == 0.0) {
                // The list runs from high rows to low ones: of equals the lowest stays.
                if best.is_none_or(|(_, press)| row.press >= press) {
                    best = Some((at as usize, row.press));
                }
            }
            at = edge.next;
        }
        best.map(|(at, _)| at)
    }

    /// Rows of the path that is being made.
    fn links_of_path(&self) -> usize {
        let done = self.lines.last().map_or(0, |line| line.links + line.count);
        self.links.len() - done as usize
    }

    fn mass_ratio(&self, first: usize) -> f32 {
        let movable = self.masses[first..].iter().filter(|mass| mass.is_finite());
        let (mut least, mut most) = (f32::INFINITY, 0.0);
        for &mass in movable {
            least = if mass < least { mass } else { least };
            most = if mass > most { mass } else { most };
        }
        most / least
    }

    /// Solves every line once.
    #[inline(never)]
    pub fn sweep<const RUBS: bool>(&mut self, rows: &mut [Row], velocity: &mut [Vec2]) -> Change {
        let mut change = Change::default();
        for place in 0..self.lines.len() {
            self.solve::<RUBS>(self.lines[place], rows, velocity, &mut change);
        }
        change
    }

    fn solve<const RUBS: bool>(
        &mut self,
        line: Line,
        rows: &mut [Row],
        velocity: &mut [Vec2],
        change: &mut Change,
    ) {
        let (first, count) = (line.bodies as usize, line.count as usize);
        let bodies = &self.bodies[first..=first + count];
        let masses = &self.masses[first..=first + count];
        let links = &self.links[line.links as usize..][..count];
        let axis = line.axis;
        wish(&mut self.nodes, rows, velocity, (bodies, masses, links), axis);
        pool(&mut self.nodes, &mut self.pools);
        self.changes.clear();
        self.changes.resize(count, 0.0);
        for pool in &self.pools {
            // From here on `speed` is the change.
            for (node, &body) in
                self.nodes[pool.first..pool.end].iter_mut().zip(&bodies[pool.first..])
            {
                let speed = &mut velocity[body as usize][axis];
                let change = node.speed - *speed;
                *speed = node.speed;
                node.speed = change;
            }
            sum_impulses(*pool, &self.nodes, links, rows, &mut self.changes);
        }
        for (link, &place) in links.iter().enumerate() {
            let row = &mut rows[place as usize];
            let before = row.press;
            let press = before + self.changes[link];
            row.press = if press > 0.0 { press } else { 0.0 };
            let mut off = 0.0;
            if before > 0.0 || row.press > 0.0 {
                off = (self.nodes[link + 1].speed - self.nodes[link].speed).abs();
            }
            if RUBS {
                off = max(off, rub(row, velocity));
            }
            change.count::<RUBS>(row, off);
        }
    }
}

/// The speeds of a line's bodies without the line's own impulses.
#[inline]
fn wish(
    nodes: &mut Vec<Node>,
    rows: &[Row],
    velocity: &[Vec2],
    (bodies, masses, links): (&[u32], &[f32], &[u32]),
    axis: usize,
) {
    nodes.clear();
    let mut below = 0.0;
    for (place, (&body, &mass)) in bodies.iter().zip(masses).enumerate() {
        let (above, gap) = match links.get(place) {
            Some(&link) => (rows[link as usize].press, -rows[link as usize].bound),
            None => (0.0, 0.0),
        };
        let speed = velocity[body as usize][axis] + (above - below) / mass;
        nodes.push(Node { speed, mass, gap });
        below = above;
    }
}

/// The changes of the impulses around a pool: none presses between two pools, and inside one they
/// differ by the change of each body's momentum, summed from the end that can move.
#[inline]
fn sum_impulses(pool: Pool, nodes: &[Node], links: &[u32], rows: &[Row], changes: &mut [f32]) {
    let Pool { first, end, .. } = pool;
    let fixed_above = nodes[end - 1].mass == f32::INFINITY && end - first > 1;
    let released = |link: usize| -rows[links[link] as usize].press;
    if end - 1 < links.len() {
        changes[end - 1] = released(end - 1);
    }
    if fixed_above {
        let mut change = if first > 0 { released(first - 1) } else { 0.0 };
        for place in first..end - 1 {
            change -= nodes[place].mass * nodes[place].speed;
            changes[place] = change;
        }
    } else {
        let mut change = if end - 1 < links.len() { released(end - 1) } else { 0.0 };
        for place in (first + 1..end).rev() {
            change += nodes[place].mass * nodes[place].speed;
            changes[place - 1] = change;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::gap::FAR;
    use super::*;

    /// A row from a lower body to a higher one.
    fn upward((a, weight_a): (u32, f32), (b, weight_b): (u32, f32), bound: f32) -> Row {
        Row {
            a,
            b,
            normal: Vec2::Y,
            bound,
            mass: 1.0 / (weight_a + weight_b),
            weight_a,
            weight_b,
            friction: 0.0,
            press: 0.0,
            rub: 0.0,
            press_before: 0.0,
            rub_before: 0.0,
            press_along: 0.0,
            rub_along: 0.0,
            pair: 0,
        }
    }

    #[test]
    fn a_line_goes_by_what_can_carry_not_by_who_passes() {
        let (ground, light, passing, heavy) = ((0, 0.0), (1, 1e4), (2, 1.0), (3, 1e-4));
        let mut rows = [
            upward(ground, light, 0.0),
            upward(light, passing, -FAR / 0.02),
            upward(light, heavy, 0.0),
        ];
        let mut lines = Lines::default();
        lines.reserve(4);
        lines.find(&rows, &[0, 1, 2]);
        assert!(lines.others.is_empty(), "{:?}", lines.others);
        let mut velocity = [0.0, 0.0, -30.0, -3.0].map(|speed| Vec2::new(0.0, speed));
        lines.sweep::<true>(&mut rows, &mut velocity);
        assert_eq!(velocity.map(|v| v.y), [0.0, 0.0, -30.0, 0.0]);
    }
}
