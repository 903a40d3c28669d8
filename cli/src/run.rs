//! `jostle run` plays a scene without sockets, as fast as possible, and prints a summary.

pub mod bots;
mod record;

use super::inputs::Inputs;
use super::trace::{self, Sums, TraceSink};
use crate::output::{Failure, json, say};
use crate::scenes::scene_named;
use bots::Bots;
use jostle_game::{Game, Input, Scene, Seat};
use jostle_protocol::replay::Change;
use record::ReplayOutput;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Play a scene headless. The same scene, seed and inputs produce the same trace, byte for byte.
///
/// Seat 0 takes part from tick 0, and so does every seat that the inputs mention. With --bots, bots play instead, in
/// seats from 0 upwards; the seed determines when they come and go. Ticks are counted from 1.
///
/// INPUTS are JSON lines. Each gives the complete input for one seat from a tick on, until that seat's next line:
///
///   {"tick":60,"seat":0,"buttons":["right","make"],"pointer":[100,50]}
///
/// "seat" defaults to 0, "buttons" to none, and "pointer" (world units) to a point outside the view.
/// Buttons: up, left, down, right, fire, make, hold, agitate, clear, pick-hero, pick-minion,
/// pick-platform.
///
/// A TRACE has one JSON object per line: {"tick":60,"hash":"16 hex digits","bodies":[{"id":1,
/// "kind":"hero","pos":[x,y],"vel":[x,y]}],"particles":0,"emitters":0,"contacts":3,"deepest":0.004,
/// "kinetic":12.5,"momentum":[x,y]}. Hash, contacts and sums describe the state after the tick.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub struct Run {
    /// A built-in scene, or the path of a TOML file
    scene: String,
    /// Number of ticks to play, at 60 per second
    #[arg(long, value_name = "N", default_value_t = 600)]
    ticks: u32,
    /// Seed for everything random
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// The seats' inputs, as JSON lines
    #[arg(long, value_name = "FILE")]
    inputs: Option<PathBuf>,
    /// Let this many bots play instead; the seed determines their input
    #[arg(long, value_name = "N", conflicts_with = "inputs", value_parser = clap::value_parser!(u16).range(1..))]
    bots: Option<u16>,
    /// Where to write a replay of the run
    #[arg(long, value_name = "FILE.jostle")]
    replay: Option<PathBuf>,
    /// File for the trace; with -, the trace goes to stdout, and no summary sentence is printed there
    #[arg(long, value_name = "FILE.jsonl")]
    trace: Option<PathBuf>,
    /// Trace only every K-th tick
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Print one JSON object on stdout at the end
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Summary {
    scene: String,
    seed: u64,
    ticks: u32,
    hash: String,
    players: usize,
    bodies: usize,
    particles: usize,
    emitters: usize,
    #[serde(flatten)]
    sums: Sums,
    /// Wall time spent in ticks only.
    elapsed_ms: f64,
    step_ms_mean: f64,
    step_ms_max: f64,
}

/// A run's players.
enum Players {
    Scripted(Inputs),
    Bots(Bots),
}

impl Players {
    /// The joins and leaves before a tick, and the inputs in it.
    fn next(&mut self, tick: u32) -> (Vec<Change>, &[(Seat, Input)]) {
        match self {
            Players::Bots(bots) => bots.next(tick),
            Players::Scripted(inputs) => {
                let joins: Vec<_> = match tick {
                    1 => inputs.seats().map(join).collect(),
                    _ => Vec::new(),
                };
                (joins, inputs.at(tick))
            }
        }
    }
}

fn join(seat: Seat) -> Change {
    Change::Join(seat, bots::appearance(seat))
}

impl Run {
    /// Plays the scene and prints the summary.
    pub fn run(self) -> Result<(), Failure> {
        let scene = Arc::new(scene_named(&self.scene)?);
        let mut players = self.players(&scene)?;
        let mut sink = self.trace.as_deref().map(TraceSink::create).transpose()?;
        let mut game = Game::new(scene, self.seed);
        let mut replay = match &self.replay {
            Some(path) => Some(ReplayOutput::create(path, &game, self.seed)?),
            None => None,
        };
        let (mut elapsed_ms, mut step_ms_max) = (0.0, 0.0f64);
        for tick in 1..=self.ticks {
            let (changes, inputs) = players.next(tick);
            let started = Instant::now();
            changes.iter().for_each(|change| apply(&mut game, change));
            game.tick(inputs);
            let step_ms = started.elapsed().as_secs_f64() * 1e3;
            elapsed_ms += step_ms;
            step_ms_max = step_ms_max.max(step_ms);
            if let Some(replay) = &mut replay {
                replay.tick(changes, inputs, &game)?;
            }
            if let Some(sink) = &mut sink
                && tick.is_multiple_of(self.every)
            {
                sink.write(&trace::line(&game))?;
            }
        }
        let is_traced_to_stdout = sink.as_ref().is_some_and(TraceSink::is_stdout);
        sink.map(TraceSink::finish).transpose()?;
        replay.map(|replay| replay.finish(&game)).transpose()?;
        let summary = self.summary(&game, elapsed_ms, step_ms_max);
        match (self.json, is_traced_to_stdout) {
            (true, _) => say(json(&summary)),
            (false, false) => say(summary.sentence()),
            (false, true) => Ok(()),
        }
    }

    fn players(&self, scene: &Scene) -> Result<Players, Failure> {
        if let Some(count) = self.bots {
            if count > scene.players_max {
                let (name, max) = (&scene.name, scene.players_max);
                let text = format!("--bots: found {count}; allowed: 1 to {max}, as {name} says");
                return Err(Failure::Usage(text));
            }
            return Ok(Players::Bots(Bots::new(count, self.seed, scene)));
        }
        let inputs = match &self.inputs {
            Some(path) => Inputs::read(path, scene.players_max)?,
            None => Inputs::none(),
        };
        Ok(Players::Scripted(inputs))
    }

    fn summary(&self, game: &Game, elapsed_ms: f64, step_ms_max: f64) -> Summary {
        let world = game.world();
        Summary {
            scene: game.scene().name.clone(),
            seed: self.seed,
            ticks: game.tick_count(),
            hash: trace::hash(game),
            players: game.players().count(),
            bodies: world.body_count(),
            particles: world.particles().len(),
            emitters: world.particles().emitter_count(),
            sums: trace::sums(world),
            elapsed_ms,
            step_ms_mean: elapsed_ms / f64::from(self.ticks.max(1)),
            step_ms_max,
        }
    }
}

impl Summary {
    fn sentence(&self) -> String {
        format!(
            "{}: {} ticks with seed {}, hash {}, {} bodies, {} contacts, deepest {}, \
             {} particles, {:.3} ms a step, {:.3} ms at most",
            self.scene,
            self.ticks,
            self.seed,
            self.hash,
            self.bodies,
            self.sums.contacts,
            self.sums.deepest,
            self.particles,
            self.step_ms_mean,
            self.step_ms_max
        )
    }
}

fn apply(game: &mut Game, change: &Change) {
    match change {
        Change::Join(seat, _) => game.join(*seat),
        Change::Leave(seat) => game.leave(*seat),
        Change::Look(..) => {}
    }
}
