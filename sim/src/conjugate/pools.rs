//! Pool adjacent violators: the exact answer for bodies in a line.
//!
//! Bodies 0..m in a line want speeds v*, and each may fall behind the next by no more than a gap
//! speed g: v[k+1] >= v[k] - g[k]. The speeds nearest to v* in the norm of the masses are found by
//! pooling: whoever would overtake the next is joined with it, and a pool moves with its mean
//! (Ayer, Brunk, Ewing, Reid and Silverman 1955; Best and Chakravarti 1990). A body that cannot be
//! pushed has infinite weight. One pass along the line, however long it is and whatever the masses.
//!
//! The mean is a speed and not a sum of impulses, so a light body under a heavy one keeps all its
//! digits: its own rounding error has its own small weight.

/// A body of a line.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Node {
    /// The speed that it wants, and then the one that it gets.
    pub speed: f32,
    /// Mass; infinite if it cannot be pushed.
    pub mass: f32,
    /// How far it may fall behind the next body's speed; of no meaning for the last.
    pub gap: f32,
}

/// Neighbours that move as one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pool {
    /// First node.
    pub first: usize,
    /// One past the last node.
    pub end: usize,
    /// Speed of the first node.
    speed: f32,
    /// Sum of the gaps inside.
    span: f32,
    mass: f32,
    /// Gap to the pool before it.
    gap: f32,
}

/// Gives every node its speed. `pools` are then the pools, in order.
pub(crate) fn pool(nodes: &mut [Node], pools: &mut Vec<Pool>) {
    pools.clear();
    let mut gap = f32::INFINITY;
    for (place, node) in nodes.iter().enumerate() {
        let mut last = Pool {
            first: place,
            end: place + 1,
            speed: node.speed,
            span: 0.0,
            mass: node.mass,
            gap,
        };
        while let Some(before) = pools.last()
            && before.speed - before.span - last.gap > last.speed
        {
            last = join(*before, last);
            pools.pop();
        }
        pools.push(last);
        gap = node.gap;
    }
    for pool in pools.iter() {
        let nodes = &mut nodes[pool.first..pool.end];
        let gained = set_off(nodes, pool.speed);
        // Joining rounds; a pool that nothing holds must not drift by it. One that is held, or of
        // absurd masses, has no such number.
        let drift = gained / pool.mass;
        if drift.is_finite() {
            nodes.iter_mut().for_each(|node| node.speed -= drift);
        }
    }
}

/// Gives the nodes of a pool their speeds, from that of the first; returns the momentum gained.
#[inline]
fn set_off(nodes: &mut [Node], first: f32) -> f32 {
    let (mut speed, mut gained) = (first, 0.0);
    for node in nodes {
        gained += node.mass * (speed - node.speed);
        node.speed = speed;
        speed -= node.gap;
    }
    gained
}

/// One pool of two; its speed is that of the first node.
#[inline]
fn join(one: Pool, other: Pool) -> Pool {
    let behind = one.span + other.gap;
    let other_speed = other.speed + behind;
    let speed = if one.mass == f32::INFINITY {
        one.speed
    } else if other.mass == f32::INFINITY {
        other_speed
    } else {
        one.speed + (other_speed - one.speed) * (other.mass / (one.mass + other.mass))
    };
    Pool {
        first: one.first,
        end: other.end,
        speed,
        span: behind + other.span,
        mass: one.mass + other.mass,
        gap: one.gap,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve(bodies: &[(f32, f32, f32)]) -> (Vec<f32>, usize) {
        let node = |&(speed, mass, gap)| Node { speed, mass, gap };
        let mut nodes: Vec<Node> = bodies.iter().map(node).collect();
        let mut pools = Vec::new();
        pool(&mut nodes, &mut pools);
        (nodes.iter().map(|node| node.speed).collect(), pools.len())
    }

    #[test]
    fn who_does_not_close_keeps_its_speed() {
        assert_eq!(solve(&[(0.0, 1.0, 0.0), (1.0, 1.0, 0.5), (0.5, 2.0, 0.0)]).1, 3);
    }

    #[test]
    fn a_pool_moves_with_its_mean() {
        assert_eq!(solve(&[(4.0, 1.0, 0.0), (0.0, 3.0, 0.0)]), (vec![1.0, 1.0], 1));
        assert_eq!(solve(&[(4.0, 1.0, 1.0), (0.0, 1.0, 0.0)]), (vec![2.5, 1.5], 1));
    }

    #[test]
    fn the_fixed_decide_and_masses_of_any_ratio_rest_exactly() {
        let floor = (0.0, f32::INFINITY, 0.0);
        let load = [floor, (-1.0, 1e-6, 0.0), (-1.0, 1e6, 0.0), (-1.0, 1.0, 0.0)];
        assert_eq!(solve(&load), (vec![0.0; 4], 1));
        let ceiling = [(1.0, 1.0, 0.0), (1.0, 2.0, 0.0), (-0.5, f32::INFINITY, 0.0)];
        assert_eq!(solve(&ceiling).0, vec![-0.5; 3]);
    }

    #[test]
    fn a_long_pool_that_nothing_holds_does_not_drift() {
        let bodies: Vec<_> = (0..100).map(|place| (0.0, 1.0 + place as f32 % 7.0, -0.3)).collect();
        let (speeds, count) = solve(&bodies);
        assert_eq!(count, 1);
        let momenta = bodies.iter().zip(&speeds).map(|(body, &speed)| f64::from(body.1 * speed));
        let drift = momenta.sum::<f64>() / bodies.iter().map(|body| f64::from(body.1)).sum::<f64>();
        assert!(drift.abs() < 1e-6, "{drift} of speeds up to {}", speeds[99]);
    }

    #[test]
    fn momentum_is_kept_without_anything_fixed() {
        let bodies = [(9.0, 1.0, 0.5), (3.0, 2.0, 0.25), (4.0, 1.0, 0.0), (-8.0, 3.0, 0.0)];
        let (speeds, _) = solve(&bodies);
        let sum = |speeds: &[f32]| -> f32 {
            bodies.iter().zip(speeds).map(|(body, speed)| body.1 * speed).sum()
        };
        let wanted: Vec<f32> = bodies.iter().map(|body| body.0).collect();
        assert!((sum(&speeds) - sum(&wanted)).abs() < 1e-5);
        for (body, pair) in bodies.iter().zip(speeds.windows(2)) {
            assert!(pair[1] >= pair[0] - body.2 - 1e-6, "{pair:?} closes too fast");
        }
    }
}
