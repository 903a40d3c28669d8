//! Solves islands by elimination in double precision if sweeps fail because heavy bodies rest on light ones.
//!
//! It uses an augmented Lagrangian with an active set (Hestenes 1969; Hintermueller, Ito and Kunisch 2002). Contacts
//! that hold are stiff springs whose forces become impulses in each round. A round solves one sparse system with a 2
//! by 2 block for each body and each contact. If whole steps do not converge, the solver starts over with a line
//! search for the minimum in each step (Newton's method for a convex function), and updates impulses only once the
//! contacts that hold are known.

use crate::forces::elimination::{Elimination, EliminationOrder};
use crate::solver::contact_constraint::ContactConstraint;
use glam::{DMat2, DVec2, Vec2};

/// Mass ratio from which elimination is worth the time, and the maximum number of contacts.
const MASS_RATIO: f32 = 20.0;
const CONTACTS_MAX: usize = 128;
/// Number of sweep visits that take as long as a round takes per contact.
pub(crate) const VISITS: u32 = 16;
/// Maximum number of sweeps over a very stiff island before elimination, and of visits made by such sweeps in a step.
const SWEEPS_BEFORE: u32 = 64;
const STEP_VISITS_BEFORE: u64 = 8000;
/// Maximum number of visits charged for eliminations in a step. In a collapsing heap, several islands would need
/// elimination in every step.
const STEP_VISITS: u64 = 100_000;
/// Maximum number of rounds. In the first half of an island's rounds, whole steps are taken.
const ROUNDS_MAX: u32 = 80;
/// Maximum number of times that the way to a round's solution is halved in the search for the minimum.
const HALVINGS: u32 = 10;
/// Stiffness of a contact, in multiples of the heaviest body's mass.
const STIFFNESS: f64 = 1e5;

/// A contact of the island.
#[derive(Clone, Debug)]
struct Contact {
    index: u32,
    /// The unknowns of both bodies; `None` for an immovable body.
    ends: [Option<u32>; 2],
    normal: DVec2,
    /// Impulses along the normal and across it.
    impulse: DVec2,
    /// Velocity contributed by immovable bodies, and the smallest allowed speed along the normal.
    driven: DVec2,
    min: f64,
    friction: f64,
    /// Friction limit that follows from the normal impulse of the previous round.
    limit: f64,
}

impl Contact {
    /// Starts with the impulses of a constraint.
    fn reset(&mut self, constraint: &ContactConstraint) {
        self.impulse = Vec2::new(constraint.normal_impulse, constraint.tangent_impulse).as_dvec2();
        self.limit = self.friction * self.impulse.x;
    }

    /// Velocity of b relative to a, counting only the unknowns.
    fn relative(&self, velocity: &[DVec2]) -> DVec2 {
        let of = |end: Option<u32>| end.map_or(DVec2::ZERO, |end| velocity[end as usize]);
        of(self.ends[1]) - of(self.ends[0])
    }

    /// Returns the vector with these components along the normal and across it.
    fn vector(&self, parts: DVec2) -> DVec2 {
        self.normal * parts.x + self.normal.perp() * parts.y
    }

    /// Speed along the normal in excess of the smallest allowed one, and speed across the normal.
    fn errors(&self, velocity: &[DVec2]) -> DVec2 {
        let relative = self.relative(velocity) + self.driven;
        DVec2::new(self.normal.dot(relative) - self.min, self.normal.perp().dot(relative))
    }

    /// The impulses of the contact's springs at these velocities, along the normal and across it, and whether each
    /// depends on the velocities.
    fn springs(&self, velocity: &[DVec2], stiffness: f64) -> (DVec2, [bool; 2]) {
        let free = self.impulse - self.errors(velocity) * stiffness;
        if free.x <= 0.0 {
            return (DVec2::ZERO, [false, false]);
        }
        let sticks = free.y.abs() < self.limit;
        let across = if sticks { free.y } else { self.limit.copysign(free.y) };
        (DVec2::new(free.x, across), [true, sticks])
    }

