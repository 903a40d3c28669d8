//! Bodies joined by springs, or held by a spring of nonzero length: an implicit step.
//!
//! With t in [1/2, 1] the path of a body is h ((1-t) v0 + t v1), and each spring pulls with its
//! mean length (1-t) |r0| + t |r1| along the mean direction. At t = 1/2 that is the midpoint rule
//! with the discrete gradient of Gonzalez (1996): of second order, and it keeps energy exactly
//! however stiff a spring is. Damping needs more: decay by y in a step is e^-y if t = 1 / (1 -
//! e^-y) - 1/y (Liniger and Willoughby 1970), which never overshoots and is 1/2 + y/12 where y is
//! small, so the order stays; it is used for springs that do not oscillate, or oscillate too fast
//! for the step. Each connected component is a network with one t, that of its fastest decay, and
//! the system is symmetric.
//!
//! A network whose fastest oscillation advances by more than [`SUBSTEP_PHASE`] in a step takes
//! substeps, as far as their work is bounded; oscillations that damping ends within a few steps need
//! none. Newton's method finds v1; a compressed spring gets no stiffness across it, so every system is
//! positive definite. Where springs rest the move is zero for any step: rest points are exact.
//!
//! Where something is in the way of a network with such oscillations, it takes another step instead
//! (see `held`).

mod held;
mod link;
mod plane;

use super::air::{Air, FAST_PHASE, Kind, Move};
use super::drag::Drag;
use super::elimination::{Elimination, EliminationOrder};
use super::springs::{Spring, SpringEnd};
use crate::bodies::Bodies;
use crate::math::exp_m1;
use crate::solver::islands;
use glam::{DMat2, DVec2};
use link::{End, Link, max_or_nan};
use plane::Plane;

/// Phase of the fastest oscillation in a substep, radians.
const SUBSTEP_PHASE: f64 = 1.0;
/// Share of an oscillation's energy, about, that damping takes in a step, from which it needs no substeps: it ends before
/// errors of its phase matter. Those of a rope of ten bodies would take five times as long.
const DAMPED: f64 = 0.15;
/// Most substeps of a step.
const SUBSTEPS_MAX: usize = 100;
/// Most springs times substeps of a network, unless it takes a single one.
const SUBSTEP_WORK_MAX: usize = 8192;
/// Most rounds of Newton's method in a substep; three or four are typical.
const ROUNDS_MAX: u32 = 12;
/// Convergence: change of a velocity, as a share of the largest one. Errors add up over the steps,
/// and energy with them, unless damping takes it.
const PRECISION: f64 = 1e-9;
const PRECISION_DAMPED: f64 = 1e-7;
/// A round that leaves more than this share of the previous change triggers a new factorisation.
const SLOW: f64 = 0.1;
/// Final change beyond which the rounds did not converge.
const DIVERGED: f64 = 1e-6;
/// Smallest scale of the speeds for the two above, units/s.
const SPEED_MIN: f64 = 1e-3;
/// A damped spring whose phase advances by less than this in a step, in radians, uses the midpoint
/// rule; faster oscillations, which a step cannot resolve, only have to decay.
const PHASE_MAX: f64 = 4.0;

/// A body of the network.
#[derive(Clone, Debug)]
struct Node {
    slot: u32,
    drag: Drag,
    /// From here on: values of this step.
    mass: f64,
    gravity: DVec2,
    /// Path since the start of the step.
    path: DVec2,
    /// Velocity without obstacles, and mass that resists them.
    free: DVec2,
    resistance: f64,
    /// Values of this substep. Rate of drag against the wind, 1/s.
    rate: f64,
    /// Decay in it, y.
    decay: f64,
    start: DVec2,
    before: DVec2,
    velocity: DVec2,
}

