//! Sends a scene through a stream tick by tick and measures the messages.

use super::{Crowd, Script};
use crate::engine::State;
use crate::scene::{Motion, Scene};
use crate::study::thread_time_us;
use glam::DVec2;
use jostle_game::Kind;
use jostle_protocol::limits::QUIET_MESSAGES_MAX;
use jostle_protocol::{Snapshot, SnapshotBody, SnapshotStream};
use jostle_sim::Conjugate;
use jostle_sim::WorldSettings;
use jostle_sim::{Aabb, BodyDef, BodyId, Shape, Solver, Vec2, World};
use std::sync::Arc;

pub const QUANTA: f64 = 256.0;
/// Size of TCP and IP headers with timestamps, in bytes.
const PACKET_BYTES: usize = 52;
/// Number of ticks that cover a keyframe and three messages at the lowest rate.
pub const FIRST_TICKS: u32 = 37;

/// Position of a body in quanta.
pub type Position = [i32; 2];

/// Traffic of a client at one message rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Traffic {
    /// Messages per second that the client requested.
    pub rate: u32,
    /// Sizes of all sent messages in bytes, in sorted order.
    pub sizes: Vec<usize>,
    /// Duration in seconds.
    pub seconds: f64,
    /// Number of bodies that moved since the previous message, summed over all messages.
    pub moved: u64,
    /// Total processor time spent encoding, in microseconds.
    pub encode_us: f64,
    /// Total processor time spent decoding, in microseconds.
    pub decode_us: f64,
}

impl Traffic {
    pub fn new(rate: u32) -> Traffic {
        Traffic { rate, sizes: Vec::new(), seconds: 0.0, moved: 0, encode_us: 0.0, decode_us: 0.0 }
    }

    /// Completes the measurement after the given number of ticks.
    pub fn finish(mut self, ticks: u32) -> Traffic {
        self.sizes.sort_unstable();
        self.seconds = f64::from(ticks) / 60.0;
        self
    }

    /// Bytes per second, excluding and including frames and packet headers.
    pub fn bytes_per_s(&self) -> [f64; 2] {
        let payload: usize = self.sizes.iter().sum();
        let frame = |&size: &usize| if size < 126 { 2 } else { 4 };
        let around: usize = self.sizes.iter().map(|size| PACKET_BYTES + frame(size)).sum();
        [payload, payload + around].map(|bytes| bytes as f64 / self.seconds)
    }

    /// A percentile of the message size in bytes.
    pub fn percentile(&self, share: f64) -> usize {
        let last = self.sizes.len().saturating_sub(1);
        self.sizes.get((share * last as f64).round() as usize).copied().unwrap_or(0)
    }

    /// Mean payload bits per moved body.
    pub fn bits_per_moved(&self) -> f64 {
        8.0 * self.sizes.iter().sum::<usize>() as f64 / self.moved.max(1) as f64
    }
}

/// A stream at one rate that is being measured.
struct Client {
    every: u32,
    sender: SnapshotStream,
    reader: SnapshotStream,
    traffic: Traffic,
}

impl Client {
    fn new(rate: u32) -> Client {
        let every = 60 / rate;
        let (sender, reader) = (SnapshotStream::new(every as u8), SnapshotStream::default());
        Client { every, sender, reader, traffic: Traffic::new(rate) }
    }

    fn see(&mut self, snapshot: &Arc<Snapshot>, counts: bool) {
        if !snapshot.tick.is_multiple_of(self.every) {
            return;
        }
        let since = self.sender.newest().map_or(0, |newest| snapshot.tick - newest.tick);
        if self.sender.is_quiet(snapshot) && since <= QUIET_MESSAGES_MAX * self.every {
            return;
        }
        let moved = self.sender.newest().map_or(0, |old| count_moved(old, snapshot));
        let begun = thread_time_us();
        let bytes = self.sender.encode(snapshot, &[]);
        let coded = thread_time_us();
        self.reader.decode(&bytes).expect("what was encoded can be decoded");
        let decoded = thread_time_us();
        assert_eq!(self.reader.newest(), Some(snapshot), "both ends hold the same");
        if counts {
            self.traffic.sizes.push(bytes.len());
            self.traffic.moved += moved;
            self.traffic.encode_us += coded - begun;
            self.traffic.decode_us += decoded - coded;
        }
    }
}

fn count_moved(old: &Snapshot, new: &Snapshot) -> u64 {
    old.bodies.iter().zip(&new.bodies).filter(|(old, new)| old.quanta != new.quanta).count() as u64
}

