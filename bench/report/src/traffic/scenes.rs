//! The scenes: scripted players and the hundreds of bodies that they push around. K901 is a flock of boxes seen from
//! above, P901 a pile seen from the side, S901 K901 with idle players, and A10k has ten thousand boxes and eight
//! players.

use crate::engine::State;
use crate::scene::{Body, Mulberry, Scene, Shape, TICK_S};
use glam::DVec2;

/// Reach of a player's pull in units, its strength in units/s^2, and the number of ticks after which it switches on or
/// off.
const PULL_REACH: f64 = 8.0;
const PULL: f64 = 40.0;
const PULL_TICKS: u32 = 120;
/// Reach of an explosion, the speed it adds at its centre, and the number of ticks between explosions.
const BLAST_REACH: f64 = 10.0;
const BLAST: f64 = 40.0;
const BLAST_TICKS: u32 = 180;

/// Many bodies in an engine, numbered in the order they were added.
pub trait Crowd {
    /// Adds to a body's velocity, in units/s.
    fn kick(&mut self, body: usize, change: DVec2);
    /// Plays one tick of 1/60 s.
    fn step(&mut self);
    /// Returns the position and velocity of a body.
    fn state(&self, body: usize) -> State;
}

/// A scene and the actions of its players.
pub struct Script {
    pub name: &'static str,
    /// The bodies: first the four walls, then the players, then all others.
    pub scene: Scene,
    /// Damping of each body in 1/s, applied as v / (1 + damping dt) per tick.
    pub damping: Vec<f64>,
    /// Number of ticks before the first counted one, and number of counted ticks.
    pub ticks: [u32; 2],
    /// Number of ticks in the recording.
    pub ticks_recorded: u32,
    /// Number of players, who are the first movable bodies.
    pub players: usize,
    size: DVec2,
    acceleration: f64,
    pulls: bool,
    blasts: bool,
    /// The counted tick from which players do nothing.
    rest_from: u32,
    draws: Mulberry,
    steering: Vec<(u32, DVec2)>,
    tick: u32,
}

/// Constructors of all scenes.
pub const SCENES: [fn() -> Script; 4] = [flock, pile, still, crowd];

/// Number of static bodies in a container.
const WALLS: usize = 4;

impl Script {
    fn new(name: &'static str, size: DVec2, gravity: f64, seed: u32) -> Script {
        let mut scene = Scene::new(gravity);
        scene.contain(size.x, size.y, 0.3, 0.0);
        Script {
            name,
            scene,
            damping: vec![0.0; WALLS],
            ticks: [0, 3600],
            ticks_recorded: 900,
            players: 0,
            size,
            acceleration: 60.0,
            pulls: true,
            blasts: false,
            rest_from: u32::MAX,
            draws: Mulberry(seed),
            steering: Vec::new(),
            tick: 0,
        }
    }

    fn player(&mut self, x: f64, y: f64, density: f64, damping: f64) {
        let shape = Shape::Circle { radius: 2.0 };
        self.add(Body::new(shape, x, y).of_mass(density * shape.area()), damping);
        self.steering.push((0, DVec2::ZERO));
        self.players += 1;
    }

    fn add(&mut self, body: Body, damping: f64) {
        self.scene.add(body);
        self.damping.push(damping);
    }

    /// Adds rows of boxes with half-size 0.5, two units apart.
    fn boxes(&mut self, count: u32, columns: u32, corner: DVec2) {
        for i in 0..count {
            let position =
                corner + 2.0 * DVec2::new(f64::from(i % columns), f64::from(i / columns));
            self.add(Body::new(Shape::rect(0.5, 0.5), position.x, position.y), 2.0);
        }
    }

    /// Returns the indices of the movable bodies.
    pub fn moving(&self) -> std::ops::Range<usize> {
        WALLS..self.scene.bodies.len()
    }

    /// Applies the players' actions and then plays a tick.
    pub fn play(&mut self, crowd: &mut dyn Crowd) {
        let positions: Vec<DVec2> = self.moving().map(|body| crowd.state(body).position).collect();
        if self.tick < self.rest_from {
            for player in 0..self.players {
                self.steer(player, &positions, crowd);
            }
        }
        let counted = self.tick.checked_sub(self.ticks[0]).map(|tick| tick + 1);
        if self.blasts && counted.is_some_and(|tick| tick % BLAST_TICKS == BLAST_TICKS / 2) {
            let x = self.size.x * self.draws.range(0.1, 0.9);
            let center = DVec2::new(x, self.draws.range(1.0, 15.0));
            push(&positions, center, BLAST_REACH, crowd, |share| BLAST * (1.0 - share));
        }
        crowd.step();
        self.tick += 1;
    }

