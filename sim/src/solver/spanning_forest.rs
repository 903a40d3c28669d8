//! The contacts that bear the load, which are solved exactly within a sweep.
//!
//! Where nothing rotates, a sticking contact takes away both of a body's degrees of freedom. A pile at rest therefore
//! has about as many contacts as bodies, and they form a forest: each body is joined by the contact that contributes
//! most to its total impulse, which at rest is the one on which it rests, down to the ground. On a tree, the
//! equations need no iteration: from the leaves to the roots, each body adds its apparent mass to its carrier, and on
//! the way back each gets its velocity (the articulated bodies of Featherstone 1983, without rotation). A sticking
//! contact passes on all of the mass, a sliding one, whose friction is at its limit, passes on only the part along
//! its normal, and an open one passes on nothing. The state of each contact is guessed from the impulses so far and
//! updated where the solution contradicts it (a primal-dual active set; Hintermueller, Ito and Kunisch 2002).
//! Impulses that are still impossible after that are clamped. The forest's solution need not be a solution for the
//! island, so impulses move towards it only for as long as the island's own objective rises. The rest of the sweep
//! corrects the contacts outside the trees.

use super::gauss_seidel::limited;
use crate::math::{clamp, max, without_dust};
use crate::solver::contact_constraint::ContactConstraint;
use crate::solver::tolerances::{FOREST_SHARE_MIN, OVERSHOOT};
use glam::Vec2;

/// Maximum number of active set rounds in a sweep.
const ACTIVE_SET_ROUNDS_MAX: u32 = 3;

const NONE: u32 = u32::MAX;

/// State of the contact between a body and its carrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ContactState {
    /// The two bodies move together.
    Stick,
    /// Friction is at its limit; the normal impulse holds.
    Slide,
    /// The contact bears no load.
    Open,
}

/// A body, and the contact that supports it.
#[derive(Clone, Copy, Debug)]
struct TreeNode {
    slot: u32,
    /// The contact; `NONE` for a floating root.
    constraint: u32,
    /// Index of the node that supports it, which is always lower; `NONE` on the ground.
    carrier: u32,
    state: ContactState,
    /// Normal of the contact, pointing towards this body.
    normal: Vec2,
    /// Mass of this body.
    own_mass: f32,
    /// Apparent mass including all bodies that it supports, and the impulse that maintains its velocity.
    mass: Symmetric,
    bias: Vec2,
    /// Change in the velocity relative to the carrier that would make the contact stick.
    stick_change: Vec2,
    /// Change in the friction impulse of a sliding contact.
    friction_change: f32,
    /// The solution: the change in the body's velocity, and the impulse that causes it.
    change: Vec2,
    impulse: Vec2,
}

/// A symmetric 2 by 2 matrix.
#[derive(Clone, Copy, Debug, Default)]
struct Symmetric {
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Symmetric {
    #[inline]
    fn times(self, v: Vec2) -> Vec2 {
        Vec2::new(self.xx * v.x + self.xy * v.y, self.xy * v.x + self.yy * v.y)
    }

    #[inline]
    fn solve(self, v: Vec2) -> Vec2 {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        Vec2::new(self.yy * v.x - self.xy * v.y, self.xx * v.y - self.xy * v.x) / determinant
    }

    #[inline]
    fn add(&mut self, other: Symmetric) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
    }

    /// The outer product of a vector with itself, times `share`.
    #[inline]
    fn square(v: Vec2, share: f32) -> Symmetric {
        Symmetric { xx: share * v.x * v.x, xy: share * v.x * v.y, yy: share * v.y * v.y }
    }
}

/// The forest of an island, and scratch memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpanningForest {
    /// Nodes, with carriers before the bodies that they support.
    nodes: Vec<TreeNode>,
    bodies: Vec<u32>,
    /// By slot: the sum of all impulses, the constraint that contributes most, its contribution, and a list of the
    /// bodies supported.
    sum: Vec<Vec2>,
    best: Vec<u32>,
    contribution: Vec<f32>,
    first: Vec<u32>,
    next: Vec<u32>,
}

