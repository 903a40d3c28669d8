//! Box2D on the same scene: rotation locked, sleep off, four sub-steps, its defaults otherwise.

use crate::rain::{FRICTION, GRAVITY, Rain};
use boxdd_sys::ffi;
use jostle_sim::{DT, Shape, Vec2};

/// Sub-steps a step, Box2D's own default.
const SUB_STEPS: i32 = 4;

pub struct Box2d {
    world: ffi::b2WorldId,
    bodies: Vec<ffi::b2BodyId>,
}

impl Box2d {
    pub fn new(scene: &Rain) -> Box2d {
        // SAFETY: definitions come from Box2D's own defaults and live across the calls.
        unsafe {
            let mut def = ffi::b2DefaultWorldDef();
            def.gravity = ffi::b2Vec2 { x: GRAVITY.x, y: GRAVITY.y };
            def.enableSleep = false;
            let world = ffi::b2CreateWorld(&def);
            for &(place, shape) in &scene.walls {
                add(world, place, shape, false);
            }
            let bodies =
                scene.bodies.iter().map(|&(place, shape)| add(world, place, shape, true)).collect();
            Box2d { world, bodies }
        }
    }

    pub fn step(&mut self) {
        // SAFETY: the world lives until drop.
        unsafe { ffi::b2World_Step(self.world, DT, SUB_STEPS) }
    }

    /// Positions and velocities of the bodies.
    pub fn state(&self) -> (Vec<Vec2>, Vec<Vec2>) {
        let read = |&body: &ffi::b2BodyId| {
            // SAFETY: the bodies live as long as their world.
            let (p, v) =
                unsafe { (ffi::b2Body_GetPosition(body), ffi::b2Body_GetLinearVelocity(body)) };
            (Vec2::new(p.x, p.y), Vec2::new(v.x, v.y))
        };
        self.bodies.iter().map(read).unzip()
    }
}

impl Drop for Box2d {
    fn drop(&mut self) {
        // SAFETY: made by `new`, destroyed once.
        unsafe { ffi::b2DestroyWorld(self.world) }
    }
}

/// Adds one body. The caller guarantees that the world lives.
unsafe fn add(world: ffi::b2WorldId, place: Vec2, shape: Shape, dynamic: bool) -> ffi::b2BodyId {
    // SAFETY: as above; definitions are Box2D's defaults with plain fields changed.
    unsafe {
        let mut def = ffi::b2DefaultBodyDef();
        def.type_ =
            if dynamic { ffi::b2BodyType_b2_dynamicBody } else { ffi::b2BodyType_b2_staticBody };
        def.position.x = place.x;
        def.position.y = place.y;
        def.motionLocks.angularZ = true;
        let body = ffi::b2CreateBody(world, &def);
        let mut shape_def = ffi::b2DefaultShapeDef();
        shape_def.density = 1.0;
        shape_def.material.friction = FRICTION;
        shape_def.material.restitution = 0.0;
        match shape {
            Shape::Circle { radius } => {
                let circle = ffi::b2Circle { center: ffi::b2Vec2 { x: 0.0, y: 0.0 }, radius };
                ffi::b2CreateCircleShape(body, &shape_def, &circle);
            }
            Shape::Box { half } => {
                let polygon = ffi::b2MakeBox(half.x, half.y);
                ffi::b2CreatePolygonShape(body, &shape_def, &polygon);
            }
        }
        body
    }
}
