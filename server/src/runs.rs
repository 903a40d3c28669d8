//! The best runs for each scene, from replays that this server has verified by playing them.
//!
//! **Data.** A stored run is just a replay file, `DIR/SCENE-HASH.jostle`, where HASH is the state hash at the tick that
//! decided the run. Names, times, points and ranks are read from the game when it is played, both at submission and
//! whenever the server starts. [`BestRuns`] are kept in memory for each scene on offer whose rules define which of two
//! runs is better ([`Measure`](jostle_room::Measure)).
//!
//! **Data flow.** A page that played alone sends its replay to `POST /api/records`. Once it has been received
//! completely, it waits for its turn in a [`TrialQueue`](crate::limits::trial_queue::TrialQueue), and a low-priority
//! thread plays it ([`prove`]) using half a processor, one replay after another. If the proven run is among the scene's
//! best, it is written under a temporary name and renamed. The run that it displaces is kept as `NAME.TIME.displaced`
//! for a while. `GET /api/records` lists the runs. `GET /records/NAME.jostle` returns a run's file, which a page plays
//! or shows as a ghost.
//!
//! **Limits.** A replay is limited by [`limits::RUN_BYTES_MAX`](crate::limits::RUN_BYTES_MAX),
//! [`RUN_TICKS_MAX`](jostle_room::run::RUN_TICKS_MAX) and [`Timeouts::run_trial`](crate::limits::Timeouts::run_trial)
//! of processor time. A scene keeps [`limits::RECORDS_MAX`](crate::limits::RECORDS_MAX) runs, one per set of players.
//! At most [`limits::RUN_TRIALS_MAX`](crate::limits::RUN_TRIALS_MAX) submissions wait at once, of which at most two are
//! from one address, and networks take turns. A run proves that its inputs lead to its result; it cannot prove that a
//! person pressed the keys.

mod best_runs;
mod proof;
mod store;

pub use best_runs::{BestRuns, Record};
pub use proof::{NoRun, prove};
pub use store::{Busy, Entered, Records};
