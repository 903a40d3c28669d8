//! Tests bodies whose position or velocity is not finite. The tests plant these values, because they cannot arise.

use super::*;
use crate::Conjugate;

/// Six crates in two piles, and another one flying towards them.
fn scene(solver: Solver) -> (World, BodyId, BodyId) {
    let settings = WorldSettings { solver: Some(solver), ..WorldSettings::default() };
    let mut world = World::new(settings);
    floor(&mut world, 0.3);
    let mut resting = None;
    for index in 0..6 {
        let at = (index / 2) as f32 * 3.0;
        resting = Some(add(&mut world, crate_at(at, 1.0 + 2.0 * (index % 2) as f32)));
    }
    let velocity = Vec2::new(0.0, -60.0);
    let flying = add(&mut world, BodyDef { velocity, ..crate_at(0.5, 24.0) });
    (world, resting.expect("there are crates"), flying)
}

/// Where a NaN or infinity is planted.
#[derive(Clone, Copy, Debug)]
enum Plant {
    Position(Vec2),
    Speed(Vec2),
}

fn plant(world: &mut World, body: BodyId, what: Plant) {
    match what {
        Plant::Position(position) => world.bodies.center[body.index as usize] = position,
        Plant::Speed(speed) => world.bodies.velocity[body.index as usize] = speed,
    }
}

const PLANTS: [Plant; 4] = [
    Plant::Position(Vec2::NAN),
    Plant::Position(Vec2::new(f32::INFINITY, 0.0)),
    Plant::Speed(Vec2::new(0.0, f32::NAN)),
    Plant::Speed(Vec2::new(f32::NEG_INFINITY, 0.0)),
];

fn solvers() -> [Solver; 2] {
    [Solver::Relaxation(Relaxation::default()), Solver::Conjugate(Conjugate::default())]
}

/// Checks that both worlds continue identically.
#[track_caller]
fn alike(one: &mut World, other: &mut World) {
    for _ in 0..60 {
        assert_eq!(one.hash(), other.hash());
        one.step();
        other.step();
        assert!(one.departed().quarantined.is_empty() && one.is_finite());
    }
}

#[test]
fn a_body_not_finite_at_the_end_of_a_step_leaves_as_if_it_were_removed() {
    for (solver, what) in solvers().into_iter().flat_map(|one| PLANTS.map(|what| (one, what))) {
        let (mut world, resting, _) = scene(solver);
        steps(&mut world, 30);
        let mut other = world.clone();
        world.step_watched(&mut |phase, world| {
            if phase == last_of(solver) {
                plant(world, resting, what);
            }
        });
        other.step();
        assert!(other.remove(resting));
        assert_eq!(world.departed().quarantined, [resting], "{solver:?}, {what:?}");
        assert!(world.departed().bodies.iter().any(|&(id, _)| id == resting));
        alike(&mut world, &mut other);
    }
}

fn last_of(solver: Solver) -> StepPhase {
    match solver {
        Solver::Relaxation(_) => StepPhase::Relax,
        Solver::Conjugate(_) => StepPhase::Integrate,
    }
}

#[test]
fn a_body_not_finite_within_a_step_affects_no_other() {
    for (solver, what) in solvers().into_iter().flat_map(|one| PLANTS.map(|what| (one, what))) {
        let (mut world, _, flying) = scene(solver);
        // Steps until the two are close enough to take part in a step together, but do not touch yet.
        while world.position(flying).y > 6.5 {
            world.step();
        }
        let mut other = world.clone();
        assert!(other.remove(flying));
        other.step();
        world.step_watched(&mut |phase, world| {
            if phase == StepPhase::Pairs {
                plant(world, flying, what);
            }
        });
        assert_eq!(world.departed().quarantined, [flying], "{solver:?}, {what:?}");
        alike(&mut world, &mut other);
    }
}

#[test]
fn a_body_not_finite_while_contacts_are_solved_affects_no_other() {
    for what in PLANTS {
        let (mut world, resting, _) = scene(Solver::Conjugate(Conjugate::default()));
        steps(&mut world, 30);
        world.step_watched(&mut |phase, world| {
            if phase == StepPhase::Relax {
                plant(world, resting, what);
            }
        });
        assert_eq!(world.departed().quarantined, [resting], "{what:?}");
        assert!(world.is_finite());
    }
}
