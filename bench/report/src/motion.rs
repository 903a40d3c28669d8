//! Random scenes in motion, each determined by (seed, number) alone: 200 to 1000 bodies in a container, with random
//! sizes, mass ratios up to 1 : 10^6, restitution, springs, platforms and disturbances.
//!
//! A comparison with a peer shows where steps are slow. Unlike the scenes of [`crate::piles`], these were not known
//! while the solver was developed.

mod disturbance;
pub mod search;

use crate::engine::{Engine, State};
use crate::scene::{Body, Drag, Hook, Scene, Shape, Spring};
use disturbance::{Disturbance, Platform};
use glam::DVec2;
use jostle_sim::Rng;

/// Number of steps in a run.
pub const STEPS: u32 = 300;
const BODIES: (u32, u32) = (200, 1000);
/// Number of walls, which are the first bodies: floor, ceiling, left, right.
const WALLS: usize = 4;

/// A scene with its disturbances.
pub struct Setting {
    pub scene: Scene,
    /// Size of the container, whose lower left corner is the origin.
    pub size: DVec2,
    /// Short descriptions of the random choices that were made.
    pub traits: Vec<String>,
    disturbances: Vec<Disturbance>,
    platforms: Vec<Platform>,
    seed: (u64, u64),
}

impl Setting {
    /// Creates the scene with a given number in the sequence of a seed.
    pub fn new(seed: u64, number: u64) -> Setting {
        let rng = &mut Rng::new(seed, number);
        let mut traits = Vec::new();
        let (mut scene, size) = bodies(rng, &mut traits);
        if rng.below(10) < 2 {
            scene.drag = Drag::Linear(round(10f64.powf(range(rng, -1.0, 0.5))));
            traits.push(format!("drag {:?}", scene.drag));
        }
        if rng.below(10) < 3 {
            springs(rng, &mut scene, &mut traits);
        }
        let mut platforms = Vec::new();
        if rng.below(10) < 4 {
            platforms =
                (0..1 + rng.below(3)).map(|_| Platform::new(rng, &mut scene, size)).collect();
            traits.push(format!("{} platforms", platforms.len()));
        }
        let count = [0, 1, 1, 2][rng.below(4) as usize];
        let mut disturbances: Vec<Disturbance> =
            (0..count).map(|_| Disturbance::new(rng)).collect();
        disturbances.dedup_by_key(|disturbance| std::mem::discriminant(disturbance));
        traits.extend(disturbances.iter().map(|disturbance| format!("{disturbance:?}")));
        Setting { scene, size, traits, disturbances, platforms, seed: (seed, number) }
    }

    /// Returns a driver for the disturbances, at tick 0.
    pub fn driver(&self) -> Driver<'_> {
        let (seed, number) = self.seed;
        Driver { setting: self, rng: Rng::new(!seed, number), tick: 0 }
    }

    /// Number of bodies that are outside the container or have been lost.
    pub fn outside(&self, states: &[State]) -> usize {
        let is_inside =
            |place: DVec2| place.cmpge(DVec2::ZERO).all() && place.cmple(self.size).all();
        self.scene.dynamic().filter(|&body| !is_inside(states[body].position)).count()
    }

    /// Whether nothing but the disturbances, which act between steps, may add energy.
    pub fn keeps_energy(&self) -> bool {
        self.platforms.is_empty()
    }

    /// Potential and kinetic energy, including that of the springs.
    pub fn energy(&self, states: &[State], gravity: DVec2) -> f64 {
        let of = |body: usize| {
            let State { position, velocity } = states[body];
            self.scene.bodies[body].mass * (velocity.length_squared() / 2.0 - gravity.dot(position))
        };
        let stored = |spring: &Spring| {
            let offset = states[spring.body].position - spring.far(states).position;
            spring.stiffness * (offset.length() - spring.length).powi(2) / 2.0
        };
        let bodies: f64 = self.scene.dynamic().map(of).sum();
        bodies + self.scene.springs.iter().map(stored).sum::<f64>()
    }
}

/// Applies the disturbances of a setting to one engine.
pub struct Driver<'a> {
    setting: &'a Setting,
    rng: Rng,
    tick: u32,
}

impl Driver<'_> {
    /// Applies the disturbances before a tick; returns the gravity for the tick.
    pub fn act(&mut self, engine: &mut dyn Engine) -> DVec2 {
        let (setting, tick) = (self.setting, self.tick);
        self.tick += 1;
        for platform in &setting.platforms {
            platform.drive(engine, tick);
        }
        for disturbance in &setting.disturbances {
            disturbance.act(engine, setting, &mut self.rng, tick);
        }
        disturbance::gravity(&setting.disturbances, setting.scene.gravity, tick)
    }
}

/// Places bodies in rows, each as tall as its tallest body, in a container with room above them.
fn bodies(rng: &mut Rng, traits: &mut Vec<String>) -> (Scene, DVec2) {
    let count = BODIES.0 + rng.below(BODIES.1 - BODIES.0 + 1);
    let stuff = Stuff::new(rng, traits);
    let gravity = if rng.below(6) == 0 { 0.0 } else { round(range(rng, 10.0, 100.0)) };
    let mut bodies: Vec<Body> = (0..count).map(|_| stuff.body(rng)).collect();
    let area: f64 =
        bodies.iter().map(|body| 4.0 * body.shape.half_extent().element_product()).sum();
    let gap = range(rng, 0.02, 1.0) * stuff.half.0;
    let width = (area * 10f64.powf(range(rng, -0.5, 1.0))).sqrt().max(10.0 * stuff.half.1);
    let (mut x, mut y, mut high) = (gap, gap, 0f64);
    for body in &mut bodies {
        let half = body.shape.half_extent();
        if x + 2.0 * half.x + gap > width {
            (x, y, high) = (gap, y + high + gap, 0.0);
        }
        body.position = DVec2::new(x + half.x, y + half.y);
        (x, high) = (x + 2.0 * half.x + gap, high.max(2.0 * half.y));
    }
    let size = DVec2::new(width, (y + high + gap) * range(rng, 1.1, 2.5) + 20.0);
    let mut scene = Scene::new(gravity);
    let (friction, restitution) = (stuff.friction, stuff.restitution.0);
    scene.contain(size.x, size.y, friction, restitution);
    bodies.into_iter().for_each(|body| {
        scene.add(body);
    });
    traits.insert(0, format!("{count} bodies in {:.0} x {:.0}, gravity {gravity}", size.x, size.y));
    (scene, size)
}

