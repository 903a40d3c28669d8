//! Graph colouring: contacts of one colour share no movable body, so eight of them are solved side
//! by side, in the lanes of vector registers.
//!
//! Colours are greedy, in the order of the contacts: each takes the lowest colour that neither of
//! its movable bodies has (Catto 2024, "SIMD Matters"). A lane computes what
//! [`solve_contact`] does, operation by operation, but for the factor on its step; with factor 1 only the
//! order of the visits differs from that of one contact after another. Nothing is summed across lanes but the changes, from the first lane to
//! the last: every machine computes the same bits.
//!
//! [`solve_contact`]: super::gauss_seidel::solve_contact

use super::contact_constraint::ContactConstraint;
use super::gauss_seidel::{Change, limited};
use crate::growth::push;
use crate::math::{max, without_dust};
use glam::Vec2;

/// Contacts that are solved side by side.
const LANES: usize = 8;
/// Colours; a contact for which none is left has lanes of its own.
const COLORS_MAX: usize = 64;

/// A number of each contact.
type Lanes = [f32; LANES];

/// Contacts of one colour. Lanes from `count` on are empty: they change nothing.
#[derive(Clone, Debug, Default)]
struct WideContact {
    count: usize,
    constraints: [u32; LANES],
    a: [u32; LANES],
    b: [u32; LANES],
    normal_x: Lanes,
    normal_y: Lanes,
    min_normal_velocity: Lanes,
    effective_mass: Lanes,
    inv_mass_a: Lanes,
    inv_mass_b: Lanes,
    friction: Lanes,
    normal_impulse: Lanes,
    tangent_impulse: Lanes,
    normal_before: Lanes,
    tangent_before: Lanes,
    normal_direction: Lanes,
    tangent_direction: Lanes,
}

/// The contacts of an island by colour, and scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColoredContacts {
    wide: Vec<WideContact>,
    /// By slot: the colours that it has; 0 between uses.
    colors: Vec<u64>,
    /// By contact: its colour.
    color_of: Vec<u8>,
    /// The contacts, colour by colour.
    order: Vec<u32>,
}

impl ColoredContacts {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.colors.resize(slots, 0);
    }

    /// Colours these constraints, and copies them to lanes.
    pub fn color(&mut self, constraints: &[ContactConstraint], indices: &[u32]) {
        let mut ends = [0; COLORS_MAX + 1];
        self.color_of.clear();
        for &index in indices {
            let constraint = &constraints[index as usize];
            let color = self.next_color(constraint);
            self.color_of.push(color as u8);
            ends[color] += 1;
        }
        for &index in indices {
            let constraint = &constraints[index as usize];
            self.colors[constraint.a as usize] = 0;
            self.colors[constraint.b as usize] = 0;
        }
        let mut end = 0;
        for count in &mut ends {
            let start = end;
            end += *count;
            *count = start;
        }
        self.order.clear();
        self.order.resize(indices.len(), 0);
        for (&index, &color) in indices.iter().zip(&self.color_of) {
            self.order[ends[usize::from(color)]] = index;
            ends[usize::from(color)] += 1;
        }
        self.wide.clear();
        let mut start = 0;
        for (color, &end) in ends.iter().enumerate() {
            let width = if color == COLORS_MAX { 1 } else { LANES };
            for members in self.order[start..end].chunks(width) {
                push(&mut self.wide, WideContact::new(constraints, members));
            }
            start = end;
        }
    }

    /// Takes the lowest colour that is left at both bodies; [`COLORS_MAX`] if none is.
    fn next_color(&mut self, constraint: &ContactConstraint) -> usize {
        let movable = constraint.bodies().map(|(slot, inv_mass)| (slot as usize, inv_mass > 0.0));
        let mut taken = 0;
        for (slot, is_movable) in movable {
            taken |= if is_movable { self.colors[slot] } else { 0 };
        }
        let color = taken.trailing_ones() as usize;
        if color < COLORS_MAX {
            for (slot, _) in movable.into_iter().filter(|&(_, is_movable)| is_movable) {
                self.colors[slot] |= 1 << color;
            }
        }
        color
    }

    /// Visits every contact once, and takes `factor` times the step to its solution, in (0, 2): beyond 1 that is
    /// successive over-relaxation.
    pub fn sweep<const FRICTION: bool>(
        &mut self,
        velocity: &mut [Vec2],
        change: &mut Change,
        factor: f32,
    ) {
        let (mut worst, mut squared) = ([0.0; LANES], [0.0; LANES]);
        for wide in &mut self.wide {
            wide.solve::<FRICTION>(velocity, &mut worst, &mut squared, factor);
        }
        for lane in 0..LANES {
            change.worst = max(change.worst, worst[lane]);
            change.squared += squared[lane];
        }
    }

    /// See `sweep::extrapolate`.
    pub fn extrapolate<const FRICTION: bool>(&mut self, velocity: &mut [Vec2], beta: Option<f32>) {
        for wide in &mut self.wide {
            wide.extrapolate::<FRICTION>(velocity, beta);
        }
    }

    /// Copies the impulses back.
    pub fn store(&self, constraints: &mut [ContactConstraint]) {
        for wide in &self.wide {
            for lane in 0..wide.count {
                let constraint = &mut constraints[wide.constraints[lane] as usize];
                constraint.normal_impulse = wide.normal_impulse[lane];
                constraint.tangent_impulse = wide.tangent_impulse[lane];
            }
        }
    }
}