    /// Adopts the impulses of the contact's springs at these velocities, given whether they hold. Returns the largest
    /// remaining error, units/s.
    fn renew(&mut self, velocity: &[DVec2], holds: [bool; 2], stiffness: f64) -> f64 {
        let errors = self.errors(velocity);
        let free = self.impulse - errors * stiffness;
        let across = if holds[1] { free.y } else { self.limit.copysign(free.y) };
        self.impulse = if holds[0] { DVec2::new(free.x, across) } else { DVec2::ZERO };
        let limit = self.friction * if free.x > 0.0 { self.impulse.x } else { 0.0 };
        let before = std::mem::replace(&mut self.limit, limit);
        let off = [
            if holds[0] { errors.x.abs() } else { -errors.x },
            if holds[1] { errors.y.abs() } else { 0.0 },
            (limit - before).abs() / (stiffness / STIFFNESS),
        ];
        off.into_iter().fold(0.0, |worst, off| if off > worst { off } else { worst })
    }
}

/// Whether an island that sweeps failed to solve should be solved by elimination.
pub(crate) fn is_worth(contacts: usize, mass_ratio: f32) -> bool {
    contacts <= CONTACTS_MAX && mass_ratio > MASS_RATIO
}

/// Maximum number of sweeps over an island with this many contacts before elimination, if such sweeps have taken
/// `visits` in the step so far.
pub(crate) fn sweeps_before(contacts: usize, visits: u64) -> u32 {
    let left = STEP_VISITS_BEFORE.saturating_sub(visits) / contacts as u64;
    SWEEPS_BEFORE.min(left as u32)
}

/// Maximum number of rounds for an island with this many contacts, if eliminations have been charged `visits` in the
/// step so far.
pub(crate) fn rounds_left(contacts: usize, visits: u64) -> u32 {
    let left = STEP_VISITS.saturating_sub(visits) / (u64::from(VISITS) * contacts as u64);
    ROUNDS_MAX.min(left as u32)
}

#[derive(Clone, Debug, Default)]
pub(crate) struct DirectSolver {
    /// The movable bodies of the island, ascending, and the pairs of their indices that share a contact.
    slots: Vec<u32>,
    edges: Vec<(u32, u32)>,
    system: Elimination,
    order: EliminationOrder,
    /// By body, in elimination order: mass, velocity, and momentum without the impulses.
    masses: Vec<f64>,
    speed: Vec<DVec2>,
    momentum: Vec<DVec2>,
    contacts: Vec<Contact>,
    /// Velocities at the start, and the velocities found by a round.
    start: Vec<DVec2>,
    target: Vec<DVec2>,
    /// Change in the velocities in a round, and the velocities after part of it.
    change: Vec<DVec2>,
    next: Vec<DVec2>,
    /// By contact: whether the contact holds along the normal and across it.
    holding: Vec<[bool; 2]>,
    /// Stiffness of the contacts.
    stiffness: f64,
}

impl DirectSolver {
    /// Solves an island from its current impulses in up to `rounds_max` rounds, or leaves it unchanged. Returns
    /// whether it was solved, and the number of rounds.
    #[inline(never)]
    pub fn solve(
        &mut self,
        constraints: &mut [ContactConstraint],
        island: &[u32],
        velocity: &mut [Vec2],
        tolerance: f32,
        rounds_max: u32,
    ) -> (bool, u32) {
        self.read(constraints, island, velocity);
        let whole_rounds = rounds_max.div_ceil(2);
        for round in 0..rounds_max {
            let steps_whole = round < whole_rounds;
            if round == whole_rounds {
                self.speed.clone_from(&self.start);
                for contact in &mut self.contacts {
                    contact.reset(&constraints[contact.index as usize]);
                }
            }
            self.assemble();
            self.system.factor();
            self.system.solve(&mut self.target);
            if !self.target.iter().all(|speed| speed.is_finite()) {
                return (false, round + 1);
            }
            let same = |(contact, holds): (&Contact, &[bool; 2])| {
                contact.springs(&self.target, self.stiffness).1 == *holds
            };
            let is_same = self.contacts.iter().zip(&self.holding).all(same);
            if !is_same && !steps_whole {
                self.step_to_lowest();
                continue;
            }
            std::mem::swap(&mut self.speed, &mut self.target);
            let mut worst = if is_same { 0.0 } else { f64::INFINITY };
            for (contact, &holds) in self.contacts.iter_mut().zip(&self.holding) {
                let off = contact.renew(&self.speed, holds, self.stiffness);
                worst = if off > worst { off } else { worst };
            }
            if worst < f64::from(tolerance) {
                self.write(constraints, velocity);
                return (true, round + 1);
            }
        }
        (false, rounds_max)
    }

