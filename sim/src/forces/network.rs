//! Moves bodies that are joined by springs, or held by a spring of nonzero length, with an implicit step.
//!
//! With t in [1/2, 1], the path of a body is h ((1-t) v0 + t v1), and each spring pulls according to its mean length
//! (1-t) |r0| + t |r1| along the mean direction. At t = 1/2 this is the midpoint rule with the discrete gradient of
//! Gonzalez (1996), which is of second order and conserves energy exactly, however stiff a spring is. Damping needs a
//! larger t: a decay by y in a step comes out as e^-y if t = 1 / (1 - e^-y) - 1/y (Liniger and Willoughby 1970). This
//! never overshoots and is 1/2 + y/12 for small y, so the order is preserved. It is used for springs that do not
//! oscillate, or that oscillate too fast for the step. Each connected component is a network with a single t, that of
//! its fastest decay, and the system is symmetric.
//!
//! A network whose fastest oscillation advances by more than [`SUBSTEP_PHASE`] in a step takes substeps, to the
//! extent that [`VISITS_MAX`] allows. Oscillations that damping ends within a few steps need none. Newton's method
//! finds v1. A compressed spring gets no stiffness across its axis, so every system is positive definite. Where
//! springs are at rest, the move is zero for any step size, so rest points are exact.
//!
//! If something blocks a network with fast oscillations, it takes another kind of step instead (see `held`).

pub(super) mod build;
mod held;
mod link;

use super::air::{Air, Drag, FAST_PHASE, Move, MoveKind};
use super::elimination::Elimination;
use crate::bodies::Bodies;
use crate::math::exp_m1;
use glam::{DMat2, DVec2};
use link::{LinkEnd, NetworkLink, Plane, max_or_nan};

/// Phase of the fastest oscillation in a substep, radians.
const SUBSTEP_PHASE: f64 = 1.0;
/// Damping that takes more than about this share of an oscillation's energy in a step makes substeps unnecessary,
/// since the oscillation ends before errors in its phase matter. Substeps for a damped rope of ten bodies would take
/// five times as long.
const DAMPED: f64 = 0.15;
/// Maximum number of substeps in a step.
const SUBSTEPS_MAX: u64 = 100;
/// Number of spring visits in rounds of Newton's method that a world's networks share for their substeps, each time
/// moves are computed. It suffices for 50 springs to take 100 substeps each, in about a millisecond. Each network
/// takes at least one step.
pub(super) const VISITS_MAX: u64 = 20_480;
/// Maximum number of rounds of Newton's method in a substep, and the expected number.
const ROUNDS_MAX: u32 = 12;
const ROUNDS: u64 = 4;
/// Maximum number of rounds of an implicit step that Newton's method cannot solve. It is enough for stability.
const SAFE_ROUNDS: u32 = 6;
/// A network is too dense for Newton's method, which may factor in each round, if this many factorisations would
/// exceed its visits.
const DENSE: u64 = 4;
/// Number of factorisation products, or of solution blocks, that take as long as one spring visit. They take 4 ns
/// and 4 to 8 ns, while a visit takes 60 ns.
const PRODUCTS_PER_VISIT: u64 = 16;
const BLOCKS_PER_VISIT: u64 = 8;
/// Convergence limit for the change in a velocity, as a share of the largest velocity. Errors accumulate over the
/// steps, and so does the energy error unless damping removes it.
const PRECISION: f64 = 1e-9;
const PRECISION_DAMPED: f64 = 1e-7;
/// If more than this share of the previous change remains after a round, the matrix is factored again.
const SLOW: f64 = 0.1;
/// Final change beyond which the rounds count as not having converged, in a substep and in an implicit step.
const DIVERGED: f64 = 1e-6;
const DIVERGED_IMPLICIT: f64 = 1e-3;
/// Rounds are abandoned if the change after half of them exceeds this; converging rounds are far below it by then.
const HALFWAY: u32 = 6;
const HALFWAY_CHANGE: f64 = 1e-2;
/// Smallest reference speed for these relative changes, units/s.
const SPEED_MIN: f64 = 1e-3;
/// A damped spring whose phase advances by less than this in a step, in radians, uses the midpoint rule. Faster
/// oscillations, which a step cannot resolve, only have to decay.
const PHASE_MAX: f64 = 4.0;

