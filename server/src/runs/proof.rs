//! Verifies a replay's bytes, and finds the run that they prove.

use crate::host::thread_time;
use crate::limits;
use jostle_game::Scene;
use jostle_protocol::replay::{Replay, ReplayError};
use jostle_room::{Run, Unproven, run};
use std::sync::Arc;
use std::time::Duration;

/// Number of ticks between clock readings.
const LOOK_TICKS: u32 = 64;

/// The reason why a submission proves no run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoRun {
    /// The submission is too long.
    #[error("the replay has {0} bytes; a run has at most {max}", max = limits::RUN_BYTES_MAX)]
    TooLong(usize),
    /// The bytes are not a replay.
    #[error("this is no replay that can be read: {0}")]
    Unreadable(#[from] ReplayError),
    /// The stored file cannot be read.
    #[error("the file cannot be read: {0}")]
    File(String),
    /// The scene is not on offer.
    #[error("this server has no scene {0:?}")]
    NoSuchScene(String),
    /// An operator removed the run.
    #[error("this run was removed by an operator of this server")]
    Removed,
    /// The replay contradicts its own hashes, or contains no finished run.
    #[error("{0}")]
    Unproven(#[from] Unproven),
}

impl NoRun {
    /// Returns whether a later attempt may succeed, once the disk responds or the machine is less busy.
    pub fn may_pass(&self) -> bool {
        matches!(self, NoRun::File(_) | NoRun::Unproven(Unproven::TooSlow(_)))
    }

    /// Returns whether the replay might be a run on a server with other scenes.
    pub fn is_of_other_scene(&self) -> bool {
        let unproven =
            matches!(self, NoRun::Unproven(Unproven::OtherScene(_) | Unproven::NotCompared));
        unproven || matches!(self, NoRun::NoSuchScene(_))
    }
}

/// Plays a replay of one of these scenes, using at most this much processor time, and returns the scene and the best
/// run. The thread sleeps for as long as it works, and stops when `may_go_on`, which is called regularly, returns
/// false.
pub fn prove(
    bytes: Vec<u8>,
    scenes: &[Arc<Scene>],
    most: Duration,
    may_go_on: impl Fn() -> bool,
) -> Result<(&Arc<Scene>, Run), NoRun> {
    if bytes.len() > limits::RUN_BYTES_MAX {
        return Err(NoRun::TooLong(bytes.len()));
    }
    let replay = Arc::new(Replay::read(bytes)?);
    let name = &replay.start().scene_name;
    let scene = scenes.iter().find(|scene| scene.name == *name);
    let scene = scene.ok_or_else(|| NoRun::NoSuchScene(name.clone()))?;
    let began = thread_time::taken();
    let (mut ticks, mut before) = (0u32, began);
    let run = run::prove(&replay, scene, || {
        ticks += 1;
        if !ticks.is_multiple_of(LOOK_TICKS) {
            return true;
        }
        let now = thread_time::taken();
        std::thread::sleep(now - before);
        before = now;
        now - began <= most && may_go_on()
    })?;
    Ok((scene, run))
}