    /// Lists an island's bodies, and finds the order in which they are eliminated.
    fn list_bodies(&mut self, constraints: &[ContactConstraint], island: &[u32]) {
        let DirectSolver { slots, edges, order, system, .. } = self;
        let bodies = || island.iter().flat_map(|&index| constraints[index as usize].bodies());
        let movable = bodies().filter(|&(_, inv_mass)| inv_mass > 0.0);
        slots.clear();
        slots.extend(movable.map(|(slot, _)| slot));
        slots.sort_unstable();
        slots.dedup();
        edges.clear();
        for &index in island {
            let ends = constraints[index as usize].bodies().map(|end| unknown(slots, end));
            if let [Some(a), Some(b)] = ends {
                edges.push((a, b));
            }
        }
        system.build(slots.len(), edges, order);
    }

    /// Reads the bodies and contacts of an island.
    fn read(&mut self, constraints: &[ContactConstraint], island: &[u32], velocity: &[Vec2]) {
        self.list_bodies(constraints, island);
        let DirectSolver { slots, order, masses, speed, momentum, contacts, .. } = self;
        masses.clear();
        masses.resize(slots.len(), 0.0);
        speed.clear();
        speed.resize(slots.len(), DVec2::ZERO);
        contacts.clear();
        for &index in island {
            let constraint = &constraints[index as usize];
            let place = |body| unknown(slots, body).map(|end| order.index_of[end as usize]);
            let ends = constraint.bodies().map(place);
            // Velocities of immovable bodies.
            let mut driven = [DVec2::ZERO; 2];
            for (side, (slot, inv_mass)) in constraint.bodies().into_iter().enumerate() {
                let of_body = velocity[slot as usize].as_dvec2();
                match ends[side] {
                    Some(end) => {
                        masses[end as usize] = 1.0 / f64::from(inv_mass);
                        speed[end as usize] = of_body;
                    }
                    None => driven[side] = of_body,
                }
            }
            let mut contact = Contact {
                index,
                ends,
                normal: constraint.normal.as_dvec2(),
                impulse: DVec2::ZERO,
                driven: driven[1] - driven[0],
                min: f64::from(constraint.min_normal_velocity),
                friction: f64::from(constraint.friction),
                limit: 0.0,
            };
            contact.reset(constraint);
            contacts.push(contact);
        }
        momentum.clear();
        momentum.extend(speed.iter().zip(&*masses).map(|(&speed, &mass)| speed * mass));
        for contact in &*contacts {
            push(momentum, contact.ends, -contact.vector(contact.impulse));
        }
        let heaviest = masses.iter().fold(0.0, |most, &mass| if mass > most { mass } else { most });
        self.stiffness = STIFFNESS * heaviest;
        self.start.clone_from(&self.speed);
    }

