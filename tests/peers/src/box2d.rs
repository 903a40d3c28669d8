//! Box2D 3.2 by its C interface. The only unsafe code of the repository.

use boxdd_sys::ffi;
use glam::DVec2;
use jostle_report::engine::{Engine, State};
use jostle_report::scene::{Body, Drag, Motion, Scene, Shape};

/// Speeds are capped at 400 unless told otherwise.
const SPEED_MAX: f32 = 1e5;

pub struct Box2d {
    world: ffi::b2WorldId,
    bodies: Vec<ffi::b2BodyId>,
    tick_s: f32,
    sub_steps: i32,
    damping: f32,
    collides: bool,
    body_steps: u64,
}

impl Box2d {
    pub fn new(scene: &Scene, sub_steps: i32) -> Result<Box2d, String> {
        let damping = match scene.drag {
            Drag::None => 0.0,
            Drag::Linear(rate) => rate as f32,
            Drag::Quadratic(_) => return Err("Box2D knows linear damping only".into()),
        };
        if scene.spring != 0.0 {
            return Err("its springs are soft joints and are not compared".into());
        }
        // SAFETY: the definition comes from Box2D's own defaults and lives across the call.
        let world = unsafe {
            ffi::b2SetLogFcn(Some(hush));
            let mut def = ffi::b2DefaultWorldDef();
            def.gravity = vector(scene.gravity);
            def.enableSleep = false;
            def.restitutionThreshold = scene.bounce_threshold as f32;
            def.maximumLinearSpeed = SPEED_MAX;
            ffi::b2CreateWorld(&def)
        };
        let tick_s = scene.tick_s as f32;
        let bodies = Vec::new();
        let collides = scene.collides;
        let mut engine =
            Box2d { world, bodies, tick_s, sub_steps, damping, collides, body_steps: 0 };
        for body in &scene.bodies {
            engine.add(body);
        }
        Ok(engine)
    }
}

/// Box2D tells of its limits once a step, which drowns everything else; figures show them too.
unsafe extern "C" fn hush(_: *const std::ffi::c_char) {}

fn vector(v: DVec2) -> ffi::b2Vec2 {
    ffi::b2Vec2 { x: v.x as f32, y: v.y as f32 }
}

impl Engine for Box2d {
    fn add(&mut self, body: &Body) -> usize {
        // SAFETY: the world lives until drop; definitions are Box2D's defaults with plain fields
        // changed and live across the calls.
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
        // SAFETY: the world lives until drop.
        unsafe { ffi::b2World_Step(self.world, self.tick_s, self.sub_steps) }
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
        // SAFETY: as above; a body is removed once.
        unsafe { ffi::b2DestroyBody(self.bodies[body]) }
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
        // SAFETY: made by `new`, destroyed once.
        unsafe { ffi::b2DestroyWorld(self.world) }
    }
}