/// Clients with different rates that receive the same snapshots.
pub struct Scale {
    clients: Vec<Client>,
    ticks: u32,
}

impl Scale {
    /// Creates one client for each message rate: 60, 20 or 5 per second.
    pub fn new(rates: &[u32]) -> Scale {
        Scale { clients: rates.iter().map(|&rate| Client::new(rate)).collect(), ticks: 0 }
    }

    /// Sends the next tick. The keyframe and the first messages are not counted, until every rate has reached its usual
    /// size.
    pub fn weigh(&mut self, snapshot: &Arc<Snapshot>) {
        self.ticks += 1;
        let counts = self.ticks > FIRST_TICKS;
        self.clients.iter_mut().for_each(|client| client.see(snapshot, counts));
    }

    /// Returns the traffic of each client.
    pub fn finish(self) -> Vec<Traffic> {
        let ticks = self.ticks.saturating_sub(FIRST_TICKS);
        self.clients.into_iter().map(|client| client.traffic.finish(ticks)).collect()
    }
}

/// Plays a script and passes on snapshots of at most `ticks_max` counted ticks.
pub fn watch(
    script: &mut Script,
    crowd: &mut dyn Crowd,
    ticks_max: u32,
    mut each: impl FnMut(Snapshot),
) {
    let [before, counted] = script.ticks;
    for tick in 0..before + counted.min(ticks_max) {
        script.play(crowd);
        if tick >= before {
            let positions = script.moving().map(|body| quanta(crowd.state(body).position));
            each(snapshot(tick + 1, positions));
        }
    }
}

fn quanta(position: DVec2) -> Position {
    [position.x, position.y].map(|axis| (axis * QUANTA).round() as i32)
}

/// A snapshot of bodies that differ only in their index.
pub fn snapshot(tick: u32, positions: impl Iterator<Item = Position>) -> Snapshot {
    let body = |(index, quanta): (u32, Position)| SnapshotBody {
        id: BodyId { index, generation: 0 },
        kind: Kind::Block,
        owner: None,
        group: 0,
        shape: Shape::circle(1.0),
        quanta,
    };
    Snapshot { tick, bodies: (0..).zip(positions).map(body).collect(), ..Snapshot::default() }
}

/// The scene in Jostle's World.
pub struct JostleCrowd {
    world: World,
    ids: Vec<BodyId>,
    damping: Vec<f32>,
}

impl JostleCrowd {
    /// Creates the World with the conjugate solver's defaults.
    pub fn new(script: &Script) -> JostleCrowd {
        let Scene { gravity, bodies, .. } = &script.scene;
        let mut world = World::new(WorldSettings {
            gravity: gravity.as_vec2(),
            solver: Some(Solver::Conjugate(Conjugate::default())),
            kill_zone: Aabb { low: Vec2::splat(-1e4), high: Vec2::splat(1e4) },
            bodies_max: bodies.len(),
            ..WorldSettings::default()
        });
        let add = |body: &crate::scene::Body| {
            let motion = match body.motion {
                Motion::Dynamic => jostle_sim::Motion::Dynamic,
                _ => jostle_sim::Motion::Static,
            };
            let def = BodyDef {
                shape: crate::jostle::shape_of(body.shape),
                position: body.position.as_vec2(),
                motion,
                mass: body.mass as f32,
                restitution: body.restitution as f32,
                friction: body.friction as f32,
                ..BodyDef::default()
            };
            world.add(&def).expect("there is room for all bodies of the scene")
        };
        let ids = bodies.iter().map(add).collect();
        let damping = script.damping.iter().map(|&damping| damping as f32).collect();
        JostleCrowd { world, ids, damping }
    }
}

impl Crowd for JostleCrowd {
    fn kick(&mut self, body: usize, change: DVec2) {
        let id = self.ids[body];
        self.world.set_velocity(id, self.world.velocity(id) + change.as_vec2());
    }

    fn step(&mut self) {
        for (&id, &damping) in self.ids.iter().zip(&self.damping) {
            if damping > 0.0 {
                let slower = self.world.velocity(id) / (1.0 + damping * jostle_sim::DT);
                self.world.set_velocity(id, slower);
            }
        }
        self.world.step();
    }

    fn state(&self, body: usize) -> State {
        let id = self.ids[body];
        State {
            position: self.world.position(id).as_dvec2(),
            velocity: self.world.velocity(id).as_dvec2(),
        }
    }
}
