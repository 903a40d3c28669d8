//! External disturbances that act on a pile: shaking, turning gravity, blasts, a plough, a crowd, slings, a lift, a
//! mixer, a pull, arms in a funnel, and volleys.

use super::scenes::SEEDS_APART;
use crate::engine::{Engine, State};
use crate::scene::{Body, Mulberry, Scene, Shape};
use glam::DVec2;

/// A disturbance that acts the same way in every run, whatever the bodies do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Script {
    Still,
    /// Every 30 ticks each velocity changes by up to 40 units/s on both axes.
    Shaken,
    /// Gravity turns by 90 degrees every 120 ticks.
    Turning,
    /// From tick 240 on, a blast every 20 ticks at a random position near the floor.
    Blasts,
    /// From tick 180 on, the scene's last body is driven from wall to wall at 60 units/s.
    Plough,
    /// One in 16 bodies is a hero that flies at 40 units/s and changes direction every 15 ticks.
    Crowd,
    /// Every 20 ticks eight bodies are slung at 140 units/s, away from the middle of the floor.
    Slings,
    /// From tick 120 on, a lift in the floor alternately rises and sinks for one second each, at 30 units/s.
    Lift,
    /// From tick 180 on, a box of 12 by 12 circles in the pile at 60 units/s.
    Mixer,
    /// In every tick, all bodies gain 2 units/s towards a point that jumps every 90 ticks.
    Pull,
    /// Two arms in a funnel move from side to side at 60 units/s, in opposite directions.
    Sweepers,
    /// Every 30 ticks all small bodies are launched at 300 units/s.
    Volley,
}

/// Speed that a pull adds per tick, in units/s, and the number of ticks after which its point jumps.
const PULL_SPEED: f64 = 2.0;
const PULL_TICKS: u32 = 90;
/// A hero's speed in units/s.
const HERO_SPEED: f64 = 40.0;
/// One in this many bodies is a hero.
const HERO_EVERY: usize = 16;
/// Speed at which a body is slung in units/s.
const SLING_SPEED: f64 = 140.0;
/// Number of bodies slung at the same time.
const SLINGS: usize = 8;
/// Half the height of the lift in units.
const LIFT: f64 = 2.0;
/// Speed of the lift in units/s, and the number of ticks for which it rises or sinks.
const LIFT_SPEED: f64 = 30.0;
const LIFT_TICKS: u32 = 60;
/// Half-size of the mixer, radius of its circle, and height of the circle's centre above the floor, in units. The
/// largest body fits below it.
const MIXER: f64 = 6.0;
const MIXER_RADIUS: f64 = 14.0;
const MIXER_HEIGHT: f64 = 28.0;
/// Speed of the mixer in units/s.
const MIXER_SPEED: f64 = 60.0;
/// Half-size of an arm, the horizontal distance between its centre and the funnel's, its height, and its travel to
/// either side.
const ARM: [f64; 2] = [2.0, 6.0];
const ARM_APART: f64 = 22.0;
const ARM_HEIGHT: f64 = 125.0;
const ARM_REACH: f64 = 15.0;
const ARM_SPEED: f64 = 60.0;
/// Largest radius of a body that a volley moves, and the speed it gets, in units/s.
const SMALL: f64 = 0.5;
const VOLLEY_SPEED: f64 = 300.0;

/// Half-size of the plough, and the minimum distance between its centre and the walls.
const PLOUGH: [f64; 2] = [2.0, 12.0];
const PLOUGH_MARGIN: f64 = 6.0;
/// Speed of the plough in units/s.
const PLOUGH_SPEED: f64 = 60.0;
/// Reach of a blast in units, and the speed it adds at its centre, in units/s.
const BLAST_REACH: f64 = 40.0;
const BLAST_SPEED: f64 = 120.0;
/// Largest change that a shake makes to a velocity component, in units/s.
const SHAKE_SPEED: f64 = 40.0;
/// Half the thickness of a container's wall.
const WALL: f64 = 10.0;

impl Script {
    /// Adds the bodies that the script needs to a scene in a container.
    pub fn prepare(self, scene: &mut Scene) {
        if self == Script::Plough {
            let shape = Shape::rect(PLOUGH[0], PLOUGH[1]);
            let plough = Body::new(shape, PLOUGH_MARGIN, height(scene) - PLOUGH[1] - 2.0);
            scene.add(plough.of_stuff(0.3, 0.0).kinematic());
        }
        if self == Script::Lift {
            let lift = Body::new(Shape::rect(width(scene) / 6.0, LIFT), width(scene) / 2.0, -LIFT);
            scene.add(lift.of_stuff(0.3, 0.0).kinematic());
        }
        if self == Script::Sweepers {
            for side in [-1.0, 1.0] {
                let x = width(scene) / 2.0 + side * ARM_APART;
                let arm = Body::new(Shape::rect(ARM[0], ARM[1]), x, ARM_HEIGHT);
                scene.add(arm.of_stuff(0.3, 0.0).kinematic());
            }
        }
        if self == Script::Mixer {
            let (x, y) = (width(scene) / 2.0, height(scene) - MIXER - 2.0);
            let mixer = Body::new(Shape::rect(MIXER, MIXER), x, y);
            scene.add(mixer.of_stuff(0.3, 0.0).kinematic());
        }
    }
}