/// Ranges for the properties of bodies.
struct Stuff {
    /// Smallest and largest half-size.
    half: (f64, f64),
    /// One in this many bodies has the largest size and the others are near the smallest; 0 for sizes in between.
    few_large: u32,
    /// Number of circles per ten bodies.
    circles: u32,
    /// One in this many bodies is heavier by this factor; if the number is 0, each body is heavier by a random factor
    /// up to this one.
    heavy: (u32, f64),
    friction: f64,
    restitution: (f64, f64),
    speed: f64,
}

impl Stuff {
    fn new(rng: &mut Rng, traits: &mut Vec<String>) -> Stuff {
        let small = round(10f64.powf(range(rng, -0.5, 0.3)));
        let half = (small, round(small * 10f64.powf(range(rng, 0.0, 0.9))));
        let ratio = round(10f64.powf(range(rng, 1.0, 6.0)));
        let heavy = match rng.below(5) {
            0 | 1 => (1, 1.0),
            2 | 3 => ([2, 5, 20, 50][rng.below(4) as usize], ratio),
            _ => (0, ratio),
        };
        let bounce = round(f64::from(rng.unit()));
        let restitution = match rng.below(5) {
            0 | 1 => (0.0, 0.0),
            2 => (bounce, bounce),
            3 => (0.0, 1.0),
            _ => (1.0, 1.0),
        };
        let few_large = [0, 0, 10, 40][rng.below(4) as usize];
        let friction = [0.0, 0.3, 0.3, 1.0][rng.below(4) as usize];
        let speed = [0.0, 0.0, 50.0, 200.0][rng.below(4) as usize];
        let circles = [0, 5, 5, 10][rng.below(4) as usize];
        traits.push(format!(
            "half-sizes {half:?}, large one in {few_large}, circles {circles}/10, heavy {heavy:?}, friction \
             {friction}, restitution {restitution:?}, speed {speed}"
        ));
        Stuff { half, few_large, circles, heavy, friction, restitution, speed }
    }

    fn body(&self, rng: &mut Rng) -> Body {
        let (small, large) = self.half;
        let exponent = |rng: &mut Rng| (large / small).powf(f64::from(rng.unit()));
        let size = |rng: &mut Rng| match self.few_large {
            0 => small * exponent(rng),
            every if rng.below(every) == 0 => large,
            _ => small * range(rng, 1.0, 1.5),
        };
        let shape = match rng.below(10) < self.circles {
            true => Shape::Circle { radius: size(rng) },
            false => Shape::rect(size(rng), size(rng)),
        };
        let (every, factor) = self.heavy;
        let factor = match every {
            0 => factor.powf(f64::from(rng.unit())),
            every if rng.below(every) == 0 => factor,
            _ => 1.0,
        };
        let restitution = range(rng, self.restitution.0, self.restitution.1);
        let body = Body::new(shape, 0.0, 0.0).of_stuff(self.friction, round(restitution));
        let velocity = direction(rng) * (self.speed * f64::from(rng.unit()));
        body.of_mass(shape.area() * factor).moving(velocity.x, velocity.y)
    }
}

/// Adds springs between bodies that are adjacent in the list, or from a body to its initial position.
fn springs(rng: &mut Rng, scene: &mut Scene, traits: &mut Vec<String>) {
    let movable: Vec<usize> = scene.dynamic().collect();
    let hertz = round(10f64.powf(range(rng, 0.0, 1.0)));
    let damping = round(range(rng, 0.05, 1.0));
    let (one_in, anchored) = (1 + rng.below(8), rng.below(3) == 0);
    for pair in movable.windows(2) {
        if rng.below(one_in) > 0 {
            continue;
        }
        let (body, other) = (pair[0], pair[1]);
        let place = |index: usize| scene.bodies[index].position;
        let (to, length) = match anchored {
            true => (Hook::Point(place(body) + DVec2::new(0.0, 4.0)), 4.0),
            false => (Hook::Body(other), place(body).distance(place(other))),
        };
        let mut spring = Spring { body, to, length, stiffness: 1.0, damping: 0.0 };
        let (mass, turn) = (scene.swinging_mass(&spring), std::f64::consts::TAU * hertz);
        (spring.stiffness, spring.damping) = (mass * turn * turn, 2.0 * damping * mass * turn);
        scene.springs.push(spring);
    }
    let ends = if anchored { "to points" } else { "between bodies" };
    traits.push(format!("{} springs {ends}, {hertz} Hz, {damping}", scene.springs.len()));
}

fn range(rng: &mut Rng, low: f64, high: f64) -> f64 {
    f64::from(rng.range(low as f32, high as f32))
}

fn direction(rng: &mut Rng) -> DVec2 {
    DVec2::from_angle(range(rng, 0.0, std::f64::consts::TAU))
}

/// Rounds to three significant digits, the way a person would write a quantity.
fn round(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests;
