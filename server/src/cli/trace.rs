//! What a run looked like at a tick, as one JSON object. Numbers are printed with the fewest digits
//! that read back as the same number, so equal states give equal bytes.

use jostle_sim::{BodyId, Game, Motion, World};
use serde::Serialize;

/// One line of a trace.
#[derive(Debug, Serialize)]
pub struct Line {
    /// Ticks played.
    pub tick: u32,
    /// State hash, 16 hex digits.
    pub hash: String,
    /// Bodies in index order.
    pub bodies: Vec<Body>,
    /// Live particles.
    pub particles: usize,
    /// Running emitters.
    pub emitters: usize,
    /// Sums over the world.
    #[serde(flatten)]
    pub sums: Sums,
}

/// One body.
#[derive(Debug, Serialize)]
pub struct Body {
    /// Index, plus 2^32 times how often the index was used before.
    pub id: u64,
    /// What it is.
    pub kind: &'static str,
    /// Centre, world units.
    pub pos: [f32; 2],
    /// Velocity, units/s.
    pub vel: [f32; 2],
}

/// Sums over all bodies and contacts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sums {
    /// Overlapping pairs at the end of the tick.
    pub contacts: usize,
    /// Deepest overlap, world units; 0 without one.
    pub deepest: f32,
    /// Sum of m v^2 / 2 over dynamic bodies.
    pub kinetic: f64,
    /// Sum of m v over dynamic bodies.
    pub momentum: [f64; 2],
}

/// The state of a game now.
pub fn line(game: &Game) -> Line {
    let world = game.world();
    let body = |info: jostle_sim::BodyInfo| Body {
        id: number(info.id),
        kind: info.kind.name(),
        pos: world.position(info.id).to_array(),
        vel: world.velocity(info.id).to_array(),
    };
    Line {
        tick: game.tick_count(),
        hash: hash(game),
        bodies: game.bodies().map(body).collect(),
        particles: world.particles().len(),
        emitters: world.particles().emitter_count(),
        sums: sums(world),
    }
}

/// The state hash as it is printed.
pub fn hash(game: &Game) -> String {
    format!("{:016x}", game.hash())
}

fn number(id: BodyId) -> u64 {
    u64::from(id.generation) << 32 | u64::from(id.index)
}

/// Sums in id order, in f64: plain + and * give the same bits everywhere.
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