/// Applies a script to one engine.
pub struct Driver {
    script: Script,
    seed: u32,
    draws: Mulberry,
    tick: u32,
    /// Direction of the plough, and the tick at which it reverses.
    plough: (f64, u32),
}

impl Driver {
    /// Creates a driver at tick 0.
    pub fn new(script: Script, seed: u32) -> Driver {
        let draws = Mulberry(0xA917_A7ED + SEEDS_APART * seed);
        Driver { script, seed, draws, tick: 0, plough: (1.0, 180) }
    }

    /// Applies the script before a tick.
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
            Script::Crowd if tick.is_multiple_of(15) => self.steer(engine, scene),
            Script::Slings if tick.is_multiple_of(20) => self.sling(engine, scene),
            Script::Lift if tick >= 120 && tick.is_multiple_of(LIFT_TICKS) => {
                let upward = (tick / LIFT_TICKS).is_multiple_of(2);
                let speed = if upward { LIFT_SPEED } else { -LIFT_SPEED };
                engine.set_velocity(scene.bodies.len() - 1, DVec2::new(0.0, speed));
            }
            Script::Mixer => mix(engine, scene, tick),
            Script::Pull => self.pull(engine, scene, tick),
            Script::Sweepers => sweep(engine, scene, tick),
            Script::Volley if tick.is_multiple_of(30) => self.volley(engine, scene),
            _ => {}
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

    fn steer(&mut self, engine: &mut dyn Engine, scene: &Scene) {
        for hero in scene.dynamic().step_by(HERO_EVERY) {
            let mut draw = || f64::from(self.draws.range(-1.0, 1.0) as f32);
            let direction = DVec2::new(draw(), draw()).normalize_or_zero();
            engine.set_velocity(hero, direction * HERO_SPEED);
        }
    }

    fn sling(&mut self, engine: &mut dyn Engine, scene: &Scene) {
        let bodies: Vec<usize> = scene.dynamic().collect();
        let middle = DVec2::new(width(scene) / 2.0, 0.0);
        for _ in 0..SLINGS {
            let draw = self.draws.range(0.0, bodies.len() as f64) as usize;
            let slung = bodies[draw.min(bodies.len() - 1)];
            let away = engine.state(slung).position - middle;
            engine.set_velocity(slung, away.normalize_or_zero() * SLING_SPEED);
        }
    }

    fn volley(&mut self, engine: &mut dyn Engine, scene: &Scene) {
        for body in scene.dynamic().filter(|&i| scene.bodies[i].shape.half_extent().x < SMALL) {
            let angle = self.draws.range(0.0, std::f64::consts::TAU);
            engine.set_velocity(body, DVec2::from_angle(angle) * VOLLEY_SPEED);
        }
    }

    fn pull(&self, engine: &mut dyn Engine, scene: &Scene, tick: u32) {
        let mut draws = Mulberry(self.seed ^ (0x9E37 * (tick / PULL_TICKS) + 1));
        let point = DVec2::new(draws.range(0.0, width(scene)), draws.range(0.0, height(scene)));
        for body in scene.dynamic() {
            let State { position, velocity } = engine.state(body);
            let gain = (point - position).normalize_or_zero() * PULL_SPEED;
            engine.set_velocity(body, velocity + gain);
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

/// Moves both arms back and forth, starting away from each other.
fn sweep(engine: &mut dyn Engine, scene: &Scene, tick: u32) {
    let ticks = (ARM_REACH / ARM_SPEED / scene.tick_s).round() as u32;
    let outward = matches!(tick / ticks % 4, 0 | 3);
    if tick.is_multiple_of(ticks) {
        let speed = if outward { ARM_SPEED } else { -ARM_SPEED };
        engine.set_velocity(scene.bodies.len() - 2, DVec2::new(-speed, 0.0));
        engine.set_velocity(scene.bodies.len() - 1, DVec2::new(speed, 0.0));
    }
}

/// Lowers the mixer into the pile, then moves it in a circle.
fn mix(engine: &mut dyn Engine, scene: &Scene, tick: u32) {
    const BEGINS: u32 = 120;
    const TURNS: u32 = 180;
    let mixer = scene.bodies.len() - 1;
    let start = scene.bodies[mixer].position;
    let on_circle = |tick: u32| {
        let angle = MIXER_SPEED / MIXER_RADIUS * f64::from(tick - TURNS) * scene.tick_s;
        DVec2::new(start.x, MIXER_HEIGHT) + DVec2::new(angle.sin(), angle.cos()) * MIXER_RADIUS
    };
    if tick == BEGINS {
        let lowered = f64::from(TURNS - BEGINS) * scene.tick_s;
        engine.set_velocity(mixer, (on_circle(TURNS) - start) / lowered);
    } else if tick >= TURNS {
        engine.set_velocity(mixer, (on_circle(tick + 1) - on_circle(tick)) / scene.tick_s);
    }
}

/// Width of the container, whose left wall is the third body and whose right wall is the fourth.
pub fn width(scene: &Scene) -> f64 {
    (scene.bodies[3].position - scene.bodies[2].position).x - 2.0 * WALL
}

/// Height of the container, whose floor is the first body and whose ceiling is the second.
pub fn height(scene: &Scene) -> f64 {
    (scene.bodies[1].position - scene.bodies[0].position).y - 2.0 * WALL
}
