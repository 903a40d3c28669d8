//! Keeps contacts from adding energy to bodies on springs.
//!
//! A contact acts once in a step, and its body is moved out of any overlap. Where springs are involved, both may add
//! energy: a bounce inside a floor towards which a spring pulls is faster than one on its surface, and pushing a body
//! against a stiff spring stores energy that nothing has lost. So bodies joined by springs and contacts may not have
//! more energy after a step than before it. The excess is taken from their speeds and, if these have too little, from
//! their paths, in which case the step ends where the springs turn the bodies around.

use super::springs::{Spring, SpringEnd};
use crate::bodies::Bodies;
use crate::solver::islands;
use glam::{DVec2, Vec2};

/// Number of bisections used to shorten a path.
const BISECTIONS: u32 = 10;

/// A group of bodies joined by springs and contacts.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    is_sprung: bool,
    /// Whether something may have added energy: a contact, or a step that did not converge.
    is_touched: bool,
    /// Whether its bodies touch each other, or moved further than resolving an overlap would take them. Bodies pushed
    /// out of something immovable are allowed to gain a little energy, or they would never get out.
    may_turn: bool,
    /// Whether something outside the group does work on it.
    may_gain: bool,
    /// Energy at the start of the step.
    start: f64,
    /// Kinetic energy at the end of the step, and potential energy after a share of the path.
    kinetic: f64,
    potential: f64,
    share: f64,
    /// Bounds on the share of the path at which it ends.
    least: f64,
    most: f64,
}

impl Group {
    fn gains(&self) -> bool {
        let is_guarded = self.is_sprung && self.is_touched && !self.may_gain;
        is_guarded && self.kinetic + self.potential > self.start
    }
}

/// Bodies at the start of a step, and their groups at its end.
#[derive(Clone, Debug, Default)]
pub(super) struct SpringGuard {
    center: Vec<Vec2>,
    velocity: Vec<Vec2>,
    /// Pairs of slots on which contacts acted.
    pub contacts: Vec<[u32; 2]>,
    /// By slot: another member of its group with a lower number, or the slot itself.
    parent: Vec<u32>,
    /// Groups, indexed by the slot that is its own parent.
    groups: Vec<Group>,
}

impl SpringGuard {
    pub fn remember(&mut self, bodies: &Bodies) {
        self.center.clone_from(&bodies.center);
        self.velocity.clone_from(&bodies.velocity);
    }

    /// Limits the energy of all groups that include a slot from `contacts` or `unsure`, except those with a slot
    /// from `may_gain`.
    pub fn limit(
        &mut self,
        bodies: &mut Bodies,
        springs: &[Spring],
        unsure: impl Iterator<Item = u32>,
        may_gain: impl Iterator<Item = u32>,
        gravity: Vec2,
    ) {
        self.join(bodies, springs);
        for slot in unsure {
            self.group(slot).is_touched = true;
        }
        for slot in may_gain {
            self.group(slot).may_gain = true;
        }
        self.find_energy(bodies, springs);
        self.find_potential(bodies, springs, gravity);
        let mut any = false;
        for group in &mut self.groups {
            group.may_turn &= group.gains() && group.potential > group.start;
            any |= group.may_turn;
        }
        if any {
            for _ in 0..BISECTIONS {
                self.turning().for_each(|group| group.share = (group.least + group.most) / 2.0);
                self.find_potential(bodies, springs, gravity);
                for group in self.turning() {
                    let too_far = group.potential > group.start;
                    *(if too_far { &mut group.most } else { &mut group.least }) = group.share;
                }
            }
            self.turning().for_each(|group| group.share = group.least);
            self.find_potential(bodies, springs, gravity);
        }
        for index in 0..bodies.moving.len() {
            let slot = bodies.moving[index];
            let group = *self.group(slot);
            if bodies.inverse_mass[slot as usize] == 0.0 {
                continue;
            }
            if group.may_turn {
                bodies.center[slot as usize] = self.position(bodies, slot).as_vec2();
            }
            if group.gains() && group.kinetic > 0.0 {
                let left = (group.start - group.potential).max(0.0);
                bodies.velocity[slot as usize] *= (left / group.kinetic).sqrt() as f32;
            }
        }
    }

