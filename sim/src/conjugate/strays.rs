//! Strays: pairs that had no row because neither body seemed able to reach the other.
//!
//! Rows are made for what the speeds before the step allow. A body at rest that is hit hard may
//! then leave its reach within the same step, and a fast one may be turned towards another. So after
//! the velocities are solved, whoever is faster than his reach, or than what he might jump over, is
//! looked after: pairs that would touch with the new speeds get a row, and their islands are solved
//! again, from the impulses that they have.

use super::impacts::Paths;
use super::rows::{self, Facts, Row, Step};
use crate::bodies::{Bodies, REACH_MIN};
use crate::features::CAN;
use crate::pairs::{Pair, near, shapes};

/// How often a step looks for strays.
pub(crate) const ROUNDS_MAX: u32 = 3;
/// Overlap at the end of the step that counts as none, world units.
const TOUCH: f32 = 1e-4;

/// The rows to come, and who is faster than his reach.
#[derive(Clone, Debug, Default)]
pub(crate) struct Strays {
    /// By slot.
    fast: Vec<bool>,
    rows: Vec<Row>,
    facts: Vec<Facts>,
    /// The rows before.
    old_rows: Vec<Row>,
    old_facts: Vec<Facts>,
    /// By row, whether it is new; islands with a new one are solved again.
    pub is_new: Vec<bool>,
}

impl Strays {
    /// Gives bodies that became faster a longer reach; whether there are any, or fast ones.
    pub fn reach_out(&mut self, bodies: &mut Bodies, dt: f32) -> bool {
        self.fast.clear();
        self.fast.resize(bodies.alive.len(), false);
        let thinnest = if CAN.continuous { bodies.thinnest() } else { f32::INFINITY };
        let Bodies { moving, velocity, reach, .. } = bodies;
        let mut any = false;
        for &slot in moving.iter() {
            let slot = slot as usize;
            let path = velocity[slot].length() * dt;
            // Half of the least reach is for what others do.
            if path > reach[slot] - REACH_MIN * 0.5 {
                reach[slot] = REACH_MIN + path;
            } else if path <= thinnest {
                continue;
            }
            self.fast[slot] = true;
            any = true;
        }
        any
    }

    /// Adds rows for pairs that would touch; whether there are any.
    pub fn gather(
        &mut self,
        bodies: &Bodies,
        pairs: &[Pair],
        paths: &Paths,
        dt: f32,
        (rows, facts): (&mut Vec<Row>, &mut Vec<Facts>),
    ) -> bool {
        let step = Step { dt, fall: 0.0, quick: true };
        self.rows.clear();
        self.facts.clear();
        let mut known = rows.iter().map(|row| row.pair).peekable();
        for (place, pair) in (0u32..).zip(pairs) {
            let has_row = known.next_if_eq(&place).is_some();
            let (a, b) = (pair.a as usize, pair.b as usize);
            if has_row || !(self.fast[a] || self.fast[b]) || !near(bodies, pair.a, pair.b) {
                continue;
            }
            let path = (bodies.velocity[b] - bodies.velocity[a]) * dt;
            let gap = rows::sight::<{ shapes::BOTH }>(bodies, paths, pair, path, dt);
            if let Some(gap) = gap.filter(|gap| gap.separation + gap.normal.dot(path) < -TOUCH) {
                let (row, facts) = rows::meet::<{ shapes::BOTH }>(bodies, pair, place, gap, step);
                // The last step's impulse, which `meet` knows, was not given in this one.
                self.rows.push(Row { press: 0.0, rub: 0.0, ..row });
                self.facts.push(facts);
            }
        }
        if self.rows.is_empty() {
            return false;
        }
        self.merge(rows, facts);
        true
    }

    /// Puts the new rows in their places.
    fn merge(&mut self, rows: &mut Vec<Row>, facts: &mut Vec<Facts>) {
        std::mem::swap(rows, &mut self.old_rows);
        std::mem::swap(facts, &mut self.old_facts);
        rows.clear();
        facts.clear();
        self.is_new.clear();
        let mut new = self.rows.iter().zip(&self.facts).peekable();
        for (row, fact) in self.old_rows.iter().zip(&self.old_facts) {
            while let Some((stray, fact)) = new.next_if(|(stray, _)| stray.pair < row.pair) {
                rows.push(*stray);
                facts.push(*fact);
                self.is_new.push(true);
            }
            rows.push(*row);
            facts.push(*fact);
            self.is_new.push(false);
        }
        for (stray, fact) in new {
            rows.push(*stray);
            facts.push(*fact);
            self.is_new.push(true);
        }
    }
}

/// Finds the pairs of the rows again after the pair list was made anew.
pub(crate) fn find_again(rows: &mut [Row], pairs: &[Pair]) {
    let mut place = 0;
    for row in rows {
        while (pairs[place].a, pairs[place].b) < (row.a, row.b) {
            place += 1;
        }
        row.pair = place as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pairs::Axis;
    use crate::shape::Shape;
    use crate::world::{BodyDef, World, WorldSettings};
    use glam::Vec2;

    #[test]
    fn a_stray_has_no_impulse_that_nobody_was_given() {
        let mut world = World::new(WorldSettings::default());
        for (x, speed) in [(0.0, 100.0), (3.0, -100.0)] {
            let (position, velocity) = (Vec2::new(x, 0.0), Vec2::new(speed, 0.0));
            let def =
                BodyDef { shape: Shape::circle(1.0), position, velocity, ..BodyDef::default() };
            world.add(&def).expect("there is room");
        }
        let mut bodies = world.body_arrays().clone();
        let (mut strays, mut paths, dt) = (Strays::default(), Paths::default(), 1.0 / 60.0);
        paths.since.resize(2, 0.0);
        assert!(strays.reach_out(&mut bodies, dt));
        let pair = Pair {
            a: 0,
            b: 1,
            normal_impulse: 5.0,
            tangent_impulse: 1.0,
            axis: Axis::Free,
            warm_normal: Vec2::ZERO,
        };
        let (mut rows, mut facts) = (Vec::new(), Vec::new());
        assert!(strays.gather(&bodies, &[pair], &paths, dt, (&mut rows, &mut facts)));
        assert_eq!((rows.len(), rows[0].press, rows[0].rub), (1, 0.0, 0.0));
    }
}
