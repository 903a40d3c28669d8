//! The rain scene, made once for every engine: numbers in f64, rounded to f32 once.

use jostle_sim::contact::collide;
use jostle_sim::world::WorldSettings;
use jostle_sim::{BodyDef, Motion, Shape, Solver, Vec2, World};

/// Friction of every body and wall; restitution is 0.
pub const FRICTION: f32 = 0.3;
/// Gravity, units/s^2.
pub const GRAVITY: Vec2 = Vec2::new(0.0, -50.0);

/// Walls and bodies as centre and shape; density is 1.
pub struct Rain {
    pub walls: Vec<(Vec2, Shape)>,
    pub bodies: Vec<(Vec2, Shape)>,
}

impl Rain {
    /// `count` bodies in a container four times as many columns wide as rows high.
    pub fn new(count: u32) -> Rain {
        let columns = f64::from(4 * count).sqrt().ceil() as u32;
        let rows = count.div_ceil(columns);
        let (width, height) = (8.0 * f64::from(columns), 8.0 * f64::from(rows) + 40.0);
        let mut draws = Mulberry(0x5EED_0000 + count);
        let bodies = (0..count).map(|i| {
            let kind = draws.unit();
            let (a, b) = (1.0 + 2.5 * draws.unit(), 1.0 + 2.5 * draws.unit());
            let (jitter_x, jitter_y) = (draws.range(-0.45, 0.45), draws.range(-0.45, 0.45));
            let shape = if kind < 0.5 {
                Shape::circle(a as f32)
            } else {
                Shape::rect(2.0 * a as f32, 2.0 * b as f32)
            };
            let x = 8.0 * (f64::from(i % columns) + 0.5) + jitter_x;
            let y = 8.0 * (f64::from(i / columns) + 0.5) + jitter_y;
            (Vec2::new(x as f32, y as f32), shape)
        });
        Rain { bodies: bodies.collect(), walls: container(width as f32, height as f32) }
    }

    /// The deepest overlap of any two bodies or a body and a wall, every pair tested.
    pub fn deepest(&self, positions: &[Vec2]) -> f32 {
        let mut deepest = 0.0;
        let placed: Vec<(Vec2, Shape)> =
            positions.iter().zip(&self.bodies).map(|(&place, body)| (place, body.1)).collect();
        for (i, a) in placed.iter().enumerate() {
            for b in placed[i + 1..].iter().chain(&self.walls) {
                if let Some(contact) = collide(a.1, a.0, b.1, b.0, (0, 1))
                    && contact.depth > deepest
                {
                    deepest = contact.depth;
                }
            }
        }
        deepest
    }
}

/// Floor, ceiling, left and right wall around (0, 0)-(w, h), 20 thick.
fn container(w: f32, h: f32) -> Vec<(Vec2, Shape)> {
    let across = Shape::rect(w + 40.0, 20.0);
    let upright = Shape::rect(20.0, h + 40.0);
    vec![
        (Vec2::new(w / 2.0, -10.0), across),
        (Vec2::new(w / 2.0, h + 10.0), across),
        (Vec2::new(-10.0, h / 2.0), upright),
        (Vec2::new(w + 10.0, h / 2.0), upright),
    ]
}

/// Area, which is the mass at density 1.
pub fn mass(shape: Shape) -> f32 {
    match shape {
        Shape::Circle { radius } => std::f32::consts::PI * radius * radius,
        Shape::Box { half } => 4.0 * half.x * half.y,
    }
}

/// The scene as a world of ours.
pub fn world(scene: &Rain) -> World {
    let mut world = World::new(WorldSettings {
        gravity: GRAVITY,
        solver: Some(Solver::default()),
        bodies_max: scene.bodies.len() + scene.walls.len(),
        ..WorldSettings::default()
    });
    let walls = scene.walls.iter().map(|wall| (wall, Motion::Static));
    for (&(position, shape), motion) in
        walls.chain(scene.bodies.iter().map(|b| (b, Motion::Dynamic)))
    {
        let def = BodyDef {
            shape,
            position,
            motion,
            mass: mass(shape),
            friction: FRICTION,
            restitution: 0.0,
            ..BodyDef::default()
        };
        world.add(&def).expect("bodies_max counts them all");
    }
    world
}

/// mulberry32, the generator that the shared scenes are defined with.
struct Mulberry(u32);

impl Mulberry {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x6D2B_79F5);
        let mut t = self.0;
        t = (t ^ (t >> 15)).wrapping_mul(t | 1);
        t ^= t.wrapping_add((t ^ (t >> 7)).wrapping_mul(t | 61));
        f64::from(t ^ (t >> 14)) / 4_294_967_296.0
    }

    fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}
