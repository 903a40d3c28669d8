//! Features that the peers lack: quadratic drag, wind, and springs of length 0, as forces that
//! their user applies before every step; and a rule for which springs are better as their own
//! joints.

use glam::DVec2;
use jostle_report::engine::State;
use jostle_report::scene::{Drag, Hook, Motion, Scene, Spring};

/// Forces applied by the user, and whether any of them change within a tick.
pub struct Forces {
    scene: Scene,
    springs: Vec<Spring>,
    /// Factor on the constant force of the wind.
    wind: f64,
}

/// A spring that turns by more than this in a step, in radians, blows up as a user's force, which
/// is explicit; as a joint it only loses energy.
const EXPLICIT_MAX: f64 = 1.0;

impl Forces {
    /// The forces of a scene that are best applied by hand, `steps` times per tick.
    pub fn new(scene: &Scene, steps: usize) -> Forces {
        let by_hand = |spring: &&Spring| !is_joint(scene, spring, steps);
        let springs = scene.springs.iter().filter(by_hand).copied().collect();
        Forces { scene: scene.clone(), springs, wind: 1.0 }
    }

    /// For an engine that damps before it pushes, v = v / (1 + k h) + h f: without this factor its
    /// bodies would be blown faster than the wind, by the factor 1 + k h.
    pub fn damped_before(self, steps: usize) -> Forces {
        let Drag::Linear(rate) = self.scene.drag else { return self };
        let wind = 1.0 / (1.0 + rate * self.scene.tick_s / steps as f64);
        Forces { wind, ..self }
    }

    /// Whether they must be computed again in every sub-step; then each sub-step is a step of its
    /// own.
    pub fn change_within_a_tick(&self) -> bool {
        !self.springs.is_empty() || matches!(self.scene.drag, Drag::Quadratic(_))
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        let windy = self.scene.wind != DVec2::ZERO && self.scene.drag != Drag::None;
        !windy && !self.change_within_a_tick()
    }

    /// The force on each body, from the states of all. Linear drag is the engine's own damping, so
    /// that the wind is a constant force.
    pub fn on(&self, states: &[State]) -> Vec<DVec2> {
        let air = |(state, body): (&State, &jostle_report::scene::Body)| match self.scene.drag {
            _ if body.motion != Motion::Dynamic => DVec2::ZERO,
            Drag::None => DVec2::ZERO,
            Drag::Linear(rate) => self.scene.wind * (rate * body.mass * self.wind),
            Drag::Quadratic(rate) => {
                let through_air = state.velocity - self.scene.wind;
                through_air * (-rate * through_air.length() * body.mass)
            }
        };
        let mut forces: Vec<DVec2> = states.iter().zip(&self.scene.bodies).map(air).collect();
        for spring in &self.springs {
            let force = spring.force(states[spring.body], spring.far(states));
            forces[spring.body] += force;
            if let Hook::Body(other) = spring.to {
                forces[other] -= force;
            }
        }
        forces
    }
}

/// Whether a spring is a joint of the engine: springs with a length, for which joints are made, and
/// springs too stiff for anything else.
pub fn is_joint(scene: &Scene, spring: &Spring, steps: usize) -> bool {
    let mass = scene.swinging_mass(spring);
    let step_s = scene.tick_s / steps as f64;
    let turn = (spring.stiffness / mass).sqrt().max(spring.damping / mass);
    spring.length > 0.0 || turn * step_s > EXPLICIT_MAX
}

/// The engine's own linear damping, 1/s.
pub fn damping(scene: &Scene) -> f32 {
    match scene.drag {
        Drag::Linear(rate) => rate as f32,
        Drag::None | Drag::Quadratic(_) => 0.0,
    }
}
