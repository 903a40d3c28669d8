//! From the bytes of a replay to the run that it proves.

use crate::host::thread_time;
use crate::limits;
use jostle_game::Scene;
use jostle_protocol::replay::{Replay, ReplayError};
use jostle_room::{Run, Unproven, run};
use std::sync::Arc;
use std::time::Duration;

/// Ticks between two looks at the time.
const LOOK_TICKS: u32 = 64;

/// The reason why bytes prove no run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoRun {
    /// They are too many.
    #[error("the replay has {0} bytes; a run has at most {max}", max = limits::RUN_BYTES_MAX)]
    TooLong(usize),
    /// They are no replay.
    #[error("this is no replay that can be read: {0}")]
    Unreadable(#[from] ReplayError),
    /// Their file cannot be read.
    #[error("the file cannot be read: {0}")]
    File(String),
    /// Its scene is not on offer.
    #[error("this server has no scene {0:?}")]
    NoSuchScene(String),
    /// An operator removed it.
    #[error("this run was removed by an operator of this server")]
    Removed,
    /// It is not what it says, or says nothing.
    #[error("{0}")]
    Unproven(#[from] Unproven),
}

impl NoRun {
    /// Returns whether it may be a run at another time: when the disk answers, or the machine is less busy.
    pub fn may_pass(&self) -> bool {
        matches!(self, NoRun::File(_) | NoRun::Unproven(Unproven::TooSlow(_)))
    }

    /// Returns whether it may be a run where other scenes are on offer.
    pub fn is_of_other_scene(&self) -> bool {
        let unproven =
            matches!(self, NoRun::Unproven(Unproven::OtherScene(_) | Unproven::NotCompared));
        unproven || matches!(self, NoRun::NoSuchScene(_))
    }
}

/// Plays a replay of one of these scenes, in at most so much processor time, and returns the scene and the best run.
/// This thread rests for as long as it works, and ends when `may_go_on`, which is asked now and then, says no.
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
