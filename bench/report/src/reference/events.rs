//! Elastic discs between hard walls, advanced from collision to collision in f64: exact up to rounding, without time
//! steps. Every event examines all pairs, which is slow but simple.

use crate::engine::State;
use glam::DVec2;

#[derive(Clone, Copy, Debug)]
pub struct Disc {
    pub radius: f64,
    pub mass: f64,
    pub state: State,
}

/// Discs in the box (0, 0)-(size); all collisions are elastic and without friction.
#[derive(Clone, Debug)]
pub struct Gas {
    /// Inner width and height of the box.
    pub size: DVec2,
    /// The discs, which do not overlap.
    pub discs: Vec<Disc>,
}

#[derive(Clone, Copy)]
enum Event {
    Pair(usize, usize),
    /// A disc bounces off a wall along the x (0) or y (1) axis.
    Wall(usize, usize),
}

impl Gas {
    /// Advances everything and returns the number of collisions.
    pub fn advance(&mut self, time_s: f64) -> u32 {
        let (mut left, mut collisions) = (time_s, 0);
        loop {
            let Some((wait, event)) = self.next().filter(|(wait, _)| *wait <= left) else {
                self.drift(left);
                return collisions;
            };
            self.drift(wait);
            self.collide(event);
            left -= wait;
            collisions += 1;
        }
    }

    fn drift(&mut self, time_s: f64) {
        for disc in &mut self.discs {
            disc.state.position += disc.state.velocity * time_s;
        }
    }

    fn next(&self) -> Option<(f64, Event)> {
        let mut first: Option<(f64, Event)> = None;
        let mut offer = |wait: f64, event: Event| {
            if first.is_none_or(|(best, _)| wait < best) {
                first = Some((wait, event));
            }
        };
        for (index, disc) in self.discs.iter().enumerate() {
            for axis in 0..2 {
                if let Some(wait) = self.wall_after(disc, axis) {
                    offer(wait, Event::Wall(index, axis));
                }
            }
            for (other, twin) in self.discs.iter().enumerate().skip(index + 1) {
                if let Some(wait) = meeting_after(disc, twin) {
                    offer(wait, Event::Pair(index, other));
                }
            }
        }
        first
    }

    fn wall_after(&self, disc: &Disc, axis: usize) -> Option<f64> {
        let (position, speed) = (disc.state.position[axis], disc.state.velocity[axis]);
        let room = if speed > 0.0 {
            self.size[axis] - disc.radius - position
        } else {
            disc.radius - position
        };
        (speed != 0.0).then(|| (room / speed).max(0.0))
    }

    fn collide(&mut self, event: Event) {
        match event {
            Event::Wall(index, axis) => {
                self.discs[index].state.velocity[axis] *= -1.0;
            }
            Event::Pair(a, b) => {
                let (one, other) = (self.discs[a], self.discs[b]);
                let normal = (other.state.position - one.state.position).normalize();
                let closing = (one.state.velocity - other.state.velocity).dot(normal);
                let impulse = 2.0 * closing / (1.0 / one.mass + 1.0 / other.mass);
                self.discs[a].state.velocity -= normal * (impulse / one.mass);
                self.discs[b].state.velocity += normal * (impulse / other.mass);
            }
        }
    }

    /// Returns the total kinetic energy, the sum of m v^2 / 2.
    pub fn energy(&self) -> f64 {
        self.discs.iter().map(|disc| disc.mass * disc.state.velocity.length_squared() / 2.0).sum()
    }
}

/// Seconds until two discs touch, if they ever do.
fn meeting_after(one: &Disc, other: &Disc) -> Option<f64> {
    let offset = other.state.position - one.state.position;
    let relative = other.state.velocity - one.state.velocity;
    let approach = offset.dot(relative);
    if approach >= 0.0 {
        return None;
    }
    let reach = one.radius + other.radius;
    let (a, c) = (relative.length_squared(), offset.length_squared() - reach * reach);
    let inside = approach * approach - a * c;
    // The stable root: c / (-b + sqrt(b^2 - a c)) loses no precision if c is small.
    (inside >= 0.0).then(|| (c / (-approach + inside.sqrt())).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::{Disc, Gas};
    use crate::engine::State;
    use crate::scene::Mulberry;
    use glam::DVec2;

    fn gas(count: u32) -> Gas {
        let mut draws = Mulberry(7);
        let discs = (0..count).map(|i| {
            let velocity = DVec2::new(draws.range(-9.0, 9.0), draws.range(-9.0, 9.0));
            let position = DVec2::new(f64::from(i % 4) * 5.0 + 2.5, f64::from(i / 4) * 5.0 + 2.5);
            let radius = draws.range(0.5, 2.0);
            Disc { radius, mass: radius * radius, state: State { position, velocity } }
        });
        Gas { size: DVec2::splat(20.0), discs: discs.collect() }
    }

    #[test]
    fn a_gas_played_backwards_returns_to_its_start() {
        let start = gas(16);
        let mut gas = start.clone();
        let collisions = gas.advance(2.0);
        assert!(collisions > 20, "{collisions} collisions");
        assert!((gas.energy() / start.energy() - 1.0).abs() < 1e-12);
        gas.discs.iter_mut().for_each(|disc| disc.state.velocity *= -1.0);
        assert_eq!(gas.advance(2.0), collisions);
        for (disc, was) in gas.discs.iter().zip(&start.discs) {
            assert!(disc.state.position.distance(was.state.position) < 1e-7);
        }
    }

    #[test]
    fn equal_discs_head_on_swap_velocities() {
        let disc = |x: f64, speed: f64| Disc {
            radius: 1.0,
            mass: 2.0,
            state: State { position: DVec2::new(x, 5.0), velocity: DVec2::new(speed, 0.0) },
        };
        let mut gas =
            Gas { size: DVec2::new(20.0, 10.0), discs: vec![disc(3.0, 4.0), disc(11.0, -2.0)] };
        assert_eq!(gas.advance(1.5), 1);
        // The discs meet after 1 s, at 7 and 9.
        assert!((gas.discs[0].state.position.x - 6.0).abs() < 1e-12);
        assert!((gas.discs[1].state.position.x - 11.0).abs() < 1e-12);
    }
}
