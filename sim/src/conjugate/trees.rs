//! Trees: what carries the load, solved exactly within a sweep.
//!
//! Where nothing turns, a contact that sticks takes both freedoms of a body. A pile at rest has
//! therefore about as many contacts as bodies, and they form a forest: each body with the contact
//! that does most of what contacts do to it, which at rest is what it rests on, down to the ground. On
//! a tree the equations need no iteration: from the leaves to the roots each body hands its apparent mass
//! on to what carries it, and on the way back each learns its velocity (the articulated bodies of
//! Featherstone 1983, without rotation). A sticking contact hands on all of the mass; a sliding
//! one, whose friction is at its limit, the part along its normal; an open one nothing. Which is
//! which is guessed from the impulses so far and mended where the answer contradicts it (a primal-dual
//! active set; Hintermueller, Ito and Kunisch 2002). What is still impossible after that is cut. The
//! answer to the forest alone may be none for the island: so impulses go towards it only as far as
//! the island's own objective rises, and the rest of the sweep corrects what is in no tree.

use super::rows::Row;
use super::sweep::limited;
use crate::math::{clamp, max};
use glam::Vec2;

/// How often a forest is solved in a sweep.
const GUESSES_MAX: u32 = 3;

/// Share of the slope of D that it may have downhill at the answer; a parabola with less is as high there
/// as where it is highest, to 1 %.
const OVERSHOOT: f32 = 0.1;
/// Share of the way to the answer from which on a forest is worth its time.
const FITS: f32 = 0.5;

const NONE: u32 = u32::MAX;

/// What a contact does to the body that it carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    /// The two move as one.
    Stick,
    /// Friction is at its limit; the normal impulse holds.
    Slide,
    /// Nothing.
    Open,
}

/// A body and the contact that carries it.
#[derive(Clone, Copy, Debug)]
struct Node {
    slot: u32,
    /// The contact; none where a tree floats.
    row: u32,
    /// Place of the node that carries it, always a lower one; none for the ground.
    carrier: u32,
    hold: Hold,
    /// Normal of the contact, towards this body.
    normal: Vec2,
    /// Mass of this body.
    own: f32,
    /// Apparent mass with all that it carries, and the impulse that it needs to keep its velocity.
    mass: Symmetric,
    need: Vec2,
    /// Change of the velocity relative to the carrier that would make the contact stick.
    wish: Vec2,
    /// Change of the friction impulse of a contact that slides.
    shift: f32,
    /// The answer: change of its velocity, and the impulse for it.
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

    /// `share` times the square of a vector.
    #[inline]
    fn square(v: Vec2, share: f32) -> Symmetric {
        Symmetric { xx: share * v.x * v.x, xy: share * v.x * v.y, yy: share * v.y * v.y }
    }
}

/// The forest of an island, and scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trees {
    /// Carriers before what they carry.
    nodes: Vec<Node>,
    bodies: Vec<u32>,
    /// By slot: the sum of all impulses, the row with the largest part in it, that part, and a list
    /// of the bodies that are carried.
    sum: Vec<Vec2>,
    best: Vec<u32>,
    part: Vec<f32>,
    first: Vec<u32>,
    next: Vec<u32>,
}

