//! Faults of docs/faults.md that no other test covers: for each the answer, the counter that rises,
//! and another player whose game goes on.

pub mod crowds;
pub mod frames;
mod host;
pub mod links;

/// The counter of a refusal.
pub fn refusals(reason: &str) -> String {
    format!("jostle_refusals_total{{reason=\"{reason}\"}}")
}
