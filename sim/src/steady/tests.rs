//! Tests that leaving out steady islands changes no bit, and that they are readmitted as soon as anything happens to
//! them.

use crate::rng::Rng;
use crate::state::bytes::{StateReader, StateWriter};
use crate::{
    BodyDef, BodyId, Conjugate, ForceSettings, Motion, Shape, Solver, Vec2, World, WorldSettings,
};

fn world() -> World {
    let mut world = World::new(WorldSettings {
        gravity: Vec2::new(0.0, -50.0),
        solver: Some(Solver::Conjugate(Conjugate::default())),
        ..WorldSettings::default()
    });
    for (x, y, width, height) in
        [(0.0, -5.0, 140.0, 10.0), (-45.0, 50.0, 10.0, 120.0), (45.0, 50.0, 10.0, 120.0)]
    {
        add(&mut world, BodyDef { motion: Motion::Static, ..box_at(x, y, width, height) });
    }
    world
}

fn add(world: &mut World, def: BodyDef) -> BodyId {
    world.add(&def).expect("there is room")
}

fn box_at(x: f32, y: f32, width: f32, height: f32) -> BodyDef {
    let position = Vec2::new(x, y);
    BodyDef { shape: Shape::rect(width, height), position, restitution: 0.0, ..BodyDef::default() }
}

fn stack(world: &mut World, x: f32, count: usize) -> Vec<BodyId> {
    (0..count).map(|row| add(world, box_at(x, 1.0 + 2.0 * row as f32, 2.0, 2.0))).collect()
}

/// Two stacks of 3 and 5 boxes, at rest.
fn two_stacks() -> (World, Vec<BodyId>, Vec<BodyId>) {
    let mut world = world();
    let (one, other) = (stack(&mut world, -10.0, 3), stack(&mut world, 10.0, 5));
    for _ in 0..120 {
        world.step();
    }
    assert_eq!(world.steady.count(), 8);
    (world, one, other)
}

/// A change to a world before a step.
type Happens<'a> = &'a dyn Fn(&mut World, u32, &mut Rng);

/// Steps a world and a twin that leaves nothing out, and compares their bits. Returns the largest number of bodies
/// left out.
fn compare(mut world: World, steps: u32, happens: Happens) -> usize {
    let mut twin = world.clone();
    twin.steady.is_off = true;
    let (mut rng, mut twin_rng) = (Rng::new(5, 1), Rng::new(5, 1));
    let mut most = 0;
    for step in 0..steps {
        happens(&mut world, step, &mut rng);
        happens(&mut twin, step, &mut twin_rng);
        world.step();
        twin.step();
        assert_eq!(world.hash(), twin.hash(), "step {step}");
        assert_eq!(world.touches(), twin.touches(), "step {step}");
        most = world.steady.count().max(most);
    }
    assert_eq!(twin.steady.count(), 0);
    most
}

/// A rain of circles and boxes that comes to rest within two seconds.
fn rain(count: u32, restitution: f32) -> World {
    let mut world = world();
    let mut rng = Rng::new(9, 0);
    for index in 0..count {
        let size = rng.range(0.7, 1.5);
        let shape = match rng.below(2) {
            0 => Shape::circle(size),
            _ => Shape::rect(2.0 * size, 2.0 * rng.range(0.7, 1.5)),
        };
        let (row, column) = ((index / 20) as f32, (index % 20) as f32);
        let position = Vec2::new((column - 9.5) * 3.8, 2.0 + row * 3.6);
        add(&mut world, BodyDef { shape, position, restitution, ..BodyDef::default() });
    }
    world
}

#[test]
fn a_pile_that_is_left_out_keeps_every_bit() {
    for restitution in [0.0, 0.5] {
        assert_eq!(compare(rain(120, restitution), 900, &|_, _, _| {}), 120);
    }
}

/// The impulses on a body under a high pile cancel only up to their own rounding, which does not count as a change.
#[test]
fn a_high_pile_is_left_out_as_a_whole() {
    const COLUMNS: usize = 40;
    const COUNT: usize = 2000;
    let mut world = world();
    let mut rng = Rng::new(7, 0);
    for index in 0..COUNT {
        let (row, column) = ((index / COLUMNS) as f32, (index % COLUMNS) as f32);
        let position = Vec2::new(2.0 * column - 39.0, 1.0 + 2.0 * row);
        let shape = Shape::circle(rng.range(0.6, 0.98));
        add(&mut world, BodyDef { shape, position, ..box_at(0.0, 0.0, 1.0, 1.0) });
    }
    let is_left_out = (0..1200).any(|_| {
        world.step();
        world.steady.count() == COUNT
    });
    assert!(is_left_out, "{} of {COUNT} are left out", world.steady.count());
}

