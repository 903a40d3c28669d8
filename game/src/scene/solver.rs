//! A scene's solver and its settings. Values out of range are refused, never silently corrected (C22c), and so are
//! settings for a solver that the scene does not use.

use super::field::Range;
use super::table::{Field, Table};
use jostle_sim::{Conjugate, Relaxation, Solver};

/// Reads `response`, `solver` and the table of the solver's settings.
pub(super) fn solver(root: &Table) -> Option<Solver> {
    // `"none"` detects contacts without solving them; a scene with no response may not name a solver. Label: Contacts,
    // for experts.
    let response = root.get("response").choice_or_first(&[("impulse", true), ("none", false)]);
    // The solver for contacts; each one has a table of settings below, and only the chosen one's table is allowed.
    // Label: Solver, for experts.
    let solver = root.get("solver");
    let [relaxation, conjugate] = ["relaxation", "conjugate"].map(|name| root.get(name));
    let is_conjugate = solver.choice_or_first(&[("relaxation", false), ("conjugate", true)]);
    if !response {
        for field in [solver, relaxation, conjugate] {
            refuse_beside(&field, "response = \"none\"");
        }
        return None;
    }
    if is_conjugate {
        refuse_beside(&relaxation, "solver = \"conjugate\"");
        return Some(Solver::Conjugate(conjugate.table(read_conjugate)));
    }
    refuse_beside(&conjugate, "solver = \"relaxation\"");
    Some(Solver::Relaxation(relaxation.table(read_relaxation)))
}

/// Reads `sleeping`, which needs the conjugate solver, since only islands can sleep, and only that solver has them.
pub(super) fn sleeping(root: &Table, solver: Option<Solver>) -> bool {
    let is_conjugate = matches!(solver, Some(Solver::Conjugate(_)));
    // Whether bodies at rest fall asleep (see [below](#sleeping)); only with the conjugate solver. Default: `true` with
    // the conjugate solver, else `false`. Label: Bodies fall asleep, for experts.
    let field = root.get("sleeping");
    let sleeping = field.truth(is_conjugate);
    if sleeping && !is_conjugate {
        let found = "true without solver = \"conjugate\"";
        field.refuse_as(found, "true only with the conjugate solver");
    }
    sleeping
}

/// Refuses a field that contradicts another one.
fn refuse_beside(field: &Field, other: &str) {
    if field.is_given() {
        let found = if field.word().is_some() { "a solver" } else { "a table" };
        field.refuse_as(format!("{found} beside {other}"), "only one of the two");
    }
}

fn read_relaxation(table: &Table) -> Relaxation {
    let base = Relaxation::default();
    Relaxation {
        // Maximum number of passes over all pairs per tick; they end early once a pass changes no velocity by more than
        // 0.001 units/s and no overlap by more than 0.0001 units.
        iterations: table.get("iterations").whole(base.iterations, 1..=240),
        // Share of an overlap that a pass removes.
        correction: table.get("correction").number(base.correction, Range::above(0.0, 1.0)),
        slop: slop(table, base.slop),
        bounce_threshold: bounce_threshold(table, base.bounce_threshold),
        // Whether to start from the previous tick's resting impulses.
        warm_start: table.get("warm_start").truth(base.warm_start),
    }
}

fn read_conjugate(table: &Table) -> Conjugate {
    let base = Conjugate::default();
    Conjugate {
        // Sweeps end once one changes no relative speed by more than this share of the speed that gravity adds in a
        // tick; islands of fewer than 30 or more than 10,000 contacts are solved more precisely.
        tolerance: table.get("tolerance").number(base.tolerance, Range::above(0.0, 1.0)),
        // Maximum number of sweeps over an island of contacts per tick.
        sweeps_max: table.get("sweeps_max").whole(base.sweeps_max, 1..=1000),
        // Maximum number of contacts that the sweeps over one island visit per tick; every island gets at least four
        // sweeps.
        work_max: table.get("work_max").whole(base.work_max, 1000..=1_000_000_000),
        bounce_threshold: bounce_threshold(table, base.bounce_threshold),
        slop: slop(table, base.slop),
        // Share of the overlap beyond the slop that a pass removes.
        correction: table.get("correction").number(base.correction, Range::above(0.0, 1.0)),
        // Maximum distance by which a pass separates a pair or moves a body.
        correction_max: table
            .get("correction_max")
            .number(base.correction_max, Range::above(0.0, 100.0)),
        // Maximum number of passes over the positions per tick; usually none is needed.
        position_passes: table.get("position_passes").whole(base.position_passes, 0..=60),
    }
}

fn bounce_threshold(table: &Table, default: f32) -> f32 {
    // Closing speed below which nothing bounces.
    table.get("bounce_threshold").number(default, Range::from(0.0, 100.0))
}

fn slop(table: &Table, default: f32) -> f32 {
    // Overlap that is allowed to remain.
    table.get("slop").number(default, Range::from(0.0, 1.0))
}
