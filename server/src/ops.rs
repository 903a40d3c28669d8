//! What operators use: a separate port with metrics and admin paths, the log of refusals, and status notifications for
//! a service manager or Agones.

mod admin;
pub mod agones;
pub mod bans;
pub mod metrics;
pub mod panic_log;
pub mod port;
pub mod process;
pub mod reasons;
pub mod refusal_log;
pub mod reserve_descriptors;
pub mod supervisor;
