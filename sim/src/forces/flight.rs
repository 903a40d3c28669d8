//! Moves a single body in closed form.
//!
//! Linear drag, wind, and springs of zero length to fixed points amount to a damped oscillator under a constant
//! force, x'' = f - c x' - w² x, which is the same along every axis. Its exact step is a matrix of four numbers,
//! which is computed once per body and kept as long as c, w² and the step do not change.
//!
//! Quadratic drag alone, u' = g - k |u| u: with E = exp(k times the path length), E u = u0 + g J where J' = E and J''
//! = k |u0 + g J|. That norm is replaced by its chord over the step, s + b J, which is exact if u stays parallel to g
//! (a fall with speed vt tanh(g t / vt)) and of third order otherwise. Then J'' = k s + k b J has J and E in closed
//! form, and ln(E) / k is the length of the path. (The substitution is the classical one for ballistics, due to
//! Legendre and Euler.) Combined with other forces, quadratic drag acts in two halves, before and after their exact
//! step (Strang 1968).

use super::air::{Air, Drag, FAST_PHASE, Hold, Move, MoveKind};
use super::obstacles::NearbyObstacle;
use super::springs::{Spring, SpringEnd};
use crate::bodies::Bodies;
use crate::math::{exp, exp_m1, ln_1p, sin_cos};
use glam::DVec2;

/// Largest share of its speed that a body may lose to drag in a step for the smooth path formula to be used.
const SMOOTH: f64 = 0.5;

/// Square of the growth rate times the step beyond which the terminal speed is taken to be reached immediately, since
/// the exponential would overflow.
const GROWN: f64 = 1e4;

/// Number of rounds over a body's obstacles. In a corner, one may push it into another.
const HOLD_ROUNDS: u32 = 4;

/// A body that no spring joins to another body.
#[derive(Clone, Debug)]
pub(super) struct Flight {
    slot: u32,
    drag: Drag,
    /// Sums over its springs of the stiffness, the damping, and the stiffness times the position.
    stiffness: f64,
    damping: f64,
    pull: DVec2,
    step: FlightStep,
}

impl Flight {
    pub fn slot(&self) -> u32 {
        self.slot
    }

    /// Creates the flight of a body from all springs of the world.
    pub fn new(slot: u32, drag: Drag, springs: &[Spring]) -> Flight {
        let mut flight = Flight {
            slot,
            drag,
            stiffness: 0.0,
            damping: 0.0,
            pull: DVec2::ZERO,
            step: FlightStep::default(),
        };
        for spring in springs.iter().filter(|spring| spring.body.index == slot) {
            let SpringEnd::Point(point) = spring.end else { continue };
            let stiffness = f64::from(spring.stiffness);
            flight.stiffness += stiffness;
            flight.damping += f64::from(spring.damping);
            flight.pull += point.as_dvec2() * stiffness;
        }
        flight
    }

    /// Computes the move of a step.
    pub fn fly(&mut self, bodies: &Bodies, air: &Air) -> Move {
        let slot = self.slot as usize;
        let (position, velocity) =
            (bodies.center[slot].as_dvec2(), bodies.velocity[slot].as_dvec2());
        let gravity = air.gravity * f64::from(bodies.gravity_scale[slot]);
        let inverse_mass = f64::from(bodies.inverse_mass[slot]);
        let rate = f64::from(self.drag.linear);
        let total = rate + self.damping * inverse_mass;
        let stiffness = self.stiffness * inverse_mass;
        let quadratic = f64::from(self.drag.quadratic);
        if quadratic > 0.0 && total == 0.0 && stiffness == 0.0 {
            let (through_air, path) = fall(velocity - air.wind, gravity, quadratic, air.dt);
            return air.limited_move(self.slot, through_air + air.wind, path + air.wind * air.dt);
        }
        self.step.renew(total, stiffness, air.dt);
        let force = gravity + air.wind * rate + self.pull * inverse_mass;
        let slowed = slow_down(velocity, air.wind, quadratic, air.dt / 2.0);
        let (path, velocity) = self.step.take(position, slowed, force);
        let slowed = slow_down(velocity, air.wind, quadratic, air.dt / 2.0);
        let found = air.limited_move(self.slot, slowed, path);
        if stiffness.sqrt() * air.dt <= FAST_PHASE {
            return found;
        }
        let implicit = self.implicit_velocity(bodies, air).0 * air.dt;
        let implicit = air.limited_move(self.slot, slowed, implicit).path;
        Move { kind: MoveKind::Fast { implicit }, ..found }
    }

