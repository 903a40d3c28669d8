//! Measures the cost of a client that sees part of a large world: A10k with a view of about 900 bodies around each
//! player, compared with K901, whose whole world has about as many bodies, over the same number of ticks.

use super::measure::{FIRST_TICKS, QUANTA, Scale, Traffic, watch};
use super::program::Make;
use super::scenes::{crowd, flock};
use crate::study::thread_time_us;
use anyhow::Result;
use jostle_game::{Scene, Seat};
use jostle_protocol::{Appearance, PlayerState, Snapshot, SnapshotStream};
use jostle_room::{BufferPool, InterestArea, Rate, Subscriber, view_of};
use jostle_sim::{BodyId, Particles, Vec2};

/// Number of ticks played in each scene.
const TICKS: u32 = 1200;
/// Side length of a view in units. Boxes are 2 units apart.
const VIEW: f32 = 60.0;
/// Side length of the world in units.
const SIDE: f64 = 220.0;
/// The world of A10k as a room's scene, with the measurement's quantum.
const PLAIN: &str = "title = \"Plain\"\nsize = [220, 220]\nquantum = 0.00390625\n\
    camera = { follow = 60 }\ntools = [\"steer\"]\ngroups = [\"hero\"]\n\
    pairs = [[\"hero\", \"hero\"]]\n[limits]\nplayers = 8\n[hero]\nspawns = [[110, 110]]\n";

/// Figures averaged over all players.
pub struct Seen {
    /// Number of bodies that a client holds.
    pub bodies: f64,
    /// The room's processor time per client and tick, in microseconds.
    pub encode_us: f64,
    /// Traffic of all messages to all players.
    traffic: Traffic,
}

impl Seen {
    /// See [`Traffic::bytes_per_s`].
    pub fn bytes_per_s(&self) -> [f64; 2] {
        self.traffic.bytes_per_s()
    }

    /// Mean payload bits per body that moved within the view itself.
    pub fn bits_per_moved(&self) -> f64 {
        self.traffic.bits_per_moved()
    }
}

/// Traffic of one client in K901 at each rate.
pub fn small_world(make: Make) -> Vec<Traffic> {
    let mut script = flock();
    let mut engine = make(&script);
    let mut scale = Scale::new(&[60, 20, 5]);
    watch(&mut script, &mut *engine, TICKS, |snapshot| scale.weigh(&snapshot.into()));
    scale.finish()
}

/// Traffic of the players in A10k at every rate, each with a separate view.
pub fn large_world(make: Make) -> Result<Vec<Seen>> {
    let scene = Scene::parse("plain.toml", PLAIN).map_err(|error| anyhow::anyhow!("{error}"))?;
    let mut script = crowd();
    let mut engine = make(&script);
    let players = script.players;
    let mut clients: Vec<Client> = Vec::new();
    watch(&mut script, &mut *engine, TICKS, |snapshot| {
        let snapshot = with_players(snapshot, players);
        if clients.is_empty() {
            let seats = || (0..players).map(|seat| Seat(seat as u16));
            let begin = |rate| seats().map(move |seat| (seat, rate));
            let asked = Rate::ALL.into_iter().flat_map(begin);
            clients =
                asked.map(|(seat, rate)| Client::begin(seat, rate, &scene, &snapshot)).collect();
        } else {
            clients.iter_mut().for_each(|client| client.see(&snapshot));
        }
    });
    let of_rate = |rate| clients.iter().filter(move |client| client.subscriber.rate == rate);
    Ok(Rate::ALL.into_iter().map(|rate| mean(of_rate(rate))).collect())
}