impl WideContact {
    fn new(constraints: &[ContactConstraint], members: &[u32]) -> WideContact {
        let first = &constraints[members[0] as usize];
        // Empty lanes read velocities of the first contact's bodies.
        let mut wide = WideContact {
            count: members.len(),
            a: [first.a; LANES],
            b: [first.b; LANES],
            ..WideContact::default()
        };
        for (lane, &index) in members.iter().enumerate() {
            let constraint = &constraints[index as usize];
            wide.constraints[lane] = index;
            wide.a[lane] = constraint.a;
            wide.b[lane] = constraint.b;
            wide.normal_x[lane] = constraint.normal.x;
            wide.normal_y[lane] = constraint.normal.y;
            wide.min_normal_velocity[lane] = constraint.min_normal_velocity;
            wide.effective_mass[lane] = constraint.effective_mass;
            wide.inv_mass_a[lane] = constraint.inv_mass_a;
            wide.inv_mass_b[lane] = constraint.inv_mass_b;
            wide.friction[lane] = constraint.friction;
            wide.normal_impulse[lane] = constraint.normal_impulse;
            wide.tangent_impulse[lane] = constraint.tangent_impulse;
            wide.normal_before[lane] = constraint.normal_impulse;
            wide.tangent_before[lane] = constraint.tangent_impulse;
            wide.normal_direction[lane] = constraint.normal_direction;
            wide.tangent_direction[lane] = constraint.tangent_direction;
        }
        wide
    }

    /// Solves every lane as `gauss_seidel::solve_contact` does, but for the factor, and adds its changes.
    #[inline]
    fn solve<const FRICTION: bool>(
        &mut self,
        velocity: &mut [Vec2],
        worst: &mut Lanes,
        squared: &mut Lanes,
        factor: f32,
    ) {
        let (x, y) = self.relative_velocities(velocity);
        let (mut impulse_x, mut impulse_y) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let (normal_x, normal_y) = (self.normal_x[lane], self.normal_y[lane]);
            let excess = normal_x * x[lane] + normal_y * y[lane] - self.min_normal_velocity[lane];
            let before = self.normal_impulse[lane];
            let normal = max(before - factor * excess * self.effective_mass[lane], 0.0);
            let normal_change = normal - before;
            self.normal_impulse[lane] = normal;
            let mut tangent_change = 0.0;
            if FRICTION {
                let slide = without_dust(normal_x * y[lane] - normal_y * x[lane]);
                let before = self.tangent_impulse[lane];
                let wanted = before - factor * slide * self.effective_mass[lane];
                let tangent = limited(wanted, self.friction[lane] * normal);
                tangent_change = tangent - before;
                self.tangent_impulse[lane] = tangent;
            }
            impulse_x[lane] = normal_x * normal_change - normal_y * tangent_change;
            impulse_y[lane] = normal_y * normal_change + normal_x * tangent_change;
            let inv_mass = self.inv_mass_a[lane] + self.inv_mass_b[lane];
            let off = max(normal_change.abs(), tangent_change.abs()) * inv_mass;
            worst[lane] = max(worst[lane], off);
            let normal_off = normal - self.normal_before[lane];
            let tangent_off = self.tangent_impulse[lane] - self.tangent_before[lane];
            squared[lane] += (normal_off * normal_off + tangent_off * tangent_off) * inv_mass;
        }
        self.apply(velocity, &impulse_x, &impulse_y);
    }

    #[inline]
    fn extrapolate<const FRICTION: bool>(&mut self, velocity: &mut [Vec2], beta: Option<f32>) {
        let Some(beta) = beta else {
            self.normal_direction = [0.0; LANES];
            self.tangent_direction = [0.0; LANES];
            self.normal_before = self.normal_impulse;
            self.tangent_before = self.tangent_impulse;
            return;
        };
        let (mut impulse_x, mut impulse_y) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let before = self.normal_impulse[lane];
            let direction = beta * self.normal_direction[lane];
            let normal = max(before + direction, 0.0);
            self.normal_direction[lane] = direction + (before - self.normal_before[lane]);
            self.normal_impulse[lane] = normal;
            self.normal_before[lane] = normal;
            let normal_change = normal - before;
            let mut tangent_change = 0.0;
            if FRICTION {
                let before = self.tangent_impulse[lane];
                let direction = beta * self.tangent_direction[lane];
                let tangent = limited(before + direction, self.friction[lane] * normal);
                self.tangent_direction[lane] = direction + (before - self.tangent_before[lane]);
                self.tangent_impulse[lane] = tangent;
                self.tangent_before[lane] = tangent;
                tangent_change = tangent - before;
            }
            let (normal_x, normal_y) = (self.normal_x[lane], self.normal_y[lane]);
            impulse_x[lane] = normal_x * normal_change - normal_y * tangent_change;
            impulse_y[lane] = normal_y * normal_change + normal_x * tangent_change;
        }
        self.apply(velocity, &impulse_x, &impulse_y);
    }

    /// Velocities of b relative to a.
    #[inline]
    fn relative_velocities(&self, velocity: &[Vec2]) -> (Lanes, Lanes) {
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let relative = velocity[self.b[lane] as usize] - velocity[self.a[lane] as usize];
            (x[lane], y[lane]) = (relative.x, relative.y);
        }
        (x, y)
    }

    /// Applies an impulse to each b and its opposite to a.
    #[inline]
    fn apply(&self, velocity: &mut [Vec2], impulse_x: &Lanes, impulse_y: &Lanes) {
        for lane in 0..self.count.min(LANES) {
            let impulse = Vec2::new(impulse_x[lane], impulse_y[lane]);
            velocity[self.a[lane] as usize] -= impulse * self.inv_mass_a[lane];
            velocity[self.b[lane] as usize] += impulse * self.inv_mass_b[lane];
        }
    }
}
