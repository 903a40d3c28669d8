//! Disturbances for random scenes, and platforms that move by themselves.

use super::{Setting, WALLS, direction, range, round};
use crate::engine::{Engine, State};
use crate::scene::{Body, Scene, Shape};
use glam::DVec2;
use jostle_sim::Rng;

/// A disturbance that acts at regular intervals, given in ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disturbance {
    /// Changes each velocity by up to `speed`, in units/s.
    Shake { every: u32, speed: f64 },
    /// Turns gravity by 90 degrees.
    Turn { every: u32 },
    /// Pushes all bodies away from a random point, with a strength that decreases with distance.
    Blast { every: u32, reach: f64, speed: f64 },
    /// Accelerates all bodies in every tick towards a point that jumps around.
    Pull { every: u32, gain: f64 },
    /// Flings some bodies away.
    Sling { every: u32, count: u32, speed: f64 },
}

impl Disturbance {
    pub fn new(rng: &mut Rng) -> Disturbance {
        let every = 10 + rng.below(110);
        let speed = round(range(rng, 20.0, 200.0));
        match rng.below(6) {
            0 => Disturbance::Shake { every, speed: speed.min(80.0) },
            1 => Disturbance::Turn { every: every.max(60) },
            2 => Disturbance::Blast { every, reach: round(range(rng, 10.0, 60.0)), speed },
            3 | 4 => Disturbance::Pull { every: every.max(40), gain: round(range(rng, 0.5, 4.0)) },
            _ => Disturbance::Sling { every, count: 1 + rng.below(16), speed },
        }
    }

    /// Applies the disturbance before a tick.
    pub fn act(self, engine: &mut dyn Engine, setting: &Setting, rng: &mut Rng, tick: u32) {
        let (scene, size) = (&setting.scene, setting.size);
        let is_due = |every: u32| tick > 0 && tick.is_multiple_of(every);
        let mut push = |of: &mut dyn FnMut(State) -> DVec2| {
            for body in scene.dynamic() {
                let state = engine.state(body);
                engine.set_velocity(body, state.velocity + of(state));
            }
        };
        match self {
            Disturbance::Shake { every, speed } if is_due(every) => {
                push(&mut |_| DVec2::new(range(rng, -speed, speed), range(rng, -speed, speed)));
            }
            Disturbance::Turn { every } if is_due(every) => {
                engine.set_gravity(turned(scene.gravity, tick / every));
            }
            Disturbance::Blast { every, reach, speed } if is_due(every) => {
                let centre = place(rng, size);
                push(&mut |state| {
                    let away = state.position - centre;
                    let share = (1.0 - away.length() / reach).max(0.0);
                    away.normalize_or_zero() * (speed * share)
                });
            }
            Disturbance::Pull { every, gain } => {
                let mut places = Rng::new(u64::from(every), u64::from(tick / every));
                let point = place(&mut places, size);
                push(&mut |state| (point - state.position).normalize_or_zero() * gain);
            }
            Disturbance::Sling { every, count, speed } if is_due(every) => {
                for _ in 0..count {
                    let movable = (scene.bodies.len() - WALLS) as u32;
                    let slung = WALLS + rng.below(movable) as usize;
                    let velocity = direction(rng) * speed;
                    if scene.bodies[slung].motion == crate::scene::Motion::Dynamic {
                        engine.set_velocity(slung, velocity);
                    }
                }
            }
            _ => {}
        }
    }
}

/// Returns the gravity for a tick.
pub fn gravity(disturbances: &[Disturbance], gravity: DVec2, tick: u32) -> DVec2 {
    let last = disturbances.iter().rev().find_map(|disturbance| match disturbance {
        Disturbance::Turn { every } if tick >= *every => Some(turned(gravity, tick / every)),
        _ => None,
    });
    last.unwrap_or(gravity)
}

fn turned(gravity: DVec2, quarters: u32) -> DVec2 {
    (0..quarters % 4).fold(gravity, |gravity, _| gravity.perp())
}

fn place(rng: &mut Rng, size: DVec2) -> DVec2 {
    DVec2::new(range(rng, 0.0, size.x), range(rng, 0.0, size.y))
}

/// A piston in the floor that moves up and down. It is taller than its travel, so that nothing gets below it.
#[derive(Clone, Copy, Debug)]
pub struct Platform {
    body: usize,
    speed: f64,
    ticks: u32,
}

impl Platform {
    /// Adds a platform to a scene.
    pub fn new(rng: &mut Rng, scene: &mut Scene, size: DVec2) -> Platform {
        let ticks = 20 + rng.below(60);
        let travel = size.y * range(rng, 0.05, 0.3);
        let speed = (travel / (f64::from(ticks) * scene.tick_s)).min(80.0);
        let half_width = size.x * range(rng, 0.05, 0.25);
        let x = range(rng, half_width, size.x - half_width);
        let piston = Body::new(Shape::rect(half_width, travel), x, -travel);
        let material = scene.bodies[0];
        let piston = piston.of_stuff(material.friction, material.restitution).kinematic();
        Platform { body: scene.add(piston), speed, ticks }
    }

    /// Sets the platform's velocity for a tick.
    pub fn drive(self, engine: &mut dyn Engine, tick: u32) {
        if tick.is_multiple_of(self.ticks) {
            let upward = (tick / self.ticks).is_multiple_of(2);
            let speed = if upward { self.speed } else { -self.speed };
            engine.set_velocity(self.body, DVec2::new(0.0, speed));
        }
    }
}
