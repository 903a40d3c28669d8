//! Records: the best runs of each scene, kept from replays that this server played again.
//!
//! **Data.** A record is a replay file and nothing else: `DIR/SCENE-HASH.jostle`, where HASH is the digest of the game's
//! state when the run was decided. Names, times, points and ranks are read off the game when it is played again, when
//! it comes and at each start of the server. [`BestRuns`] are kept in memory for each scene on offer whose rules say
//! which run is better ([`Measure`](jostle_room::Measure)).
//!
//! **Its trip.** A page that played alone sends its replay to `POST /api/records`. Once that is whole, it waits for its turn in
//! a [`TrialQueue`](crate::limits::trial_queue::TrialQueue), and a thread that goes after all others plays it ([`prove`]), one replay at a time, at half a processor. A proven run among the best of its scene is written under
//! another name and renamed, and the run that it displaces is kept as `NAME.TIME.displaced` for a while. `GET /api/records` lists the runs,
//! `GET /records/NAME.jostle` is the file of one, which a page watches or shows as a ghost.
//!
//! **Limits.** Of a replay: [`limits::RUN_BYTES_MAX`](crate::limits::RUN_BYTES_MAX),
//! [`RUN_TICKS_MAX`](jostle_room::run::RUN_TICKS_MAX) and [`Waits::run_trial`](crate::limits::Waits::run_trial) of
//! processor time. Of a scene: [`limits::RECORDS_MAX`](crate::limits::RECORDS_MAX) runs, one of each name. Of senders:
//! [`limits::RUN_TRIALS_MAX`](crate::limits::RUN_TRIALS_MAX) wait at a time, two of an address, and networks take turns.
//! A run proves that its inputs lead to its result; it cannot prove that a person pressed the keys.

mod best_runs;
mod proof;
mod store;

pub use best_runs::{BestRuns, Record};
pub use proof::{NoRun, prove};
pub use store::{Busy, Entered, Records};