#[test]
fn nothing_that_happens_to_a_pile_changes_another_bit_for_what_is_left_out() {
    let happens = |world: &mut World, step: u32, rng: &mut Rng| {
        let is_dynamic = |id: &BodyId| world.motion(*id) == Motion::Dynamic;
        let ids: Vec<BodyId> = world.ids().filter(is_dynamic).collect();
        let some = ids[rng.below(ids.len() as u32) as usize];
        match step {
            0..300 => {}
            _ if !step.is_multiple_of(40) => {}
            _ => match rng.below(9) {
                0 => world.set_velocity(some, Vec2::new(rng.range(-90.0, 90.0), 40.0)),
                1 | 2 => world.set_gravity_scale(some, rng.range(0.5, 2.0)),
                3 => assert!(world.remove(some)),
                4 => {
                    let at = Vec2::new(rng.range(-30.0, 30.0), rng.range(30.0, 60.0));
                    world.set_position(some, at);
                }
                5 => {
                    let velocity = Vec2::new(rng.range(-40.0, 40.0), -140.0);
                    let ball = BodyDef {
                        shape: Shape::circle(1.0),
                        restitution: 0.6,
                        velocity,
                        ..BodyDef::default()
                    };
                    let position = Vec2::new(rng.range(-30.0, 30.0), 60.0);
                    add(world, BodyDef { position, ..ball });
                }
                6 => {
                    let at = (rng.range(-30.0, 30.0), rng.range(1.0, 10.0));
                    add(world, BodyDef { motion: Motion::Static, ..box_at(at.0, at.1, 3.0, 1.0) });
                }
                7 => world.set_gravity(Vec2::new(rng.range(-20.0, 20.0), -50.0)),
                _ => {
                    let at = (rng.range(-30.0, 30.0), rng.range(20.0, 30.0));
                    let lift =
                        BodyDef { motion: Motion::Kinematic, ..box_at(at.0, at.1, 6.0, 1.0) };
                    let lift = add(world, lift);
                    world.set_velocity(lift, Vec2::new(0.0, rng.range(-10.0, -2.0)));
                }
            },
        }
    };
    for restitution in [0.0, 0.5] {
        assert!(compare(rain(120, restitution), 2400, &happens) > 60);
    }
}

#[test]
fn only_the_island_that_is_met_returns() {
    let (mut world, one, other) = two_stacks();
    let velocity = Vec2::new(0.0, -20.0);
    add(&mut world, BodyDef { velocity, ..box_at(-10.0, 9.0, 2.0, 2.0) });
    let mut fewest = 8;
    for _ in 0..30 {
        world.step();
        fewest = world.steady.count().min(fewest);
    }
    assert_eq!(fewest, other.len(), "the other stack stays out");
    (0..90).for_each(|_| world.step());
    assert_eq!(world.steady.count(), one.len() + 1 + other.len());
}

#[test]
fn a_step_of_a_world_at_rest_gathers_no_contact_and_reports_every_touch() {
    let (mut world, ..) = two_stacks();
    assert_eq!((world.solvers.conjugate.contacts.constraints.len(), world.touches().len()), (0, 8));
    world.step();
    assert_eq!((world.solvers.conjugate.contacts.constraints.len(), world.touches().len()), (0, 8));
    assert!(world.touches().iter().all(|touch| !touch.began));
}

#[test]
fn a_kinematic_body_that_starts_turns_or_stops_takes_its_load_along() {
    let mut world = world();
    let lift = BodyDef { motion: Motion::Kinematic, ..box_at(0.0, 1.0, 6.0, 2.0) };
    let lift = add(&mut world, lift);
    let load = add(&mut world, box_at(0.0, 3.0, 2.0, 2.0));
    // The box juts out so far that the lift leaves it without support within a tick.
    add(&mut world, box_at(-3.9, 3.0, 2.0, 2.0));
    (0..60).for_each(|_| world.step());
    assert_eq!(world.steady.count(), 2);
    let mut rising = world.clone();
    rising.set_velocity(lift, Vec2::new(0.0, 6.0));
    (0..60).for_each(|_| rising.step());
    assert!((rising.position(load).y - 9.0).abs() < 0.01, "{}", rising.position(load));
    let drives = |world: &mut World, step: u32, _: &mut Rng| {
        let velocity = match step {
            0 => Vec2::new(6.0, 0.0),
            60 => Vec2::ZERO,
            200 => Vec2::new(-6.0, 3.0),
            230 => Vec2::new(0.0, -3.0),
            260 => Vec2::ZERO,
            _ => return,
        };
        world.set_velocity(lift, velocity);
    };
    assert_eq!(compare(world, 600, &drives), 2);
}

#[test]
fn a_world_with_steady_islands_that_was_saved_continues_by_the_same_bits() {
    let (mut world, ..) = two_stacks();
    let mut saved = StateWriter::default();
    world.save(&mut saved);
    let mut twin = World::restore(world.settings().clone(), &mut StateReader::new(&saved.0))
        .expect("what was saved is a state");
    for step in 0..120 {
        if step == 30 {
            for world in [&mut world, &mut twin] {
                add(
                    world,
                    BodyDef { velocity: Vec2::new(3.0, -30.0), ..box_at(-10.0, 20.0, 2.0, 2.0) },
                );
            }
        }
        world.step();
        twin.step();
        assert_eq!(world.hash(), twin.hash(), "step {step}");
        assert_eq!(world.touches(), twin.touches(), "step {step}");
    }
}

