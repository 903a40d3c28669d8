//! Bodies under gravity, drag and springs, without contacts, integrated in f64 by the classical fourth-order
//! Runge-Kutta method, with steps so small that halving them changes no result.

use crate::engine::State;
use crate::scene::{Drag, Hook, Scene};
use glam::DVec2;

/// The states at the start and after each tick, with `steps` steps per tick.
pub fn flight(scene: &Scene, ticks: usize, steps: u32) -> Vec<Vec<State>> {
    let start = scene.bodies.iter();
    let start = start.map(|body| State { position: body.position, velocity: body.velocity });
    let mut all: Vec<Vec<State>> = vec![start.collect()];
    let step_s = scene.tick_s / f64::from(steps);
    for tick in 0..ticks {
        let mut states = all[tick].clone();
        for _ in 0..steps {
            states = step(scene, &states, step_s);
        }
        all.push(states);
    }
    all
}

fn step(scene: &Scene, at: &[State], h: f64) -> Vec<State> {
    let a = slopes(scene, at);
    let b = slopes(scene, &along(at, &a, h / 2.0));
    let c = slopes(scene, &along(at, &b, h / 2.0));
    let d = slopes(scene, &along(at, &c, h));
    let mean = |i: usize| State {
        position: (a[i].position + d[i].position) / 6.0 + (b[i].position + c[i].position) / 3.0,
        velocity: (a[i].velocity + d[i].velocity) / 6.0 + (b[i].velocity + c[i].velocity) / 3.0,
    };
    let slopes: Vec<State> = (0..at.len()).map(mean).collect();
    along(at, &slopes, h)
}

fn along(at: &[State], slopes: &[State], h: f64) -> Vec<State> {
    let moved = |(state, slope): (&State, &State)| State {
        position: state.position + slope.position * h,
        velocity: state.velocity + slope.velocity * h,
    };
    at.iter().zip(slopes).map(moved).collect()
}

fn slopes(scene: &Scene, states: &[State]) -> Vec<State> {
    let free = |state: &State| {
        let air = state.velocity - scene.wind;
        let slowed = match scene.drag {
            Drag::None => DVec2::ZERO,
            Drag::Linear(rate) => air * rate,
            Drag::Quadratic(rate) => air * (rate * air.length()),
        };
        State { position: state.velocity, velocity: scene.gravity - slowed }
    };
    let mut found: Vec<State> = states.iter().map(free).collect();
    for spring in &scene.springs {
        let force = spring.force(states[spring.body], spring.far(states));
        found[spring.body].velocity += force / scene.bodies[spring.body].mass;
        if let Hook::Body(other) = spring.to {
            found[other].velocity -= force / scene.bodies[other].mass;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::flight;
    use crate::reference::closed;
    use crate::scene::{Body, Drag, Hook, Scene, Shape, Spring};
    use glam::DVec2;

    #[test]
    fn it_agrees_with_closed_forms() {
        let mut scene = Scene { drag: Drag::Quadratic(0.05), ..Scene::new(50.0) };
        scene.add(Body::new(Shape::Circle { radius: 1.0 }, 0.0, 0.0));
        let (way, speed) = closed::quadratic_fall(50.0, 0.05, 1.0);
        let last = flight(&scene, 60, 16)[60][0];
        assert!((last.position.y + way).abs() < 1e-9 && (last.velocity.y + speed).abs() < 1e-9);

        let mut scene = Scene::new(50.0);
        let body = scene.add(Body::new(Shape::Circle { radius: 1.0 }, 1.0, 0.0).of_mass(2.0));
        let to = Hook::Point(DVec2::ZERO);
        scene.springs.push(Spring { body, to, length: 0.0, stiffness: 80.0, damping: 4.0 });
        let start = scene.bodies[0].position;
        let exact = closed::damped(start, DVec2::ZERO, scene.gravity, 40.0, 2.0, 1.0);
        let last = flight(&scene, 60, 16)[60][0];
        assert!(last.position.distance(exact.0) < 1e-8 && last.velocity.distance(exact.1) < 1e-7);
    }
}
