//! Games with scripted players as clients receive them: the messages to a client that joins at some tick, and digests
//! of the game's own particles for comparison.

use anyhow::{Context, Result, anyhow};
use jostle_client_web::world::particle_probe::record;
use jostle_client_web::world::room_in_page::scripted_input;
use jostle_game::{Scene, Seat};
use jostle_protocol::Appearance;
use jostle_room::{Rate, Room, Subscriber};
use std::sync::Arc;

/// Number of ticks in a game.
pub const TICKS: u32 = 1000;
/// The ticks after which clients join.
const JOIN_TICKS: [u32; 4] = [1, 7, 333, 702];
const PLAYERS: u8 = 3;

/// Particles hit bodies that move and die. They come from emitters of every kind, exceed the limit, and pause for a
/// while.
const FOUNTAINS: &str = r#"title = "Fountains"
size = [160, 90]
gravity = [0, -60]
tools = ["steer", "launch", "dumb", "hold"]
groups = ["hero", "block", "pack", "dumb"]
pairs = [["hero", "block"], ["block", "block"], ["pack", "block"], ["dumb", "block"]]
particles_meet = ["hero", "block"]

[limits]
particles = 900

[hero]
spawns = [[20, 30], [60, 16], [100, 16], [140, 16]]

[recipes.drops]
life_ticks = [20, 90]
velocity = [[-40, 20], [40, 70]]
acceleration = [0, -80]
drag = 0.99

[[bodies]]
kind = "wall"
position = [80, 2]
size = [160, 4]
group = "block"

[[bodies]]
name = "ferry"
kind = "platform"
path = [[40, 40], [120, 40]]
period = 6
size = [20, 3]
group = "block"

[[bodies]]
name = "ball"
kind = "block"
position = [90, 60]
radius = 3
velocity = [60, 0]
group = "block"

[[layouts]]
kind = "block"
count = 60
area = [[20, 50], [140, 85]]
radius = 1.5
group = "block"

[[emitters]]
recipe = "fire"
count = 400
position = [50, 10]
start = 10
every = 240

[[emitters]]
recipe = "drops"
count = 90
follow = "ferry"
start = 40
every = 120

[[emitters]]
recipe = "drops"
count = 700
follow = "ball"
start = 60
every = 480

[[emitters]]
recipe = "fire"
count = 3
position = [110, 30]
start = 650
every = 7
"#;

/// The messages to one client, and the expected result.
pub struct Received {
    /// The scene file's text.
    pub scene: String,
    /// The tick at which the client joined and the digests begin.
    pub first: u32,
    /// The messages, in the format of [`jostle_client_web::world::particle_probe`].
    pub recording: Vec<u8>,
    /// Digests of the game's particles, by tick.
    pub digests: Vec<(u32, u64)>,
    /// Largest number of particles at any time, and their number when the client joined.
    pub particles: [usize; 2],
}

/// The scenes with particles: two shipped scenes, and one with every kind of emitter.
pub fn scenes() -> Result<Vec<Arc<Scene>>> {
    let shipped = ["emitters", "particles"];
    let built_in = Scene::built_in().into_iter();
    let mut scenes: Vec<Arc<Scene>> =
        built_in.filter(|scene| shipped.contains(&scene.name.as_str())).map(Arc::new).collect();
    let own = Scene::parse("fountains.toml", FOUNTAINS).map_err(|error| anyhow!("{error}"))?;
    scenes.push(Arc::new(own));
    Ok(scenes)
}

/// Plays a scene and returns the messages of clients that joined at the ticks of [`JOIN_TICKS`].
pub fn play(scene: &Arc<Scene>) -> Result<Vec<Received>> {
    let mut room = Room::new("streams", Arc::clone(scene), 5);
    for (color, name) in (0..PLAYERS).zip(["Ada", "Grace", "Alan"]) {
        join(&mut room, name, color)?;
    }
    let mut clients: Vec<(Subscriber, Received)> = Vec::new();
    let mut particles_max = 0;
    for tick in 1..=TICKS {
        for seat in (0..u16::from(PLAYERS)).map(Seat) {
            room.input(seat, tick, scripted_input(scene, seat, tick));
        }
        room.tick();
        let particles = room.game().world().particles();
        particles_max = particles_max.max(particles.len());
        let now = (tick, particles.digest());
        for (reader, received) in &mut clients {
            received.digests.push(now);
            if let Some(message) = room.message(reader) {
                record(message, &mut received.recording);
            }
        }
        if JOIN_TICKS.contains(&tick) {
            let flying = particles.len();
            let (reader, keyframe) = room.subscribe(Rate::Full);
            let mut recording = Vec::new();
            record(&keyframe, &mut recording);
            let received = Received {
                scene: scene.source.clone(),
                first: tick,
                recording,
                digests: vec![now],
                particles: [0, flying],
            };
            clients.push((reader, received));
        }
    }
    let received = clients.into_iter().map(|(_, received)| received);
    Ok(received
        .map(|received| Received { particles: [particles_max, received.particles[1]], ..received })
        .collect())
}

fn join(room: &mut Room, name: &str, color: u8) -> Result<()> {
    let look = Appearance::new(name, color).map_err(|error| anyhow!("{error}"))?;
    let joined = room.join(look, None);
    joined.map_err(|refusal| anyhow!("{refusal:?}")).context("a seat").map(drop)
}

impl Received {
    /// Compares a client's particles with the game's, tick by tick, and returns the number of ticks.
    pub fn compare(&self, digests: &[(u32, u64)]) -> Result<usize> {
        // The last ticks may not have been sent if nothing moved in them.
        let sent = &self.digests[..digests.len().min(self.digests.len())];
        for (game, copy) in sent.iter().zip(digests) {
            anyhow::ensure!(game == copy, "joined at {}: {game:?} became {copy:?}", self.first);
        }
        Ok(sent.len())
    }
}