#[test]
fn bodies_outside_the_kill_zone_depart_even_if_they_stand_still() {
    let mut world = World::new(WorldSettings {
        gravity: Vec2::ZERO,
        solver: Some(Solver::Conjugate(Conjugate::default())),
        ..WorldSettings::default()
    });
    let out = world.settings().kill_zone.high.x + 50.0;
    let pair = [0.0, 2.01].map(|x| add(&mut world, box_at(out + x, 0.0, 2.0, 2.0)));
    world.step();
    assert!(pair.iter().all(|&id| !world.contains(id)), "both are gone");
}

#[test]
fn worlds_that_sleep_or_have_forces_leave_nothing_out() {
    let settings = |sleeping, forces| WorldSettings {
        gravity: Vec2::new(0.0, -50.0),
        solver: Some(Solver::Conjugate(Conjugate::default())),
        sleeping,
        forces,
        ..WorldSettings::default()
    };
    let windless = ForceSettings::default();
    for settings in [settings(true, None), settings(false, Some(windless))] {
        let mut world = World::new(settings);
        add(&mut world, BodyDef { motion: Motion::Static, ..box_at(0.0, -5.0, 140.0, 10.0) });
        stack(&mut world, 0.0, 3);
        for _ in 0..120 {
            world.step();
            assert_eq!(world.steady.count(), 0);
        }
    }
}

#[test]
fn friction_at_its_limit_ends_with_the_pull_that_needed_it() {
    // Tests one box, and a stack, since a single contact and an island are solved differently.
    for count in [1, 3] {
        let mut world = World::new(WorldSettings {
            solver: Some(Solver::Conjugate(Conjugate::default())),
            // This is beyond the share of the limit from which a contact counts as sliding.
            gravity: Vec2::new(0.4998 * 50.0, -50.0),
            ..WorldSettings::default()
        });
        let rough = |def| BodyDef { friction: 0.5, ..def };
        let floor = BodyDef { motion: Motion::Static, ..box_at(0.0, -5.0, 140.0, 10.0) };
        add(&mut world, rough(floor));
        let boxes: Vec<BodyId> = (0..count)
            .map(|row| add(&mut world, rough(box_at(0.0, 1.0 + 2.0 * row as f32, 2.0, 2.0))))
            .collect();
        (0..120).for_each(|_| world.step());
        let at_rest = |world: &World| boxes.iter().all(|&id| world.velocity(id) == Vec2::ZERO);
        assert!(at_rest(&world), "{count}");
        world.set_gravity(Vec2::new(0.0, -50.0));
        for step in 0..30 {
            world.step();
            for &id in &boxes {
                let speed = world.velocity(id).length();
                assert!(speed < 1e-3, "{count} boxes, step {step}: {speed}");
            }
        }
    }
}

#[test]
fn a_gas_beside_bodies_at_rest_takes_as_many_predictions_as_with_them() {
    let mut world = world();
    for index in 0..40 {
        for row in 0..3 {
            add(&mut world, box_at(-38.0 + 1.9 * index as f32, 0.5 + row as f32, 1.0, 1.0));
        }
    }
    for _ in 0..60 {
        world.step();
    }
    let (mut rng, side, y) = (Rng::new(9, 0), 24.0, 60.0);
    for (x, y, width, height) in [
        (0.0, y - 14.0, 32.0, 4.0),
        (0.0, y + 14.0, 32.0, 4.0),
        (-14.0, y, 4.0, 24.0),
        (14.0, y, 4.0, 24.0),
    ] {
        let wall = box_at(x, y, width, height);
        add(
            &mut world,
            BodyDef { motion: Motion::Static, restitution: 1.0, friction: 0.0, ..wall },
        );
    }
    for index in 0..64 {
        let (column, row) = ((index % 8) as f32 - 3.5, (index / 8) as f32 - 3.5);
        let disc = BodyDef {
            shape: Shape::circle(0.6),
            position: Vec2::new(column, row) * (side / 8.5) + Vec2::new(0.0, y),
            velocity: Vec2::new(rng.range(-1500.0, 1500.0), rng.range(-1500.0, 1500.0)),
            restitution: 1.0,
            friction: 0.0,
            gravity_scale: 0.0,
            ..BodyDef::default()
        };
        add(&mut world, disc);
    }
    let work = |world: &World| world.step_counts().predictions;
    let most = std::cell::Cell::new(0);
    let left_out = compare(world, 20, &|world, _, _| most.set(most.get().max(work(world))));
    assert!(most.get() > 40_000, "{} predictions", most.get());
    assert_eq!(left_out, 120);
}