    /// Does the same in the presence of obstacles, with an implicit step.
    pub fn hold(&self, bodies: &Bodies, obstacles: &[NearbyObstacle], air: &Air) -> Move {
        let (free, resistance) = self.implicit_velocity(bodies, air);
        let mut velocity = free;
        for _ in 0..HOLD_ROUNDS {
            for obstacle in obstacles {
                let short = obstacle.speed_min - obstacle.normal.dot(velocity);
                if short > 0.0 {
                    velocity += obstacle.normal * short;
                }
            }
        }
        let found = air.limited_move(self.slot, velocity, velocity * air.dt);
        let velocity = air.limited_move(self.slot, free, DVec2::ZERO).velocity;
        let inverse_mass = f64::from(bodies.inverse_mass[self.slot as usize]) / resistance;
        let hold = Hold { velocity, inverse_mass: inverse_mass as f32 };
        Move { kind: MoveKind::Held(hold), ..found }
    }

    /// Velocity at the end of an implicit Euler step, and the factor by which springs and drag raise the mass in it.
    fn implicit_velocity(&self, bodies: &Bodies, air: &Air) -> (DVec2, f64) {
        let slot = self.slot as usize;
        let (position, velocity) =
            (bodies.center[slot].as_dvec2(), bodies.velocity[slot].as_dvec2());
        let gravity = air.gravity * f64::from(bodies.gravity_scale[slot]);
        let inverse_mass = f64::from(bodies.inverse_mass[slot]);
        let Drag { linear, quadratic } = self.drag;
        let rate = f64::from(linear) + f64::from(quadratic) * (velocity - air.wind).length();
        let pull = (self.pull - position * self.stiffness) * inverse_mass;
        let force = gravity + air.wind * rate + pull;
        let springs = (self.damping + self.stiffness * air.dt) * inverse_mass;
        let resistance = 1.0 + (rate + springs) * air.dt;
        ((velocity + force * air.dt) / resistance, resistance)
    }
}

/// Quadratic drag alone: u' = -k |u| u is solved by u / (1 + k |u| t).
fn slow_down(velocity: DVec2, wind: DVec2, rate: f64, time: f64) -> DVec2 {
    if rate == 0.0 {
        return velocity;
    }
    let through_air = velocity - wind;
    wind + through_air / (1.0 + rate * through_air.length() * time)
}

/// Velocity through the air and path after `time`, under quadratic drag and gravity.
pub(super) fn fall(start: DVec2, gravity: DVec2, rate: f64, time: f64) -> (DVec2, DVec2) {
    let first = start.length();
    let last = (start + gravity * time).length();
    let middle = (start + gravity * (time / 2.0)).length();
    // The chord, shifted so that the mean of the norm is right (Simpson).
    let speed = first + (2.0 * middle - first - last) / 3.0;
    let shed = rate * speed * time;
    let mut slope = (last - first) / time;
    // Where drag dominates, a braking body slows down long before the chord would indicate.
    if slope < 0.0 && shed > SMOOTH {
        slope = 0.0;
    }
    let y = rate * slope * time * time;
    if y > GROWN {
        let terminal = gravity * (1.0 / (rate * gravity.length())).sqrt();
        return (terminal, terminal * time);
    }
    let (c, s, v) = stumpff(y);
    let growth = c + shed * s;
    let sum = time * (s + shed * v);
    let velocity = (start + gravity * sum) / growth;
    (velocity, path(start, velocity, gravity, rate, time, growth))
}

/// Path by Hermite's fourth-order formula, from both ends and both slopes, if the step is smooth;
/// otherwise the exact length along the mean direction.
fn path(start: DVec2, end: DVec2, gravity: DVec2, rate: f64, time: f64, growth: f64) -> DVec2 {
    let bend = |velocity: DVec2| gravity - velocity * (rate * velocity.length());
    let mean = (start + end) * (time / 2.0);
    if rate * (start.length() + end.length()) * time <= SMOOTH {
        return mean + (bend(start) - bend(end)) * (time * time / 12.0);
    }
    mean.normalize_or_zero() * (ln_1p(growth - 1.0) / rate)
}

