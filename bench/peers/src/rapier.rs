//! rapier2d 0.36.1.

use crate::forces::{Forces, damping, is_joint};
use glam::DVec2;
use jostle_report::engine::{Engine, State};
use jostle_report::scene::{Body, Hook, Motion, Scene, Shape, Spring};
use rapier2d::prelude::*;

pub struct Rapier {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    tick_s: f32,
    sub_steps: usize,
    damping: f32,
    forces: Forces,
    collides: bool,
    sleeping: bool,
    body_steps: u64,
}

impl Rapier {
    pub fn new(scene: &Scene, sub_steps: usize, length_unit: f32) -> Result<Rapier, String> {
        let mut world = PhysicsWorld::new();
        world.gravity = vector(scene.gravity);
        world.integration_parameters.dt = scene.tick_s as f32;
        world.integration_parameters.num_solver_iterations = sub_steps;
        world.integration_parameters.length_unit = length_unit;
        world.integration_parameters.normalized_max_linear_velocity = f32::MAX;
        let mut engine = Rapier {
            world,
            bodies: Vec::new(),
            tick_s: scene.tick_s as f32,
            sub_steps,
            damping: damping(scene),
            forces: Forces::new(scene, sub_steps),
            collides: scene.collides,
            sleeping: scene.sleeping,
            body_steps: 0,
        };
        for body in &scene.bodies {
            engine.add(body);
        }
        for spring in scene.springs.iter().filter(|s| is_joint(scene, s, sub_steps)) {
            engine.tie(spring);
        }
        Ok(engine)
    }
}

impl Rapier {
    /// Sets the linear damping of a body, 1/s.
    pub fn set_damping(&mut self, body: usize, damping: f64) {
        if let Some(body) = self.world.bodies.get_mut(self.bodies[body]) {
            body.set_linear_damping(damping as f32);
        }
    }

    /// A spring joint, implemented as a soft motor towards its length.
    fn tie(&mut self, spring: &Spring) {
        let far = match spring.to {
            Hook::Body(other) => self.bodies[other],
            Hook::Point(point) => {
                self.world.insert_body(RigidBodyBuilder::fixed().translation(vector(point)))
            }
        };
        let (length, stiffness) = (spring.length as f32, spring.stiffness as f32);
        let joint = SpringJointBuilder::new(length, stiffness, spring.damping as f32);
        self.world.insert_impulse_joint(far, self.bodies[spring.body], joint);
    }

    fn push(&mut self) {
        let states: Vec<State> = (0..self.bodies.len()).map(|body| self.state(body)).collect();
        for (&id, force) in self.bodies.iter().zip(self.forces.on(&states)) {
            if let Some(body) = self.world.bodies.get_mut(id) {
                body.reset_forces(true);
                body.add_force(vector(force), true);
            }
        }
    }
}

fn vector(v: DVec2) -> Vector {
    Vector::new(v.x as f32, v.y as f32)
}

impl Engine for Rapier {
    fn add(&mut self, body: &Body) -> usize {
        let builder = match body.motion {
            Motion::Static => RigidBodyBuilder::fixed(),
            Motion::Kinematic => RigidBodyBuilder::kinematic_velocity_based(),
            Motion::Dynamic => RigidBodyBuilder::dynamic(),
        };
        let builder = builder
            .translation(vector(body.position))
            .linvel(vector(body.velocity))
            .linear_damping(self.damping)
            .lock_rotations()
            .can_sleep(self.sleeping);
        let collider = match body.shape {
            Shape::Circle { radius } => ColliderBuilder::ball(radius as f32),
            Shape::Box { half } => ColliderBuilder::cuboid(half.x as f32, half.y as f32),
        };
        let collider = collider
            .density((body.mass / body.shape.area()) as f32)
            .friction(body.friction as f32)
            .restitution(body.restitution as f32)
            .collision_groups(if self.collides {
                InteractionGroups::all()
            } else {
                InteractionGroups::none()
            });
        let (id, _) = self.world.insert(builder, collider);
        self.bodies.push(id);
        self.bodies.len() - 1
    }

    fn tick(&mut self) {
        let (steps, sub_steps) = match self.forces.change_within_a_tick() {
            true => (self.sub_steps, 1),
            false => (1, self.sub_steps),
        };
        self.world.integration_parameters.dt = self.tick_s / steps as f32;
        self.world.integration_parameters.num_solver_iterations = sub_steps;
        for _ in 0..steps {
            if !self.forces.is_empty() {
                self.push();
            }
            self.world.step();
        }
        self.body_steps += self.bodies.len() as u64 * self.sub_steps as u64;
    }

    fn state(&self, body: usize) -> State {
        let body = &self.world.bodies[self.bodies[body]];
        let (p, v) = (body.translation(), body.linvel());
        State {
            position: DVec2::new(f64::from(p.x), f64::from(p.y)),
            velocity: DVec2::new(f64::from(v.x), f64::from(v.y)),
        }
    }

    fn set_velocity(&mut self, body: usize, velocity: DVec2) {
        if let Some(body) = self.world.bodies.get_mut(self.bodies[body]) {
            body.set_linvel(vector(velocity), true);
        }
    }

    fn remove(&mut self, body: usize) {
        self.world.remove_body(self.bodies[body]);
    }

    fn set_gravity(&mut self, gravity: DVec2) {
        self.world.gravity = vector(gravity);
    }

    fn is_asleep(&self, body: usize) -> bool {
        self.world.bodies[self.bodies[body]].is_sleeping()
    }

    fn pair_solves(&self) -> Option<u64> {
        None
    }

    fn body_steps(&self) -> u64 {
        self.body_steps
    }
}
