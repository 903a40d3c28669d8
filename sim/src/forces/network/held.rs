//! A network blocked by something takes one implicit Euler step in which no node passes an obstacle. Its nodes resist
//! contacts with the mass given by their response to an impulse. The impulses of the contacts are then spread over
//! all nodes, so that springs transmit weight.

use super::link::{Plane, max_or_nan};
use super::{DIVERGED_IMPLICIT, Network};
use crate::bodies::Bodies;
use crate::forces::air::{Air, Hold, Move, MoveKind};
use crate::forces::obstacles::Obstacles;
use crate::math::clamp_length;
use glam::DVec2;

/// Stiffness of a plane, as a multiple of the node's resisting mass.
const PLANE_STIFFNESS: f64 = 1e7;
/// Largest product of obstacles and nodes for which responses are computed.
const RESPONSES_MAX: usize = 4096;
/// Maximum number of rounds in which nodes may reach new planes.
const PLANE_ROUNDS_MAX: u32 = 4;

impl Network {
    /// Computes the moves of an implicit step with obstacles.
    pub fn hold(&mut self, bodies: &Bodies, obstacles: &Obstacles, air: &Air, moves: &mut [Move]) {
        self.read_bodies(bodies);
        self.planes.clear();
        for (at, node) in (0u32..).zip(&self.nodes) {
            let of = obstacles.of(node.slot).iter();
            self.planes.extend(of.filter(|found| found.speed_min.is_finite()).map(|found| Plane {
                node: at,
                normal: found.normal,
                speed_min: found.speed_min,
                is_active: false,
                stiffness: 0.0,
            }));
        }
        self.advance_implicitly(bodies, air, 0.0);
        self.find_free_velocities(bodies, air);
        self.find_resistances(air.dt);
        for (node, row) in self.nodes.iter_mut().zip(&self.residual) {
            node.resistance = row.x;
        }
        self.responds = self.find_responses(obstacles);
        for node in &self.nodes {
            let found = air.limited_move(node.slot, node.velocity, node.path);
            let velocity = air.limited_move(node.slot, node.free, DVec2::ZERO).velocity;
            if let Some(index) = obstacles.move_of(node.slot) {
                let hold = Hold { velocity, inverse_mass: (1.0 / node.resistance) as f32 };
                moves[index] = Move { kind: MoveKind::Held(hold), ..found };
            }
        }
    }

    /// Finds the velocities that the nodes would have without the impulses of planes, and factors the
    /// matrix without planes.
    fn find_free_velocities(&mut self, bodies: &Bodies, air: &Air) {
        let planes = std::mem::take(&mut self.planes);
        self.assemble(bodies, air, 0.0, true);
        self.factor();
        self.residual.fill(DVec2::ZERO);
        for plane in &planes {
            let impulse = plane.impulse(self.nodes[plane.node as usize].velocity);
            self.residual[plane.node as usize] += plane.normal * impulse;
        }
        self.eliminate();
        for (node, change) in self.nodes.iter_mut().zip(&self.residual) {
            node.free = node.velocity - *change;
        }
    }

    /// Finds the masses with which nodes resist their obstacles, and returns whether contacts also act on their
    /// neighbours. They do not where nodes touch each other, since they would be pushed into each other.
    fn find_responses(&mut self, obstacles: &Obstacles) -> bool {
        let all = || self.nodes.iter().flat_map(|node| obstacles.of(node.slot));
        let is_inner = |other: u32| self.nodes.iter().any(|node| node.slot == other);
        if all().count() * self.nodes.len() > RESPONSES_MAX || all().any(|met| is_inner(met.other))
        {
            return false;
        }
        for at in 0..self.nodes.len() {
            let mut most = 0.0;
            for obstacle in obstacles.of(self.nodes[at].slot) {
                self.residual.fill(DVec2::ZERO);
                self.residual[at] = obstacle.normal;
                self.eliminate();
                most = max_or_nan(obstacle.normal.dot(self.residual[at]), most);
            }
            if most > 0.0 {
                self.nodes[at].resistance = 1.0 / most;
            }
        }
        true
    }

    /// Spreads the impulses of contacts over the springs, so that a node whose velocity was changed by contacts
    /// takes its neighbours along.
    pub fn respond(&mut self, bodies: &mut Bodies, is_free: bool, speed_max: f32) {
        if !std::mem::take(&mut self.responds) {
            return;
        }
        for (row, node) in self.residual.iter_mut().zip(&self.nodes) {
            let before = if is_free { node.free } else { node.velocity };
            let change = bodies.velocity[node.slot as usize].as_dvec2() - before;
            *row = change * node.resistance;
        }
        self.eliminate();
        for (change, node) in self.residual.iter().zip(&self.nodes) {
            let before = if is_free { node.free } else { node.velocity };
            let velocity = clamp_length((before + *change).as_vec2(), speed_max);
            if velocity.is_finite() {
                bodies.velocity[node.slot as usize] = velocity;
            }
        }
    }

    /// Takes an implicit Euler step in which no node passes a plane, beginning `elapsed` seconds after the start.
    #[inline(never)]
    pub(super) fn advance_implicitly(&mut self, bodies: &Bodies, air: &Air, elapsed: f64) {
        self.begin_substep(air);
        self.weight = 1.0;
        self.find_resistances(air.dt);
        for plane in &mut self.planes {
            plane.stiffness = PLANE_STIFFNESS * self.residual[plane.node as usize].x;
        }
        for round in 1..=PLANE_ROUNDS_MAX {
            self.is_hard = self.is_hard || !self.solve(bodies, air, elapsed, DIVERGED_IMPLICIT);
            if self.is_hard {
                self.solve_safely(bodies, air, elapsed);
            }
            // Checks for planes only if another round can follow. A second round always can.
            let has_time = round == 1 || self.has_time_to_factor();
            if round == PLANE_ROUNDS_MAX || !has_time || !self.meet_planes() {
                break;
            }
        }
        self.move_nodes(air.dt);
    }

    /// Activates the planes that nodes would pass, and returns whether there are new ones.
    fn meet_planes(&mut self) -> bool {
        let mut any = false;
        for plane in &mut self.planes {
            let velocity = self.nodes[plane.node as usize].velocity;
            let passes = plane.normal.dot(velocity) < plane.speed_min;
            any |= passes && !plane.is_active;
            plane.is_active |= passes;
        }
        any
    }

    /// For each node, stores in `residual.x` the mass that resists a change in velocity while its neighbours do not
    /// move.
    fn find_resistances(&mut self, dt: f64) {
        for (row, node) in self.residual.iter_mut().zip(&self.nodes) {
            *row = DVec2::splat(node.mass);
        }
        for link in &self.links {
            for node in [link.a.node(), link.b.node()].into_iter().flatten() {
                self.residual[node as usize].x += (link.stiffness * dt + link.damping) * dt;
            }
        }
    }
}
