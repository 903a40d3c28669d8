//! The operators' side: a port of their own with metrics and admin paths, and the log of refusals.

mod admin;
pub mod bans;
pub mod metrics;
pub mod port;
pub mod process;
pub mod refusal_log;
