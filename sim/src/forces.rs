//! Forces other than gravity: air drag, wind and springs. A world whose settings do not enable them has no such
//! state, runs no such loops and hashes nothing for them.
//!
//! A step asks for the [`Move`]s of all bodies subject to a force. A move consists of the path of free flight through
//! the whole step and the velocity at its end, on which contacts act. There is one file for each method:
//! - `flight` moves a single body in closed form, under drag, wind, and springs of zero length to fixed points;
//! - `network` moves bodies joined by springs with an implicit step, solved by `elimination`;
//! - `obstacles` finds what blocks stiff springs, which then take an implicit step;
//! - `energy_guard` keeps contacts from adding energy to bodies on springs;
//! - `euler` moves bodies in groups selected by a scene with one of Euler's methods, for comparison.
//!
//! Forces are computed in double precision, because a stiff spring multiplies the rounding errors of the positions
//! it joins by its stiffness. Double precision is just as reproducible on every target as single precision.

pub(crate) mod air;
pub(crate) mod elimination;
mod energy_guard;
pub(crate) mod euler;
mod flight;
mod network;
mod obstacles;
pub(crate) mod springs;
mod state;

use crate::bodies::{Bodies, REACH_MIN};
use crate::body::{GROUPS_MAX, Motion};
use crate::broad_phase::pairs::Pair;
use crate::math::max;
use air::{Air, Drag, FORCE_MAX};
pub(crate) use air::{Move, MoveKind};
use energy_guard::SpringGuard;
use euler::{EulerBody, EulerGroups};
use flight::Flight;
use glam::Vec2;
use network::{Network, VISITS_MAX};
use obstacles::Obstacles;
use springs::{Spring, SpringEnd};

/// Settings of a world with forces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceSettings {
    /// Velocity of the air, units/s.
    pub wind: Vec2,
    /// Maximum number of springs at any time.
    pub springs_max: usize,
    /// Groups that are moved by one of Euler's methods.
    pub euler: EulerGroups,
}

/// Constants for a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings {
    pub gravity: Vec2,
    pub dt: f32,
    pub speed_max: f32,
    /// For each group, the groups with which it collides.
    pub meets: [u32; GROUPS_MAX],
}

/// Drag and springs of a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forces {
    wind: Vec2,
    springs_max: usize,
    euler: EulerGroups,
    /// Bodies with drag, in ascending slot order.
    pub dragged: Vec<(u32, Drag)>,
    pub springs: Vec<Spring>,
    /// Whether the three fields below are up to date.
    is_classified: bool,
    euler_bodies: Vec<EulerBody>,
    flights: Vec<Flight>,
    networks: Vec<Network>,
    /// Number of spring visits in this step before the current moves were computed.
    visits_before: u64,
    guard: SpringGuard,
    obstacles: Obstacles,
    /// Slots and original inverse masses of bodies held by obstacles.
    masses: Vec<(u32, f32)>,
    /// Moves of this step.
    pub moves: Vec<Move>,
}

impl Forces {
    pub fn new(settings: &ForceSettings) -> Forces {
        let ForceSettings { wind, springs_max, euler } = *settings;
        Forces { wind, springs_max, euler, ..Forces::default() }
    }

    /// Registers a new body.
    pub fn added(&mut self, slot: u32, group: u8, drag: Drag) {
        assert!(drag.is_valid(), "{drag:?} not in 0..={FORCE_MAX}");
        self.is_classified &= !self.euler.have(group);
        if drag != Drag::NONE {
            let at = self.dragged.partition_point(|&(other, _)| other < slot);
            self.dragged.insert(at, (slot, drag));
            self.is_classified = false;
        }
    }

    /// Drops the drag and the springs of removed bodies.
    pub fn keep_alive(&mut self, bodies: &Bodies) {
        let lives = |slot: u32| bodies.alive[slot as usize];
        let counts = (self.dragged.len(), self.springs.len());
        self.dragged.retain(|&(slot, _)| lives(slot));
        self.springs.retain(|spring| spring.slots().all(lives));
        let is_same = counts == (self.dragged.len(), self.springs.len());
        self.is_classified &= is_same && self.euler_bodies.iter().all(|body| lives(body.slot()));
    }