    /// Sets up the system of a round, with the contacts that hold at the current velocities.
    fn assemble(&mut self) {
        let DirectSolver { system, speed, target, holding, stiffness, .. } = self;
        system.clear();
        target.clone_from(&self.momentum);
        for (end, &mass) in (0u32..).zip(&self.masses) {
            system.add_diagonal(end, DMat2::from_diagonal(DVec2::splat(mass)));
        }
        holding.clear();
        for contact in &self.contacts {
            let (springs, holds) = contact.springs(speed, *stiffness);
            let relative = contact.relative(speed);
            let (mut block, mut impulse) = (DMat2::ZERO, contact.vector(springs));
            for (holds, axis) in holds.into_iter().zip([contact.normal, contact.normal.perp()]) {
                if holds {
                    block += DMat2::from_cols(axis * axis.x, axis * axis.y) * *stiffness;
                    impulse += axis * (axis.dot(relative) * *stiffness);
                }
            }
            push(target, contact.ends, impulse);
            for end in contact.ends.into_iter().flatten() {
                system.add_diagonal(end, block);
            }
            if let [Some(a), Some(b)] = contact.ends {
                system.add(a, b, -block);
            }
            holding.push(holds);
        }
    }

    /// Moves to the minimum on the way to a round's solution.
    fn step_to_lowest(&mut self) {
        self.change.clear();
        let ways = self.target.iter().zip(&self.speed).map(|(&to, &from)| to - from);
        self.change.extend(ways);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let share = 0.5 * (low + high);
            let at = |(&from, &change): (&DVec2, &DVec2)| from + change * share;
            self.next.clear();
            self.next.extend(self.speed.iter().zip(&self.change).map(at));
            *(if self.slope() < 0.0 { &mut low } else { &mut high }) = share;
        }
        for (speed, change) in self.speed.iter_mut().zip(&self.change) {
            *speed += *change * high;
        }
    }

    /// Slope, along the change and at the next velocities, of the convex function that a round minimizes.
    fn slope(&self) -> f64 {
        let mut sum = 0.0;
        let bodies = self.next.iter().zip(&self.momentum).zip(&self.masses).zip(&self.change);
        for (((&speed, &momentum), &mass), &change) in bodies {
            sum += (speed * mass - momentum).dot(change);
        }
        for contact in &self.contacts {
            let (springs, _) = contact.springs(&self.next, self.stiffness);
            sum -= contact.vector(springs).dot(contact.relative(&self.change));
        }
        sum
    }

    /// Writes the velocities and impulses back.
    fn write(&self, constraints: &mut [ContactConstraint], velocity: &mut [Vec2]) {
        for (&slot, &end) in self.slots.iter().zip(&self.order.index_of) {
            velocity[slot as usize] = self.speed[end as usize].as_vec2();
        }
        for contact in &self.contacts {
            let constraint = &mut constraints[contact.index as usize];
            let impulse = contact.impulse.as_vec2();
            (constraint.normal_impulse, constraint.tangent_impulse) = (impulse.x, impulse.y);
        }
    }
}

/// A body's index among those of the island; `None` if it does not move.
fn unknown(slots: &[u32], (slot, inv_mass): (u32, f32)) -> Option<u32> {
    (inv_mass > 0.0).then(|| slots.binary_search(&slot).expect("listed") as u32)
}

/// Adds an impulse to the second of two bodies, and the opposite impulse to the first.
fn push(momentum: &mut [DVec2], ends: [Option<u32>; 2], impulse: DVec2) {
    for (end, impulse) in ends.into_iter().zip([-impulse, impulse]) {
        if let Some(end) = end {
            momentum[end as usize] += impulse;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rounds_of_a_step_fit_into_its_visits() {
        assert_eq!([0, 7000, 7900, 9000].map(|visits| sweeps_before(100, visits)), [64, 10, 1, 0]);
        assert_eq!(rounds_left(2, 0), ROUNDS_MAX);
        assert_eq!(rounds_left(2, STEP_VISITS - 64), 2);
        assert_eq!(rounds_left(CONTACTS_MAX, 0), 48);
        assert_eq!(
            [rounds_left(CONTACTS_MAX, STEP_VISITS), rounds_left(2, 2 * STEP_VISITS)],
            [0, 0]
        );
    }
}