    /// Joins bodies connected by springs and contacts.
    fn join(&mut self, bodies: &Bodies, springs: &[Spring]) {
        self.parent.clear();
        self.parent.extend(0..bodies.alive.len() as u32);
        self.groups.clear();
        self.groups.resize(bodies.alive.len(), Group { share: 1.0, most: 1.0, ..Group::default() });
        let pushed = |slot: u32| bodies.inverse_mass[slot as usize] > 0.0;
        let by_springs = springs.iter().filter_map(|spring| match spring.end {
            SpringEnd::Body(other) => Some([spring.body.index, other.index]),
            SpringEnd::Point(_) => None,
        });
        let contacts = std::mem::take(&mut self.contacts);
        let pairs = by_springs.chain(contacts.iter().copied());
        for [a, b] in pairs.clone().filter(|pair| pair.iter().all(|&slot| pushed(slot))) {
            islands::join(&mut self.parent, a, b);
        }
        for [a, b] in pairs {
            for [own, other] in [[a, b], [b, a]] {
                let moves = bodies.velocity[other as usize] != Vec2::ZERO;
                self.group(own).may_gain |= !pushed(other) && moves;
            }
        }
        for &[a, b] in &contacts {
            for slot in [a, b] {
                let group = self.group(slot);
                group.is_touched = true;
                group.may_turn |= pushed(a) && pushed(b);
            }
        }
        self.contacts = contacts;
    }

    fn group(&mut self, slot: u32) -> &mut Group {
        let root = islands::root(&mut self.parent, slot);
        &mut self.groups[root as usize]
    }

    fn turning(&mut self) -> impl Iterator<Item = &mut Group> {
        self.groups.iter_mut().filter(|group| group.may_turn)
    }

    /// Finds the energy at the start of the step, and the kinetic energy at its end.
    fn find_energy(&mut self, bodies: &Bodies, springs: &[Spring]) {
        for &slot in &bodies.moving {
            let index = slot as usize;
            let inverse_mass = f64::from(bodies.inverse_mass[index]);
            if inverse_mass == 0.0 {
                continue;
            }
            let of = |velocity: Vec2| velocity.as_dvec2().length_squared() / (2.0 * inverse_mass);
            let (before, now) = (of(self.velocity[index]), of(bodies.velocity[index]));
            let path = bodies.center[index] - self.center[index];
            let group = self.group(slot);
            group.start += before;
            group.kinetic += now;
            group.may_turn |= path.length() > bodies.thickness(index);
        }
        for spring in springs {
            let center = &self.center;
            let stored = spring.energy(|slot| center[slot as usize].as_dvec2());
            let own = spring.slots().find(|&slot| bodies.inverse_mass[slot as usize] > 0.0);
            let group = self.group(own.unwrap_or(spring.body.index));
            group.is_sprung = true;
            group.start += stored;
        }
    }

    /// Finds the potential energy of each group after its share of the path. Gravity's part is 0 at the start of the
    /// step.
    fn find_potential(&mut self, bodies: &Bodies, springs: &[Spring], gravity: Vec2) {
        self.groups.iter_mut().for_each(|group| group.potential = 0.0);
        for &slot in &bodies.moving {
            let index = slot as usize;
            let inverse_mass = f64::from(bodies.inverse_mass[index]);
            if inverse_mass > 0.0 {
                let weight = gravity.as_dvec2() * f64::from(bodies.gravity_scale[index]);
                let path = self.position(bodies, slot) - self.center[index].as_dvec2();
                self.group(slot).potential -= weight.dot(path) / inverse_mass;
            }
        }
        for spring in springs {
            let stored = spring.energy(|slot| self.position(bodies, slot));
            let own = spring.slots().find(|&slot| bodies.inverse_mass[slot as usize] > 0.0);
            self.group(own.unwrap_or(spring.body.index)).potential += stored;
        }
    }

    /// Position of a body after its share of the path.
    fn position(&mut self, bodies: &Bodies, slot: u32) -> DVec2 {
        let share = self.group(slot).share;
        let (start, end) = (self.center[slot as usize], bodies.center[slot as usize]);
        start.as_dvec2().lerp(end.as_dvec2(), share)
    }
}
