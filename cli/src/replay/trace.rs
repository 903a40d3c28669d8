//! `jostle replay trace` plays a replay again and prints its trace, so that two machines or two versions can be
//! compared line by line.

use super::file::read;
use crate::output::Failure;
use crate::trace::{TraceSink, line};
use jostle_game::Phase;
use jostle_protocol::replay::Replay;
use jostle_room::Playback;
use jostle_sim::{StateHasher, World};
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;

/// Play a replay again and print its trace, in the format of `jostle run --trace`
///
/// The replay is always played from its start. If it diverges from the recording, the status is 1 and the first
/// differing tick is printed, but the trace continues to the end.
#[derive(clap::Args)]
pub struct Trace {
    /// The replay file
    file: PathBuf,
    /// Print only every K-th tick
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Print only this tick
    #[arg(long, value_name = "T", conflicts_with = "every")]
    tick: Option<u32>,
    /// Print the phases of the tick instead: {"tick":60,"phase":"relax","hash":"16 hex digits"}, where the hash covers
    /// the world within the step, including the active pairs
    #[arg(long, requires = "tick")]
    phases: bool,
}

#[derive(Serialize)]
struct PhaseLine {
    tick: u32,
    phase: &'static str,
    hash: String,
}

impl Trace {
    /// Plays the replay and prints its trace.
    pub fn run(self) -> Result<(), Failure> {
        let file = self.file.display().to_string();
        let replay = Arc::new(read(&self.file)?);
        let last = self.last(&file, &replay)?;
        let failed = |error| Failure::Check(format!("{file}: {error}"));
        let mut playback = Playback::new(Arc::clone(&replay)).map_err(failed)?;
        let mut sink = TraceSink::stdout();
        let mut differs = None;
        while playback.tick() < last {
            let tick = playback.tick() + 1;
            if self.phases && tick == last {
                print_phases(&playback, &replay, &mut sink).map_err(failed)??;
            }
            let Some(played) = playback.step().map_err(failed)? else { break };
            differs = differs.or((!played.agrees).then_some(tick));
            if !self.phases && self.prints(tick) {
                sink.write(&line(playback.game()))?;
            }
        }
        sink.finish()?;
        match differs {
            None => Ok(()),
            Some(tick) => {
                let text = format!("{file}: tick {tick}: the hash is not the recorded one");
                Err(Failure::Check(text))
            }
        }
    }

    /// The last tick to play.
    fn last(&self, file: &str, replay: &Replay) -> Result<u32, Failure> {
        let ticks = replay.first_tick() + 1..=replay.last_tick();
        match self.tick {
            None => Ok(replay.last_tick()),
            Some(tick) if ticks.contains(&tick) => Ok(tick),
            Some(tick) => {
                let (first, last) = (ticks.start(), ticks.end());
                let text = format!("{file}: --tick: found {tick}; allowed: {first} to {last}");
                Err(Failure::Usage(text))
            }
        }
    }

    fn prints(&self, tick: u32) -> bool {
        match self.tick {
            Some(only) => tick == only,
            None => tick.is_multiple_of(self.every),
        }
    }
}

/// Plays the next tick of a copy and prints its phases.
fn print_phases(
    playback: &Playback,
    replay: &Replay,
    sink: &mut TraceSink,
) -> Result<Result<(), Failure>, jostle_room::PlaybackError> {
    let tick = playback.tick() + 1;
    let Some(block) = replay.block_with(tick) else { return Ok(Ok(())) };
    let mut lines = Vec::new();
    let mut watch = |phase: Phase, world: &mut World| {
        let mut hasher = StateHasher::default();
        world.visit_in_step(&mut hasher);
        let hash = format!("{:016x}", hasher.finish());
        lines.push(PhaseLine { tick, phase: phase.name(), hash });
    };
    playback.moment().clone().step(&block, &mut watch)?;
    Ok(lines.iter().try_for_each(|line| sink.write(line)))
}
