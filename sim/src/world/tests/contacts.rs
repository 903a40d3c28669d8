//! Tests contacts in the relaxation solver: impulses, projection and friction.

use super::*;

// --- Impulses -----------------------------------------------------------------------------------

#[test]
fn a_heavy_body_passes_its_momentum_on() {
    let mut world = world(Relaxation::default(), 0.0);
    let heavy =
        BodyDef { mass: 2.0, velocity: Vec2::new(30.0, 0.0), friction: 0.0, ..BodyDef::default() };
    let a = add(&mut world, heavy);
    let b = add(&mut world, BodyDef { position: Vec2::new(2.2, 0.0), ..BodyDef::default() });
    let before = momentum(&world);
    steps(&mut world, 5);
    close(world.velocity(a).x, 12.0, 1e-3);
    close(world.velocity(b).x, 36.0, 1e-3);
    close((momentum(&world) - before).length(), 0.0, 1e-3);
}

#[test]
fn a_pair_takes_the_smaller_restitution() {
    let mut world = world(Relaxation::default(), 0.0);
    let soft = BodyDef { restitution: 0.25, velocity: Vec2::new(20.0, 0.0), ..BodyDef::default() };
    let a = add(&mut world, soft);
    let hard = BodyDef { restitution: 1.0, position: Vec2::new(2.1, 0.0), ..BodyDef::default() };
    let b = add(&mut world, hard);
    steps(&mut world, 5);
    close(world.velocity(b).x - world.velocity(a).x, 5.0, 1e-3);
}

#[test]
fn nothing_bounces_below_the_threshold() {
    let mut world = world(Relaxation::default(), 0.0);
    floor(&mut world, 0.0);
    let slow = BodyDef { velocity: Vec2::new(0.0, -1.9), restitution: 1.0, ..crate_at(0.0, 1.01) };
    let id = add(&mut world, slow);
    steps(&mut world, 10);
    close(world.velocity(id).y, 0.0, 1e-6);
}

#[test]
fn a_body_that_leaves_is_neither_pushed_nor_braked() {
    let mut world = world(Relaxation::default(), 0.0);
    floor(&mut world, 1.0);
    let leaving = BodyDef { velocity: Vec2::new(20.0, 5.0), friction: 1.0, ..crate_at(0.0, 0.99) };
    let id = add(&mut world, leaving);
    steps(&mut world, 3);
    assert_eq!(world.velocity(id), Vec2::new(20.0, 5.0), "C13");
}

#[test]
fn a_resting_body_rests_whatever_its_restitution() {
    for restitution in [0.0, 0.3, 0.8, 1.0] {
        let mut world = world(Relaxation::default(), 50.0);
        floor(&mut world, 0.3);
        let id = add(&mut world, BodyDef { restitution, ..crate_at(0.0, 1.0) });
        steps(&mut world, 120);
        close(world.velocity(id).length(), 0.0, 1e-5);
        close(world.position(id).y, 1.0 - SLOP, 1e-3);
    }
}

#[test]
fn an_elastic_gas_keeps_its_energy() {
    let no_threshold = Relaxation { bounce_threshold: 0.0, ..Relaxation::default() };
    let mut world = world(no_threshold, 0.0);
    let wall =
        BodyDef { motion: Motion::Static, restitution: 1.0, friction: 0.0, ..BodyDef::default() };
    for (x, y, w, h) in [
        (60.0, -10.0, 160.0, 20.0),
        (60.0, 130.0, 160.0, 20.0),
        (-10.0, 60.0, 20.0, 160.0),
        (130.0, 60.0, 20.0, 160.0),
    ] {
        add(&mut world, BodyDef { shape: Shape::rect(w, h), position: Vec2::new(x, y), ..wall });
    }
    let mut rng = crate::rng::Rng::new(5, 0);
    for i in 0..100 {
        let position = Vec2::new((i % 10) as f32 + 0.5, (i / 10) as f32 + 0.5) * 12.0;
        let velocity = Vec2::new(rng.range(-50.0, 50.0), rng.range(-50.0, 50.0));
        let shape = Shape::circle(rng.range(1.0, 3.5));
        add(
            &mut world,
            BodyDef {
                shape,
                position,
                velocity,
                restitution: 1.0,
                friction: 0.0,
                ..BodyDef::default()
            },
        );
    }
    let before = kinetic(&world);
    steps(&mut world, 600);
    let after = kinetic(&world);
    assert!((after / before - 1.0).abs() < 1e-4, "energy {before} became {after}");
}

