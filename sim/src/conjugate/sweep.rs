//! Sweeps: projected Gauss-Seidel, accelerated by nonlinear conjugate gradients.
//!
//! A sweep visits every row once: the normal impulse that stops the two closing too fast, then
//! friction, whose limit is then known (Moreau 1988; Jean 1999). What it changed, d, is the negative
//! gradient of the problem in the norm of the effective masses. Between sweeps the impulses move
//! on along p by beta = |d|^2 / |d before|^2, and p becomes beta p + d; where beta exceeds 1 the
//! direction is forgotten (Silcowitz-Hansen, Niebe and Erleben 2010, "A nonsmooth nonlinear
//! conjugate gradient method for interactive contact force problems"). The end is always a sweep,
//! and the sweep that changes no relative speed by more than the tolerance is the last one.

use super::lines::Lines;
use super::rows::Row;
use crate::math::{clamp, max};
use glam::Vec2;

/// What a sweep changed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Residual {
    /// Sum of the squared changes of the impulses over the effective masses.
    squared: f32,
    /// Largest change of a relative speed, units/s.
    worst: f32,
}

impl Residual {
    /// A row's impulse changed by `change`, its relative speed by `speed`.
    #[inline]
    pub fn add(&mut self, change: f32, speed: f32, mass: f32) {
        self.squared += change * change / mass;
        self.worst = max(self.worst, speed);
    }
}

/// Solves an island; returns the number of sweeps.
pub(crate) fn solve(
    rows: &mut [Row],
    island: &[u32],
    lines: &mut Lines,
    velocity: &mut [Vec2],
    (tolerance, sweeps_max): (f32, u32),
) -> u32 {
    let mut before = 0.0;
    for count in 1..=sweeps_max {
        let residual = sweep(rows, lines, velocity);
        if residual.worst < tolerance || count == sweeps_max {
            return count;
        }
        let ratio = if before > 0.0 { residual.squared / before } else { 0.0 };
        // Sums of squares of implausible numbers may be infinite, and their ratio no number.
        let beta = (ratio <= 1.0).then_some(ratio);
        before = residual.squared;
        for &place in island {
            move_on(&mut rows[place as usize], velocity, beta);
        }
    }
    sweeps_max
}

fn sweep(rows: &mut [Row], lines: &mut Lines, velocity: &mut [Vec2]) -> Residual {
    let mut residual = Residual::default();
    lines.sweep(rows, velocity, &mut residual);
    for &place in &lines.others {
        press(&mut rows[place as usize], velocity, &mut residual);
    }
    residual
}

/// Both impulses of a row. The normal one leaves the sliding speed alone, since nothing turns: one
/// look at the velocities serves both.
#[inline]
fn press(row: &mut Row, velocity: &mut [Vec2], residual: &mut Residual) {
    let relative = row.relative(velocity);
    let excess = row.normal.dot(relative) - row.bound;
    let press = max(row.press - excess * row.mass, 0.0);
    row.press_change = press - row.press;
    row.press = press;
    let limit = row.friction * press;
    let slide = row.normal.perp().dot(relative);
    let rub = clamp(row.rub - slide * row.mass, -limit, limit);
    row.rub_change = rub - row.rub;
    row.rub = rub;
    let weight = row.weight_a + row.weight_b;
    residual.add(row.press_change, row.press_change.abs() * weight, row.mass);
    residual.add(row.rub_change, row.rub_change.abs() * weight, row.mass);
    row.apply(velocity, row.impulse(row.press_change, row.rub_change));
}

/// The friction of a row whose normal impulse is known.
#[inline]
pub(crate) fn rub(row: &mut Row, velocity: &mut [Vec2], residual: &mut Residual) {
    let limit = row.friction * row.press;
    if limit <= 0.0 && row.rub == 0.0 {
        row.rub_change = 0.0;
        return;
    }
    let along = row.normal.perp();
    let slide = along.dot(row.relative(velocity));
    let rub = clamp(row.rub - slide * row.mass, -limit, limit);
    row.rub_change = rub - row.rub;
    row.rub = rub;
    residual.add(row.rub_change, row.rub_change.abs() * (row.weight_a + row.weight_b), row.mass);
    row.apply(velocity, along * row.rub_change);
}

/// Moves a row's impulses along the direction, as far as they stay possible, or forgets it.
#[inline]
fn move_on(row: &mut Row, velocity: &mut [Vec2], beta: Option<f32>) {
    let Some(beta) = beta else {
        row.press_along = 0.0;
        row.rub_along = 0.0;
        return;
    };
    let (press_before, rub_before) = (row.press, row.rub);
    row.press = max(press_before + beta * row.press_along, 0.0);
    let limit = row.friction * row.press;
    row.rub = clamp(rub_before + beta * row.rub_along, -limit, limit);
    row.press_along = beta * row.press_along + row.press_change;
    row.rub_along = beta * row.rub_along + row.rub_change;
    let (press, rub) = (row.press - press_before, row.rub - rub_before);
    if press != 0.0 || rub != 0.0 {
        row.apply(velocity, row.impulse(press, rub));
    }
}
