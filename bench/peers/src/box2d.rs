//! Box2D 3.2 through its C interface. This is the only unsafe code in the repository.

use crate::forces::{Forces, damping, is_joint};
use boxdd_sys::ffi;
use glam::DVec2;
use jostle_report::engine::{Engine, State};
use jostle_report::scene::{Body, Hook, Motion, Scene, Shape, Spring};

/// Raised because the default caps speeds at 400.
const SPEED_MAX: f32 = 1e5;

pub struct Box2d {
    world: ffi::b2WorldId,
    bodies: Vec<ffi::b2BodyId>,
    tick_s: f32,
    sub_steps: i32,
    length_unit: f32,
    damping: f32,
    forces: Forces,
    collides: bool,
    body_steps: u64,
}

impl Box2d {
    pub fn new(scene: &Scene, sub_steps: i32, length_unit: f32) -> Result<Box2d, String> {
        // SAFETY: the definition comes from Box2D's own defaults and outlives the call.
        let world = unsafe {
            ffi::b2SetLogFcn(Some(ignore_warning));
            ffi::b2SetLengthUnitsPerMeter(length_unit);
            let mut def = ffi::b2DefaultWorldDef();
            def.gravity = vector(scene.gravity);
            def.enableSleep = scene.sleeping;
            def.restitutionThreshold = scene.bounce_threshold as f32;
            def.maximumLinearSpeed = SPEED_MAX;
            ffi::b2CreateWorld(&def)
        };
        let mut engine = Box2d {
            world,
            bodies: Vec::new(),
            tick_s: scene.tick_s as f32,
            sub_steps,
            length_unit,
            damping: damping(scene),
            forces: Forces::new(scene, sub_steps as usize).damped_before(sub_steps as usize),
            collides: scene.collides,
            body_steps: 0,
        };
        for body in &scene.bodies {
            engine.add(body);
        }
        for spring in scene.springs.iter().filter(|s| is_joint(scene, s, sub_steps as usize)) {
            engine.tie(scene, spring);
        }
        Ok(engine)
    }
}

impl Box2d {
    /// Adds a distance joint with a spring, no shorter than Box2D's minimum length.
    fn tie(&mut self, scene: &Scene, spring: &Spring) {
        let mass = scene.swinging_mass(spring);
        let turn = (spring.stiffness / mass).sqrt();
        // SAFETY: the world lives until drop, and so do its bodies; definitions are Box2D's defaults with plain fields
        // changed, and outlive the calls.
        unsafe {
            let far = match spring.to {
                Hook::Body(other) => self.bodies[other],
                Hook::Point(point) => {
                    let mut def = ffi::b2DefaultBodyDef();
                    def.position.x = point.x as f32;
                    def.position.y = point.y as f32;
                    ffi::b2CreateBody(self.world, &def)
                }
            };
            let mut def = ffi::b2DefaultDistanceJointDef();
            def.base.bodyIdA = far;
            def.base.bodyIdB = self.bodies[spring.body];
            def.length = spring.length as f32;
            def.enableSpring = true;
            def.hertz = (turn / std::f64::consts::TAU) as f32;
            def.dampingRatio = (spring.damping / (2.0 * turn * mass)) as f32;
            ffi::b2CreateDistanceJoint(self.world, &def);
        }
    }

    fn push(&mut self) {
        let states: Vec<State> = (0..self.bodies.len()).map(|body| self.state(body)).collect();
        for (&id, force) in self.bodies.iter().zip(self.forces.on(&states)) {
            // SAFETY: ids are checked by Box2D; bodies live as long as their world.
            unsafe { ffi::b2Body_ApplyForceToCenter(id, vector(force), true) }
        }
    }
}

/// Drops Box2D's warnings, because one about its limits is printed in every step and would drown out everything else.
/// The figures show these limits too.
unsafe extern "C" fn ignore_warning(_: *const std::ffi::c_char) {}

fn vector(v: DVec2) -> ffi::b2Vec2 {
    ffi::b2Vec2 { x: v.x as f32, y: v.y as f32 }
}

