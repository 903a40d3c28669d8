//! Features that the peers lack: quadratic drag, wind, and springs of length 0, applied as external forces before every
//! step. Also decides which springs are better modelled by the engine's own joints.

use glam::DVec2;
use jostle_report::engine::State;
use jostle_report::scene::{Drag, Hook, Motion, Scene, Spring};

/// External forces on the bodies of a scene.
pub struct Forces {
    scene: Scene,
    springs: Vec<Spring>,
    /// Factor applied to the constant force of the wind.
    wind: f64,
}

/// A spring whose phase advances by more than this per step, in radians, blows up as an external force, which is
/// integrated explicitly; as a joint it only loses energy.
const EXPLICIT_MAX: f64 = 1.0;

impl Forces {
    /// The scene's forces that are best applied externally, `steps` times per tick.
    pub fn new(scene: &Scene, steps: usize) -> Forces {
        let by_hand = |spring: &&Spring| !is_joint(scene, spring, steps);
        let springs = scene.springs.iter().filter(by_hand).copied().collect();
        Forces { scene: scene.clone(), springs, wind: 1.0 }
    }

    /// Adapts the wind to an engine that applies damping before forces, v = v / (1 + k h) + h f. Without this, bodies
    /// would move too fast in wind, by a factor of 1 + k h.
    pub fn damped_before(self, steps: usize) -> Forces {
        let Drag::Linear(rate) = self.scene.drag else { return self };
        let wind = 1.0 / (1.0 + rate * self.scene.tick_s / steps as f64);
        Forces { wind, ..self }
    }

    /// Whether the forces must be recomputed in every sub-step. Each sub-step is then a separate step of the engine.
    pub fn change_within_a_tick(&self) -> bool {
        !self.springs.is_empty() || matches!(self.scene.drag, Drag::Quadratic(_))
    }

    /// Whether there are no forces.
    pub fn is_empty(&self) -> bool {
        let windy = self.scene.wind != DVec2::ZERO && self.scene.drag != Drag::None;
        !windy && !self.change_within_a_tick()
    }

    /// The force on each body, given the states of all bodies. Linear drag is left to the engine's own damping, which
    /// makes the wind a constant force.
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

/// Whether a spring is modelled by a joint of the engine: true for springs with a rest length, which joints are made
/// for, and for those too stiff to be simulated in any other way.
pub fn is_joint(scene: &Scene, spring: &Spring, steps: usize) -> bool {
    let mass = scene.swinging_mass(spring);
    let step_s = scene.tick_s / steps as f64;
    let turn = (spring.stiffness / mass).sqrt().max(spring.damping / mass);
    spring.length > 0.0 || turn * step_s > EXPLICIT_MAX
}

/// Returns the engine's own linear damping in 1/s.
pub fn damping(scene: &Scene) -> f32 {
    match scene.drag {
        Drag::Linear(rate) => rate as f32,
        Drag::None | Drag::Quadratic(_) => 0.0,
    }
}
