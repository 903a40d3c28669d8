//! Tests of faults from docs/faults.md that no other test covers. Each checks the response, the counter that increases,
//! and that another player's game continues.

pub mod crowds;
pub mod frames;
mod host;
pub mod links;

/// The name of a refusal's counter.
pub fn refusals(reason: &str) -> String {
    format!("jostle_refusals_total{{reason=\"{reason}\"}}")
}