impl SpanningForest {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.best.resize(slots, NONE);
        self.sum.resize(slots, Vec2::ZERO);
        self.contribution.resize(slots, 0.0);
        self.first.resize(slots, NONE);
        self.next.resize(slots, NONE);
    }

    /// Finds an island's forest from the current impulses. Bodies that support each other in a cycle are left out.
    pub fn find<const FRICTION: bool>(
        &mut self,
        constraints: &[ContactConstraint],
        island: &[u32],
    ) {
        self.nodes.clear();
        self.bodies.clear();
        for &index in island {
            let constraint = &constraints[index as usize];
            if constraint.normal_impulse > 0.0 {
                let impulse = constraint.accumulated::<FRICTION>();
                self.sum[constraint.a as usize] -= impulse;
                self.sum[constraint.b as usize] += impulse;
            }
        }
        for &index in island {
            let constraint = &constraints[index as usize];
            if constraint.normal_impulse > 0.0 {
                let impulse = constraint.accumulated::<FRICTION>();
                if constraint.inv_mass_a > 0.0 {
                    self.consider_carrier(constraint.a, index, -impulse);
                }
                if constraint.inv_mass_b > 0.0 {
                    self.consider_carrier(constraint.b, index, impulse);
                }
            }
        }
        self.add_roots(constraints);
        let mut index = 0;
        while index < self.nodes.len() {
            let mut carried = self.first[self.nodes[index].slot as usize];
            while carried != NONE {
                self.add_node(carried, index as u32, constraints);
                carried = self.next[carried as usize];
            }
            index += 1;
        }
        for &index in island {
            let constraint = &constraints[index as usize];
            for slot in [constraint.a as usize, constraint.b as usize] {
                self.sum[slot] = Vec2::ZERO;
                self.best[slot] = NONE;
                self.first[slot] = NONE;
            }
        }
    }

    #[inline]
    fn consider_carrier(&mut self, slot: u32, constraint: u32, impulse: Vec2) {
        let index = slot as usize;
        let contribution = impulse.dot(self.sum[index]);
        if self.best[index] == NONE {
            self.bodies.push(slot);
        } else if contribution <= self.contribution[index] {
            return;
        }
        self.best[index] = constraint;
        self.contribution[index] = contribution;
    }

    /// Adds the bodies that rest on the ground or float, and lists the others by their carrier.
    fn add_roots(&mut self, constraints: &[ContactConstraint]) {
        for index in 0..self.bodies.len() {
            let slot = self.bodies[index];
            let best = self.best[slot as usize];
            let constraint = &constraints[best as usize];
            let [a, b] = constraint.bodies();
            let (other, inv_mass) = if slot == a.0 { b } else { a };
            if inv_mass == 0.0 {
                self.add_node(slot, NONE, constraints);
            } else if self.best[other as usize] == best && slot < other {
                // The two bodies support each other, so the one with the lower slot floats.
                self.add_node(slot, NONE, constraints);
                self.nodes.last_mut().expect("just added").constraint = NONE;
            } else {
                self.next[slot as usize] = self.first[other as usize];
                self.first[other as usize] = slot;
            }
        }
    }

    #[inline]
    fn add_node(&mut self, slot: u32, carrier: u32, constraints: &[ContactConstraint]) {
        let index = self.best[slot as usize];
        let constraint = &constraints[index as usize];
        let is_b = slot == constraint.b;
        self.nodes.push(TreeNode {
            slot,
            constraint: index,
            carrier,
            state: ContactState::Open,
            normal: if is_b { constraint.normal } else { -constraint.normal },
            own_mass: 1.0 / if is_b { constraint.inv_mass_b } else { constraint.inv_mass_a },
            mass: Symmetric::default(),
            bias: Vec2::ZERO,
            stick_change: Vec2::ZERO,
            friction_change: 0.0,
            change: Vec2::ZERO,
            impulse: Vec2::ZERO,
        });
    }

    /// Number of bodies in the forest.
    pub fn node_count(&self) -> u64 {
        self.nodes.len() as u64
    }

    pub fn clear(&mut self) {
        self.nodes.clear();
    }

    /// Solves the forest by moving impulses and velocities to the solution, or towards it for as long as D
    /// rises (see `warm_start`). Returns whether this is more than [`FOREST_SHARE_MIN`] of the way.
    /// `FRICTION` is as in [`crate::solver::sweep`].
    pub fn solve<const FRICTION: bool>(
        &mut self,
        constraints: &mut [ContactConstraint],
        velocity: &mut [Vec2],
    ) -> bool {
        if self.nodes.is_empty() {
            return true;
        }
        for node in self.nodes.iter_mut().filter(|node| node.constraint != NONE) {
            classify::<FRICTION>(node, &constraints[node.constraint as usize], velocity);
        }
        for _ in 0..ACTIVE_SET_ROUNDS_MAX {
            self.accumulate_masses::<FRICTION>(constraints);
            self.propagate_changes::<FRICTION>(constraints);
            if !self.update_states::<FRICTION>(constraints) {
                break;
            }
        }
        for node in self.nodes.iter_mut().filter(|node| node.constraint != NONE) {
            apply_impulse::<FRICTION>(node, &mut constraints[node.constraint as usize], velocity);
        }
        let share = self.step_share(constraints, velocity);
        if share < 1.0 {
            for node in self.nodes.iter().filter(|node| node.constraint != NONE) {
                scale_back::<FRICTION>(
                    node,
                    &mut constraints[node.constraint as usize],
                    velocity,
                    share,
                );
            }
        }
        share > FOREST_SHARE_MIN
    }

    /// The share of the way to the solution at which D is greatest, or 1 if D is hardly less at the solution.
    fn step_share(&self, constraints: &[ContactConstraint], velocity: &[Vec2]) -> f32 {
        // Slopes of D at both ends of the way, along which D is a parabola.
        let (mut start, mut end) = (0.0, 0.0);
        for node in self.nodes.iter().filter(|node| node.constraint != NONE) {
            start += node.impulse.dot(node.stick_change);
            end += node.impulse.dot(stick_change(
                node,
                &constraints[node.constraint as usize],
                velocity,
            ));
        }
        if end >= -OVERSHOOT * start {
            1.0
        } else if start > 0.0 {
            start / (start - end)
        } else {
            0.0
        }
    }

    /// Accumulates the mass and impulse that each carrier has to move, from the leaves to the roots.
    fn accumulate_masses<const FRICTION: bool>(&mut self, constraints: &[ContactConstraint]) {
        for node in &mut self.nodes {
            node.mass = Symmetric { xx: node.own_mass, xy: 0.0, yy: node.own_mass };
            node.bias = Vec2::ZERO;
        }
        for index in (0..self.nodes.len()).rev() {
            let node = &self.nodes[index];
            let carrier = node.carrier;
            if carrier != NONE {
                let (mass, bias) = passed_to_carrier::<FRICTION>(node, constraints);
                let carrier = &mut self.nodes[carrier as usize];
                carrier.mass.add(mass);
                carrier.bias += bias;
            }
        }
    }

    /// Finds each body's change, from the roots to the leaves.
    fn propagate_changes<const FRICTION: bool>(&mut self, constraints: &[ContactConstraint]) {
        for index in 0..self.nodes.len() {
            let carrier_change = self.carrier_change(index);
            let node = &mut self.nodes[index];
            (node.change, node.impulse) = solve_node::<FRICTION>(node, constraints, carrier_change);
        }
    }

    /// Change in the velocity of a node's carrier.
    #[inline]
    fn carrier_change(&self, index: usize) -> Vec2 {
        match self.nodes[index].carrier {
            NONE => Vec2::ZERO,
            carrier => self.nodes[carrier as usize].change,
        }
    }

    /// Updates the state of each contact that contradicts the solution, and returns whether any changed.
    fn update_states<const FRICTION: bool>(&mut self, constraints: &[ContactConstraint]) -> bool {
        let mut any = false;
        for index in 0..self.nodes.len() {
            let carrier_change = self.carrier_change(index);
            let node = &mut self.nodes[index];
            if node.constraint != NONE {
                any |= update_state::<FRICTION>(
                    node,
                    &constraints[node.constraint as usize],
                    carrier_change,
                );
            }
        }
        any
    }
}

