//! Tests a world's memory, counted on a test's thread: its bytes per body, and that a steady step makes no allocations.

use super::*;
use crate::rng::Rng;
use crate::solver::settings::Conjugate;
use allocation_counter::measure;

/// Number of steps between two shakes.
const SHAKE_STEPS: u32 = 30;

/// Balls and crates between walls.
struct Pile {
    world: World,
    ids: Vec<BodyId>,
    rng: Rng,
}

impl Pile {
    fn new(solver: Solver, count: u32) -> Pile {
        let columns = 2 * (count as f32).sqrt() as u32;
        let width = columns as f32 * 4.0;
        let mut world = World::new(WorldSettings { solver: Some(solver), ..Default::default() });
        let size = Vec2::new(10.0, 1200.0);
        for (position, size) in [
            (Vec2::new(width / 2.0, -5.0), Vec2::new(2.0 * width, 10.0)),
            (Vec2::new(-5.0, 500.0), size),
            (Vec2::new(width + 5.0, 500.0), size),
        ] {
            let shape = Shape::rect(size.x, size.y);
            add(
                &mut world,
                BodyDef { shape, position, motion: Motion::Static, ..BodyDef::default() },
            );
        }
        let (mut rng, mut ids) = (Rng::new(3, 1), Vec::with_capacity(count as usize));
        for index in 0..count {
            let half = rng.range(0.7, 1.5);
            let is_ball = index % 2 == 0;
            let shape =
                if is_ball { Shape::circle(half) } else { Shape::rect(2.0 * half, 2.0 * half) };
            let mass = half * half;
            let (column, row) = ((index % columns) as f32, (index / columns) as f32);
            let position = Vec2::new(column * 4.0 + 2.0 + rng.range(-0.3, 0.3), row * 4.0 + 2.0);
            let def = BodyDef {
                shape,
                position,
                mass,
                friction: 0.3,
                restitution: 0.0,
                ..BodyDef::default()
            };
            ids.push(add(&mut world, def));
        }
        Pile { world, ids, rng }
    }

    fn shake(&mut self, steps: u32) {
        for step in 0..steps {
            if step % SHAKE_STEPS == 0 {
                for &id in &self.ids {
                    let (x, y) = (self.rng.range(-30.0, 30.0), self.rng.range(0.0, 60.0));
                    self.world.set_velocity(id, Vec2::new(x, y));
                }
            }
            self.world.step();
        }
    }
}

/// Bytes per body in a world of 1000 bodies, first after it was shaken, and then after it came to rest.
fn bytes_a_body(solver: Solver) -> [i64; 2] {
    let (mut pile, mut after) = (None, [0; 2]);
    let shaken = measure(|| {
        let mut new = Pile::new(solver, 1000);
        new.shake(300);
        pile = Some(new);
    });
    let mut pile = pile.expect("just made");
    let rested = measure(|| {
        pile.shake(120);
        steps(&mut pile.world, 900);
    });
    after[0] = shaken.bytes_current - (pile.ids.capacity() * size_of::<BodyId>()) as i64;
    after[1] = after[0] + rested.bytes_current;
    after.map(|bytes| bytes / 1000)
}

#[test]
fn a_pile_takes_few_bytes_a_body() {
    let conjugate = bytes_a_body(Solver::Conjugate(Conjugate::default()));
    assert!(conjugate[0] <= 560 && conjugate[1] <= 310, "conjugate: {conjugate:?}");
    let relaxation = bytes_a_body(Solver::Relaxation(Relaxation::default()));
    assert!(relaxation[0] <= 410 && relaxation[1] <= 600, "relaxation: {relaxation:?}");
}

#[test]
fn a_steady_step_allocates_nothing() {
    for solver in
        [Solver::Conjugate(Conjugate::default()), Solver::Relaxation(Relaxation::default())]
    {
        let mut pile = Pile::new(solver, 100);
        pile.shake(1500);
        assert_eq!(measure(|| pile.shake(300)).count_total, 0, "{solver:?}");
    }
}

/// Stacks in which heavy crates rest on light ones are pushed back and forth, so that sweeps do not solve their
/// islands.
#[test]
fn a_step_with_eliminations_allocates_nothing() {
    let solver = Solver::Conjugate(Conjugate::default());
    let mut world = World::new(WorldSettings { solver: Some(solver), ..Default::default() });
    floor(&mut world, 0.3);
    let mut crates = Vec::new();
    for index in 0..60 {
        let (stack, level) = ((index / 6) as f32, index % 6);
        let mass = if level == 3 || level == 5 { 1e4 } else { 1.0 };
        let crate_def = crate_at(6.0 * stack, 1.0 + 2.0 * level as f32);
        crates.push(add(&mut world, BodyDef { mass, friction: 0.3, ..crate_def }));
    }
    let mut rng = Rng::new(3, 1);
    let mut push = |times: u32| {
        for _ in 0..times {
            for &id in &crates {
                let (x, y) = (rng.range(-1.0, 1.0), rng.range(0.0, 3.0));
                world.set_velocity(id, Vec2::new(x, y));
            }
            steps(&mut world, 30);
        }
    };
    // The capacity follows the largest island so far, and larger islands become rare.
    push(400);
    assert_eq!(measure(|| push(4)).count_total, 0);
}
