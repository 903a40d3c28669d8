//! `jostle run`: plays a scene without sockets, as fast as it goes, and says what happened.

use super::inputs::Inputs;
use super::trace::{self, Sums};
use super::{Failure, say, scene_named};
use jostle_sim::Game;
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Play a scene headless: the same scene, seed and inputs give the same trace, byte for byte.
///
/// Seat 0 takes part from tick 0, and so does every seat that the inputs name. Ticks count from 1.
///
/// INPUTS are JSON lines. Each says all that one seat holds from a tick on, until its next line:
///
///   {"tick":60,"seat":0,"buttons":["right","make"],"pointer":[100,50]}
///
/// "seat" is 0, "buttons" is empty and "pointer" (world units) is away from the view unless given.
/// Buttons: up, left, down, right, fire, make, hold, agitate, clear, pick-hero, pick-minion,
/// pick-platform.
///
/// A TRACE is one JSON object a line: {"tick":60,"hash":"16 hex digits","bodies":[{"id":1,
/// "kind":"hero","pos":[x,y],"vel":[x,y]}],"particles":0,"emitters":0,"contacts":3,"deepest":0.004,
/// "kinetic":12.5,"momentum":[x,y]}. Hash, contacts and sums are those after the tick.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub struct Run {
    /// A built-in scene, or the path of a TOML file
    scene: String,
    /// Ticks to play, 60 a second
    #[arg(long, value_name = "N", default_value_t = 600)]
    ticks: u32,
    /// Seed of everything random
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// What the seats hold, as JSON lines
    #[arg(long, value_name = "FILE")]
    inputs: Option<PathBuf>,
    /// Where to write the trace
    #[arg(long, value_name = "FILE.jsonl")]
    trace: Option<PathBuf>,
    /// Trace only every K-th tick
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// End with one JSON object on stdout
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
    /// Wall time of the ticks alone.
    elapsed_ms: f64,
    step_ms_mean: f64,
    step_ms_max: f64,
}

impl Run {
    /// Plays and reports.
    pub fn run(self) -> Result<(), Failure> {
        let scene = Arc::new(scene_named(&self.scene)?);
        let mut inputs = match &self.inputs {
            Some(path) => Inputs::read(path, scene.players_max)?,
            None => Inputs::none(),
        };
        let mut sink = match &self.trace {
            Some(path) => Some(TraceFile::create(path)?),
            None => None,
        };
        let mut game = Game::new(scene, self.seed);
        inputs.seats().for_each(|seat| game.join(seat));
        let (mut elapsed_ms, mut step_ms_max) = (0.0, 0.0f64);
        for tick in 1..=self.ticks {
            let inputs = inputs.at(tick);
            let started = Instant::now();
            game.tick(inputs);
            let step_ms = started.elapsed().as_secs_f64() * 1e3;
            elapsed_ms += step_ms;
            step_ms_max = step_ms_max.max(step_ms);
            if let Some(sink) = &mut sink
                && tick.is_multiple_of(self.every)
            {
                sink.write(&game)?;
            }
        }
        if let Some(sink) = sink {
            sink.finish()?;
        }
        let summary = self.summary(&game, elapsed_ms, step_ms_max);
        if self.json { say(json(&summary)) } else { say(summary.sentence()) }
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

/// Text of a report.
pub fn json(report: &impl Serialize) -> String {
    serde_json::to_string(report).expect("reports hold strings and numbers only")
}

struct TraceFile {
    path: PathBuf,
    file: BufWriter<File>,
}

impl TraceFile {
    fn create(path: &Path) -> Result<TraceFile, Failure> {
        let failed = |error| Failure::Usage(format!("--trace {}: {error}", path.display()));
        let file = BufWriter::new(File::create(path).map_err(failed)?);
        Ok(TraceFile { path: path.to_owned(), file })
    }

    fn write(&mut self, game: &Game) -> Result<(), Failure> {
        let line = json(&trace::line(game));
        writeln!(self.file, "{line}").map_err(|error| failed_write(&self.path, &error))
    }

    fn finish(mut self) -> Result<(), Failure> {
        self.file.flush().map_err(|error| failed_write(&self.path, &error))
    }
}

fn failed_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Check(format!("{}: {error}", path.display()))
}