    fn steer(&mut self, player: usize, positions: &[DVec2], crowd: &mut dyn Crowd) {
        let (timer, _) = self.steering[player];
        if timer == 0 {
            let wait = 12 + (36.0 * self.draws.unit()) as u32;
            let mut turn = || f64::from((3.0 * self.draws.unit()) as u32) - 1.0;
            let turned = DVec2::new(turn(), turn());
            self.steering[player] = (wait, turned);
        }
        self.steering[player].0 -= 1;
        let direction = self.inward(positions[player], self.steering[player].1);
        crowd.kick(WALLS + player, direction * self.acceleration * TICK_S);
        if self.pulls && self.tick / PULL_TICKS % 2 == 1 {
            let others = &positions[self.players..];
            for (index, position) in others.iter().enumerate() {
                let away = positions[player] - *position;
                if away.length() <= PULL_REACH && away != DVec2::ZERO {
                    let pull = away.normalize() * PULL * TICK_S;
                    crowd.kick(WALLS + self.players + index, pull);
                }
            }
        }
    }

    /// Turns a player around near a wall. In a side view players may stay low.
    fn inward(&self, position: DVec2, direction: DVec2) -> DVec2 {
        let share = position / self.size;
        let along = |share: f64, low: f64, direction: f64| match share {
            share if share < low => 1.0,
            share if share > 0.85 => -1.0,
            _ => direction,
        };
        let side_view = self.scene.gravity.y != 0.0;
        let low = if side_view { 0.3 } else { 0.15 };
        let y = if side_view && share.y < low && direction.y <= 0.0 {
            direction.y
        } else {
            along(share.y, low, direction.y)
        };
        DVec2::new(along(share.x, 0.15, direction.x), y)
    }
}

/// Gives bodies within `reach` of a centre a velocity that points away from it.
fn push(
    positions: &[DVec2],
    center: DVec2,
    reach: f64,
    crowd: &mut dyn Crowd,
    speed: impl Fn(f64) -> f64,
) {
    for (index, position) in positions.iter().enumerate() {
        let away = *position - center;
        if away.length() < reach && away != DVec2::ZERO {
            crowd.kick(WALLS + index, away.normalize() * speed(away.length() / reach));
        }
    }
}

/// A flock of 900 boxes and a player.
pub fn flock() -> Script {
    let mut script = Script::new("K901", DVec2::splat(100.0), 0.0, 0x4B39_3031);
    script.player(50.0, 10.0, 4.0, 4.0);
    script.boxes(900, 30, DVec2::splat(21.0));
    script
}

fn still() -> Script {
    let mut script = Script { name: "S901", ticks: [4800, 600], rest_from: 3600, ..flock() };
    script.blasts = false;
    script
}

/// Ten thousand boxes and eight players.
pub fn crowd() -> Script {
    let mut script = Script::new("A10k", DVec2::splat(220.0), 0.0, 0x4131_3030);
    for player in 0..8 {
        let y = if player < 4 { 5.0 } else { 215.0 };
        script.player(35.0 + 50.0 * f64::from(player % 4), y, 4.0, 4.0);
    }
    script.boxes(9992, 100, DVec2::splat(11.0));
    Script { ticks: [0, 1200], ticks_recorded: 240, ..script }
}

fn pile() -> Script {
    let mut script = Script::new("P901", DVec2::new(80.0, 60.0), 50.0, 0x5039_3031);
    script.player(40.0, 57.0, 2.0, 1.0);
    let mut draws = Mulberry(0x5EED_0384);
    for i in 0..900 {
        let round = draws.unit() < 0.5;
        let (a, b) = (draws.range(0.4, 0.9), draws.range(0.4, 0.9));
        let shape = if round { Shape::Circle { radius: a } } else { Shape::rect(a, b) };
        let (x, y) = (2.0 + 2.11 * f64::from(i % 37), 1.0 + 2.0 * f64::from(i / 37));
        script.add(Body::new(shape, x, y), 0.0);
    }
    Script { acceleration: 120.0, pulls: false, blasts: true, ticks: [600, 3600], ..script }
}
