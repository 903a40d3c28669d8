//! Tests how stacks, pyramids and heaps bear their load, and how soon they come to rest.

use super::*;

/// Stacks boxes of height 2, and returns the top one.
fn stack(world: &mut World, masses: &[f32], gap: f32) -> BodyId {
    floor(world);
    let mut top = None;
    for (index, &mass) in masses.iter().enumerate() {
        let y = 1.0 + gap + (2.0 + gap) * index as f32;
        top = Some(add(world, BodyDef { mass, ..crate_at(0.0, y) }));
    }
    top.expect("a stack has a box")
}

/// Steps a stack and checks that it stays upright.
#[track_caller]
fn stands(masses: &[f32]) {
    let mut world = world();
    let top = stack(&mut world, masses, 0.0);
    for _ in 0..120 {
        world.step();
        assert!(deepest(&world) <= SLOP, "overlap {}", deepest(&world));
    }
    assert!(rms_speed(&world) <= 1e-5, "rms speed {}", rms_speed(&world));
    close(world.position(top).y, 2.0 * masses.len() as f32 - 1.0, SLOP);
}

#[test]
fn stacks_stand_as_they_were_built() {
    for count in [1, 2, 20, 100, 1000] {
        stands(&vec![4.0; count]);
    }
}

#[test]
fn masses_of_any_ratio_rest_on_each_other() {
    for exponent in 1..=6 {
        let heavy = 10_u32.pow(exponent) as f32;
        stands(&[1.0, heavy]);
        stands(&[heavy, 1.0]);
    }
    let mut under = vec![1.0; 10];
    under.push(1000.0);
    stands(&under);
    let alternating: Vec<f32> = (0..100).map(|k| [1.0, 1000.0][k % 2]).collect();
    stands(&alternating);
}

fn pyramid(world: &mut World, base: usize, gap: f32, cap: f32) -> BodyId {
    floor(world);
    let mut top = None;
    for row in 0..base {
        let count = base - row;
        for index in 0..count {
            let x = (index as f32 - (count as f32 - 1.0) / 2.0) * 2.2;
            let mass = if count == 1 { cap } else { 4.0 };
            let y = 1.0 + gap + (2.0 + gap) * row as f32;
            top = Some(add(world, BodyDef { mass, ..crate_at(x, y) }));
        }
    }
    top.expect("a pyramid has a top")
}

#[test]
fn a_pyramid_carries_a_cap_a_thousand_times_as_heavy() {
    for (gap, cap) in [(0.0, 4000.0), (0.25, 4.0)] {
        let mut world = world();
        let top = pyramid(&mut world, 20, gap, cap);
        for _ in 0..150 {
            world.step();
            assert!(deepest(&world) <= SLOP, "overlap {}", deepest(&world));
        }
        assert!(rms_speed(&world) <= 1e-5, "rms speed {}", rms_speed(&world));
        close(world.position(top).y, 39.0, SLOP);
    }
}

#[test]
fn a_dropped_stack_of_a_thousand_settles_when_its_top_has_fallen() {
    let mut world = world();
    let top = stack(&mut world, &[4.0; 1000], 0.05);
    let free_fall_s = (2.0 * 1000.0 * 0.05 / 50.0_f32).sqrt();
    for _ in 0..((free_fall_s + 0.05) * 60.0) as usize {
        world.step();
        assert!(dynamic(&world).all(|id| world.velocity(id).y <= 0.01), "thrown up");
        assert!(deepest(&world) <= SLOP);
    }
    assert!(dynamic(&world).all(|id| world.velocity(id).length() < 0.01), "not at rest");
    close(world.position(top).y, 1999.0, SLOP);
}

#[test]
fn momentum_is_conserved_in_a_row_of_any_masses() {
    let mut world = bouncy_world(0.0);
    let mut rng = Rng::new(1, 0);
    let mut size = 0.0;
    for index in 0..30 {
        let mass = [1.0, 1000.0, 0.01][rng.below(3) as usize];
        let velocity = Vec2::new(rng.range(-20.0, 20.0) - index as f32, 0.0);
        size += f64::from(mass * velocity.x.abs());
        add(&mut world, BodyDef { mass, velocity, ..crate_at(index as f32 * 2.5, 0.0) });
    }
    let before = momentum(&world);
    steps(&mut world, 300);
    let after = momentum(&world);
    for axis in 0..2 {
        assert!((after[axis] - before[axis]).abs() < 1e-5 * size, "{before:?} became {after:?}");
    }
}

#[test]
fn a_crooked_tower_is_a_tree_and_takes_one_sweep() {
    let mut world = world();
    let ground = floor(&mut world);
    let mut carrier = ground;
    let mut rng = Rng::new(6, 0);
    let (mut x, mut y) = (0.0, 1.0);
    for _ in 0..60 {
        let mass = rng.range(0.1, 10.0);
        carrier = add(&mut world, BodyDef { mass, friction: 0.3, ..ball_at(x, y) });
        // A friction of 0.3 holds on a slope of 0.29. Nothing rotates, so nothing rolls off.
        let lean = rng.range(-0.4, 0.4);
        x += lean;
        y += (4.0 - lean * lean).sqrt();
    }
    let top = world.position(carrier);
    for step in 0..60 {
        world.step();
        assert!(
            world.solvers.passes() <= if step == 0 { 60 } else { 2 },
            "{} sweeps",
            world.solvers.passes()
        );
    }
    assert!(rms_speed(&world) <= 1e-5, "rms speed {}", rms_speed(&world));
    close((world.position(carrier) - top).length(), 0.0, 1e-3);
}

