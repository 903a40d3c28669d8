//! Bodies that springs tie together, or that a spring with a length of its own holds: an implicit step.
//!
//! With t in [1/2, 1] the path of a body is h ((1-t) v0 + t v1), and each spring pulls with its mean
//! length (1-t) |r0| + t |r1| along the mean direction. At t = 1/2 that is the midpoint rule with the
//! discrete gradient of Gonzalez (1996): of second order, and it keeps energy exactly however stiff a
//! spring is. Damping wants more: decay by y in a step is e^-y if t = 1 / (1 - e^-y) - 1/y (Liniger and
//! Willoughby 1970), never overshoots, and is 1/2 + y/12 where y is small, so the order stays; it is for
//! springs that do not swing, or swing too fast for the step.
//! All that one component ties together has one t, of its fastest decay, and the system is symmetric.
//!
//! Newton's method finds v1; a spring that pushes gets no stiffness across it, so every system is
//! positive definite. Where springs rest, no move is found whatever the step: rest points are exact.

use super::elimination::Elimination;
use super::{Air, Drag, Move, Spring, SpringEnd};
use crate::bodies::Bodies;
use crate::math::exp_m1;
use glam::{DMat2, DVec2};

/// Rounds of Newton's method in a step at most; two or three are the rule.
const ROUNDS_MAX: u32 = 8;
/// Change of a velocity, as a share of the largest one, at which they end.
const PRECISION: f64 = 1e-5;
/// A round that leaves more than this share of the change before it asks for a new system.
const SLOW: f64 = 0.1;
/// Change at the end from which on they led nowhere.
const ASTRAY: f64 = 1e-3;
/// Speed that counts as the largest where nothing moves, units/s.
const SPEED_MIN: f64 = 1e-3;
/// A damped spring that swings by less than this in a step, in radians, is followed by the midpoint
/// rule; swings that a step cannot tell apart are only to die out.
const TURN_MAX: f64 = 4.0;
/// Springs shorter than this have no direction, world units.
const LENGTH_MIN: f64 = 1e-9;

/// A body of the network.
#[derive(Clone, Debug)]
struct Node {
    slot: u32,
    drag: Drag,
    /// Name of its component: the least place in it.
    component: u32,
    /// What follows is of this step.
    mass: f64,
    /// Rate of drag against the wind, 1/s.
    rate: f64,
    /// Decay in the step, y.
    decay: f64,
    start: DVec2,
    velocity: DVec2,
    before: DVec2,
    gravity: DVec2,
}

/// An end of a spring.
#[derive(Clone, Copy, Debug)]
enum End {
    Node(u32),
    /// A body that forces do not move.
    Slot(u32),
    Point(DVec2),
}

#[derive(Clone, Debug)]
struct Link {
    a: End,
    b: End,
    rest_length: f64,
    stiffness: f64,
    damping: f64,
}

/// All bodies and springs that are tied.
#[derive(Clone, Debug, Default)]
pub(super) struct Network {
    /// In the order of their elimination.
    nodes: Vec<Node>,
    links: Vec<Link>,
    system: Elimination,
    /// Scratch: what is wrong with the velocities, and then the change that mends it.
    wrong: Vec<DVec2>,
    /// Weight t of the end of the step, by component.
    weight: Vec<f64>,
}

/// An end as a link sees it: start, velocities at start and end.
#[derive(Clone, Copy)]
struct Seen {
    place: DVec2,
    before: DVec2,
    velocity: DVec2,
}

impl Network {
    /// Of these slots, ascending, with their drag, and the springs among all that touch them.
    pub fn new(slots: &[u32], drag: &[Drag], springs: &[Spring]) -> Network {
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
        let (system, place) = Elimination::new(slots.len(), &edges);
        let mut order = vec![0; slots.len()];
        for (node, &at) in place.iter().enumerate() {
            order[at as usize] = node;
        }
        let component = components(&place, &edges);
        let node = |&node: &usize| Node {
            slot: slots[node],
            drag: drag[node],
            component: component[place[node] as usize],
            mass: 1.0,
            rate: 0.0,
            decay: 0.0,
            start: DVec2::ZERO,
            velocity: DVec2::ZERO,
            before: DVec2::ZERO,
            gravity: DVec2::ZERO,
        };
        let end = |slot: u32| match node_of(slot) {
            Some(node) => End::Node(place[node as usize]),
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
            wrong: vec![DVec2::ZERO; slots.len()],
            weight: vec![0.5; slots.len()],
        }
    }

