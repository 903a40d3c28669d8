//! The work-precision problems: scenes with known answers, and the errors of a run.

mod contact;
mod flight;
mod gas;
mod impact;
mod pile;
mod rubbing;
mod springs;
mod stack;

use crate::study::Problem;
pub use stack::FORCE_ERROR;

/// All problems, in the order of the report.
pub fn all() -> Vec<Problem> {
    let mut problems = Vec::new();
    problems.extend(flight::PROBLEMS);
    problems.extend(contact::PROBLEMS);
    problems.extend(springs::PROBLEMS);
    problems.extend(stack::PROBLEMS);
    problems.extend(gas::PROBLEMS);
    problems.extend(impact::PROBLEMS);
    problems.extend(pile::PROBLEMS);
    problems.extend(rubbing::PROBLEMS);
    problems.sort_by_key(|problem| order(problem.id));
    problems
}

/// Sort key of an id: "4b" comes after "4a" and before "10".
fn order(id: &str) -> (u32, &str) {
    let digits = id.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    (digits.parse().unwrap_or(u32::MAX), &id[digits.len()..])
}

/// Returns the largest error; NaN if any is NaN.
fn worst(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |worst, error| if error > worst || error.is_nan() { error } else { worst })
}