/// Initial state of a node's contact, given its impulses and velocities.
#[inline]
fn classify<const FRICTION: bool>(
    node: &mut TreeNode,
    constraint: &ContactConstraint,
    velocity: &[Vec2],
) {
    node.state = if constraint.normal_impulse <= 0.0 {
        ContactState::Open
    } else if FRICTION && constraint.sticks() {
        ContactState::Stick
    } else {
        ContactState::Slide
    };
    node.friction_change = 0.0;
    node.stick_change = stick_change(node, constraint, velocity);
}

/// Change in a node's velocity relative to its carrier that would make the contact stick.
#[inline]
fn stick_change(node: &TreeNode, constraint: &ContactConstraint, velocity: &[Vec2]) -> Vec2 {
    let relative = constraint.relative_velocity(velocity);
    let relative = if node.slot == constraint.b { relative } else { -relative };
    let change = node.normal * constraint.min_normal_velocity - relative;
    Vec2::new(without_dust(change.x), without_dust(change.y))
}

/// The apparent mass and the impulse that a node passes to its carrier.
#[inline]
fn passed_to_carrier<const FRICTION: bool>(
    node: &TreeNode,
    constraints: &[ContactConstraint],
) -> (Symmetric, Vec2) {
    match node.state {
        ContactState::Stick => (node.mass, node.mass.times(node.stick_change) + node.bias),
        ContactState::Slide => {
            let (share, stick_change) = along_normal::<FRICTION>(node);
            let normal = node.normal * (share * stick_change);
            let bias =
                if FRICTION { normal + node.normal.perp() * node.friction_change } else { normal };
            (Symmetric::square(node.normal, share), bias)
        }
        ContactState::Open => {
            (Symmetric::default(), removal_impulse::<FRICTION>(node, constraints))
        }
    }
}

