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

/// Sweeps for which a forest is kept.
const FOREST_SWEEPS: u32 = 4;

/// Solves an island; returns the number of sweeps.
pub(crate) fn solve<const RUBS: bool>(
    rows: &mut [Row],
    island: &[u32],
    (lines, trees): (&mut Lines, &mut Trees),
    velocity: &mut [Vec2],
    (tolerance, sweeps_max): (f32, u32),
) -> u32 {
    let mut before = 0.0;
    for count in 1..=sweeps_max {
        if count % FOREST_SWEEPS == 1 {
            trees.find(rows, island);
        }
        let worst = sweep::<RUBS>(rows, island, (lines, trees), velocity);
        if worst < tolerance || count == sweeps_max {
            return count;
        }
        let squared = changes::<RUBS>(rows, island);
        let ratio = if before > 0.0 { squared / before } else { 0.0 };
        // Sums of squares of implausible numbers may be infinite, and their ratio no number.
        let beta = (ratio <= 1.0).then_some(ratio);
        before = squared;
        for &place in island {
            move_on::<RUBS>(&mut rows[place as usize], velocity, beta);
        }
    }
    sweeps_max
}

/// Returns the largest change of a relative speed by a row, units/s.
fn sweep<const RUBS: bool>(
    rows: &mut [Row],
    island: &[u32],
    (lines, trees): (&mut Lines, &mut Trees),
    velocity: &mut [Vec2],
) -> f32 {
    for &place in island {
        let row = &mut rows[place as usize];
        (row.press_before, row.rub_before) = (row.press, row.rub);
    }
    trees.solve(rows, velocity);
    let mut worst = lines.sweep(rows, velocity);
    for &place in &lines.others {
        worst = max(worst, press::<RUBS>(&mut rows[place as usize], velocity));
    }
    worst
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
    row.apply(velocity, row.impulse(press_change, rub_change));
    max(press_change.abs(), rub_change.abs()) * (row.weight_a + row.weight_b)
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

/// Friction within its limit; never minus nothing, so that a limit of 0 leaves no trace.
#[inline]
pub(crate) fn limited(rub: f32, limit: f32) -> f32 {
    clamp(rub, -limit, limit) + 0.0
}

/// |d|^2 of the last sweep.
fn changes<const RUBS: bool>(rows: &[Row], island: &[u32]) -> f32 {
    let mut squared = 0.0;
    for &place in island {
        let row = &rows[place as usize];
        let press = row.press - row.press_before;
        let rub = if RUBS { row.rub - row.rub_before } else { 0.0 };
        squared += (press * press + rub * rub) * (row.weight_a + row.weight_b);
    }
    squared
}

/// Moves a row's impulses along the direction, as far as they stay possible, or forgets it.
#[inline]
fn move_on<const RUBS: bool>(row: &mut Row, velocity: &mut [Vec2], beta: Option<f32>) {
    let Some(beta) = beta else {
        row.press_along = 0.0;
        row.rub_along = 0.0;
        return;
    };
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
        row.apply(velocity, row.impulse(press_change, rub_change));
    }
}
