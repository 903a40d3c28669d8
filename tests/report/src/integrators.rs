//! Small reference integrators for one body without contacts: what the textbooks' schemes do where
//! the World cannot be switched. They are yardsticks, no part of Jostle.

use crate::engine::{Engine, State};
use crate::scene::{Body, Drag, Scene};
use glam::DVec2;

/// A scheme for x'' = a(x, x').
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// x += h v, then v += h a: order 1, gains energy.
    ExplicitEuler,
    /// v += h a, then x += h v: order 1, keeps energy bounded; what the World does.
    SymplecticEuler,
    /// Half a kick, a drift, half a kick (velocity Verlet), each kick by the midpoint rule: order 2.
    KickDriftKick,
}

/// The bits in which the state is kept between steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// f32, as engines do: shows their rounding floor.
    Single,
    /// f64: shows the scheme alone.
    Double,
}

/// Bodies in free flight.
pub struct FreeFlight {
    scheme: Scheme,
    precision: Precision,
    steps: u32,
    step_s: f64,
    gravity: DVec2,
    drag: Drag,
    spring: f64,
    states: Vec<State>,
    body_steps: u64,
}

impl FreeFlight {
    /// The scene's bodies; refuses scenes in which they can touch.
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
            gravity: scene.gravity,
            drag: scene.drag,
            spring: scene.spring,
            states: Vec::new(),
            body_steps: 0,
        };
        for body in &scene.bodies {
            flight.add(body);
        }
        Ok(flight)
    }

    fn acceleration(&self, state: State) -> DVec2 {
        let slowed = match self.drag {
            Drag::None => DVec2::ZERO,
            Drag::Linear(rate) => state.velocity * -rate,
            Drag::Quadratic(rate) => state.velocity * (-rate * state.velocity.length()),
        };
        self.gravity + slowed - state.position * self.spring
    }

    /// v' = a(x, v) at a fixed place, by the midpoint rule.
    fn kick(&self, state: State, time_s: f64) -> State {
        let half = state.velocity + self.acceleration(state) * (time_s / 2.0);
        let slope = self.acceleration(State { velocity: half, ..state });
        State { velocity: state.velocity + slope * time_s, ..state }
    }

    fn step(&self, state: State) -> State {
        let h = self.step_s;
        let State { position, velocity } = state;
        match self.scheme {
            Scheme::ExplicitEuler => State {
                position: position + velocity * h,
                velocity: velocity + self.acceleration(state) * h,
            },
            Scheme::SymplecticEuler => {
                let velocity = velocity + self.acceleration(state) * h;
                State { position: position + velocity * h, velocity }
            }
            Scheme::KickDriftKick => {
                let kicked = self.kick(state, h / 2.0);
                let moved = State { position: position + kicked.velocity * h, ..kicked };
                self.kick(moved, h / 2.0)
            }
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

impl Engine for FreeFlight {
    fn add(&mut self, body: &Body) -> usize {
        let state = State { position: body.position, velocity: body.velocity };
        self.states.push(self.rounded(state));
        self.states.len() - 1
    }

    fn tick(&mut self) {
        for _ in 0..self.steps {
            for body in 0..self.states.len() {
                self.states[body] = self.rounded(self.step(self.states[body]));
            }
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