    /// Where a step takes them.
    pub fn fly(&mut self, bodies: &Bodies, air: &Air, moves: &mut Vec<Move>) {
        if self.nodes.is_empty() {
            return;
        }
        self.look(bodies, air);
        self.weigh(air.dt);
        let change = self.solve(bodies, air);
        // Not a number is astray too.
        if change.is_nan() || change > ASTRAY {
            // Springs that turn over within a step: no more than stability is asked for.
            self.weight.fill(1.0);
            self.start_again();
            if !self.solve(bodies, air).is_finite() {
                self.start_again();
            }
        }
        for node in &self.nodes {
            let path = way(node, self.weight[node.component as usize], air.dt);
            moves.push(air.allow(node.slot, node.velocity, path));
        }
    }

    /// Reads the bodies; the first guess is the velocity that they have.
    fn look(&mut self, bodies: &Bodies, air: &Air) {
        for node in &mut self.nodes {
            let slot = node.slot as usize;
            node.mass = 1.0 / f64::from(bodies.inverse_mass[slot]);
            node.start = bodies.center[slot].as_dvec2();
            node.before = bodies.velocity[slot].as_dvec2();
            node.velocity = node.before;
            node.gravity = air.gravity * f64::from(bodies.gravity_scale[slot]);
            let speed = (node.before - air.wind).length();
            node.rate = f64::from(node.drag.linear) + f64::from(node.drag.quadratic) * speed;
        }
    }

    /// The weight of each component: that of the body whose speed decays fastest.
    fn weigh(&mut self, dt: f64) {
        for node in &mut self.nodes {
            node.decay = node.rate * dt;
        }
        for link in &self.links {
            let ends = [link.a.node(), link.b.node()];
            let weight =
                |end: Option<u32>| end.map_or(0.0, |node| 1.0 / self.nodes[node as usize].mass);
            let weight = weight(ends[0]) + weight(ends[1]);
            let decay = link.damping * weight * dt;
            let turn = (link.stiffness * weight).sqrt() * dt;
            let follows = turn < TURN_MAX && decay < 2.0 * turn;
            for node in ends.into_iter().flatten().filter(|_| !follows) {
                self.nodes[node as usize].decay += decay;
            }
        }
        self.weight.fill(0.5);
        for node in &self.nodes {
            let weight = &mut self.weight[node.component as usize];
            let wanted = fitted(node.decay);
            if wanted > *weight {
                *weight = wanted;
            }
        }
    }

    /// Back to the speeds at the start, which are also what is left where numbers run out of range.
    fn start_again(&mut self) {
        self.nodes.iter_mut().for_each(|node| node.velocity = node.before);
    }

    /// Newton's method with the system of the first round as long as it serves; the last change, as
    /// a share of the largest speed.
    fn solve(&mut self, bodies: &Bodies, air: &Air) -> f64 {
        let mut change = f64::INFINITY;
        let mut stale = true;
        for _ in 0..ROUNDS_MAX {
            self.look_at_forces(bodies, air, stale);
            if stale {
                self.system.factor();
            }
            self.system.solve(&mut self.wrong);
            let before = change;
            change = self.improve();
            if change <= PRECISION {
                break;
            }
            stale = change > SLOW * before;
        }
        change
    }

    /// What is wrong with the velocities, and the system that says how to mend it, if `wanted`.
    fn look_at_forces(&mut self, bodies: &Bodies, air: &Air, wanted: bool) {
        if wanted {
            self.system.clear();
        }
        for (at, node) in (0u32..).zip(&self.nodes) {
            let t = self.weight[node.component as usize];
            let through_air = node.before * (1.0 - t) + node.velocity * t - air.wind;
            let force = (node.gravity - through_air * node.rate) * air.dt;
            self.wrong[at as usize] = (node.before + force - node.velocity) * node.mass;
            if wanted {
                let inertia = node.mass * (1.0 + t * node.rate * air.dt);
                self.system.add_diagonal(at, DMat2::IDENTITY * inertia);
            }
        }
        for place in 0..self.links.len() {
            self.pull(place, bodies, air.dt, wanted);
        }
    }

    /// Takes the change that was found.
    fn improve(&mut self) -> f64 {
        let (mut largest, mut change) = (SPEED_MIN * SPEED_MIN, 0.0);
        for (node, &step) in self.nodes.iter_mut().zip(&self.wrong) {
            node.velocity += step;
            largest = larger(node.velocity.length_squared(), largest);
            change = larger(step.length_squared(), change);
        }
        (change / largest).sqrt()
    }