/// A body of the network.
#[derive(Clone, Debug, Default)]
struct NetworkNode {
    slot: u32,
    drag: Drag,
    /// The fields from here on are values for this step.
    mass: f64,
    gravity_scale: f64,
    /// Path since the start of the step.
    path: DVec2,
    /// Velocity without obstacles, and the mass that resists them.
    free: DVec2,
    resistance: f64,
    /// The fields from here on are values for this substep. Rate of drag against the wind, 1/s.
    rate: f64,
    /// Decay y in the substep.
    decay: f64,
    start: DVec2,
    before: DVec2,
    velocity: DVec2,
}

/// A connected component of bodies and springs.
#[derive(Clone, Debug, Default)]
pub(super) struct Network {
    /// Bodies in elimination order.
    nodes: Vec<NetworkNode>,
    links: Vec<NetworkLink>,
    system: Elimination,
    /// Scratch for the residual of the velocities, then for the change that corrects it.
    residual: Vec<DVec2>,
    /// Upper bound on the angular frequency of its fastest oscillation, rad/s.
    frequency: f64,
    /// Whether the network turns over within a few steps and something may block it.
    is_fast: bool,
    pub visits: Visits,
    /// Whether implicit steps are left to safe rounds (see `solve_safely`), and whether the current one is safe.
    is_hard: bool,
    is_safe: bool,
    /// Whether contacts also act on a node's neighbours in this step.
    responds: bool,
    /// Whether part of this step is a first-order implicit one, because Newton's method failed or its visits were
    /// used up.
    pub has_diverged: bool,
    /// Whether damping ends all its oscillations within a few steps.
    is_damped: bool,
    /// Weight t given to the end of a substep.
    weight: f64,
    planes: Vec<Plane>,
}

/// Spring visits in a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Visits {
    /// Visits made by rounds.
    done: u64,
    /// Visits to which factorisations are equivalent.
    factored: u64,
    pub wanted: u64,
    pub allowed: u64,
}

impl Visits {
    pub fn all(&self) -> u64 {
        self.done + self.factored
    }

    pub fn forget(&mut self) {
        (self.done, self.factored) = (0, 0);
    }
}

/// An end of a link, with its position at the start and its velocities at the start and the end.
#[derive(Clone, Copy)]
struct EndState {
    position: DVec2,
    before: DVec2,
    velocity: DVec2,
}

/// The nodes of a link and their inverse masses; 0 for an end that is not a node.
#[inline(never)]
fn inverse_masses(link: &NetworkLink, nodes: &[NetworkNode]) -> ([Option<u32>; 2], [f64; 2]) {
    let ends = [link.a.node(), link.b.node()];
    (ends, ends.map(|end| end.map_or(0.0, |node| 1.0 / nodes[node as usize].mass)))
}