#[test]
fn a_pile_without_a_forest_is_solved_too() {
    let mut world = world_with(Conjugate::default(), 0.0);
    let mut rng = Rng::new(10, 0);
    for index in 0..100 {
        let (row, column) = ((index / 10) as f32, (index % 10) as f32);
        let x = (column + if index / 10 % 2 == 1 { 0.5 } else { 0.0 }) * 1.998;
        let velocity = Vec2::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        add(&mut world, BodyDef { velocity, ..ball_at(x, row * 1.998 * 0.75f32.sqrt()) });
    }
    world.step();
    assert!(world.solvers.passes() < 150, "{} sweeps", world.solvers.passes());
}

#[test]
fn a_compressed_heap_separates_within_a_second() {
    let mut world = world_with(Conjugate::default(), 10.0);
    floor(&mut world);
    for side in [-1.0, 1.0] {
        fixed(&mut world, (side * 16.0, 40.0), (5.0, 40.0), 0.3);
    }
    for index in 0..200 {
        let (row, column) = ((index / 10) as f32, (index % 10) as f32);
        let shift = if index / 10 % 2 == 1 { 1.1 } else { 0.1 };
        let x = -9.8 + shift + column * 2.0;
        add(&mut world, BodyDef { friction: 0.3, ..ball_at(x, 1.0 + row * 1.3) });
    }
    steps(&mut world, 60);
    let deepest = world.touches().iter().fold(0.0, |most, touch| max(most, touch.depth));
    assert!(deepest <= SLOP * 1.01, "{deepest} after a second");
}

#[test]
fn a_stack_whose_floor_goes_falls_as_one_body_does() {
    for count in 1..=10 {
        for (size, friction) in [(2.0, 0.0), (10.0, 0.4)] {
            let mut world = world();
            let floor = floor(&mut world);
            let stack: Vec<BodyId> = (0..count)
                .map(|row| {
                    let shape = Shape::rect(size, size);
                    let position = Vec2::new(0.0, size * (row as f32 + 0.5));
                    add(&mut world, BodyDef { shape, position, friction, ..crate_at(0.0, 0.0) })
                })
                .collect();
            steps(&mut world, 120);
            let before: Vec<f32> = stack.iter().map(|&id| world.position(id).y).collect();
            world.remove(floor);
            steps(&mut world, 60);
            // Free fall covers 50 / 2 units in a second.
            for (&id, before) in stack.iter().zip(before) {
                let fallen = before - world.position(id).y;
                assert!((fallen - 25.0).abs() < 1e-4, "{count} of {size}: {fallen}");
            }
        }
    }
}

/// Balls of radius 3 in a shaft, alternately left and right, so that each rests on the one below and on a wall.
fn shaft(masses: &[f32], width: f32, friction: f32, across: bool) -> (World, Vec<BodyId>) {
    let turn = |v: Vec2| if across { Vec2::new(v.y, v.x) } else { v };
    let mut world = World::new(WorldSettings {
        gravity: turn(Vec2::new(0.0, -50.0)),
        solver: Some(Solver::Conjugate(Conjugate::default())),
        ..WorldSettings::default()
    });
    for (center, half) in [
        (Vec2::new(0.0, -10.0), Vec2::new(50.0, 10.0)),
        (Vec2::new(-width / 2.0 - 5.0, 100.0), Vec2::new(5.0, 100.0)),
        (Vec2::new(width / 2.0 + 5.0, 100.0), Vec2::new(5.0, 100.0)),
    ] {
        let (center, half) = (turn(center), turn(half));
        fixed(&mut world, (center.x, center.y), (half.x, half.y), friction);
    }
    let aside = width / 2.0 - 3.0;
    let rise = (36.0 - 4.0 * aside * aside).sqrt();
    let ball = |(index, &mass): (usize, &f32)| {
        let x = if index % 2 == 0 { -aside } else { aside };
        let at = turn(Vec2::new(x, 3.0 + rise * index as f32));
        let def = BodyDef { shape: Shape::circle(3.0), mass, friction, ..ball_at(at.x, at.y) };
        add(&mut world, def)
    };
    let balls = masses.iter().enumerate().map(ball).collect();
    (world, balls)
}

#[test]
fn balls_in_a_shaft_carry_others_of_any_mass() {
    let mut rng = Rng::new(4, 0);
    for (count, heavy) in [(4, 1e6_f32), (6, 1e4), (10, 1e4), (10, 1e6), (30, 1e3), (30, 1e6)] {
        for (width, friction, is_random) in [
            (6.5, 0.0, false),
            (8.0, 0.0, false),
            (10.0, 0.0, false),
            (8.0, 0.0, true),
            (9.0, 0.3, true),
        ] {
            let across = count % 4 == 0;
            let mass = |index: usize| match is_random {
                true => [1.0, heavy.sqrt(), heavy][rng.below(3) as usize],
                false => [heavy, 1.0][index % 2],
            };
            let masses: Vec<f32> = (0..count).map(mass).collect();
            let (mut world, balls) = shaft(&masses, width, friction, across);
            let before: Vec<Vec2> = balls.iter().map(|&id| world.position(id)).collect();
            let mut worst = 0.0;
            for _ in 0..300 {
                world.step();
                worst = max(worst, deepest(&world));
            }
            let paths = balls.iter().zip(&before).map(|(&id, &at)| world.position(id).distance(at));
            let moved = paths.fold(0.0, max);
            assert!(
                worst < 0.05 && moved < 0.15,
                "{count} balls, 1:{heavy}, shaft {width}: {worst} deep, moved by {moved}"
            );
        }
    }
}
