//! The solver of a scene and its settings. Values out of range are refused and never corrected
//! silently (C22c), and so are settings of a solver that the scene does not use.

use super::table::{Field, Range, Table};
use jostle_sim::Conjugate;
use jostle_sim::Relaxation;
use jostle_sim::Solver;

#[cfg(test)]
mod tests;

/// Words of `solver`; the first is the default.
const SOLVERS: [(&str, bool); 2] = [("relaxation", false), ("conjugate", true)];

/// Reads `response`, `solver` and the table of its settings.
pub(super) fn solver(root: &Table) -> Option<Solver> {
    let responses = [("impulse", true), ("none", false)];
    let response = root.get("response").choice(&responses).unwrap_or(true);
    let [solver, relaxation, conjugate] =
        ["solver", "relaxation", "conjugate"].map(|name| root.get(name));
    let is_conjugate = solver.choice(&SOLVERS).unwrap_or(false);
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

/// Reads `sleeping`: only islands can sleep, and only the conjugate solver has them.
pub(super) fn sleeping(root: &Table, solver: Option<Solver>) -> bool {
    let is_conjugate = matches!(solver, Some(Solver::Conjugate(_)));
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
        iterations: table.get("iterations").whole(base.iterations, 1..=240),
        correction: table.get("correction").number(base.correction, Range::above(0.0, 1.0)),
        slop: table.get("slop").number(base.slop, Range::from(0.0, 1.0)),
        bounce_threshold: bounce_threshold(table, base.bounce_threshold),
        warm_start: table.get("warm_start").truth(base.warm_start),
    }
}

fn read_conjugate(table: &Table) -> Conjugate {
    let base = Conjugate::default();
    Conjugate {
        tolerance: table.get("tolerance").number(base.tolerance, Range::above(0.0, 1.0)),
        sweeps_max: table.get("sweeps_max").whole(base.sweeps_max, 1..=1000),
        work_max: table.get("work_max").whole(base.work_max, 1000..=1_000_000_000),
        bounce_threshold: bounce_threshold(table, base.bounce_threshold),
        slop: table.get("slop").number(base.slop, Range::from(0.0, 1.0)),
        correction: table.get("correction").number(base.correction, Range::above(0.0, 1.0)),
        correction_max: table
            .get("correction_max")
            .number(base.correction_max, Range::above(0.0, 100.0)),
        position_passes: table.get("position_passes").whole(base.position_passes, 0..=60),
    }
}

fn bounce_threshold(table: &Table, default: f32) -> f32 {
    table.get("bounce_threshold").number(default, Range::from(0.0, 100.0))
}
