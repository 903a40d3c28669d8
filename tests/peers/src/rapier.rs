//! rapier2d 0.36.1.

use glam::DVec2;
use jostle_report::engine::{Engine, State};
use jostle_report::scene::{Body, Drag, Motion, Scene, Shape};
use rapier2d::prelude::*;

pub struct Rapier {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    damping: f32,
    collides: bool,
    body_steps: u64,
}

impl Rapier {
    pub fn new(scene: &Scene, sub_steps: usize) -> Result<Rapier, String> {
        let damping = match scene.drag {
            Drag::None => 0.0,
            Drag::Linear(rate) => rate as f32,
            Drag::Quadratic(_) => return Err("rapier2d knows linear damping only".into()),
        };
        if scene.spring != 0.0 {
            return Err("its springs are soft joints and are not compared".into());
        }
        let mut world = PhysicsWorld::new();
        world.gravity = vector(scene.gravity);
        world.integration_parameters.dt = scene.tick_s as f32;
        world.integration_parameters.num_solver_iterations = sub_steps;
        world.integration_parameters.normalized_max_linear_velocity = f32::MAX;
        let mut engine =
            Rapier { world, bodies: Vec::new(), damping, collides: scene.collides, body_steps: 0 };
        for body in &scene.bodies {
            engine.add(body);
        }
        Ok(engine)
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
            .can_sleep(false);
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
        self.world.step();
        let sub_steps = self.world.integration_parameters.num_solver_iterations;
        self.body_steps += self.bodies.len() as u64 * sub_steps as u64;
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

    fn pair_solves(&self) -> Option<u64> {
        None
    }

    fn body_steps(&self) -> u64 {
        self.body_steps
    }
}
