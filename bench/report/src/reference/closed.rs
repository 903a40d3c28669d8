//! Closed-form solutions: flight with and without drag, bouncing, sliding, and collisions of two bodies.

use glam::DVec2;

/// Position in flight without drag after `t` seconds.
pub fn flight(start: DVec2, velocity: DVec2, gravity: DVec2, t: f64) -> DVec2 {
    start + velocity * t + gravity * (t * t / 2.0)
}

/// Position and velocity in flight with drag -k v.
pub fn linear_drag(
    start: DVec2,
    velocity: DVec2,
    gravity: DVec2,
    rate: f64,
    t: f64,
) -> (DVec2, DVec2) {
    let terminal = gravity / rate;
    let left = (-rate * t).exp();
    let way = terminal * t + (velocity - terminal) * ((1.0 - left) / rate);
    (start + way, terminal + (velocity - terminal) * left)
}

/// Distance and speed of a fall from rest with drag -k |v| v.
pub fn quadratic_fall(gravity: f64, rate: f64, t: f64) -> (f64, f64) {
    let terminal = (gravity / rate).sqrt();
    let reach = gravity * t / terminal;
    (terminal * terminal / gravity * reach.cosh().ln(), terminal * reach.tanh())
}

/// Position and velocity of a damped oscillation x'' = g - c x' - w² x with less than critical damping.
pub fn damped(
    start: DVec2,
    velocity: DVec2,
    gravity: DVec2,
    stiffness: f64,
    rate: f64,
    t: f64,
) -> (DVec2, DVec2) {
    let rest = gravity / stiffness;
    let turn = (stiffness - rate * rate / 4.0).sqrt();
    let (sin, cos) = (turn * t).sin_cos();
    let decay = (-rate * t / 2.0).exp();
    let (even, odd) = (start - rest, (velocity + (start - rest) * (rate / 2.0)) / turn);
    let position = (even * cos + odd * sin) * decay;
    let speed = (odd * cos - even * sin) * (turn * decay) - position * (rate / 2.0);
    (rest + position, speed)
}

/// Height above the floor of a ball that is dropped from `height` and keeps `restitution` of its speed at each bounce.
/// It comes to rest after infinitely many bounces.
pub fn bounce(height: f64, gravity: f64, restitution: f64, t: f64) -> f64 {
    let mut since = t - (2.0 * height / gravity).sqrt();
    if since < 0.0 {
        return height - gravity * t * t / 2.0;
    }
    let mut speed = restitution * (2.0 * gravity * height).sqrt();
    while speed > 1e-9 {
        let flight = 2.0 * speed / gravity;
        if since <= flight {
            return speed * since - gravity * since * since / 2.0;
        }
        since -= flight;
        speed *= restitution;
    }
    0.0
}

/// Distance covered by a body that slides with constant deceleration until it stops.
pub fn slide(speed: f64, deceleration: f64, t: f64) -> f64 {
    let stop = speed / deceleration;
    let t = if t < stop { t } else { stop };
    speed * t - deceleration * t * t / 2.0
}

/// Velocities of two bodies after a collision along `normal`, from a to b, with restitution and
/// Coulomb friction; nothing rotates.
pub fn collision(
    masses: [f64; 2],
    velocities: [DVec2; 2],
    normal: DVec2,
    restitution: f64,
    friction: f64,
) -> [DVec2; 2] {
    let effective = 1.0 / (1.0 / masses[0] + 1.0 / masses[1]);
    let relative = velocities[1] - velocities[0];
    let (closing, along) = (-relative.dot(normal), normal.perp());
    if closing <= 0.0 {
        return velocities;
    }
    let push = (1.0 + restitution) * closing * effective;
    let hold = -relative.dot(along) * effective;
    let limit = friction * push;
    let impulse = normal * push + along * hold.clamp(-limit, limit);
    [velocities[0] - impulse / masses[0], velocities[1] + impulse / masses[1]]
}

#[cfg(test)]
mod tests;