/// Stumpff's functions cosh(z), sinh(z)/z and (cosh(z) - 1)/z² of y = z², also for negative y.
fn stumpff(y: f64) -> (f64, f64, f64) {
    if y * y <= 1.0 {
        // The terms 1/(2n)! and 1/(2n+1)!, nested. The next one is below 1e-17.
        let v = 0.5
            * (1.0
                + y / 12.0
                    * (1.0
                        + y / 30.0
                            * (1.0
                                + y / 56.0
                                    * (1.0
                                        + y / 90.0
                                            * (1.0
                                                + y / 132.0
                                                    * (1.0 + y / 182.0 * (1.0 + y / 240.0)))))));
        let s = 1.0
            + y / 6.0
                * (1.0
                    + y / 20.0
                        * (1.0
                            + y / 42.0
                                * (1.0
                                    + y / 72.0
                                        * (1.0
                                            + y / 110.0 * (1.0 + y / 156.0 * (1.0 + y / 210.0))))));
        return (1.0 + y * v, s, v);
    }
    if y > 0.0 {
        let z = y.sqrt();
        let (up, down) = (exp(z), exp(-z));
        let c = (up + down) / 2.0;
        return (c, (up - down) / (2.0 * z), (c - 1.0) / (z * z));
    }
    let z = (-y).sqrt();
    let (sin, cos) = sin_cos(z);
    (cos, sin / z, (cos - 1.0) / y)
}

/// The exact step of x'' = f - c x' - w² x.
#[derive(Clone, Copy, Debug, Default)]
struct FlightStep {
    /// c, w² and the time in seconds for which the other fields were computed; the time is 0 if they were not.
    of: (f64, f64, f64),
    /// Path and change in velocity, per unit of distance from the point where the force vanishes ...
    path_of_position: f64,
    change_of_position: f64,
    /// ... and per unit of velocity.
    path_of_speed: f64,
    change_of_speed: f64,
    /// Path per unit of force, without a spring.
    path_of_force: f64,
}

impl FlightStep {
    fn renew(&mut self, rate: f64, stiffness: f64, time: f64) {
        if self.of == (rate, stiffness, time) {
            return;
        }
        *self = if stiffness > 0.0 {
            FlightStep::oscillator(rate, stiffness, time)
        } else {
            FlightStep::free(rate, time)
        };
        self.of = (rate, stiffness, time);
    }

    /// The step without a spring, in which velocities tend to f / c.
    fn free(rate: f64, time: f64) -> FlightStep {
        let change_of_speed = exp_m1(-rate * time);
        let small = rate * time < 1e-4;
        let path_of_speed = if small {
            time * (1.0 - rate * time / 2.0 * (1.0 - rate * time / 3.0))
        } else {
            -change_of_speed / rate
        };
        let path_of_force = if small {
            time * time / 2.0 * (1.0 - rate * time / 3.0 * (1.0 - rate * time / 4.0))
        } else {
            (time - path_of_speed) / rate
        };
        FlightStep { path_of_speed, change_of_speed, path_of_force, ..FlightStep::default() }
    }

    fn oscillator(rate: f64, stiffness: f64, time: f64) -> FlightStep {
        let half = rate / 2.0;
        let spread = half * half - stiffness;
        let (a, b, d) = if spread * time * time > 1.0 {
            // There are two decays, of which the slow one is computed without cancellation.
            let root = spread.sqrt();
            let (slow, fast) = (-stiffness / (half + root), -(half + root));
            let (late, early) = (exp(slow * time), exp(fast * time));
            let width = slow - fast;
            (
                (slow * early - fast * late) / width,
                (late - early) / width,
                (slow * late - fast * early) / width,
            )
        } else {
            let (c, s, _) = stumpff(spread * time * time);
            let (decay, s) = (exp(-half * time), s * time);
            (decay * (c + half * s), decay * s, decay * (c - half * s))
        };
        FlightStep {
            path_of_position: a - 1.0,
            path_of_speed: b,
            change_of_position: -stiffness * b,
            change_of_speed: d - 1.0,
            ..FlightStep::default()
        }
    }

    /// Path and velocity at the end.
    fn take(&self, position: DVec2, velocity: DVec2, force: DVec2) -> (DVec2, DVec2) {
        let stiffness = self.of.1;
        let (path, change) = if stiffness > 0.0 {
            let from_rest = position - force / stiffness;
            (from_rest * self.path_of_position, from_rest * self.change_of_position)
        } else {
            (force * self.path_of_force, force * self.path_of_speed)
        };
        let path = path + velocity * self.path_of_speed;
        (path, velocity + velocity * self.change_of_speed + change)
    }
}