impl Trees {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.best.resize(slots, NONE);
        self.sum.resize(slots, Vec2::ZERO);
        self.part.resize(slots, 0.0);
        self.first.resize(slots, NONE);
        self.next.resize(slots, NONE);
    }

    /// Finds the forest of an island by the present impulses. Bodies that carry each other in a
    /// ring are in none.
    pub fn find<const RUBS: bool>(&mut self, rows: &[Row], island: &[u32]) {
        self.nodes.clear();
        self.bodies.clear();
        for &place in island {
            let row = &rows[place as usize];
            if row.press > 0.0 {
                let impulse = row.impulse_of::<RUBS>(row.press, row.rub);
                self.sum[row.a as usize] -= impulse;
                self.sum[row.b as usize] += impulse;
            }
        }
        for &place in island {
            let row = &rows[place as usize];
            if row.press > 0.0 {
                let impulse = row.impulse_of::<RUBS>(row.press, row.rub);
                if row.weight_a > 0.0 {
                    self.offer(row.a, place, -impulse);
                }
                if row.weight_b > 0.0 {
                    self.offer(row.b, place, impulse);
                }
            }
        }
        self.plant_roots(rows);
        let mut place = 0;
        while place < self.nodes.len() {
            let mut carried = self.first[self.nodes[place].slot as usize];
            while carried != NONE {
                self.plant(carried, place as u32, rows);
                carried = self.next[carried as usize];
            }
            place += 1;
        }
        for &place in island {
            let row = &rows[place as usize];
            for slot in [row.a as usize, row.b as usize] {
                self.sum[slot] = Vec2::ZERO;
                self.best[slot] = NONE;
                self.first[slot] = NONE;
            }
        }
    }

    #[inline]
    fn offer(&mut self, slot: u32, place: u32, impulse: Vec2) {
        let index = slot as usize;
        let part = impulse.dot(self.sum[index]);
        if self.best[index] == NONE {
            self.bodies.push(slot);
        } else if part <= self.part[index] {
            return;
        }
        self.best[index] = place;
        self.part[index] = part;
    }

    /// Plants what stands on the ground or floats, and lists the others with what carries them.
    fn plant_roots(&mut self, rows: &[Row]) {
        for place in 0..self.bodies.len() {
            let slot = self.bodies[place];
            let best = self.best[slot as usize];
            let row = &rows[best as usize];
            let (other, weight) =
                if slot == row.a { (row.b, row.weight_b) } else { (row.a, row.weight_a) };
            if weight == 0.0 {
                self.plant(slot, NONE, rows);
            } else if self.best[other as usize] == best && slot < other {
                // Two that carry each other: the lower slot floats.
                self.plant(slot, NONE, rows);
                self.nodes.last_mut().expect("just planted").row = NONE;
            } else {
                self.next[slot as usize] = self.first[other as usize];
                self.first[other as usize] = slot;
            }
        }
    }

    #[inline]
    fn plant(&mut self, slot: u32, carrier: u32, rows: &[Row]) {
        let place = self.best[slot as usize];
        let row = &rows[place as usize];
        let is_b = slot == row.b;
        self.nodes.push(Node {
            slot,
            row: place,
            carrier,
            hold: Hold::Open,
            normal: if is_b { row.normal } else { -row.normal },
            own: 1.0 / if is_b { row.weight_b } else { row.weight_a },
            mass: Symmetric::default(),
            need: Vec2::ZERO,
            wish: Vec2::ZERO,
            shift: 0.0,
            change: Vec2::ZERO,
            impulse: Vec2::ZERO,
        });
    }

    /// Forgets the forest.
    pub fn clear(&mut self) {
        self.nodes.clear();
    }

    /// Solves the forest: impulses and velocities move to the answer, or as far towards it as raises
    /// D (see `warm`). Whether that is more than [`FITS`] of the way. `RUBS` as in [`super::sweep`].
    pub fn solve<const RUBS: bool>(&mut self, rows: &mut [Row], velocity: &mut [Vec2]) -> bool {
        if self.nodes.is_empty() {
            return true;
        }
        for node in self.nodes.iter_mut().filter(|node| node.row != NONE) {
            guess::<RUBS>(node, &rows[node.row as usize], velocity);
        }
        for _ in 0..GUESSES_MAX {
            self.climb_down::<RUBS>(rows);
            self.climb_up::<RUBS>(rows);
            if !self.mend::<RUBS>(rows) {
                break;
            }
        }
        for node in self.nodes.iter_mut().filter(|node| node.row != NONE) {
            give::<RUBS>(node, &mut rows[node.row as usize], velocity);
        }
        let share = self.best_share(rows, velocity);
        if share < 1.0 {
            for node in self.nodes.iter().filter(|node| node.row != NONE) {
                take_back::<RUBS>(node, &mut rows[node.row as usize], velocity, share);
            }
        }
        share > FITS
    }

    /// How far towards the answer D is greatest; 1 for what is hardly less.
    fn best_share(&self, rows: &[Row], velocity: &[Vec2]) -> f32 {
        // Slopes of D at both ends of the way; it is a parabola.
        let (mut start, mut end) = (0.0, 0.0);
        for node in self.nodes.iter().filter(|node| node.row != NONE) {
            start += node.impulse.dot(node.wish);
            end += node.impulse.dot(lack(node, &rows[node.row as usize], velocity));
        }
        if end >= -OVERSHOOT * start {
            1.0
        } else if start > 0.0 {
            start / (start - end)
        } else {
            0.0
        }
    }

    /// From the leaves to the roots: what each carrier has to move.
    fn climb_down<const RUBS: bool>(&mut self, rows: &[Row]) {
        for node in &mut self.nodes {
            node.mass = Symmetric { xx: node.own, xy: 0.0, yy: node.own };
            node.need = Vec2::ZERO;
        }
        for place in (0..self.nodes.len()).rev() {
            let node = &self.nodes[place];
            let carrier = node.carrier;
            if carrier != NONE {
                let (mass, need) = hand_on::<RUBS>(node, rows);
                let carrier = &mut self.nodes[carrier as usize];
                carrier.mass.add(mass);
                carrier.need += need;
            }
        }
    }

    /// From the roots to the leaves: what each body does.
    fn climb_up<const RUBS: bool>(&mut self, rows: &[Row]) {
        for place in 0..self.nodes.len() {
            let below = self.below(place);
            let node = &mut self.nodes[place];
            (node.change, node.impulse) = answer::<RUBS>(node, rows, below);
        }
    }

    /// Change of the velocity of what carries a node.
    #[inline]
    fn below(&self, place: usize) -> Vec2 {
        match self.nodes[place].carrier {
            NONE => Vec2::ZERO,
            carrier => self.nodes[carrier as usize].change,
        }
    }

    /// Changes what each contact does where the answer contradicts it; whether any was changed.
    fn mend<const RUBS: bool>(&mut self, rows: &[Row]) -> bool {
        let mut any = false;
        for place in 0..self.nodes.len() {
            let below = self.below(place);
            let node = &mut self.nodes[place];
            if node.row != NONE {
                any |= mend::<RUBS>(node, &rows[node.row as usize], below);
            }
        }
        any
    }
}

