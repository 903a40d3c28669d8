//! The solver of a scene and its settings. Nothing is mended in silence: what is out of range is
//! refused (C22c), and so are settings of a solver that the scene does not use.

use super::SceneError;
use super::document::{Range, Table};
use crate::conjugate::Conjugate;
use crate::relaxation::Relaxation;
use crate::solver::Solver;

#[cfg(test)]
mod tests;

const RELAXATION_FIELDS: &[&str] =
    &["iterations", "correction", "slop", "bounce_threshold", "warm_start"];
const CONJUGATE_FIELDS: &[&str] = &[
    "tolerance",
    "sweeps_max",
    "work_max",
    "bounce_threshold",
    "slop",
    "correction",
    "correction_max",
    "position_passes",
];
/// Names of the solvers; the first is the default.
const SOLVERS: [&str; 2] = ["relaxation", "conjugate"];

/// Reads `response`, `solver` and the table of its settings.
pub(super) fn solver(root: &Table) -> Result<Option<Solver>, SceneError> {
    let responses = ["impulse", "none"];
    let response = root.get("response").map_or(Ok(0), |field| field.choice(&responses))?;
    let chosen = root.get("solver").map(|field| field.choice(&SOLVERS)).transpose()?;
    if response == 1 {
        for name in ["solver", SOLVERS[0], SOLVERS[1]] {
            refuse(root, name, "response = \"none\"")?;
        }
        return Ok(None);
    }
    if chosen == Some(1) {
        refuse(root, SOLVERS[0], "solver = \"conjugate\"")?;
        return Ok(Some(Solver::Conjugate(conjugate(root)?)));
    }
    refuse(root, SOLVERS[1], "solver = \"relaxation\"")?;
    Ok(Some(Solver::Relaxation(relaxation(root)?)))
}

/// Reads `sleeping`: only islands can sleep, and only the conjugate solver has them.
pub(super) fn sleeping(root: &Table, solver: Option<Solver>) -> Result<bool, SceneError> {
    let conjugate = matches!(solver, Some(Solver::Conjugate(_)));
    let asked = root.get("sleeping").map(|field| field.truth()).transpose()?;
    match asked {
        Some(true) if !conjugate => {
            let found = "true without solver = \"conjugate\"".to_owned();
            Err(root.error("sleeping", found, "true only with the conjugate solver".to_owned()))
        }
        Some(asked) => Ok(asked),
        None => Ok(conjugate),
    }
}

/// Refuses a field that contradicts another one.
fn refuse(root: &Table, name: &str, beside: &str) -> Result<(), SceneError> {
    match root.get(name) {
        Some(field) => {
            let found = if field.word().is_some() { "a solver" } else { "a table" };
            Err(root.error(name, format!("{found} beside {beside}"), "only one of the two".into()))
        }
        None => Ok(()),
    }
}

fn relaxation(root: &Table) -> Result<Relaxation, SceneError> {
    let base = Relaxation::default();
    let Some(table) = root.table("relaxation", RELAXATION_FIELDS)? else { return Ok(base) };
    let warm_start = table.get("warm_start").map(|field| field.truth()).transpose()?;
    Ok(Relaxation {
        iterations: table.whole("iterations", base.iterations, 1, 240)?,
        correction: table.number("correction", base.correction, Range::above(0.0, 1.0))?,
        slop: table.number("slop", base.slop, Range::from(0.0, 1.0))?,
        bounce_threshold: table.number(
            "bounce_threshold",
            base.bounce_threshold,
            Range::from(0.0, 100.0),
        )?,
        warm_start: warm_start.unwrap_or(base.warm_start),
    })
}

fn conjugate(root: &Table) -> Result<Conjugate, SceneError> {
    let base = Conjugate::default();
    let Some(table) = root.table("conjugate", CONJUGATE_FIELDS)? else { return Ok(base) };
    Ok(Conjugate {
        tolerance: table.number("tolerance", base.tolerance, Range::above(0.0, 1.0))?,
        sweeps_max: table.whole("sweeps_max", base.sweeps_max, 1, 1000)?,
        work_max: table.whole("work_max", base.work_max, 1000, 1_000_000_000)?,
        bounce_threshold: table.number(
            "bounce_threshold",
            base.bounce_threshold,
            Range::from(0.0, 100.0),
        )?,
        slop: table.number("slop", base.slop, Range::from(0.0, 1.0))?,
        correction: table.number("correction", base.correction, Range::above(0.0, 1.0))?,
        correction_max: table.number(
            "correction_max",
            base.correction_max,
            Range::above(0.0, 100.0),
        )?,
        position_passes: table.whole("position_passes", base.position_passes, 0, 60)?,
    })
}