#[test]
fn newtons_cradle_passes_the_impact_to_the_last_ball() {
    let no_threshold = Relaxation { bounce_threshold: 0.0, ..Relaxation::default() };
    let mut world = world(no_threshold, 0.0);
    let ball = BodyDef { restitution: 1.0, friction: 0.0, ..BodyDef::default() };
    let balls: Vec<BodyId> = (0..5)
        .map(|i| add(&mut world, BodyDef { position: Vec2::new(i as f32 * 2.0, 0.0), ..ball }))
        .collect();
    world.set_position(balls[0], Vec2::new(-3.0, 0.0));
    world.set_velocity(balls[0], Vec2::new(20.0, 0.0));
    steps(&mut world, 30);
    for &ball in &balls[..4] {
        close(world.velocity(ball).x, 0.0, 0.02);
    }
    close(world.velocity(balls[4]).x, 20.0, 0.02);
}

// --- Projection ---------------------------------------------------------------------------------

#[test]
fn one_pass_leaves_a_fifth_of_the_overlap() {
    let one = Relaxation { iterations: 1, slop: 0.0, ..Relaxation::default() };
    let mut world = world(one, 0.0);
    let a = add(&mut world, crate_at(0.0, 0.0));
    let b = add(&mut world, crate_at(1.0, 0.0));
    world.step();
    close(world.position(b).x - world.position(a).x, 1.8, 1e-5);
}

#[test]
fn masses_of_1_and_3_move_3_to_1() {
    let one = Relaxation { iterations: 1, slop: 0.0, ..Relaxation::default() };
    let mut world = world(one, 0.0);
    let a = add(&mut world, crate_at(0.0, 0.0));
    let b = add(&mut world, BodyDef { mass: 3.0, ..crate_at(1.0, 0.0) });
    world.step();
    close(world.position(a).x, -0.6, 1e-5);
    close(world.position(b).x, 1.2, 1e-5);
}

#[test]
fn n_passes_for_n_and_one_is_enough_to_stand() {
    for iterations in [1, 2, 5, 15, 60] {
        // Full correction is a valid setting, and a pair with opposing overlaps never converges.
        let settings =
            Relaxation { iterations, correction: 1.0, slop: 0.0, ..Relaxation::default() };
        let mut jammed = world(settings, 0.0);
        let wall = BodyDef { motion: Motion::Static, ..crate_at(-1.5, 0.0) };
        add(&mut jammed, wall);
        add(&mut jammed, BodyDef { position: Vec2::new(1.5, 0.0), ..wall });
        add(&mut jammed, crate_at(0.1, 0.0));
        jammed.step();
        assert_eq!(jammed.solvers.passes(), iterations, "C22a");
    }
    let once = Relaxation { iterations: 1, ..Relaxation::default() };
    let mut world = world(once, 50.0);
    floor(&mut world, 0.3);
    let id = add(&mut world, crate_at(0.0, 5.0));
    steps(&mut world, 300);
    close(world.position(id).y, 1.0, 0.02);
}

#[test]
fn passes_end_when_nothing_is_left_to_correct() {
    let mut world = world(Relaxation::default(), 50.0);
    floor(&mut world, 0.3);
    add(&mut world, crate_at(0.0, 1.0));
    steps(&mut world, 60);
    assert_eq!(world.solvers.passes(), 1, "C19");
}

#[test]
fn all_pairs_relax_together() {
    let mut world = world(Relaxation::default(), 50.0);
    floor(&mut world, 0.3);
    for i in 0..10 {
        add(&mut world, crate_at(0.0, 1.0 + 2.0 * i as f32));
    }
    steps(&mut world, 300);
    let deepest = world.touches().iter().map(|touch| touch.depth).fold(0.0, crate::math::max);
    assert!(deepest < 2.0 * SLOP, "deepest overlap {deepest} (C22f, C22i)");
    let top = world.ids().last().expect("ten crates");
    close(world.position(top).y, 19.0, 10.0 * SLOP + 0.01);
    close(world.velocity(top).length(), 0.0, 1e-3);
}

#[test]
fn bodies_at_one_point_separate_and_stay_finite() {
    for shape in [Shape::circle(6.5), Shape::rect(4.0, 4.0)] {
        let mut world = world(Relaxation::default(), 0.0);
        for _ in 0..40 {
            add(&mut world, BodyDef { shape, restitution: 0.0, ..BodyDef::default() });
        }
        steps(&mut world, 600);
        assert!(world.is_finite());
        let deepest = world.touches().iter().map(|touch| touch.depth).fold(0.0, crate::math::max);
        assert!(deepest < 0.05, "{shape:?} still overlap by {deepest}");
    }
}

// --- Friction -----------------------------------------------------------------------------------