/// What the contact of a node does by its impulses, and what it lacks.
#[inline]
fn guess<const RUBS: bool>(node: &mut Node, row: &Row, velocity: &[Vec2]) {
    node.hold = if row.press <= 0.0 {
        Hold::Open
    } else if RUBS && row.sticks() {
        Hold::Stick
    } else {
        Hold::Slide
    };
    node.shift = 0.0;
    node.wish = lack(node, row, velocity);
}

/// Change of a node's velocity relative to its carrier that would make the contact stick.
#[inline]
fn lack(node: &Node, row: &Row, velocity: &[Vec2]) -> Vec2 {
    let relative = row.relative(velocity);
    let relative = if node.slot == row.b { relative } else { -relative };
    node.normal * row.bound - relative
}

/// The apparent mass and the need that a node hands on.
#[inline]
fn hand_on<const RUBS: bool>(node: &Node, rows: &[Row]) -> (Symmetric, Vec2) {
    match node.hold {
        Hold::Stick => (node.mass, node.mass.times(node.wish) + node.need),
        Hold::Slide => {
            let (share, lack) = along_normal::<RUBS>(node);
            let press = node.normal * (share * lack);
            let need = if RUBS { press + node.normal.perp() * node.shift } else { press };
            (Symmetric::square(node.normal, share), need)
        }
        Hold::Open => (Symmetric::default(), taken_back::<RUBS>(node, rows)),
    }
}

