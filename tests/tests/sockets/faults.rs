//! Faults from docs/faults.md that no other test covers. Each test checks the answer, the counter that increases, and
//! that another player's game continues.

pub mod crowds;
pub mod frames;
mod host;
pub mod links;

/// Name of a refusal's counter.
pub fn refusals(reason: &str) -> String {
    format!("jostle_refusals_total{{reason=\"{reason}\"}}")
}
