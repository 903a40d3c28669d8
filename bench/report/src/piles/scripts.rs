//! What disturbs a pile from outside: shaking, gravity that turns, blasts, a plough.

use crate::engine::Engine;
use crate::scene::{Body, Mulberry, Scene, Shape};
use glam::DVec2;

/// A disturbance. Every run of a script is the same, whatever the bodies do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Script {
    /// None.
    Still,
    /// Every 30 ticks each velocity changes by up to 40 units/s in x and in y.
    Shaken,
    /// Gravity turns by 90 degrees every 120 ticks.
    Turning,
    /// From tick 240 on, every 20 ticks a blast at a random place near the floor.
    Blasts,
    /// From tick 180 on, the last body of the scene is driven from wall to wall at 60 units/s.
    Plough,
}

/// Half-size of the plough, and the distance that its centre keeps from the walls.
const PLOUGH: [f64; 2] = [2.0, 12.0];
const PLOUGH_MARGIN: f64 = 6.0;
const PLOUGH_SPEED: f64 = 60.0;
/// Reach of a blast, units, and the speed that it gives at its centre, units/s.
const BLAST_REACH: f64 = 40.0;
const BLAST_SPEED: f64 = 120.0;
const SHAKE_SPEED: f64 = 40.0;
/// Half the thickness of a container's wall.
const WALL: f64 = 10.0;

impl Script {
    /// Adds what the script needs to a scene in a container.
    pub fn prepare(self, scene: &mut Scene) {
        if self == Script::Plough {
            let shape = Shape::rect(PLOUGH[0], PLOUGH[1]);
            let plough = Body::new(shape, PLOUGH_MARGIN, height(scene) - PLOUGH[1] - 2.0);
            scene.add(plough.of_stuff(0.3, 0.0).kinematic());
        }
    }
}

/// A script at work on one engine.
pub struct Driver {
    script: Script,
    draws: Mulberry,
    tick: u32,
    /// Direction of the plough, and the tick in which it turns.
    plough: (f64, u32),
}

impl Driver {
    /// At tick 0.
    pub fn new(script: Script) -> Driver {
        Driver { script, draws: Mulberry(0xA917_A7ED), tick: 0, plough: (1.0, 180) }
    }

    /// Acts before a tick.
    pub fn act(&mut self, engine: &mut dyn Engine, scene: &Scene) {
        let tick = self.tick;
        self.tick += 1;
        match self.script {
            Script::Still => {}
            Script::Shaken if tick > 0 && tick.is_multiple_of(30) => self.shake(engine, scene),
            Script::Turning if tick.is_multiple_of(120) => {
                let directions = [-DVec2::Y, DVec2::X, DVec2::Y, -DVec2::X];
                let direction = directions[(tick / 120 % 4) as usize];
                engine.set_gravity(direction * scene.gravity.length());
            }
            Script::Blasts if tick >= 240 && tick.is_multiple_of(20) => self.blast(engine, scene),
            Script::Plough => self.plough(engine, scene, tick),
            Script::Shaken | Script::Turning | Script::Blasts => {}
        }
    }

    fn shake(&mut self, engine: &mut dyn Engine, scene: &Scene) {
        for body in scene.dynamic() {
            let mut draw = || f64::from(self.draws.range(-SHAKE_SPEED, SHAKE_SPEED) as f32);
            let change = DVec2::new(draw(), draw());
            engine.set_velocity(body, engine.state(body).velocity + change);
        }
    }

    fn blast(&mut self, engine: &mut dyn Engine, scene: &Scene) {
        let width = width(scene);
        let centre = DVec2::new(self.draws.range(0.0, width), self.draws.range(0.0, 40.0));
        for body in scene.dynamic() {
            let state = engine.state(body);
            let away = state.position - centre;
            let distance = away.length();
            if distance < BLAST_REACH {
                let speed = BLAST_SPEED * (1.0 - distance / BLAST_REACH);
                engine.set_velocity(body, state.velocity + away.normalize_or_zero() * speed);
            }
        }
    }

    fn plough(&mut self, engine: &mut dyn Engine, scene: &Scene, tick: u32) {
        let plough = scene.bodies.len() - 1;
        let start = scene.bodies[plough].position;
        let (direction, turns_at) = self.plough;
        if tick == 120 {
            engine.set_velocity(plough, DVec2::new(0.0, PLOUGH[1] + 0.5 - start.y));
        } else if tick == turns_at {
            engine.set_velocity(plough, DVec2::new(direction * PLOUGH_SPEED, 0.0));
            let ticks = (width(scene) - 2.0 * PLOUGH_MARGIN) / PLOUGH_SPEED / scene.tick_s;
            self.plough = (-direction, tick + ticks.round() as u32);
        }
    }
}

/// Width of the container, whose left wall comes third and right wall fourth.
pub fn width(scene: &Scene) -> f64 {
    (scene.bodies[3].position - scene.bodies[2].position).x - 2.0 * WALL
}

/// Height of the container, whose floor comes first and ceiling second.
pub fn height(scene: &Scene) -> f64 {
    (scene.bodies[1].position - scene.bodies[0].position).y - 2.0 * WALL
}