    pub fn drag(&self, slot: u32) -> Drag {
        let at = self.dragged.binary_search_by_key(&slot, |&(other, _)| other);
        at.map_or(Drag::NONE, |at| self.dragged[at].1)
    }

    /// Adds a spring, or returns `false` if there are too many.
    pub fn add_spring(&mut self, spring: Spring) -> bool {
        spring.check();
        let fits = self.springs.len() < self.springs_max;
        if fits {
            self.springs.push(spring);
            self.is_classified = false;
        }
        fits
    }

    /// Number of spring visits in the latest step.
    pub fn spring_visits(&self) -> u64 {
        self.visits_before + self.networks.iter().map(|network| network.visits.all()).sum::<u64>()
    }

    pub fn has_springs(&self) -> bool {
        !self.springs.is_empty()
    }

    /// Computes the moves of a step from the current positions and velocities.
    pub fn find_moves(&mut self, bodies: &Bodies, around: Surroundings) {
        if !self.is_classified {
            self.classify(bodies);
        }
        self.visits_before = self.spring_visits();
        self.moves.clear();
        self.masses.clear();
        let air = self.air(around);
        for body in &self.euler_bodies {
            self.moves.push(body.fly(bodies, &air));
        }
        for flight in &mut self.flights {
            self.moves.push(flight.fly(bodies, &air));
        }
        let meets = |slot: u32| around.meets[usize::from(bodies.group[slot as usize])] != 0;
        for network in &mut self.networks {
            let may_touch = network.slots().any(meets);
            network.begin(bodies, air.dt, may_touch);
        }
        self.share_visits();
        for network in &mut self.networks {
            network.fly(bodies, &air, &mut self.moves);
        }
    }

    /// Divides [`VISITS_MAX`] among the networks in proportion to the visits they want. A small network gets twice
    /// what it wants, up to an equal share, regardless of the others, so the total may reach twice the limit.
    fn share_visits(&mut self) {
        let all = self.networks.iter().map(|network| network.visits.wanted).sum::<u64>();
        let equal = VISITS_MAX / self.networks.len().max(1) as u64;
        for network in &mut self.networks {
            let wanted = network.visits.wanted;
            let by_want = wanted * VISITS_MAX / all;
            network.visits.allowed = by_want.max(equal.min(2 * wanted));
        }
    }

    /// Extends the reach of bodies on stiff springs, and returns whether there are any.
    pub fn extend_reach(&self, bodies: &mut Bodies) -> bool {
        let mut any = false;
        for found in &self.moves {
            if let MoveKind::Fast { implicit } = found.kind {
                let path = max(found.path.length(), implicit.length());
                let reach = &mut bodies.reach[found.slot as usize];
                *reach = max(*reach, REACH_MIN + path);
                any = true;
            }
        }
        any
    }

    /// For each slot, finds how springs bend the body's path, as the acceleration on the parabola that ends where
    /// its move does.
    pub fn find_sprung(&self, bodies: &Bodies, dt: f32, sprung: &mut Vec<Option<Vec2>>) {
        sprung.clear();
        if !self.has_springs() {
            return;
        }
        sprung.resize(bodies.alive.len(), None);
        let ends = self.springs.iter().flat_map(Spring::slots);
        ends.for_each(|slot| sprung[slot as usize] = Some(Vec2::ZERO));
        for found in &self.moves {
            let slot = found.slot as usize;
            let bend = found.path - bodies.velocity[slot] * dt;
            sprung[slot] = sprung[slot].map(|_| bend * (2.0 / (dt * dt)));
        }
    }

    /// Begins a step by saving positions and velocities for the energy guard.
    pub fn begin(&mut self, bodies: &Bodies) {
        self.visits_before = 0;
        self.networks.iter_mut().for_each(|network| network.visits.forget());
        if self.has_springs() {
            self.guard.remember(bodies);
        }
    }

