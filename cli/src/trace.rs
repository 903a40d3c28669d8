//! A game's state after a tick, as one JSON object. Numbers are printed with the fewest digits that read back as the
//! same number, so equal states produce equal bytes.

use crate::output::{Failure, OrFail, json};
use jostle_game::Game;
use jostle_sim::{BodyId, Motion, World};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// A line of a trace.
#[derive(Debug, Serialize)]
pub struct TraceLine {
    pub tick: u32,
    /// The state hash, as 16 hex digits.
    pub hash: String,
    /// Bodies in index order.
    pub bodies: Vec<TracedBody>,
    pub particles: usize,
    pub emitters: usize,
    /// Sums over the world.
    #[serde(flatten)]
    pub sums: Sums,
}

#[derive(Debug, Serialize)]
pub struct TracedBody {
    /// The body's index, plus 2^32 times the number of earlier bodies with the same index.
    pub id: u64,
    pub kind: &'static str,
    /// Centre, world units.
    pub pos: [f32; 2],
    /// Velocity, units/s.
    pub vel: [f32; 2],
}

/// Sums over all bodies and contacts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sums {
    /// Number of overlapping pairs at the end of the tick.
    pub contacts: usize,
    /// The deepest overlap, world units; 0 if nothing overlaps.
    pub deepest: f32,
    /// Sum of m v^2 / 2 over dynamic bodies.
    pub kinetic: f64,
    /// Sum of m v over dynamic bodies.
    pub momentum: [f64; 2],
}

/// A game's current state.
pub fn line(game: &Game) -> TraceLine {
    let world = game.world();
    let body = |info: jostle_game::SnapshotBody| TracedBody {
        id: number(info.id),
        kind: info.kind.name(),
        pos: world.position(info.id).to_array(),
        vel: world.velocity(info.id).to_array(),
    };
    TraceLine {
        tick: game.tick_count(),
        hash: hash(game),
        bodies: game.bodies().map(body).collect(),
        particles: world.particles().len(),
        emitters: world.particles().emitter_count(),
        sums: sums(world),
    }
}

/// The state hash in printed form.
pub fn hash(game: &Game) -> String {
    format!("{:016x}", game.hash())
}

fn number(id: BodyId) -> u64 {
    u64::from(id.generation) << 32 | u64::from(id.index)
}

/// Sums in id order, in f64. Plain + and * produce the same bits on every machine.
pub fn sums(world: &World) -> Sums {
    let mut sums = Sums { contacts: 0, deepest: 0.0, kinetic: 0.0, momentum: [0.0, 0.0] };
    for touch in world.touches() {
        sums.contacts += 1;
        if touch.depth > sums.deepest {
            sums.deepest = touch.depth;
        }
    }
    for id in world.ids().filter(|id| world.motion(*id) == Motion::Dynamic) {
        let mass = 1.0 / f64::from(world.inverse_mass(id));
        let [x, y] = world.velocity(id).to_array().map(f64::from);
        sums.kinetic += mass * (x * x + y * y) * 0.5;
        sums.momentum[0] += mass * x;
        sums.momentum[1] += mass * y;
    }
    sums
}

/// Where a trace goes.
pub struct TraceSink {
    /// The file's name for error messages; `None` for stdout.
    file: Option<String>,
    out: BufWriter<Box<dyn Write>>,
    /// Whether the reader of stdout has closed it.
    is_closed: bool,
}

impl TraceSink {
    /// Creates a trace file; `-` stands for stdout.
    pub fn create(path: &Path) -> Result<TraceSink, Failure> {
        if path == Path::new("-") {
            return Ok(TraceSink::stdout());
        }
        let file = path.display().to_string();
        let out = Box::new(File::create(path).or_usage(format_args!("--trace {file}"))?);
        Ok(TraceSink { file: Some(file), out: BufWriter::new(out), is_closed: false })
    }

    pub fn stdout() -> TraceSink {
        TraceSink { file: None, out: BufWriter::new(Box::new(io::stdout())), is_closed: false }
    }

    /// Whether the trace goes to stdout.
    pub fn is_stdout(&self) -> bool {
        self.file.is_none()
    }

    /// Adds a line of JSON.
    pub fn write(&mut self, line: &impl Serialize) -> Result<(), Failure> {
        if self.is_closed {
            return Ok(());
        }
        let written = writeln!(self.out, "{}", json(line));
        self.check(written)
    }

    pub fn finish(mut self) -> Result<(), Failure> {
        let flushed = self.out.flush();
        self.check(flushed)
    }

    /// Checks a write. If the reader has closed stdout, as `head` does, that is not an error.
    fn check(&mut self, done: io::Result<()>) -> Result<(), Failure> {
        match done {
            Err(error) if self.is_stdout() && error.kind() == io::ErrorKind::BrokenPipe => {
                self.is_closed = true;
                Ok(())
            }
            done => done.or_check(self.file.as_deref().unwrap_or("stdout")),
        }
    }
}