impl Network {
    pub fn slots(&self) -> impl Iterator<Item = u32> + '_ {
        self.nodes.iter().map(|node| node.slot)
    }

    /// Begins a step and computes how many visits the network wants.
    pub fn begin(&mut self, bodies: &Bodies, dt: f64, may_touch: bool) {
        self.read_bodies(bodies);
        self.find_frequency();
        self.has_diverged = false;
        self.responds = false;
        self.visits.forget();
        self.is_damped = self.links.iter().all(|link| self.decay(link) * dt >= DAMPED);
        self.is_fast = may_touch && self.frequency * dt > FAST_PHASE;
        self.visits.wanted = match self.is_dense(VISITS_MAX) {
            true => {
                self.visits_of_factorisation() + u64::from(SAFE_ROUNDS) * self.visits_of_round()
            }
            false => self.substeps(dt) * self.visits_of_substep(),
        };
    }

    /// Computes the moves of a step within roughly the allowed visits. Fast networks that may touch something first
    /// take an implicit step to find out where it leads.
    pub fn fly(&mut self, bodies: &Bodies, air: &Air, moves: &mut Vec<Move>) {
        let first = moves.len();
        self.is_hard = self.is_dense(self.visits.allowed);
        self.planes.clear();
        let is_resolved =
            self.substeps(air.dt) * self.visits_of_substep() <= 2 * self.visits.allowed;
        if self.is_fast {
            self.advance_implicitly(bodies, air, 0.0);
            for node in &self.nodes {
                let found = air.limited_move(node.slot, node.velocity, node.path);
                moves.push(Move { kind: MoveKind::Fast { implicit: found.path }, ..found });
            }
        }
        // If even one implicit step is hard to solve, then so are substeps that are far larger than they should be.
        if self.is_hard && !is_resolved {
            self.has_diverged = true;
            if !self.is_fast {
                self.advance_implicitly(bodies, air, 0.0);
            }
        } else {
            self.read_bodies(bodies);
            self.advance_in_substeps(bodies, air);
        }
        for (index, node) in self.nodes.iter().enumerate() {
            let found = air.limited_move(node.slot, node.velocity, node.path);
            match moves.get_mut(first + index) {
                Some(fast) => *fast = Move { kind: fast.kind, ..found },
                None => moves.push(found),
            }
        }
    }

    /// Advances by a step. If Newton's method fails because springs turn over within a substep, or the visits are
    /// used up, one implicit step covers the rest. There, stability is enough, and the guard limits the energy.
    fn advance_in_substeps(&mut self, bodies: &Bodies, air: &Air) {
        let most = (self.visits.allowed / self.visits_of_substep()).max(1);
        let substeps = self.substeps(air.dt).min(most);
        let part = Air { dt: air.dt / substeps as f64, ..*air };
        for index in 0..substeps {
            let elapsed = index as f64 * part.dt;
            let has_time = index == 0 || self.visits.all() < self.visits.allowed;
            if !(has_time && self.advance(bodies, &part, elapsed)) {
                self.has_diverged = true;
                let rest = Air { dt: air.dt - elapsed, ..*air };
                self.advance_implicitly(bodies, &rest, elapsed);
                break;
            }
        }
    }

    fn read_bodies(&mut self, bodies: &Bodies) {
        for node in &mut self.nodes {
            let slot = node.slot as usize;
            node.mass = 1.0 / f64::from(bodies.inverse_mass[slot]);
            node.gravity_scale = f64::from(bodies.gravity_scale[slot]);
            node.path = DVec2::ZERO;
            node.start = bodies.center[slot].as_dvec2();
            node.velocity = bodies.velocity[slot].as_dvec2();
        }
    }

    /// Rate at which the damping of a spring takes energy from its oscillation, 1/s.
    fn decay(&self, link: &NetworkLink) -> f64 {
        let (_, inv_masses) = inverse_masses(link, &self.nodes);
        link.damping * (inv_masses[0] + inv_masses[1])
    }

    /// Number of substeps that its oscillations need over `dt` seconds.
    fn substeps(&self, dt: f64) -> u64 {
        let phases = (self.frequency * dt / SUBSTEP_PHASE).ceil() as u64;
        if self.is_damped { 1 } else { phases.clamp(1, SUBSTEPS_MAX) }
    }

    /// Expected number of spring visits in a substep.
    fn visits_of_substep(&self) -> u64 {
        ROUNDS * self.visits_of_round() + self.visits_of_factorisation()
    }

    fn visits_of_round(&self) -> u64 {
        self.links.len() as u64 + self.system.blocks() / BLOCKS_PER_VISIT
    }

    /// Whether this number of visits is too small for Newton's method.
    fn is_dense(&self, visits: u64) -> bool {
        DENSE * self.visits_of_factorisation() > visits
    }

    /// Finds an upper bound on the fastest oscillation. By Gershgorin's theorem, the square of its frequency is at
    /// most the largest row sum of K / m.
    fn find_frequency(&mut self) {
        // This is used only as scratch here.
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
        self.frequency = squared.sqrt();
    }

    /// Advances by a substep that begins `elapsed` seconds after the start of the step. Returns whether it was
    /// solved.
    fn advance(&mut self, bodies: &Bodies, air: &Air, elapsed: f64) -> bool {
        self.begin_substep(air);
        self.choose_weight(air.dt);
        let is_solved = self.solve(bodies, air, elapsed, DIVERGED);
        if is_solved {
            self.move_nodes(air.dt);
        } else {
            self.reset_velocities();
        }
        is_solved
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

    /// Chooses the weight that fits the fastest decay.
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

    /// Resets the velocities to those at the start, which are also the result if numbers overflow.
    fn reset_velocities(&mut self) {
        self.nodes.iter_mut().for_each(|node| node.velocity = node.before);
    }

    /// Sets the first guess, which is the current velocity or, if a spring might turn over along it, the velocity
    /// for which nothing moves.
    fn guess_velocities(&mut self, dt: f64) {
        let rests = !self.is_damped && self.frequency * dt > SUBSTEP_PHASE;
        let factor = if rests { 1.0 - 1.0 / self.weight } else { 1.0 };
        self.nodes.iter_mut().for_each(|node| node.velocity = node.before * factor);
    }

    /// Runs Newton's method, keeping the factored system as long as it converges. Returns whether the last change, as
    /// a share of the largest speed, is at most `tolerance`.
    #[inline(never)]
    fn solve(&mut self, bodies: &Bodies, air: &Air, elapsed: f64, tolerance: f64) -> bool {
        self.guess_velocities(air.dt);
        let precision = if self.is_damped { PRECISION_DAMPED } else { PRECISION };
        let mut change = f64::INFINITY;
        let mut stale = true;
        for round in 0..ROUNDS_MAX {
            if stale && self.visits.factored > 0 && !self.has_time_to_factor() {
                break;
            }
            self.assemble(bodies, air, elapsed, stale);
            if stale {
                self.factor();
            }
            self.eliminate();
            let before = change;
            change = self.apply_newton_step();
            let is_lost = change.is_nan() || round == HALFWAY && change > HALFWAY_CHANGE;
            if change <= precision || is_lost {
                break;
            }
            stale = change > SLOW * before;
        }
        // A NaN is not a solution either.
        change <= tolerance
    }

    /// For an implicit step, runs rounds in which each spring has its full stiffness in every direction, an upper
    /// bound on the true one. Starting from rest, each round lowers the energy of the step, if only slowly (Bouaziz
    /// and others 2014, projective dynamics), and one factorisation suffices for them all.
    fn solve_safely(&mut self, bodies: &Bodies, air: &Air, elapsed: f64) {
        self.nodes.iter_mut().for_each(|node| node.velocity = DVec2::ZERO);
        self.is_safe = true;
        for round in 0..SAFE_ROUNDS {
            self.assemble(bodies, air, elapsed, round == 0);
            if round == 0 {
                self.factor();
            }
            self.eliminate();
            let change = self.apply_newton_step();
            if change.is_nan() || change <= PRECISION_DAMPED {
                break;
            }
        }
        self.is_safe = false;
        if !self.nodes.iter().all(|node| node.velocity.is_finite()) {
            self.reset_velocities();
        }
    }

    fn has_time_to_factor(&self) -> bool {
        self.visits.factored + self.visits_of_factorisation() <= self.visits.allowed
    }

    fn visits_of_factorisation(&self) -> u64 {
        self.system.products() / PRODUCTS_PER_VISIT
    }

    /// Solves the system for the residual, in place.
    fn eliminate(&mut self) {
        self.system.solve(&mut self.residual);
        self.visits.done += self.system.blocks() / BLOCKS_PER_VISIT;
    }

    fn factor(&mut self) {
        self.system.factor();
        self.visits.factored += self.visits_of_factorisation();
    }

    /// Computes the residual of the velocities, and the system matrix if `with_matrix`.
    fn assemble(&mut self, bodies: &Bodies, air: &Air, elapsed: f64, with_matrix: bool) {
        if with_matrix {
            self.system.clear();
        }
        self.visits.done += self.links.len() as u64;
        let t = self.weight;
        for (at, node) in (0u32..).zip(&self.nodes) {
            let through_air = node.before * (1.0 - t) + node.velocity * t - air.wind;
            let gravity = air.gravity * node.gravity_scale;
            let force = (gravity - through_air * node.rate) * air.dt;
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

    /// Applies the computed change.
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
        let state = |end: LinkEnd| self.end_state(end, bodies, elapsed);
        let (a, b) = (state(link.a), state(link.b));
        let (node_a, node_b) = (link.a.node(), link.b.node());
        let t = self.weight;
        let early = b.position - a.position;
        let speed = (b.before - a.before) * (1.0 - t) + (b.velocity - a.velocity) * t;
        let late = early + speed * dt;
        let pull = link.pull(early, late, speed, t);
        let impulse = pull.force * dt;
        let stiffness_matrix = pull.stiffness(link, self.is_safe, t, dt);
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

    fn end_state(&self, end: LinkEnd, bodies: &Bodies, elapsed: f64) -> EndState {
        match end {
            LinkEnd::Node(node) => {
                let node = &self.nodes[node as usize];
                EndState { position: node.start, before: node.before, velocity: node.velocity }
            }
            LinkEnd::Slot(slot) => {
                let velocity = bodies.velocity[slot as usize].as_dvec2();
                let position = bodies.center[slot as usize].as_dvec2() + velocity * elapsed;
                EndState { position, before: velocity, velocity }
            }
            LinkEnd::Point(position) => {
                EndState { position, before: DVec2::ZERO, velocity: DVec2::ZERO }
            }
        }
    }
}

/// The weight for which a decay by `decay` in a step is exact.
fn fitted(decay: f64) -> f64 {
    if decay < 1e-3 { 0.5 + decay / 12.0 } else { -1.0 / exp_m1(-decay) - 1.0 / decay }
}