    /// Removes the energy that contacts between these slots added to bodies on springs in a step.
    pub fn limit_energy(
        &mut self,
        bodies: &mut Bodies,
        contacts: impl Iterator<Item = [u32; 2]>,
        gravity: Vec2,
    ) {
        // Without moves, all of them are at rest.
        if self.has_springs() && !self.moves.is_empty() {
            self.guard.contacts.clear();
            self.guard.contacts.extend(contacts);
            let (wind, dragged, euler) = (self.wind, &self.dragged, &self.euler_bodies);
            let blown = dragged.iter().filter(|_| wind != Vec2::ZERO).map(|&(slot, _)| slot);
            let may_gain = blown.chain(euler.iter().map(EulerBody::slot));
            let diverged = self.networks.iter().filter(|network| network.has_diverged);
            let held = self.masses.iter().map(|&(slot, _)| slot);
            let unsure = held.chain(diverged.flat_map(Network::slots));
            self.guard.limit(bodies, &self.springs, unsure, may_gain, gravity);
        }
    }

    /// Recomputes the moves of bodies on stiff springs that are blocked by something, and gives these bodies the mass
    /// that resists contacts until `restore_masses`.
    pub fn meet_obstacles(&mut self, bodies: &mut Bodies, pairs: &[Pair], around: Surroundings) {
        self.obstacles.find(bodies, pairs, &self.moves, around.dt);
        if self.obstacles.is_empty() {
            return;
        }
        let air = self.air(around);
        for flight in &self.flights {
            let obstacles = self.obstacles.of(flight.slot());
            if let (Some(index), false) =
                (self.obstacles.move_of(flight.slot()), obstacles.is_empty())
            {
                self.moves[index] = flight.hold(bodies, obstacles, &air);
            }
        }
        for network in &mut self.networks {
            if network.slots().any(|slot| !self.obstacles.of(slot).is_empty()) {
                network.hold(bodies, &self.obstacles, &air, &mut self.moves);
            }
        }
        for found in &self.moves {
            if let MoveKind::Held(hold) = found.kind {
                let inverse_mass = &mut bodies.inverse_mass[found.slot as usize];
                self.masses.push((found.slot, *inverse_mass));
                *inverse_mass = hold.inverse_mass;
            }
        }
    }

    /// Spreads the impulses of contacts over stiff springs, and restores the masses of bodies that were held by
    /// obstacles in a step. `is_free` says whether contacts added to the velocities without obstacles.
    pub fn respond(&mut self, bodies: &mut Bodies, is_free: bool, speed_max: f32) {
        for network in &mut self.networks {
            network.respond(bodies, is_free, speed_max);
        }
        for &(slot, inverse_mass) in &self.masses {
            bodies.inverse_mass[slot as usize] = inverse_mass;
        }
    }

    fn air(&self, around: Surroundings) -> Air {
        Air {
            gravity: around.gravity.as_dvec2(),
            wind: self.wind.as_dvec2(),
            dt: f64::from(around.dt),
            speed_max: f64::from(around.speed_max),
        }
    }

    /// Sorts bodies into those moved by Euler's methods, single bodies in flight, and those joined by springs.
    fn classify(&mut self, bodies: &Bodies) {
        // By slot: whether forces act on the body, and whether its springs join it to other bodies or have a length.
        let mut acts = vec![(false, false); bodies.alive.len()];
        for &(slot, _) in &self.dragged {
            acts[slot as usize].0 = true;
        }
        for spring in &self.springs {
            let is_tied = spring.rest_length > 0.0 || matches!(spring.end, SpringEnd::Body(_));
            for slot in spring.slots() {
                let (is_sprung, was_tied) = &mut acts[slot as usize];
                (*is_sprung, *was_tied) = (true, *was_tied || is_tied);
            }
        }
        self.euler_bodies.clear();
        self.flights.clear();
        let mut tied = Vec::new();
        for slot in bodies.slots() {
            if bodies.motion[slot as usize] != Motion::Dynamic {
                continue;
            }
            let (drag, springs) = (self.drag(slot), &self.springs);
            let group = bodies.group[slot as usize];
            if self.euler.have(group) {
                let is_explicit = self.euler.explicit >> group & 1 == 1;
                self.euler_bodies.push(EulerBody::new(slot, drag, is_explicit, springs));
            } else {
                match acts[slot as usize] {
                    (_, true) => tied.push((slot, drag)),
                    (true, false) => self.flights.push(Flight::new(slot, drag, springs)),
                    (false, false) => {}
                }
            }
        }
        self.networks = network::build::networks(&tied, &self.springs);
        self.is_classified = true;
    }
}

#[cfg(test)]
mod energy_tests;
#[cfg(test)]
mod tests;
