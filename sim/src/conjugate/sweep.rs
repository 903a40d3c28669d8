//! Sweeps: block Gauss-Seidel, accelerated by nonlinear conjugate gradients.
//!
//! A sweep solves the trees, then the lines, then every other row: the normal impulse that stops
//! the two closing too fast, then friction, whose limit is then known (Moreau 1988; Jean 1999). What
//! a sweep changed, d, takes the part of the negative gradient in the norm of the effective masses.
//! Between sweeps the impulses move on along p by beta = |d|^2 / |d before|^2, and p becomes
//! beta p + d; where beta exceeds 1 the direction is forgotten (Silcowitz-Hansen, Niebe and Erleben
//! 2010, "A nonsmooth nonlinear conjugate gradient method for interactive contact force problems").
//! The end is always a sweep: the one in which no row changes a relative speed by more than the
//! tolerance. `RUBS` is false where nothing has friction: what would stay 0 is then not computed.

use super::lines::Lines;
use super::rows::Row;
use super::trees::Trees;
use crate::math::{clamp, max};
use glam::Vec2;

/// Sweeps for which a forest is kept. Where it does not fit the wait for another one doubles.
const FOREST_SWEEPS: u32 = 4;

/// An island is calm if its warm start misses the answer by less than so many tolerances. The first
/// sweep then does without a forest, and is the last one if it changes less than this share of the
/// tolerance.
const CALM: f32 = 10.0;
const STRICT: f32 = 0.01;

/// What a sweep changed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Change {
    /// Largest change of a relative speed, units/s.
    pub worst: f32,
    /// |d|^2.
    pub squared: f32,
}

impl Change {
    /// Counts a row that changed a relative speed by up to `off`.
    #[inline]
    pub fn count<const RUBS: bool>(&mut self, row: &Row, off: f32) {
        let press = row.press - row.press_before;
        let rub = if RUBS { row.rub - row.rub_before } else { 0.0 };
        let squared = if RUBS { press * press + rub * rub } else { press * press };
        self.worst = max(self.worst, off);
        self.squared += squared * (row.weight_a + row.weight_b);
    }
}

/// When an island's sweeps end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// Change of a relative speed that is small enough, units/s.
    pub tolerance: f32,
    /// Sweeps at most.
    pub sweeps_max: u32,
}

/// Sweeps over the walls alone: two of them that meet in a corner need no more.
const WALL_SWEEPS: u32 = 2;

/// Solves an island; returns the number of sweeps.
pub(crate) fn solve<const RUBS: bool>(
    rows: &mut [Row],
    island: &[u32],
    (lines, trees): (&mut Lines, &mut Trees),
    velocity: &mut [Vec2],
    end: End,
) -> u32 {
    let calm = residual::<RUBS>(rows, island, velocity) < CALM * end.tolerance;
    let (mut forest_at, mut wait) = (if calm { 2 } else { 1 }, FOREST_SWEEPS);
    let mut before = 0.0;
    trees.clear();
    for &place in island {
        rows[place as usize].remember();
    }
    for count in 1..=end.sweeps_max {
        if count == forest_at {
            trees.find::<RUBS>(rows, island);
            forest_at += wait;
        }
        if !trees.solve::<RUBS>(rows, velocity) {
            trees.clear();
            wait *= 2;
            forest_at = count + wait;
        }
        let change = sweep::<RUBS>(rows, lines, velocity);
        let strict = if calm && count == 1 { STRICT } else { 1.0 };
        if change.worst < strict * end.tolerance {
            return count;
        }
        let ratio = if before > 0.0 { change.squared / before } else { 0.0 };
        // Sums of squares of implausible numbers may be infinite, and their ratio no number.
        let beta = (ratio <= 1.0).then_some(ratio);
        before = change.squared;
        if count < end.sweeps_max {
            for &place in island {
                move_on::<RUBS>(&mut rows[place as usize], velocity, beta);
            }
        }
    }
    end.sweeps_max
}

/// The relative speed by which a row misses most what it asks for, units/s.
fn residual<const RUBS: bool>(rows: &[Row], island: &[u32], velocity: &[Vec2]) -> f32 {
    let mut worst = 0.0;
    for &place in island {
        let row = &rows[place as usize];
        let relative = row.relative(velocity);
        let lack = row.bound - row.normal.dot(relative);
        if row.press <= 0.0 {
            worst = max(worst, lack);
        } else {
            worst = max(worst, lack.abs());
            if RUBS && row.sticks() {
                worst = max(worst, row.normal.perp().dot(relative).abs());
            }
        }
    }
    worst
}

