//! How bodies squash and stretch: a damped spring a body, kicked by sudden changes of velocity.
//! Drawn only; nothing of it reaches the simulation.

use crate::view::frame::FrameBody;
use jostle_game::Kind;
use jostle_sim::{BodyId, Vec2};

/// Indices past this are drawn without a spring.
const SPRINGS_MAX: usize = 65_536;
/// Stiffness in 1/s^2 (about 7 Hz) and damping in 1/s.
const STIFFNESS: f32 = 2000.0;
const DAMPING: f32 = 16.0;
/// Largest share by which a body gets flatter or taller.
const SQUASH_MAX: f32 = 0.16;
/// Changes of velocity below this between two frames are ordinary acceleration, units/s.
const KICK_MIN: f32 = 4.0;
/// Seconds in which a new body pops up.
const POP_S: f32 = 0.18;

#[derive(Clone, Copy)]
struct SprungBody {
    id: BodyId,
    seen_frame: u32,
    spring: SquashSpring,
}

/// How flat a body is, and how fast that changes.
#[derive(Clone, Copy, Debug)]
pub struct SquashSpring {
    velocity: Vec2,
    /// By what share the body is flatter.
    pub squash: f32,
    rate: f32,
}

/// A body as it is to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre, world units.
    pub center: Vec2,
    /// Half extent, world units.
    pub half: Vec2,
}

/// Springs of all bodies, by index.
#[derive(Default)]
pub struct BodySprings {
    springs: Vec<Option<SprungBody>>,
    time: f32,
    step_s: f32,
    frame: u32,
    calm: bool,
}

impl BodySprings {
    /// Starts a frame at a time in seconds.
    pub fn begin(&mut self, time: f32, calm: bool) {
        self.step_s = (time - self.time).clamp(0.0, 0.05);
        self.time = time;
        self.calm = calm;
        self.frame = self.frame.wrapping_add(1);
    }

    /// How to draw `body` in this frame.
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
        // Flatter means wider; the lower edge keeps its place, so that feet stay on the floor.
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

    /// Advances the spring of a body; positive is flatter.
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
    /// Of a body that has moved like this for long.
    pub fn at_rest(velocity: Vec2) -> SquashSpring {
        SquashSpring { velocity, squash: 0.0, rate: 0.0 }
    }

    /// Advances by this many seconds with a velocity.
    pub fn advance(&mut self, velocity: Vec2, step_s: f32) {
        let change = (velocity - self.velocity).abs();
        self.velocity = velocity;
        if change.x.max(change.y) > KICK_MIN {
            // A blow along y flattens, one along x narrows.
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

/// Size of a body that has just appeared: past its full size, then back to it.
fn pop(age: f32) -> f32 {
    if age >= POP_S {
        return 1.0;
    }
    let left = 1.0 - (age / POP_S).max(0.0);
    1.0 - left * left * left * 2.2 + left * left * 1.2
}
