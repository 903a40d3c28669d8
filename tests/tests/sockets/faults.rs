//! Faults of docs/faults.md that no other test here shows: for each the answer, the counter that
//! moves, and another player whose game goes on.

pub mod crowds;
pub mod frames;
mod host;
pub mod links;

/// Name of the counter of a refusal.
pub fn refusals(reason: &str) -> String {
    format!("jostle_refusals_total{{reason=\"{reason}\"}}")
}
