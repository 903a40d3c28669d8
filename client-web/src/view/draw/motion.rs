//! Squash and stretch: a damped spring per body, driven by sudden changes in velocity. It affects only the drawing,
//! never the simulation.

use crate::view::frame::FrameBody;
use jostle_game::Kind;
use jostle_sim::{BodyId, Vec2};

/// Bodies with higher indices are drawn without a spring.
const SPRINGS_MAX: usize = 65_536;
/// Stiffness in 1/s^2 (about 7 Hz) and damping in 1/s.
const STIFFNESS: f32 = 2000.0;
const DAMPING: f32 = 16.0;
/// Maximum share by which a body becomes flatter or taller.
const SQUASH_MAX: f32 = 0.16;
/// Minimum change in velocity between two frames that kicks the spring, units/s; smaller changes are ordinary
/// acceleration.
const KICK_MIN: f32 = 4.0;
/// Duration of the pop-up animation of a new body, seconds.
const POP_S: f32 = 0.18;

#[derive(Clone, Copy)]
struct SprungBody {
    id: BodyId,
    seen_frame: u32,
    spring: SquashSpring,
}

/// The flatness of a body and its rate of change.
#[derive(Clone, Copy, Debug)]
pub struct SquashSpring {
    velocity: Vec2,
    /// The share by which the body is flattened.
    pub squash: f32,
    rate: f32,
}

/// A body's position and size as drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre, world units.
    pub center: Vec2,
    /// Half extent, world units.
    pub half: Vec2,
}

/// The springs of all bodies, by index.
#[derive(Default)]
pub struct BodySprings {
    springs: Vec<Option<SprungBody>>,
    time: f32,
    step_s: f32,
    frame: u32,
    calm: bool,
}

impl BodySprings {
    /// Starts a frame at this time, seconds.
    pub fn begin(&mut self, time: f32, calm: bool) {
        self.step_s = (time - self.time).clamp(0.0, 0.05);
        self.time = time;
        self.calm = calm;
        self.frame = self.frame.wrapping_add(1);
    }

    /// The pose in which to draw `body` in this frame.
    pub fn pose(&mut self, body: &FrameBody) -> Pose {
        let half = body.shape.half_extent();
        if matches!(body.kind, Kind::Wall | Kind::Platform) {
            return Pose { center: body.center, half };
        }
        let squash = match body.squash {
            _ if self.calm => 0.0,
            Some(known) => known,
            None => self.squash(body),
        };
        let half = half * pop(body.age);
        // A flatter body is wider. The lower edge stays in place, so that feet remain on the floor.
        let squashed = Vec2::new(half.x * (1.0 + 0.8 * squash), half.y * (1.0 - squash));
        let center = body.center - Vec2::new(0.0, half.y - squashed.y);
        Pose { center: center + self.bob(body), half: squashed }
    }

    fn bob(&self, body: &FrameBody) -> Vec2 {
        if body.kind != Kind::Minion || self.calm {
            return Vec2::ZERO;
        }
        let phase = body.id.index as f32 * 2.4;
        Vec2::new(0.0, 0.28 * (self.time * 3.2 + phase).sin())
    }

    /// Advances a body's spring and returns its squash; positive values mean flatter.
    fn squash(&mut self, body: &FrameBody) -> f32 {
        let index = body.id.index as usize;
        if index >= SPRINGS_MAX {
            return 0.0;
        }
        if index >= self.springs.len() {
            self.springs.resize(index + 1, None);
        }
        let slot = &mut self.springs[index];
        let mut spring = match *slot {
            Some(old) if old.id == body.id && old.seen_frame == self.frame.wrapping_sub(1) => {
                old.spring
            }
            _ => SquashSpring::at_rest(body.velocity),
        };
        spring.advance(body.velocity, self.step_s);
        *slot = Some(SprungBody { id: body.id, seen_frame: self.frame, spring });
        spring.squash
    }
}

impl SquashSpring {
    /// The spring of a body that has been moving at this velocity for a long time.
    pub fn at_rest(velocity: Vec2) -> SquashSpring {
        SquashSpring { velocity, squash: 0.0, rate: 0.0 }
    }

    /// Advances the spring by this many seconds at this velocity.
    pub fn advance(&mut self, velocity: Vec2, step_s: f32) {
        let change = (velocity - self.velocity).abs();
        self.velocity = velocity;
        if change.x.max(change.y) > KICK_MIN {
            // An impact along y flattens the body, one along x narrows it.
            self.rate += (change.y - change.x).clamp(-60.0, 60.0) * 0.11;
        }
        let stretch = (velocity.x.abs() - velocity.y.abs()).clamp(-60.0, 60.0) * 0.0008;
        // Small steps keep the stiff spring stable at any frame rate.
        let steps = (step_s / 0.004).ceil().max(1.0);
        let dt = step_s / steps;
        for _ in 0..steps as u32 {
            let force = (stretch - self.squash) * STIFFNESS - self.rate * DAMPING;
            self.rate += force * dt;
            self.squash = (self.squash + self.rate * dt).clamp(-SQUASH_MAX, SQUASH_MAX);
        }
    }
}

/// The scale of a body that has just appeared, which overshoots the full size and then returns to it.
fn pop(age: f32) -> f32 {
    if age >= POP_S {
        return 1.0;
    }
    let left = 1.0 - (age / POP_S).max(0.0);
    1.0 - left * left * left * 2.2 + left * left * 1.2
}
