use super::*;
use crate::scene::Mulberry;

/// A random graph of contacts between `count` bodies, the first of which never moves.
fn random(seed: u32, count: usize, contacts: usize) -> Program {
    let mut draws = Mulberry(seed);
    let mut program = Program::default();
    for body in 0..count {
        program.inverse_masses.push(if body == 0 { 0.0 } else { draws.range(0.5, 2.0) });
        let velocity = DVec2::new(draws.range(-1.0, 1.0), draws.range(-1.0, 1.0));
        program.free.push(if body == 0 { DVec2::ZERO } else { velocity });
    }
    while program.contacts.len() < contacts {
        let (a, b) =
            ((draws.unit() * count as f64) as usize, (draws.unit() * count as f64) as usize);
        let turn = draws.range(0.0, 6.3);
        if a != b {
            let min_normal_velocity = draws.range(-0.2, 0.0);
            program.contacts.push(Contact {
                a,
                b,
                normal: DVec2::from_angle(turn),
                min_normal_velocity,
            });
        }
    }
    program
}

#[test]
fn two_methods_agree_and_meet_the_optimality_conditions() {
    for seed in 0..20 {
        let program = random(seed, 12, 16);
        let (one, other) =
            (program.gauss_seidel(1e-14, 200_000), program.accelerated(1e-12, 200_000));
        assert!(program.residual(&one.impulses) < 1e-11, "seed {seed}");
        for (a, b) in one.velocities.iter().zip(&other.velocities) {
            assert!(a.distance(*b) < 1e-9, "seed {seed}: {a} and {b}");
        }
    }
}

/// Tries all partitions of the sequence into blocks, with each block replaced by its mean, and returns the best
/// feasible one.
fn brute_force(values: &[f64], weights: &[f64]) -> Vec<f64> {
    let count = values.len();
    let mut best: Option<(f64, Vec<f64>)> = None;
    for cuts in 0u32..1 << (count - 1) {
        let mut fit = Vec::new();
        let mut from = 0;
        for to in 1..=count {
            if to == count || cuts >> (to - 1) & 1 == 1 {
                let weight: f64 = weights[from..to].iter().sum();
                let sum: f64 = (from..to).map(|i| values[i] * weights[i]).sum();
                fit.extend(std::iter::repeat_n(sum / weight, to - from));
                from = to;
            }
        }
        let sorted = fit.windows(2).all(|pair| pair[0] <= pair[1]);
        let cost: f64 = (0..count).map(|i| weights[i] * (fit[i] - values[i]).powi(2)).sum();
        if sorted && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, fit));
        }
    }
    best.expect("one block is always sorted").1
}

#[test]
fn pava_agrees_with_brute_force() {
    let mut draws = Mulberry(3);
    for length in 1..=10 {
        for _ in 0..20 {
            let values: Vec<f64> = (0..length).map(|_| draws.range(-1.0, 1.0)).collect();
            let weights: Vec<f64> =
                (0..length).map(|_| 10f64.powf(draws.range(-3.0, 3.0))).collect();
            let (one, other) = (pava(&values, &weights), brute_force(&values, &weights));
            for (a, b) in one.iter().zip(&other) {
                assert!((a - b).abs() < 1e-9, "{one:?} and {other:?}");
            }
        }
    }
}

#[test]
fn pava_and_the_program_agree_on_a_chain() {
    let masses = [f64::INFINITY, 1.0, 30.0, 0.2, 5.0, 1.0];
    let speeds = [0.0, -1.0, -3.0, 2.0, -0.5, -0.4];
    let contacts =
        (0..5).map(|a| Contact { a, b: a + 1, normal: DVec2::Y, min_normal_velocity: 0.0 });
    let program = Program {
        inverse_masses: masses.iter().map(|mass| 1.0 / mass).collect(),
        free: speeds.iter().map(|&speed| DVec2::new(0.0, speed)).collect(),
        contacts: contacts.collect(),
    };
    let solution = program.gauss_seidel(1e-15, 100_000);
    for (velocity, expected) in solution.velocities.iter().zip(pava(&speeds, &masses)) {
        assert!((velocity.y - expected).abs() < 1e-10, "{} is not {expected}", velocity.y);
    }
}