impl Engine for Box2d {
    fn add(&mut self, body: &Body) -> usize {
        // SAFETY: the world lives until drop; definitions are Box2D's defaults with plain fields changed, and outlive
        // the calls.
        unsafe {
            let mut def = ffi::b2DefaultBodyDef();
            def.type_ = match body.motion {
                Motion::Static => ffi::b2BodyType_b2_staticBody,
                Motion::Kinematic => ffi::b2BodyType_b2_kinematicBody,
                Motion::Dynamic => ffi::b2BodyType_b2_dynamicBody,
            };
            def.position.x = body.position.x as f32;
            def.position.y = body.position.y as f32;
            def.linearVelocity = vector(body.velocity);
            def.linearDamping = self.damping;
            def.motionLocks.angularZ = true;
            let id = ffi::b2CreateBody(self.world, &def);
            let mut shape = ffi::b2DefaultShapeDef();
            shape.density = (body.mass / body.shape.area()) as f32;
            shape.material.friction = body.friction as f32;
            shape.material.restitution = body.restitution as f32;
            if !self.collides {
                shape.filter.maskBits = 0;
            }
            match body.shape {
                Shape::Circle { radius } => {
                    let center = ffi::b2Vec2 { x: 0.0, y: 0.0 };
                    let circle = ffi::b2Circle { center, radius: radius as f32 };
                    ffi::b2CreateCircleShape(id, &shape, &circle);
                }
                Shape::Box { half } => {
                    let polygon = ffi::b2MakeBox(half.x as f32, half.y as f32);
                    ffi::b2CreatePolygonShape(id, &shape, &polygon);
                }
            }
            self.bodies.push(id);
        }
        self.bodies.len() - 1
    }

    fn tick(&mut self) {
        let (steps, sub_steps) = match self.forces.change_within_a_tick() {
            true => (self.sub_steps, 1),
            false => (1, self.sub_steps),
        };
        for _ in 0..steps {
            if !self.forces.is_empty() {
                self.push();
            }
            // SAFETY: the world lives until drop; the length unit is global and set before every step.
            unsafe {
                ffi::b2SetLengthUnitsPerMeter(self.length_unit);
                ffi::b2World_Step(self.world, self.tick_s / steps as f32, sub_steps);
            }
        }
        self.body_steps += self.bodies.len() as u64 * self.sub_steps as u64;
    }

    fn state(&self, body: usize) -> State {
        let id = self.bodies[body];
        // SAFETY: ids are checked by Box2D; bodies live as long as their world.
        let (p, v) = unsafe { (ffi::b2Body_GetPosition(id), ffi::b2Body_GetLinearVelocity(id)) };
        State {
            position: DVec2::new(f64::from(p.x), f64::from(p.y)),
            velocity: DVec2::new(f64::from(v.x), f64::from(v.y)),
        }
    }

    fn set_velocity(&mut self, body: usize, velocity: DVec2) {
        // SAFETY: as above.
        unsafe { ffi::b2Body_SetLinearVelocity(self.bodies[body], vector(velocity)) }
    }

    fn remove(&mut self, body: usize) {
        // SAFETY: as above; a body is removed only once.
        unsafe { ffi::b2DestroyBody(self.bodies[body]) }
    }

    fn set_gravity(&mut self, gravity: DVec2) {
        // SAFETY: the world lives until drop.
        unsafe { ffi::b2World_SetGravity(self.world, vector(gravity)) }
    }

    fn is_asleep(&self, body: usize) -> bool {
        // SAFETY: as above.
        unsafe { !ffi::b2Body_IsAwake(self.bodies[body]) }
    }

    fn pair_solves(&self) -> Option<u64> {
        None
    }

    fn body_steps(&self) -> u64 {
        self.body_steps
    }
}

impl Drop for Box2d {
    fn drop(&mut self) {
        // SAFETY: made by `new`, and destroyed only once.
        unsafe { ffi::b2DestroyWorld(self.world) }
    }
}