/// A connected component: bodies and springs that are joined.
#[derive(Clone, Debug, Default)]
pub(super) struct Network {
    /// In the order of elimination.
    nodes: Vec<Node>,
    links: Vec<Link>,
    system: Elimination,
    /// Scratch: residual of the velocities, then the change that corrects it.
    residual: Vec<DVec2>,
    /// Whether contacts act on its neighbours too in this step.
    responds: bool,
    /// Whether Newton's method found no solution in this step.
    pub has_diverged: bool,
    /// Whether damping ends all its oscillations within a few steps.
    is_damped: bool,
    /// Weight t of the end of a substep.
    weight: f64,
    planes: Vec<Plane>,
}

/// An end of a link: position at the start, velocities at start and end.
#[derive(Clone, Copy)]
struct EndState {
    position: DVec2,
    before: DVec2,
    velocity: DVec2,
}

/// The nodes of a link, and their inverse masses; 0 where an end is none.
#[inline(never)]
fn inverse_masses(link: &Link, nodes: &[Node]) -> ([Option<u32>; 2], [f64; 2]) {
    let ends = [link.a.node(), link.b.node()];
    (ends, ends.map(|end| end.map_or(0.0, |node| 1.0 / nodes[node as usize].mass)))
}

/// The networks of these slots, ascending, with their drag, and of all springs that touch them.
pub(super) fn networks(slots: &[u32], drag: &[Drag], springs: &[Spring]) -> Vec<Network> {
    let node_of = |slot: u32| slots.binary_search(&slot).ok().map(|at| at as u32);
    let edge = |spring: &Spring| match spring.end {
        SpringEnd::Body(other) => node_of(spring.body.index).zip(node_of(other.index)),
        SpringEnd::Point(_) => None,
    };
    let edges: Vec<(u32, u32)> = springs.iter().filter_map(edge).collect();
    let component = components(slots.len(), &edges);
    let mut networks = Vec::new();
    for root in 0..slots.len() {
        if component[root] as usize != root {
            continue;
        }
        let members = (root..slots.len()).filter(|&node| component[node] as usize == root);
        let (slots, drag): (Vec<u32>, Vec<Drag>) =
            members.map(|node| (slots[node], drag[node])).unzip();
        networks.push(Network::new(&slots, &drag, springs));
    }
    networks
}

impl Network {
    /// Builds the network of these slots, ascending, with their drag, and of the springs of a world
    /// that touch them.
    fn new(slots: &[u32], drag: &[Drag], springs: &[Spring]) -> Network {
        let node_of = |slot: u32| slots.binary_search(&slot).ok().map(|at| at as u32);
        let ends = |spring: &Spring| {
            let other = match spring.end {
                SpringEnd::Body(id) => node_of(id.index),
                SpringEnd::Point(_) => None,
            };
            (node_of(spring.body.index), other)
        };
        let edges: Vec<(u32, u32)> =
            springs.iter().filter_map(|s| ends(s).0.zip(ends(s).1)).collect();
        let (mut system, mut order) = (Elimination::default(), EliminationOrder::default());
        system.build(slots.len(), &edges, &mut order);
        let index_of = order.index_of;
        let mut order = vec![0; slots.len()];
        for (node, &at) in index_of.iter().enumerate() {
            order[at as usize] = node;
        }
        let node = |&node: &usize| Node {
            slot: slots[node],
            drag: drag[node],
            mass: 1.0,
            gravity: DVec2::ZERO,
            path: DVec2::ZERO,
            free: DVec2::ZERO,
            resistance: 1.0,
            rate: 0.0,
            decay: 0.0,
            start: DVec2::ZERO,
            before: DVec2::ZERO,
            velocity: DVec2::ZERO,
        };
        let end = |slot: u32| match node_of(slot) {
            Some(node) => End::Node(index_of[node as usize]),
            None => End::Slot(slot),
        };
        let link = |spring: &Spring| Link {
            a: end(spring.body.index),
            b: match spring.end {
                SpringEnd::Point(point) => End::Point(point.as_dvec2()),
                SpringEnd::Body(id) => end(id.index),
            },
            rest_length: f64::from(spring.rest_length),
            stiffness: f64::from(spring.stiffness),
            damping: f64::from(spring.damping),
        };
        let touching = springs.iter().filter(|s| ends(s).0.is_some() || ends(s).1.is_some());
        Network {
            nodes: order.iter().map(node).collect(),
            links: touching.map(link).collect(),
            system,
            residual: vec![DVec2::ZERO; slots.len()],
            responds: false,
            has_diverged: false,
            is_damped: false,
            weight: 0.5,
            planes: Vec::new(),
        }
    }