/// Solves the lines, and all other rows one by one.
fn sweep<const RUBS: bool>(rows: &mut [Row], lines: &mut Lines, velocity: &mut [Vec2]) -> Change {
    let mut change = lines.sweep::<RUBS>(rows, velocity);
    for &place in &lines.others {
        let row = &mut rows[place as usize];
        let off = press::<RUBS>(row, velocity);
        change.count::<RUBS>(row, off);
    }
    change
}

/// Both impulses of a row. The normal one leaves the sliding speed alone, since nothing turns: one
/// look at the velocities serves both. Returns the largest change of a relative speed.
#[inline]
fn press<const RUBS: bool>(row: &mut Row, velocity: &mut [Vec2]) -> f32 {
    let relative = row.relative(velocity);
    let excess = row.normal.dot(relative) - row.bound;
    let press = max(row.press - excess * row.mass, 0.0);
    let press_change = press - row.press;
    row.press = press;
    let rub_change = if RUBS { rub_against(row, relative) } else { 0.0 };
    row.apply(velocity, row.impulse_of::<RUBS>(press_change, rub_change));
    let change = if RUBS { max(press_change.abs(), rub_change.abs()) } else { press_change.abs() };
    change * (row.weight_a + row.weight_b)
}

/// Starts a row from its stored impulses and visits it so often.
#[inline]
pub(crate) fn alone<const RUBS: bool>(row: &mut Row, velocity: &mut [Vec2], visits: u32) {
    row.apply(velocity, row.impulse_of::<RUBS>(row.press, row.rub));
    for _ in 0..visits {
        press::<RUBS>(row, velocity);
    }
}

/// A sweep without lines, trees and directions.
pub(crate) fn plainly(rows: &mut [Row], island: &[u32], velocity: &mut [Vec2]) {
    for &place in island {
        press::<true>(&mut rows[place as usize], velocity);
    }
}

/// What nothing can push has the last word where sweeps ended before they had converged: rather two
/// bodies overlap than that one is driven through a wall.
pub(crate) fn walls(rows: &mut [Row], island: &[u32], velocity: &mut [Vec2]) {
    for _ in 0..WALL_SWEEPS {
        for &place in island {
            let row = &mut rows[place as usize];
            if !row.is_free() {
                press::<false>(row, velocity);
            }
        }
    }
}

/// The friction of a row whose normal impulse is known. Returns the change of the sliding speed.
#[inline]
pub(crate) fn rub(row: &mut Row, velocity: &mut [Vec2]) -> f32 {
    if row.friction * row.press <= 0.0 && row.rub == 0.0 {
        return 0.0;
    }
    let change = rub_against(row, row.relative(velocity));
    row.apply(velocity, row.normal.perp() * change);
    change.abs() * (row.weight_a + row.weight_b)
}

/// Opposes a relative velocity by friction; returns the change of its impulse.
#[inline]
fn rub_against(row: &mut Row, relative: Vec2) -> f32 {
    let limit = row.friction * row.press;
    let slide = row.normal.perp().dot(relative);
    let rub = limited(row.rub - slide * row.mass, limit);
    let change = rub - row.rub;
    row.rub = rub;
    change
}

/// Friction within its limit; never minus nothing, so that a limit of 0 leaves no trace. A limit that
/// is no number, of an infinite impulse without friction, is 0 too.
#[inline]
pub(crate) fn limited(rub: f32, limit: f32) -> f32 {
    if limit > 0.0 { clamp(rub, -limit, limit) + 0.0 } else { 0.0 }
}

/// Moves a row's impulses along the direction, as far as they stay possible, or forgets it; what
/// they are then is where the next sweep begins.
#[inline]
fn move_on<const RUBS: bool>(row: &mut Row, velocity: &mut [Vec2], beta: Option<f32>) {
    if let Some(beta) = beta {
        let press = max(row.press + beta * row.press_along, 0.0);
        row.press_along = beta * row.press_along + (row.press - row.press_before);
        let press_change = press - row.press;
        let mut rub_change = 0.0;
        if RUBS {
            let limit = row.friction * press;
            let rub = limited(row.rub + beta * row.rub_along, limit);
            row.rub_along = beta * row.rub_along + (row.rub - row.rub_before);
            rub_change = rub - row.rub;
            row.rub = rub;
        }
        if press_change != 0.0 || rub_change != 0.0 {
            row.press = press;
            row.apply(velocity, row.impulse_of::<RUBS>(press_change, rub_change));
        }
    } else {
        row.press_along = 0.0;
        row.rub_along = 0.0;
    }
    row.remember();
}
