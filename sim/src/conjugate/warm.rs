//! Warm start: begin from the impulses of the last step, as far as that cannot add energy.
//!
//! With impulses l, D(l) = l.(b - J v*) - l.A.l / 2 is what the rows' problem maximises, and the
//! kinetic energy changes by l.b - D(l), where b <= 0. So impulses with D >= 0 never raise the
//! energy, and a sweep never lowers D. Along the stored impulses D is a parabola c x - q x^2 / 2:
//! positive up to x = 2 c / q, greatest at x = c / q. Where the world has not changed the stored
//! impulses solve the new step, c = q, and all of them are taken; an impact that is over is not
//! given again.

use super::rows::Row;
use glam::Vec2;

/// Share of the best factor below which the stored impulses are cut back. At 0.5 the last energy
/// that they can cost would still be theirs; 1 cuts at every rounding error.
const CUT: f32 = 0.75;

/// Applies the stored impulses of an island's rows to the velocities, cut back to what is safe.
pub(crate) fn start<const RUBS: bool>(rows: &mut [Row], island: &[u32], velocity: &mut [Vec2]) {
    let (mut gain, mut before) = (0.0, 0.0);
    for &place in island {
        let row = &rows[place as usize];
        gain += row.press * row.bound;
        before += row.impulse_of::<RUBS>(row.press, row.rub).dot(row.relative(velocity));
    }
    for &place in island {
        let row = &rows[place as usize];
        row.apply(velocity, row.impulse_of::<RUBS>(row.press, row.rub));
    }
    let mut after = 0.0;
    for &place in island {
        let row = &rows[place as usize];
        after += row.impulse_of::<RUBS>(row.press, row.rub).dot(row.relative(velocity));
    }
    // c = l.(b - J v*), q = l.A.l = l.J(v - v*).
    let (slope, curve) = (gain - before, after - before);
    if slope >= CUT * curve {
        return;
    }
    let share = if slope > 0.0 { slope / curve } else { 0.0 };
    for &place in island {
        let row = &mut rows[place as usize];
        row.apply(velocity, row.impulse_of::<RUBS>(row.press, row.rub) * (share - 1.0));
        row.press *= share;
        row.rub *= share;
    }
}