/// Change of a node's velocity, and the impulse for it, given the change of its carrier.
#[inline]
fn answer<const RUBS: bool>(node: &Node, rows: &[Row], below: Vec2) -> (Vec2, Vec2) {
    let impulse = match node.hold {
        Hold::Stick => {
            let change = below + node.wish;
            return (change, node.mass.times(change) + node.need);
        }
        Hold::Slide => {
            let (share, lack) = along_normal::<RUBS>(node);
            let press = node.normal * (share * (lack + node.normal.dot(below)));
            if RUBS { press + node.normal.perp() * node.shift } else { press }
        }
        Hold::Open => taken_back::<RUBS>(node, rows),
    };
    (node.mass.solve(impulse - node.need), impulse)
}

/// Apparent mass of a sliding node along its normal, and the speed that it lacks there.
#[inline]
fn along_normal<const RUBS: bool>(node: &Node) -> (f32, f32) {
    let share = 1.0 / node.normal.dot(node.mass.solve(node.normal));
    let rest = if RUBS { node.need - node.normal.perp() * node.shift } else { node.need };
    let free = node.mass.solve(rest);
    (share, node.normal.dot(node.wish + free))
}

/// The impulse that takes back what an open contact has given.
#[inline]
fn taken_back<const RUBS: bool>(node: &Node, rows: &[Row]) -> Vec2 {
    match node.row {
        NONE => Vec2::ZERO,
        row => {
            let row = &rows[row as usize];
            let press = node.normal * row.press;
            -(if RUBS { press + node.normal.perp() * row.rub } else { press })
        }
    }
}

/// What the contact of a node must do instead; whether that is anything else.
#[inline]
fn mend<const RUBS: bool>(node: &mut Node, row: &Row, below: Vec2) -> bool {
    let (press, rub) = total::<RUBS>(node, row);
    let rubs = RUBS && row.friction > 0.0;
    // Velocity relative to the carrier in the end.
    let relative = node.normal * row.bound + node.change - below - node.wish;
    let hold = match node.hold {
        Hold::Stick | Hold::Slide if press < 0.0 => Hold::Open,
        Hold::Stick if RUBS && rub.abs() > row.friction * press => {
            let limit = row.friction * press;
            node.shift = clamp(rub, -limit, limit) - row.rub;
            Hold::Slide
        }
        // Friction that drives the slide has to hold it.
        Hold::Slide if rubs && rub * node.normal.perp().dot(relative) > 0.0 => Hold::Stick,
        Hold::Open if node.normal.dot(relative) < row.bound => {
            if rubs {
                Hold::Stick
            } else {
                Hold::Slide
            }
        }
        hold => hold,
    };
    let changed = hold != node.hold;
    node.hold = hold;
    changed
}

/// Normal and friction impulse of a contact after the answer.
#[inline]
fn total<const RUBS: bool>(node: &Node, row: &Row) -> (f32, f32) {
    let press = row.press + node.normal.dot(node.impulse);
    let rub = if RUBS { row.rub + node.normal.perp().dot(node.impulse) } else { 0.0 };
    (press, rub)
}

/// Gives a node its impulse, as far as the contact can; `impulse` becomes what it was given.
#[inline]
fn give<const RUBS: bool>(node: &mut Node, row: &mut Row, velocity: &mut [Vec2]) {
    let (press, rub) = total::<RUBS>(node, row);
    let press = max(press, 0.0);
    let rub = if RUBS { limited(rub, row.friction * press) } else { 0.0 };
    let change = row.impulse_of::<RUBS>(press - row.press, rub - row.rub);
    row.press = press;
    row.rub = rub;
    row.apply(velocity, change);
    node.impulse = if node.slot == row.b { change } else { -change };
}

/// Leaves a node a share of what it was given.
#[inline]
fn take_back<const RUBS: bool>(node: &Node, row: &mut Row, velocity: &mut [Vec2], share: f32) {
    let given = if node.slot == row.b { node.impulse } else { -node.impulse };
    row.apply(velocity, given * (share - 1.0));
    row.press = row.press_before + share * (row.press - row.press_before);
    if RUBS {
        row.rub = row.rub_before + share * (row.rub - row.rub_before);
    }
}