/// Adds players to a snapshot. The first bodies become their heroes.
fn with_players(mut snapshot: Snapshot, players: usize) -> Snapshot {
    let heroes = snapshot.bodies.iter().take(players).map(|body| body.id);
    let player = |(seat, hero)| PlayerState {
        seat: Seat(seat),
        appearance: Appearance { name: "Ann".into(), color: 0 },
        connected: true,
        input_seq: 0,
        hero: Some(hero),
        selected: None,
        held: None,
        score: 0,
        pointer: None,
    };
    snapshot.players = (0..).zip(heroes).map(player).collect();
    snapshot
}

/// Both ends of one player's stream.
struct Client {
    area: InterestArea,
    buffers: BufferPool,
    subscriber: Subscriber,
    stream: SnapshotStream,
    traffic: Traffic,
    hero: BodyId,
    bodies: u64,
    ticks: u32,
}

impl Client {
    fn begin(seat: Seat, rate: Rate, scene: &Scene, first: &Snapshot) -> Client {
        let view = view_of(scene, Some(Vec2::splat(VIEW))).expect("the world is larger");
        let (area, subscriber, keyframe) =
            InterestArea::subscribe(None, seat, rate, scene, view, first, None);
        let hero = first.bodies[usize::from(seat.0)].id;
        let mut stream = SnapshotStream::default();
        stream.decode(&keyframe).expect("a keyframe can be decoded");
        Client {
            area,
            buffers: BufferPool::default(),
            subscriber,
            stream,
            traffic: Traffic::new(0),
            hero,
            bodies: 0,
            ticks: 0,
        }
    }

    fn see(&mut self, snapshot: &Snapshot) {
        self.ticks += 1;
        let begun = thread_time_us();
        self.area.push(snapshot, &[], &Particles::default(), &mut self.buffers);
        let pushed = thread_time_us();
        let before = self.stream.newest().cloned().expect("a keyframe was read");
        let message = self.area.message(&self.subscriber);
        if let Some(bytes) = message {
            self.stream.decode(bytes).expect("what was encoded can be decoded");
        }
        let newest = self.stream.newest().expect("a keyframe was read");
        if self.ticks > FIRST_TICKS {
            self.traffic.sizes.extend(message.map(|bytes| bytes.len()));
            self.traffic.encode_us += pushed - begun;
            self.bodies += newest.bodies.len() as u64;
            self.traffic.moved += moved_in_view(self.hero, &before, newest);
        }
    }
}

/// Number of moving bodies on the screen of a client that follows the hero.
fn moved_in_view(hero: BodyId, before: &Snapshot, now: &Snapshot) -> u64 {
    let position = |snapshot: &Snapshot, id: BodyId| {
        let index = snapshot.bodies.binary_search_by_key(&id.index, |body| body.id.index);
        index.ok().map(|index| snapshot.bodies[index].quanta.map(|axis| f64::from(axis) / QUANTA))
    };
    let half = f64::from(VIEW) / 2.0;
    let hero = position(now, hero).expect("the own hero is always sent");
    let middle = hero.map(|axis| axis.clamp(half, SIDE - half));
    let shows = |at: &[f64; 2]| (0..2).all(|axis| (at[axis] - middle[axis]).abs() < half);
    let moved = now.bodies.iter().filter_map(|body| {
        let at = position(now, body.id)?;
        (position(before, body.id)? != at).then_some(at)
    });
    moved.filter(shows).count() as u64
}

/// Averages over all clients.
fn mean<'a>(clients: impl Iterator<Item = &'a Client>) -> Seen {
    let (mut traffic, mut bodies, mut ticks) = (Traffic::new(0), 0, 0);
    for client in clients {
        ticks += client.ticks.saturating_sub(FIRST_TICKS);
        traffic.sizes.extend(&client.traffic.sizes);
        traffic.moved += client.traffic.moved;
        traffic.encode_us += client.traffic.encode_us;
        bodies += client.bodies;
    }
    let each = |sum: f64| sum / f64::from(ticks.max(1));
    let (bodies, encode_us) = (each(bodies as f64), each(traffic.encode_us));
    Seen { bodies, encode_us, traffic: traffic.finish(ticks) }
}
