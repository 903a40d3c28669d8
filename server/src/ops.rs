//! The operators' side: a port of their own with metrics and admin paths, the log of refusals, and signs of life for a
//! service manager or Agones.

mod admin;
pub mod agones;
pub mod bans;
pub mod metrics;
pub mod panic_log;
pub mod port;
pub mod process;
pub mod reasons;
pub mod refusal_log;
pub mod spare;
pub mod supervisor;