    /// Adds what a spring does to what is wrong, and to the system if `wanted`.
    fn pull(&mut self, place: usize, bodies: &Bodies, dt: f64, wanted: bool) {
        let link = &self.links[place];
        let (a, b) = (self.see(link.a, bodies), self.see(link.b, bodies));
        let (node_a, node_b) = (link.a.node(), link.b.node());
        let Some(any) = node_a.or(node_b) else { return };
        let t = self.weight[self.nodes[any as usize].component as usize];
        let early = b.place - a.place;
        let speed = (b.before - a.before) * (1.0 - t) + (b.velocity - a.velocity) * t;
        let late = early + speed * dt;
        let pull = link.pull(early, late, speed, t);
        let impulse = pull.force * dt;
        let stiff = pull.stiffness(link, t, dt);
        if let Some(node) = node_a {
            self.wrong[node as usize] -= impulse;
        }
        if let Some(node) = node_b {
            self.wrong[node as usize] += impulse;
        }
        if !wanted {
            return;
        }
        for node in [node_a, node_b].into_iter().flatten() {
            self.system.add_diagonal(node, stiff);
        }
        if let (Some(one), Some(other)) = (node_a, node_b) {
            self.system.add(one, other, -stiff);
        }
    }

    fn see(&self, end: End, bodies: &Bodies) -> Seen {
        match end {
            End::Node(node) => {
                let node = &self.nodes[node as usize];
                Seen { place: node.start, before: node.before, velocity: node.velocity }
            }
            End::Slot(slot) => {
                let velocity = bodies.velocity[slot as usize].as_dvec2();
                let place = bodies.center[slot as usize].as_dvec2();
                Seen { place, before: velocity, velocity }
            }
            End::Point(place) => Seen { place, before: DVec2::ZERO, velocity: DVec2::ZERO },
        }
    }
}

/// What a spring does.
struct Pull {
    /// On its far end.
    force: DVec2,
    direction: DVec2,
    /// Tension over length, where it pulls: its stiffness across.
    across: f64,
}

impl End {
    fn node(self) -> Option<u32> {
        match self {
            End::Node(node) => Some(node),
            End::Slot(_) | End::Point(_) => None,
        }
    }
}

impl Link {
    fn pull(&self, early: DVec2, late: DVec2, speed: DVec2, t: f64) -> Pull {
        let mean = early * (1.0 - t) + late * t;
        if self.rest_length == 0.0 {
            let force = -mean * self.stiffness - speed * self.damping;
            return Pull { force, direction: DVec2::X, across: 0.0 };
        }
        let length = early.length() * (1.0 - t) + late.length() * t;
        let direction = unit(mean);
        let tension = self.stiffness * (length - self.rest_length);
        let (slant, across) = if length > LENGTH_MIN {
            (mean / length, larger(tension, 0.0) / length)
        } else {
            (direction, 0.0)
        };
        let damped = direction * (self.damping * direction.dot(speed));
        Pull { force: -slant * tension - damped, direction, across }
    }
}

impl Pull {
    /// Change of the impulse with the velocity at the end of the step.
    fn stiffness(&self, link: &Link, t: f64, dt: f64) -> DMat2 {
        let along = dt * t * (link.stiffness * t * dt + link.damping);
        if link.rest_length == 0.0 {
            return DMat2::IDENTITY * along;
        }
        let across = dt * t * self.across * t * dt;
        let direction = self.direction;
        let outer = DMat2::from_cols(direction * direction.x, direction * direction.y);
        outer * (along - across) + DMat2::IDENTITY * across
    }
}

/// A direction also for what has none.
fn unit(vector: DVec2) -> DVec2 {
    let length = vector.length();
    if length > LENGTH_MIN { vector / length } else { DVec2::X }
}

fn way(node: &Node, t: f64, dt: f64) -> DVec2 {
    (node.before * (1.0 - t) + node.velocity * t) * dt
}

/// The weight with which a speed that decays by `decay` in a step does so exactly.
fn fitted(decay: f64) -> f64 {
    if decay < 1e-3 { 0.5 + decay / 12.0 } else { -1.0 / exp_m1(-decay) - 1.0 / decay }
}

/// The larger one; what is not a number wins.
fn larger(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

/// The least place of the component of each place.
fn components(place: &[u32], edges: &[(u32, u32)]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..place.len() as u32).collect();
    let root = |parent: &[u32], mut at: u32| {
        while parent[at as usize] != at {
            at = parent[at as usize];
        }
        at
    };
    for &(a, b) in edges {
        let one = root(&parent, place[a as usize]);
        let other = root(&parent, place[b as usize]);
        let (low, high) = if one < other { (one, other) } else { (other, one) };
        parent[high as usize] = low;
    }
    (0..place.len() as u32).map(|at| root(&parent, at)).collect()
}
