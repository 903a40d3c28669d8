//! Small reference integrators for bodies without contacts: textbook schemes that the World does not offer. They serve
//! as reference points and are not part of Jostle.

use crate::engine::{Engine, State};
use crate::scene::{Body, Drag, Hook, Scene};
use glam::DVec2;

/// A scheme for x'' = a(x, x').
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// x += h v, then v += h a: order 1; gains energy.
    ExplicitEuler,
    /// v += h a, then x += h v: order 1; keeps energy bounded. This is the scheme that the World uses.
    SymplecticEuler,
    /// Half a kick, a drift and another half kick (velocity Verlet), with kicks by the midpoint rule: order 2.
    KickDriftKick,
}

/// Precision of the state that is kept between steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// f32, as in game engines; shows their rounding floor.
    Single,
    /// f64; shows only the error of the scheme.
    Double,
}

/// Bodies in free flight.
pub struct FreeFlight {
    scheme: Scheme,
    precision: Precision,
    steps: u32,
    step_s: f64,
    scene: Scene,
    states: Vec<State>,
    body_steps: u64,
}

impl FreeFlight {
    /// Creates the scene's bodies; rejects scenes in which they can touch.
    pub fn new(
        scene: &Scene,
        scheme: Scheme,
        precision: Precision,
        steps: u32,
    ) -> Result<FreeFlight, String> {
        let still = scene.dynamic().count() < scene.bodies.len();
        if still {
            return Err("the reference integrators know no contacts".into());
        }
        let mut flight = FreeFlight {
            scheme,
            precision,
            steps,
            step_s: scene.tick_s / f64::from(steps),
            scene: scene.clone(),
            states: Vec::new(),
            body_steps: 0,
        };
        for body in &scene.bodies {
            flight.add(body);
        }
        Ok(flight)
    }

    /// Accelerations of all bodies.
    fn accelerations(&self, states: &[State]) -> Vec<DVec2> {
        let falls = |state: &State| {
            let through_air = state.velocity - self.scene.wind;
            let slowed = match self.scene.drag {
                Drag::None => DVec2::ZERO,
                Drag::Linear(rate) => through_air * -rate,
                Drag::Quadratic(rate) => through_air * (-rate * through_air.length()),
            };
            self.scene.gravity + slowed
        };
        let mut found: Vec<DVec2> = states.iter().map(falls).collect();
        for spring in &self.scene.springs {
            let force = spring.force(states[spring.body], spring.far(states));
            found[spring.body] += force / self.scene.bodies[spring.body].mass;
            if let Hook::Body(other) = spring.to {
                found[other] -= force / self.scene.bodies[other].mass;
            }
        }
        found
    }

    /// Integrates v' = a(x, v) at fixed positions by the midpoint rule.
    fn kick(&self, states: &[State], time_s: f64) -> Vec<State> {
        let half = pushed(states, &self.accelerations(states), time_s / 2.0);
        pushed(states, &self.accelerations(&half), time_s)
    }

    fn step(&self, states: &[State]) -> Vec<State> {
        let h = self.step_s;
        match self.scheme {
            Scheme::ExplicitEuler => {
                let pushed = pushed(states, &self.accelerations(states), h);
                let moved = |(state, next): (&State, State)| State {
                    position: state.position + state.velocity * h,
                    ..next
                };
                states.iter().zip(pushed).map(moved).collect()
            }
            Scheme::SymplecticEuler => drifted(&pushed(states, &self.accelerations(states), h), h),
            Scheme::KickDriftKick => self.kick(&drifted(&self.kick(states, h / 2.0), h), h / 2.0),
        }
    }

    fn rounded(&self, state: State) -> State {
        match self.precision {
            Precision::Double => state,
            Precision::Single => State {
                position: state.position.as_vec2().as_dvec2(),
                velocity: state.velocity.as_vec2().as_dvec2(),
            },
        }
    }
}

/// The states after constant accelerations for the given time.
fn pushed(states: &[State], accelerations: &[DVec2], time_s: f64) -> Vec<State> {
    let push = |(state, acceleration): (&State, &DVec2)| State {
        velocity: state.velocity + *acceleration * time_s,
        ..*state
    };
    states.iter().zip(accelerations).map(push).collect()
}

/// The states after drifting for the given time.
fn drifted(states: &[State], time_s: f64) -> Vec<State> {
    let drift =
        |state: &State| State { position: state.position + state.velocity * time_s, ..*state };
    states.iter().map(drift).collect()
}

impl Engine for FreeFlight {
    fn add(&mut self, body: &Body) -> usize {
        let state = State { position: body.position, velocity: body.velocity };
        self.states.push(self.rounded(state));
        self.states.len() - 1
    }

    fn tick(&mut self) {
        for _ in 0..self.steps {
            let next = self.step(&self.states);
            self.states = next.into_iter().map(|state| self.rounded(state)).collect();
            self.body_steps += self.states.len() as u64;
        }
    }

    fn state(&self, body: usize) -> State {
        self.states[body]
    }

    fn set_velocity(&mut self, body: usize, velocity: DVec2) {
        self.states[body].velocity = velocity;
    }

    fn remove(&mut self, _: usize) {}

    fn pair_solves(&self) -> Option<u64> {
        Some(0)
    }

    fn body_steps(&self) -> u64 {
        self.body_steps
    }
}
