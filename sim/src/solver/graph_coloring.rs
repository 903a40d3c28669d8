//! Graph colouring: contacts of the same colour share no movable body, so four of them can be
//! solved side by side in the lanes of vector registers.
//!
//! Colours are assigned greedily, in contact order: each contact takes the lowest colour that neither of its movable
//! bodies has (Catto 2024, "SIMD Matters"). A lane computes the same as [`solve_contact`], operation by operation,
//! except that its step is scaled by a factor. With a factor of 1, only the order of the visits differs. Only the
//! changes are summed across lanes, from the first lane to the last, so every machine computes the same bits.
//!
//! [`solve_contact`]: super::gauss_seidel::solve_contact

use super::contact_constraint::ContactConstraint;
use super::gauss_seidel::SweepChange;
use crate::growth::push;
use crate::math::{DUST, max};
use glam::{Vec2, Vec4};

/// Number of contacts solved side by side.
const LANES: usize = 4;
/// Takes the place of the constraint index in an empty lane.
const EMPTY: u32 = u32::MAX;
/// Number of colours. A contact for which none is left gets a vector to itself.
const COLORS_MAX: usize = 64;

/// Up to four contacts of the same colour. Empty lanes change nothing.
#[derive(Clone, Debug, Default)]
struct WideContact {
    /// Indices of the constraints; [`EMPTY`] for an empty lane.
    constraints: [u32; LANES],
    a: [u32; LANES],
    b: [u32; LANES],
    normal_x: Vec4,
    normal_y: Vec4,
    min_normal_velocity: Vec4,
    effective_mass: Vec4,
    inv_mass_a: Vec4,
    inv_mass_b: Vec4,
    friction: Vec4,
    normal_impulse: Vec4,
    tangent_impulse: Vec4,
    normal_before: Vec4,
    tangent_before: Vec4,
    normal_direction: Vec4,
    tangent_direction: Vec4,
}

/// The contacts of an island by colour, and scratch memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColoredContacts {
    wide: Vec<WideContact>,
    /// By slot: bit set of the colours used at the body; 0 between uses.
    colors: Vec<u64>,
    /// Colours of the contacts.
    color_of: Vec<u8>,
    /// The contacts, colour by colour.
    order: Vec<u32>,
}