    pub fn slots(&self) -> impl Iterator<Item = u32> + '_ {
        self.nodes.iter().map(|node| node.slot)
    }

    /// Computes the moves of a step. Fast ones that may touch something first take an implicit step, to find where that
    /// leads.
    pub fn fly(&mut self, bodies: &Bodies, air: &Air, may_touch: bool, moves: &mut Vec<Move>) {
        let first = moves.len();
        self.read_bodies(bodies, air);
        self.has_diverged = false;
        self.responds = false;
        self.is_damped = self.links.iter().all(|link| self.decay(link) * air.dt >= DAMPED);
        let is_fast = may_touch && self.phase(air.dt) > FAST_PHASE;
        self.planes.clear();
        if is_fast {
            self.advance_implicitly(bodies, air);
            for node in &self.nodes {
                let found = air.limited_move(node.slot, node.velocity, node.path);
                moves.push(Move { kind: Kind::Fast { implicit: found.path }, ..found });
            }
            self.read_bodies(bodies, air);
        }
        let substeps = self.substeps(air.dt);
        let part = Air { dt: air.dt / substeps as f64, ..*air };
        for index in 0..substeps {
            self.advance(bodies, &part, index as f64 * part.dt);
        }
        for (index, node) in self.nodes.iter().enumerate() {
            let found = air.limited_move(node.slot, node.velocity, node.path);
            match moves.get_mut(first + index) {
                Some(fast) => *fast = Move { kind: fast.kind, ..found },
                None => moves.push(found),
            }
        }
    }

    fn read_bodies(&mut self, bodies: &Bodies, air: &Air) {
        for node in &mut self.nodes {
            let slot = node.slot as usize;
            node.mass = 1.0 / f64::from(bodies.inverse_mass[slot]);
            node.gravity = air.gravity * f64::from(bodies.gravity_scale[slot]);
            node.path = DVec2::ZERO;
            node.start = bodies.center[slot].as_dvec2();
            node.velocity = bodies.velocity[slot].as_dvec2();
        }
    }

    /// Rate at which the damping of a spring takes energy from its oscillation, 1/s.
    fn decay(&self, link: &Link) -> f64 {
        let (_, inv_masses) = inverse_masses(link, &self.nodes);
        link.damping * (inv_masses[0] + inv_masses[1])
    }

    /// Number of substeps in `dt` seconds.
    fn substeps(&mut self, dt: f64) -> usize {
        let most = (SUBSTEP_WORK_MAX / self.links.len()).clamp(1, SUBSTEPS_MAX);
        if self.is_damped {
            return 1;
        }
        ((self.phase(dt) / SUBSTEP_PHASE).ceil() as usize).clamp(1, most)
    }

    /// Upper bound of the phase of the fastest oscillation in `dt` seconds, radians: by Gershgorin's
    /// theorem the square of its frequency is at most the largest sum of a row of K / m.
    fn phase(&mut self, dt: f64) -> f64 {
        // Only scratch here.
        self.residual.fill(DVec2::ZERO);
        for link in &self.links {
            let (ends, inv_masses) = inverse_masses(link, &self.nodes);
            let times = if ends[0].is_some() && ends[1].is_some() { 2.0 } else { 1.0 };
            for (node, inv_mass) in ends.into_iter().zip(inv_masses) {
                if let Some(node) = node {
                    self.residual[node as usize].x += times * link.stiffness * inv_mass;
                }
            }
        }
        let squared = self.residual.iter().fold(0.0, |most, row| max_or_nan(row.x, most));
        squared.sqrt() * dt
    }

    /// Advances by a substep that begins `elapsed` seconds after the start of the step.
    fn advance(&mut self, bodies: &Bodies, air: &Air, elapsed: f64) {
        self.begin_substep(air);
        self.choose_weight(air.dt);
        // A NaN counts as diverged too.
        let is_solved = |change: f64| change <= DIVERGED;
        if !is_solved(self.solve(bodies, air, elapsed)) {
            // Springs that turn over within a step: stability is enough, and the guard sees to the energy.
            self.has_diverged = true;
            self.weight = 1.0;
            if !self.solve(bodies, air, elapsed).is_finite() {
                self.reset_velocities();
            }
        }
        self.move_nodes(air.dt);
    }

    fn begin_substep(&mut self, air: &Air) {
        for node in &mut self.nodes {
            node.before = node.velocity;
            let speed = (node.before - air.wind).length();
            node.rate = f64::from(node.drag.linear) + f64::from(node.drag.quadratic) * speed;
        }
    }

    fn move_nodes(&mut self, dt: f64) {
        for node in &mut self.nodes {
            let path = (node.before * (1.0 - self.weight) + node.velocity * self.weight) * dt;
            node.start += path;
            node.path += path;
        }
    }

    /// Chooses the weight: that of the fastest decay.
    fn choose_weight(&mut self, dt: f64) {
        for node in &mut self.nodes {
            node.decay = node.rate * dt;
        }
        for link in &self.links {
            let (ends, inv_masses) = inverse_masses(link, &self.nodes);
            let weight = inv_masses[0] + inv_masses[1];
            let decay = link.damping * weight * dt;
            let phase = (link.stiffness * weight).sqrt() * dt;
            let follows = phase < PHASE_MAX && decay < 2.0 * phase;
            for node in ends.into_iter().flatten().filter(|_| !follows) {
                self.nodes[node as usize].decay += decay;
            }
        }
        self.weight = 0.5;
        for node in &self.nodes {
            self.weight = max_or_nan(fitted(node.decay), self.weight);
        }
    }

    /// Resets to the velocities at the start, which are also the result where numbers overflow.
    fn reset_velocities(&mut self) {
        self.nodes.iter_mut().for_each(|node| node.velocity = node.before);
    }

    /// The first guess: the present velocity or, where a spring may turn over along it, the one for
    /// which nothing moves.
    fn guess_velocities(&mut self, dt: f64) {
        let rests = !self.is_damped && self.phase(dt) > SUBSTEP_PHASE;
        let factor = if rests { 1.0 - 1.0 / self.weight } else { 1.0 };
        self.nodes.iter_mut().for_each(|node| node.velocity = node.before * factor);
    }

    /// Newton's method, keeping the factored system as long as it converges; returns the last
    /// change, as a share of the largest speed.
    fn solve(&mut self, bodies: &Bodies, air: &Air, elapsed: f64) -> f64 {
        self.guess_velocities(air.dt);
        let precision = if self.is_damped { PRECISION_DAMPED } else { PRECISION };
        let mut change = f64::INFINITY;
        let mut stale = true;
        for _ in 0..ROUNDS_MAX {
            self.assemble(bodies, air, elapsed, stale);
            if stale {
                self.system.factor();
            }
            self.system.solve(&mut self.residual);
            let before = change;
            change = self.apply_newton_step();
            if change <= precision {
                break;
            }
            stale = change > SLOW * before;
        }
        change
    }

    /// Computes the residual of the velocities, and the system matrix if `with_matrix`.
    fn assemble(&mut self, bodies: &Bodies, air: &Air, elapsed: f64, with_matrix: bool) {
        if with_matrix {
            self.system.clear();
        }
        let t = self.weight;
        for (at, node) in (0u32..).zip(&self.nodes) {
            let through_air = node.before * (1.0 - t) + node.velocity * t - air.wind;
            let force = (node.gravity - through_air * node.rate) * air.dt;
            self.residual[at as usize] = (node.before + force - node.velocity) * node.mass;
            if with_matrix {
                let inertia = node.mass * (1.0 + t * node.rate * air.dt);
                self.system.add_diagonal(at, DMat2::IDENTITY * inertia);
            }
        }
        for index in 0..self.links.len() {
            self.add_spring(index, bodies, (air.dt, elapsed), with_matrix);
        }
        for plane in self.planes.iter().filter(|plane| plane.is_active) {
            let (at, normal) = (plane.node, plane.normal);
            self.residual[at as usize] += normal * plane.impulse(self.nodes[at as usize].velocity);
            if with_matrix {
                let outer = DMat2::from_cols(normal * normal.x, normal * normal.y);
                self.system.add_diagonal(at, outer * plane.stiffness);
            }
        }
    }

    /// Applies the change that was found.
    fn apply_newton_step(&mut self) -> f64 {
        let (mut largest, mut change) = (SPEED_MIN * SPEED_MIN, 0.0);
        for (node, &step) in self.nodes.iter_mut().zip(&self.residual) {
            node.velocity += step;
            largest = max_or_nan(node.velocity.length_squared(), largest);
            change = max_or_nan(step.length_squared(), change);
        }
        (change / largest).sqrt()
    }

    /// Adds a spring to the residual, and to the matrix if `with_matrix`.
    fn add_spring(
        &mut self,
        index: usize,
        bodies: &Bodies,
        (dt, elapsed): (f64, f64),
        with_matrix: bool,
    ) {
        let link = &self.links[index];
        let state = |end: End| self.end_state(end, bodies, elapsed);
        let (a, b) = (state(link.a), state(link.b));
        let (node_a, node_b) = (link.a.node(), link.b.node());
        let t = self.weight;
        let early = b.position - a.position;
        let speed = (b.before - a.before) * (1.0 - t) + (b.velocity - a.velocity) * t;
        let late = early + speed * dt;
        let pull = link.pull(early, late, speed, t);
        let impulse = pull.force * dt;
        let stiffness_matrix = pull.stiffness(link, t, dt);
        if let Some(node) = node_a {
            self.residual[node as usize] -= impulse;
        }
        if let Some(node) = node_b {
            self.residual[node as usize] += impulse;
        }
        if !with_matrix {
            return;
        }
        for node in [node_a, node_b].into_iter().flatten() {
            self.system.add_diagonal(node, stiffness_matrix);
        }
        if let (Some(one), Some(other)) = (node_a, node_b) {
            self.system.add(one, other, -stiffness_matrix);
        }
    }

    fn end_state(&self, end: End, bodies: &Bodies, elapsed: f64) -> EndState {
        match end {
            End::Node(node) => {
                let node = &self.nodes[node as usize];
                EndState { position: node.start, before: node.before, velocity: node.velocity }
            }
            End::Slot(slot) => {
                let velocity = bodies.velocity[slot as usize].as_dvec2();
                let position = bodies.center[slot as usize].as_dvec2() + velocity * elapsed;
                EndState { position, before: velocity, velocity }
            }
            End::Point(position) => {
                EndState { position, before: DVec2::ZERO, velocity: DVec2::ZERO }
            }
        }
    }
}

/// The weight for which a decay by `decay` in a step is exact.
fn fitted(decay: f64) -> f64 {
    if decay < 1e-3 { 0.5 + decay / 12.0 } else { -1.0 / exp_m1(-decay) - 1.0 / decay }
}

/// For each node, the smallest one of its connected component.
fn components(count: usize, edges: &[(u32, u32)]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..count as u32).collect();
    edges.iter().for_each(|&(a, b)| islands::join(&mut parent, a, b));
    (0..count as u32).map(|at| islands::root(&mut parent, at)).collect()
}