/// Lets a crate slide over a floor at 20 units/s, and returns how far it slid and in how many steps.
fn slide(
    friction: f32,
    floor_friction: f32,
    gravity: f32,
    mass: f32,
    iterations: u32,
) -> (f32, u32) {
    let mut world = world(Relaxation { iterations, ..Relaxation::default() }, gravity);
    floor(&mut world, floor_friction);
    let id = add(&mut world, BodyDef { friction, mass, ..crate_at(0.0, 1.0 - SLOP) });
    steps(&mut world, 5);
    world.set_velocity(id, Vec2::new(20.0, 0.0));
    let start = world.position(id).x;
    for step in 1..=1200 {
        world.step();
        assert!(world.velocity(id).x > -1e-5, "friction reversed a slide (C09)");
        if world.velocity(id).x < 1e-4 {
            return (world.position(id).x - start, step);
        }
    }
    (f32::INFINITY, u32::MAX)
}

#[test]
fn a_slide_stops_at_the_coulomb_distance() {
    for (friction, gravity) in [(0.3, 50.0), (0.6, 50.0), (0.3, 500.0), (1.0, 20.0)] {
        let (distance, steps) = slide(friction, friction, gravity, 1.0, 15);
        let braking = friction * gravity;
        // A step moves before it brakes, so the distance is off by at most one step's path.
        close(distance, 400.0 / (2.0 * braking), 20.0 / 60.0 + 0.005 * 200.0 / braking);
        close(steps as f32 / 60.0, 20.0 / braking, 0.04);
    }
}

#[test]
fn braking_does_not_depend_on_mass_passes_or_seams() {
    let reference = slide(0.3, 0.3, 50.0, 1.0, 15).0;
    for mass in [0.01, 0.1, 100.0] {
        close(slide(0.3, 0.3, 50.0, mass, 15).0, reference, 0.01 * reference);
    }
    for iterations in [1, 4, 60] {
        close(slide(0.3, 0.3, 50.0, 1.0, iterations).0, reference, 0.01 * reference);
    }
}

#[test]
fn both_surfaces_count() {
    assert_eq!(slide(0.3, 0.0, 50.0, 1.0, 15).0, f32::INFINITY, "no ice (C12)");
    let mixed = slide(0.4, 0.1, 50.0, 1.0, 15).0;
    let mean = slide(0.2, 0.2, 50.0, 1.0, 15).0;
    close(mixed, mean, 0.01 * mean);
}

#[test]
fn either_body_of_a_pair_is_braked_and_momentum_is_kept() {
    // The second body of the pair slides over the first, and both are free (C08, C11).
    let mut world = world(Relaxation::default(), 50.0);
    floor(&mut world, 0.0);
    let sled =
        BodyDef { shape: Shape::rect(40.0, 2.0), friction: 0.0, ..crate_at(0.0, 1.0 - SLOP) };
    let sled = add(&mut world, BodyDef { friction: 1.0, ..sled });
    let top = add(&mut world, BodyDef { friction: 0.25, ..crate_at(-10.0, 3.0 - 2.0 * SLOP) });
    steps(&mut world, 5);
    world.set_velocity(top, Vec2::new(10.0, 0.0));
    steps(&mut world, 60);
    close(world.velocity(top).x, 5.0, 0.05);
    close(world.velocity(sled).x, 5.0, 0.05);
}

#[test]
fn boxes_moving_together_have_no_friction() {
    let mut world = world(Relaxation::default(), 0.0);
    let together = Vec2::new(0.0, 10.0);
    let a = add(&mut world, BodyDef { velocity: together, ..crate_at(0.0, 0.0) });
    let b = add(&mut world, BodyDef { velocity: together, ..crate_at(1.999, 0.0) });
    steps(&mut world, 10);
    assert_eq!((world.velocity(a), world.velocity(b)), (together, together), "C11");
}

#[test]
fn a_rider_is_carried_by_a_moving_platform() {
    let mut world = world(Relaxation::default(), 50.0);
    let slab =
        BodyDef { shape: Shape::rect(30.0, 3.0), motion: Motion::Kinematic, ..BodyDef::default() };
    let slab = add(&mut world, BodyDef { friction: 0.6, ..slab });
    let rider = add(&mut world, BodyDef { friction: 0.6, ..crate_at(0.0, 2.5) });
    steps(&mut world, 30);
    world.set_velocity(slab, Vec2::new(10.0, 0.0));
    steps(&mut world, 60);
    close(world.velocity(rider).x, 10.0, 1e-3);
    let lag = world.position(slab).x - world.position(rider).x;
    assert!((0.0..2.0).contains(&lag), "rider slid by {lag} while it sped up");
    for up in [10.0, -10.0, 0.0] {
        world.set_velocity(slab, Vec2::new(0.0, up));
        steps(&mut world, 60);
        close(world.velocity(rider).y, up, 1e-2);
        close(world.position(rider).y - world.position(slab).y, 2.5, 0.02);
    }
}