impl ColoredContacts {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.colors.resize(slots, 0);
    }

    /// Number of groups of contacts that are solved side by side.
    pub fn wide_count(&self) -> u64 {
        self.wide.len() as u64
    }

    /// Colours these constraints, and copies them to lanes.
    pub fn color(&mut self, constraints: &[ContactConstraint], indices: &[u32]) {
        let mut ends = [0; COLORS_MAX + 1];
        self.color_of.clear();
        for &index in indices {
            let constraint = &constraints[index as usize];
            let color = self.next_color(constraint);
            push(&mut self.color_of, color as u8);
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

    /// Returns the lowest colour that is free at both bodies and marks it as used. Returns [`COLORS_MAX`] if no
    /// colour is free.
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

    /// Visits every contact once, taking `factor` times the step to its solution. The factor is in (0, 2);
    /// above 1, this is successive over-relaxation.
    pub fn sweep<const FRICTION: bool>(
        &mut self,
        velocity: &mut [Vec2],
        change: &mut SweepChange,
        factor: f32,
    ) {
        let (mut worst, mut squared) = (Vec4::ZERO, Vec4::ZERO);
        for wide in &mut self.wide {
            wide.solve::<FRICTION>(velocity, &mut worst, &mut squared, factor);
        }
        for lane in 0..LANES {
            change.worst = max(change.worst, worst[lane]);
            change.squared += squared[lane];
        }
    }

    pub fn extrapolate<const FRICTION: bool>(&mut self, velocity: &mut [Vec2], beta: Option<f32>) {
        for wide in &mut self.wide {
            wide.extrapolate::<FRICTION>(velocity, beta);
        }
    }

    /// Copies the impulses back to the constraints.
    pub fn store(&self, constraints: &mut [ContactConstraint]) {
        for wide in &self.wide {
            let lanes = (0..LANES).filter(|&lane| wide.constraints[lane] != EMPTY);
            for lane in lanes {
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
        // Empty lanes load and store the velocities of the first contact's bodies; see `store`.
        let mut wide = WideContact {
            constraints: [EMPTY; LANES],
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

    /// Solves every lane as `gauss_seidel::solve_contact` does, except for the factor, and adds up the changes.
    #[inline]
    fn solve<const FRICTION: bool>(
        &mut self,
        velocity: &mut [Vec2],
        worst: &mut Vec4,
        squared: &mut Vec4,
        factor: f32,
    ) {
        let (x, y) = self.relative_velocities(velocity);
        let excess = self.normal_x * x + self.normal_y * y - self.min_normal_velocity;
        let before = self.normal_impulse;
        let normal = greater(before - factor * excess * self.effective_mass, Vec4::ZERO);
        let normal_change = normal - before;
        self.normal_impulse = normal;
        let mut tangent_change = Vec4::ZERO;
        if FRICTION {
            let slide = (self.normal_x * y - self.normal_y * x + DUST) - DUST;
            let before = self.tangent_impulse;
            let wanted = before - factor * slide * self.effective_mass;
            self.tangent_impulse = limited(wanted, self.friction * normal);
            tangent_change = self.tangent_impulse - before;
        }
        let inv_mass = self.inv_mass_a + self.inv_mass_b;
        *worst = greater(*worst, greater(normal_change.abs(), tangent_change.abs()) * inv_mass);
        let normal_off = normal - self.normal_before;
        let tangent_off = self.tangent_impulse - self.tangent_before;
        *squared += (normal_off * normal_off + tangent_off * tangent_off) * inv_mass;
        self.apply(velocity, normal_change, tangent_change);
    }

    #[inline]
    fn extrapolate<const FRICTION: bool>(&mut self, velocity: &mut [Vec2], beta: Option<f32>) {
        let Some(beta) = beta else {
            self.normal_direction = Vec4::ZERO;
            self.tangent_direction = Vec4::ZERO;
            self.normal_before = self.normal_impulse;
            self.tangent_before = self.tangent_impulse;
            return;
        };
        let before = self.normal_impulse;
        let direction = beta * self.normal_direction;
        let normal = greater(before + direction, Vec4::ZERO);
        self.normal_direction = direction + (before - self.normal_before);
        self.normal_impulse = normal;
        self.normal_before = normal;
        let normal_change = normal - before;
        let mut tangent_change = Vec4::ZERO;
        if FRICTION {
            let before = self.tangent_impulse;
            let direction = beta * self.tangent_direction;
            let tangent = limited(before + direction, self.friction * normal);
            self.tangent_direction = direction + (before - self.tangent_before);
            self.tangent_impulse = tangent;
            self.tangent_before = tangent;
            tangent_change = tangent - before;
        }
        self.apply(velocity, normal_change, tangent_change);
    }

    /// Velocities of b relative to a.
    #[inline(always)]
    fn relative_velocities(&self, velocity: &[Vec2]) -> (Vec4, Vec4) {
        let [a_low, a_high] = load(velocity, self.a);
        let [b_low, b_high] = load(velocity, self.b);
        let (low, high) = (b_low - a_low, b_high - a_high);
        (Vec4::new(low.x, low.z, high.x, high.z), Vec4::new(low.y, low.w, high.y, high.w))
    }

    /// Applies an impulse to each b, and the opposite impulse to each a.
    #[inline(always)]
    fn apply(&self, velocity: &mut [Vec2], normal: Vec4, tangent: Vec4) {
        let x = self.normal_x * normal - self.normal_y * tangent;
        let y = self.normal_y * normal + self.normal_x * tangent;
        let [low, high] = load(velocity, self.a);
        let [low_change, high_change] = paired(x * self.inv_mass_a, y * self.inv_mass_a);
        store(velocity, self.a, [low - low_change, high - high_change]);
        let [low, high] = load(velocity, self.b);
        let [low_change, high_change] = paired(x * self.inv_mass_b, y * self.inv_mass_b);
        store(velocity, self.b, [low + low_change, high + high_change]);
    }
}

/// Loads the velocities of four bodies, two per register. It does not use `map`, which would be a call per body in
/// the page's program.
#[inline(always)]
fn load(velocity: &[Vec2], slots: [u32; LANES]) -> [Vec4; 2] {
    let pair = |first: u32, second: u32| {
        let (first, second) = (velocity[first as usize], velocity[second as usize]);
        Vec4::new(first.x, first.y, second.x, second.y)
    };
    [pair(slots[0], slots[1]), pair(slots[2], slots[3])]
}

/// The inverse of [`load`]. The first lane is stored last, because empty lanes refer to its bodies too. An immovable
/// body may be in several lanes, which all store the value that they loaded.
#[inline(always)]
fn store(velocity: &mut [Vec2], slots: [u32; LANES], [low, high]: [Vec4; 2]) {
    velocity[slots[3] as usize] = Vec2::new(high.z, high.w);
    velocity[slots[2] as usize] = Vec2::new(high.x, high.y);
    velocity[slots[1] as usize] = Vec2::new(low.z, low.w);
    velocity[slots[0] as usize] = Vec2::new(low.x, low.y);
}

/// Four vectors with these components, two per register.
#[inline(always)]
fn paired(x: Vec4, y: Vec4) -> [Vec4; 2] {
    [Vec4::new(x.x, y.x, x.y, y.y), Vec4::new(x.z, y.z, x.w, y.w)]
}

/// The larger number in each lane; see `math::max`. `Vec4::max` treats NaN differently from machine to machine.
#[inline(always)]
fn greater(a: Vec4, b: Vec4) -> Vec4 {
    Vec4::select(a.cmpgt(b), a, b)
}

#[inline(always)]
fn limited(tangent: Vec4, limit: Vec4) -> Vec4 {
    let low = Vec4::select(tangent.cmplt(-limit), -limit, tangent);
    let within = Vec4::select(low.cmpgt(limit), limit, low) + Vec4::ZERO;
    Vec4::select(limit.cmpgt(Vec4::ZERO), within, Vec4::ZERO)
}