/// Change in a node's velocity and the impulse that causes it, given the change in its carrier's velocity.
#[inline]
fn solve_node<const FRICTION: bool>(
    node: &TreeNode,
    constraints: &[ContactConstraint],
    carrier_change: Vec2,
) -> (Vec2, Vec2) {
    let impulse = match node.state {
        ContactState::Stick => {
            let change = carrier_change + node.stick_change;
            return (change, node.mass.times(change) + node.bias);
        }
        ContactState::Slide => {
            let (share, stick_change) = along_normal::<FRICTION>(node);
            let normal = node.normal * (share * (stick_change + node.normal.dot(carrier_change)));
            if FRICTION { normal + node.normal.perp() * node.friction_change } else { normal }
        }
        ContactState::Open => removal_impulse::<FRICTION>(node, constraints),
    };
    (node.mass.solve(impulse - node.bias), impulse)
}

/// Apparent mass of a sliding node along its normal, and the speed that it lacks there.
#[inline]
fn along_normal<const FRICTION: bool>(node: &TreeNode) -> (f32, f32) {
    let share = 1.0 / node.normal.dot(node.mass.solve(node.normal));
    let rest =
        if FRICTION { node.bias - node.normal.perp() * node.friction_change } else { node.bias };
    let free = node.mass.solve(rest);
    (share, node.normal.dot(node.stick_change + free))
}

