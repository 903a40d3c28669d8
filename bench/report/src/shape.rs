//! Overlaps of shapes in f64, to judge results without trusting any engine's contacts.

use crate::engine::State;
use crate::scene::{Body, Motion, Shape};
use glam::DVec2;

/// Penetration depth of two placed shapes along the shortest way out; 0 or less if they do not overlap.
pub fn overlap(a: Shape, at_a: DVec2, b: Shape, at_b: DVec2) -> f64 {
    let offset = at_b - at_a;
    match (a, b) {
        (Shape::Circle { radius: one }, Shape::Circle { radius: other }) => {
            one + other - offset.length()
        }
        (Shape::Box { half: one }, Shape::Box { half: other }) => {
            (one + other - offset.abs()).min_element()
        }
        (Shape::Box { half }, Shape::Circle { radius })
        | (Shape::Circle { radius }, Shape::Box { half }) => {
            let outside = offset.abs() - half;
            let beyond = outside.max(DVec2::ZERO);
            // Inside the box, use the nearest side; outside it, the nearest point.
            if beyond == DVec2::ZERO {
                radius - outside.max_element()
            } else {
                radius - beyond.length()
            }
        }
    }
}

/// All overlaps between pairs of bodies, at least one of which is dynamic, found by sort and sweep.
pub fn overlaps(bodies: &[Body], states: &[State]) -> Vec<f64> {
    let axis = longer_axis(bodies, states);
    let low = |i: usize| states[i].position[axis] - bodies[i].shape.half_extent()[axis];
    let high = |i: usize| states[i].position[axis] + bodies[i].shape.half_extent()[axis];
    let placed = |i: &usize| states[*i].position.is_finite();
    let mut order: Vec<usize> = (0..bodies.len()).filter(placed).collect();
    order.sort_by(|&a, &b| low(a).total_cmp(&low(b)));
    let mut found = Vec::new();
    for (rank, &a) in order.iter().enumerate() {
        for &b in order[rank + 1..].iter().take_while(|&&b| low(b) < high(a)) {
            let movable = |i: usize| bodies[i].motion == Motion::Dynamic;
            if movable(a) || movable(b) {
                let (one, other) = (bodies[a].shape, bodies[b].shape);
                let depth = overlap(one, states[a].position, other, states[b].position);
                if depth > 0.0 {
                    found.push(depth);
                }
            }
        }
    }
    found
}

/// The deepest overlap; 0 if no bodies overlap.
pub fn deepest_overlap(bodies: &[Body], states: &[State]) -> f64 {
    overlaps(bodies, states).into_iter().fold(0.0, f64::max)
}

/// The axis along which the dynamic bodies are spread out further.
fn longer_axis(bodies: &[Body], states: &[State]) -> usize {
    let mut low = DVec2::INFINITY;
    let mut high = DVec2::NEG_INFINITY;
    for (body, state) in bodies.iter().zip(states) {
        if body.motion == Motion::Dynamic && state.position.is_finite() {
            low = low.min(state.position);
            high = high.max(state.position);
        }
    }
    usize::from((high - low).y > (high - low).x)
}

#[cfg(test)]
mod tests {
    use super::{deepest_overlap, overlap};
    use crate::engine::State;
    use crate::scene::{Body, Mulberry, Shape};
    use glam::DVec2;

    #[test]
    fn overlaps_agree_with_those_of_the_simulation() {
        let mut draws = Mulberry(1);
        let mut met = 0;
        for _ in 0..2000 {
            let mut shape = || {
                let (a, b) = (draws.range(0.5, 2.0), draws.range(0.5, 2.0));
                if draws.unit() < 0.5 { Shape::Circle { radius: a } } else { Shape::rect(a, b) }
            };
            let (a, b) = (shape(), shape());
            let position = DVec2::new(draws.range(-3.0, 3.0), draws.range(-3.0, 3.0));
            let ours = |shape| match shape {
                Shape::Circle { radius } => jostle_sim::Shape::circle(radius as f32),
                Shape::Box { half } => jostle_sim::Shape::Box { half: half.as_vec2() },
            };
            let zero = jostle_sim::Vec2::ZERO;
            let contact = jostle_sim::collide(ours(a), zero, ours(b), position.as_vec2(), (0, 1));
            let depth = overlap(a, DVec2::ZERO, b, position);
            let expected = contact.map_or(0.0, |contact| f64::from(-contact.separation));
            met += i32::from(contact.is_some());
            assert!(
                (depth.max(0.0) - expected).abs() < 1e-5,
                "{a:?} {b:?} {position}: {depth} {expected}"
            );
        }
        assert!(met > 400, "{met} met");
    }

    #[test]
    fn the_sweep_finds_the_deepest_and_skips_fixed_pairs() {
        let block = |x: f64| Body::new(Shape::rect(1.0, 1.0), x, 0.0);
        let fixed = |x: f64| Body::fixed(Shape::rect(1.0, 1.0), x, 0.0);
        let bodies = [block(0.0), block(1.5), block(3.25), fixed(9.0), fixed(9.1)];
        let states = bodies.map(|body| State { position: body.position, velocity: DVec2::ZERO });
        assert!((deepest_overlap(&bodies, &states) - 0.5).abs() < 1e-12);
    }
}
