//! The pool adjacent violators algorithm finds the exact velocities of bodies in a chain.
//!
//! Bodies 0..m in a chain have target speeds v*, and each may close on the next by no more than g:
//! `v[k+1] >= v[k] - g[k]`. The speeds nearest to v* in the mass norm are found by pooling: a body
//! that would overtake the next is joined with it, and a pool moves at its mean speed (Ayer, Brunk,
//! Ewing, Reid and Silverman 1955; Best and Chakravarti 1990). An immovable body has infinite
//! weight. One pass along the chain suffices for any length and any masses.
//!
//! The mean is a speed and not a sum of impulses, so a light body under a heavy one loses no
//! digits: its own rounding error has only its own small weight.

/// A body of a chain.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ChainNode {
    /// The target speed at first, then the resulting speed.
    pub speed: f32,
    /// Mass; infinite for an immovable body.
    pub mass: f32,
    /// Largest speed at which it may close on the next body; meaningless for the last body.
    pub closing_max: f32,
}

/// Neighbouring bodies that move together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pool {
    /// First node.
    pub first: usize,
    /// One past the last node.
    pub end: usize,
    /// Speed of the first node.
    speed: f32,
    /// Sum of `closing_max` inside the pool.
    span: f32,
    mass: f32,
    /// `closing_max` of the last node of the previous pool.
    closing_max: f32,
}

/// Computes the speed of every node. Afterwards `pools` holds the pools, in order.
pub(crate) fn pool(nodes: &mut [ChainNode], pools: &mut Vec<Pool>) {
    pools.clear();
    let mut closing_max = f32::INFINITY;
    for (index, node) in nodes.iter().enumerate() {
        let mut last = Pool {
            first: index,
            end: index + 1,
            speed: node.speed,
            span: 0.0,
            mass: node.mass,
            closing_max,
        };
        while let Some(before) = pools.last()
            && before.speed - before.span - last.closing_max > last.speed
        {
            last = join(*before, last);
            pools.pop();
        }
        pools.push(last);
        closing_max = node.closing_max;
    }
    for pool in pools.iter() {
        let nodes = &mut nodes[pool.first..pool.end];
        let gained = set_off(nodes, pool.speed);
        // Joining pools involves rounding, which must not make a free pool drift. A pool with an immovable body, or
        // with absurd masses, has no finite drift.
        let drift = gained / pool.mass;
        if drift.is_finite() {
            nodes.iter_mut().for_each(|node| node.speed -= drift);
        }
    }
}

/// Sets the speeds of a pool's nodes from that of the first node, and returns the momentum gained.
#[inline]
fn set_off(nodes: &mut [ChainNode], first: f32) -> f32 {
    let (mut speed, mut gained) = (first, 0.0);
    for node in nodes {
        gained += node.mass * (speed - node.speed);
        node.speed = speed;
        speed -= node.closing_max;
    }
    gained
}

/// Joins two pools. The speed of the resulting pool is that of its first node.
#[inline]
fn join(lower: Pool, upper: Pool) -> Pool {
    let behind = lower.span + upper.closing_max;
    let upper_speed = upper.speed + behind;
    let speed = if lower.mass == f32::INFINITY {
        lower.speed
    } else if upper.mass == f32::INFINITY {
        upper_speed
    } else {
        lower.speed + (upper_speed - lower.speed) * (upper.mass / (lower.mass + upper.mass))
    };
    Pool {
        first: lower.first,
        end: upper.end,
        speed,
        span: behind + upper.span,
        mass: lower.mass + upper.mass,
        closing_max: lower.closing_max,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve(bodies: &[(f32, f32, f32)]) -> (Vec<f32>, usize) {
        let node = |&(speed, mass, closing_max)| ChainNode { speed, mass, closing_max };
        let mut nodes: Vec<ChainNode> = bodies.iter().map(node).collect();
        let mut pools = Vec::new();
        pool(&mut nodes, &mut pools);
        (nodes.iter().map(|node| node.speed).collect(), pools.len())
    }

    #[test]
    fn bodies_that_do_not_close_keep_their_speeds() {
        assert_eq!(solve(&[(0.0, 1.0, 0.0), (1.0, 1.0, 0.5), (0.5, 2.0, 0.0)]).1, 3);
    }

    #[test]
    fn a_pool_moves_with_its_mean() {
        assert_eq!(solve(&[(4.0, 1.0, 0.0), (0.0, 3.0, 0.0)]), (vec![1.0, 1.0], 1));
        assert_eq!(solve(&[(4.0, 1.0, 1.0), (0.0, 1.0, 0.0)]), (vec![2.5, 1.5], 1));
    }

    #[test]
    fn immovable_bodies_decide_and_masses_of_any_ratio_rest_exactly() {
        let floor = (0.0, f32::INFINITY, 0.0);
        let load = [floor, (-1.0, 1e-6, 0.0), (-1.0, 1e6, 0.0), (-1.0, 1.0, 0.0)];
        assert_eq!(solve(&load), (vec![0.0; 4], 1));
        let ceiling = [(1.0, 1.0, 0.0), (1.0, 2.0, 0.0), (-0.5, f32::INFINITY, 0.0)];
        assert_eq!(solve(&ceiling).0, vec![-0.5; 3]);
    }

    #[test]
    fn a_long_free_pool_does_not_drift() {
        let bodies: Vec<_> = (0..100).map(|index| (0.0, 1.0 + index as f32 % 7.0, -0.3)).collect();
        let (speeds, count) = solve(&bodies);
        assert_eq!(count, 1);
        let momenta = bodies.iter().zip(&speeds).map(|(body, &speed)| f64::from(body.1 * speed));
        let drift = momenta.sum::<f64>() / bodies.iter().map(|body| f64::from(body.1)).sum::<f64>();
        assert!(drift.abs() < 1e-6, "{drift} of speeds up to {}", speeds[99]);
    }

    #[test]
    fn momentum_is_conserved_without_immovable_bodies() {
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