#[test]
fn a_kinematic_body_is_not_moved_by_contacts() {
    let mut world = world(Relaxation::default(), 50.0);
    let slab =
        BodyDef { motion: Motion::Kinematic, velocity: Vec2::new(0.0, -1.0), ..crate_at(0.0, 0.0) };
    let slab = add(&mut world, slab);
    add(&mut world, BodyDef { mass: 1e4, ..crate_at(0.0, 5.0) });
    steps(&mut world, 60);
    close(world.position(slab).y, -1.0, 1e-4);
    assert_eq!(world.velocity(slab), Vec2::new(0.0, -1.0));
}

#[test]
fn a_box_that_coasts_over_an_edge_keeps_its_speed() {
    // The contact normal jumps from the top to the side when the x overlap becomes the smaller one.
    for speed in [0.5, 3.0, 20.0] {
        let mut world = world(Relaxation::default(), 50.0);
        let slab = BodyDef {
            shape: Shape::rect(20.0, 10.0),
            motion: Motion::Static,
            ..BodyDef::default()
        };
        add(&mut world, BodyDef { position: Vec2::new(0.0, -5.0), friction: 0.0, ..slab });
        let id = add(&mut world, BodyDef { friction: 0.0, ..crate_at(9.0, 1.0 - SLOP) });
        steps(&mut world, 5);
        world.set_velocity(id, Vec2::new(speed, 0.0));
        while world.position(id).y > -5.0 {
            world.step();
            assert!((world.velocity(id).x - speed).abs() < 1e-4, "{}", world.velocity(id).x);
        }
    }
}

#[test]
fn two_worlds_stepped_in_turns_are_independent() {
    let build = |count: usize| {
        let mut world = world(Relaxation::default(), 50.0);
        floor(&mut world, 0.3);
        for i in 0..count {
            add(&mut world, crate_at((i % 3) as f32 * 1.9, 2.0 + i as f32));
        }
        world
    };
    let (mut alone, mut one, mut other) = (build(12), build(12), build(7));
    steps(&mut alone, 100);
    for _ in 0..100 {
        one.step();
        other.step();
    }
    assert_eq!(one.hash(), alone.hash(), "C22e");
}

#[test]
fn bodies_share_no_state() {
    let mut world = world(Relaxation::default(), 50.0);
    let a = add(&mut world, BodyDef { mass: 4.0, ..crate_at(0.0, 0.0) });
    let b = add(&mut world, crate_at(50.0, 0.0));
    world.set_velocity(a, Vec2::new(9.0, 0.0));
    world.set_gravity_scale(a, 0.0);
    world.step();
    close(world.velocity(b).x, 0.0, 0.0);
    close(world.velocity(b).y, -50.0 / 60.0, 1e-6);
    assert_eq!((world.inverse_mass(a), world.inverse_mass(b)), (0.25, 1.0));
}

#[test]
fn a_pair_of_one_group_touches_once() {
    let mut world = world(Relaxation::default(), 0.0);
    add(&mut world, crate_at(0.0, 0.0));
    add(&mut world, crate_at(1.0, 0.0));
    world.step();
    assert_eq!(world.touches().len(), 1, "C22g");
}

#[test]
fn projection_alone_separates_and_impulses_alone_stop() {
    // Overlapping bodies at rest separate without gaining speed (A0.10). Closing bodies that hardly overlap are
    // stopped, not thrown apart (A0.11).
    let mut still = world(Relaxation::default(), 0.0);
    let a = add(&mut still, crate_at(0.0, 0.0));
    let b = add(&mut still, crate_at(1.0, 0.0));
    steps(&mut still, 10);
    assert!(still.position(b).x - still.position(a).x > 2.0 - 2.0 * SLOP);
    assert_eq!((still.velocity(a), still.velocity(b)), (Vec2::ZERO, Vec2::ZERO));
    let mut closing = world(Relaxation::default(), 0.0);
    let a = add(&mut closing, BodyDef { velocity: Vec2::new(0.2, 0.0), ..crate_at(0.0, 0.0) });
    let b = add(&mut closing, BodyDef { velocity: Vec2::new(-0.2, 0.0), ..crate_at(1.999, 0.0) });
    closing.step();
    close((closing.velocity(a) - closing.velocity(b)).length(), 0.0, 1e-6);
}
