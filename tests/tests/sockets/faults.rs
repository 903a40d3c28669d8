//! Faults of docs/faults.md that no other test here shows: for each the answer, the counter that
//! moves, and another player whose game goes on.

mod crowds;
mod frames;
mod host;
mod links;
mod soak;

/// Name of the counter of a refusal.
fn refusals(reason: &str) -> String {
    format!("jostle_refusals_total{{reason=\"{reason}\"}}")
}