/// The impulse that cancels the impulses of an open contact.
#[inline]
fn removal_impulse<const FRICTION: bool>(
    node: &TreeNode,
    constraints: &[ContactConstraint],
) -> Vec2 {
    match node.constraint {
        NONE => Vec2::ZERO,
        constraint => {
            let constraint = &constraints[constraint as usize];
            let normal = node.normal * constraint.normal_impulse;
            -(if FRICTION {
                normal + node.normal.perp() * constraint.tangent_impulse
            } else {
                normal
            })
        }
    }
}

/// Updates the state of a node's contact, and returns whether it changed.
#[inline]
fn update_state<const FRICTION: bool>(
    node: &mut TreeNode,
    constraint: &ContactConstraint,
    carrier_change: Vec2,
) -> bool {
    let (normal, tangent) = total::<FRICTION>(node, constraint);
    let slides = FRICTION && constraint.friction > 0.0;
    // Final velocity relative to the carrier.
    let relative = node.normal * constraint.min_normal_velocity + node.change
        - carrier_change
        - node.stick_change;
    let state = match node.state {
        ContactState::Stick | ContactState::Slide if normal < 0.0 => ContactState::Open,
        ContactState::Stick if FRICTION && tangent.abs() > constraint.friction * normal => {
            let limit = constraint.friction * normal;
            node.friction_change = clamp(tangent, -limit, limit) - constraint.tangent_impulse;
            ContactState::Slide
        }
        // Friction would act in the direction of sliding, so the contact must stick.
        ContactState::Slide if slides && tangent * node.normal.perp().dot(relative) > 0.0 => {
            ContactState::Stick
        }
        ContactState::Open if node.normal.dot(relative) < constraint.min_normal_velocity => {
            if slides {
                ContactState::Stick
            } else {
                ContactState::Slide
            }
        }
        state => state,
    };
    let changed = state != node.state;
    node.state = state;
    changed
}

/// Normal and friction impulse of a contact in the solution.
#[inline]
fn total<const FRICTION: bool>(node: &TreeNode, constraint: &ContactConstraint) -> (f32, f32) {
    let normal = constraint.normal_impulse + node.normal.dot(node.impulse);
    let tangent = if FRICTION {
        constraint.tangent_impulse + node.normal.perp().dot(node.impulse)
    } else {
        0.0
    };
    (normal, tangent)
}

/// Applies a node's impulse within the limits of its contact, and sets `impulse` to the applied impulse.
#[inline]
fn apply_impulse<const FRICTION: bool>(
    node: &mut TreeNode,
    constraint: &mut ContactConstraint,
    velocity: &mut [Vec2],
) {
    let (normal, tangent) = total::<FRICTION>(node, constraint);
    let normal = max(normal, 0.0);
    let tangent = if FRICTION { limited(tangent, constraint.friction * normal) } else { 0.0 };
    let change = constraint.impulse_of::<FRICTION>(
        normal - constraint.normal_impulse,
        tangent - constraint.tangent_impulse,
    );
    constraint.normal_impulse = normal;
    constraint.tangent_impulse = tangent;
    constraint.apply(velocity, change);
    node.impulse = if node.slot == constraint.b { change } else { -change };
}

/// Scales a node's applied impulse down to a share.
#[inline]
fn scale_back<const FRICTION: bool>(
    node: &TreeNode,
    constraint: &mut ContactConstraint,
    velocity: &mut [Vec2],
    share: f32,
) {
    let given = if node.slot == constraint.b { node.impulse } else { -node.impulse };
    constraint.apply(velocity, given * (share - 1.0));
    constraint.normal_impulse =
        constraint.normal_before + share * (constraint.normal_impulse - constraint.normal_before);
    if FRICTION {
        constraint.tangent_impulse = constraint.tangent_before
            + share * (constraint.tangent_impulse - constraint.tangent_before);
    }
}
