//! Tests that a step which needs more than its budget is aborted before it spends more.

use super::*;
use crate::{Conjugate, EmitterDef, Recipe, Source, StepBudget};

fn solvers() -> [Solver; 2] {
    let relaxation = Relaxation { iterations: 30, ..Relaxation::default() };
    [Solver::Relaxation(relaxation), Solver::Conjugate(Conjugate::default())]
}

/// Bouncing discs of this radius around one point, surrounded by walls.
fn heap(solver: Solver, count: u32, radius: f32, budget: StepBudget) -> World {
    let settings = WorldSettings { solver: Some(solver), budget, ..WorldSettings::default() };
    let mut world = World::new(settings);
    for (x, y, width, height) in [(0.0, -30.0, 80.0, 4.0), (-40.0, 0.0, 4.0, 80.0)] {
        let shape = Shape::rect(width, height);
        let position = Vec2::new(x, y);
        add(&mut world, BodyDef { shape, position, motion: Motion::Static, ..BodyDef::default() });
    }
    let mut rng = crate::Rng::new(5, 0);
    for _ in 0..count {
        let mut random = |most: f32| Vec2::new(rng.range(-most, most), rng.range(-most, most));
        let (shape, position, velocity) = (Shape::circle(radius), random(8.0), random(40.0));
        let def = BodyDef { shape, position, velocity, restitution: 0.9, ..BodyDef::default() };
        add(&mut world, def);
    }
    world
}

#[test]
fn too_many_pairs_end_a_step_before_they_are_listed() {
    let budget = StepBudget { pairs: 2000, ..StepBudget::UNLIMITED };
    for solver in solvers() {
        let mut world = heap(solver, 400, 12.0, budget);
        world.step();
        assert!(world.is_over_budget());
        let list = &world.pairs;
        let held = list.pairs.capacity();
        assert!(held <= 2 * (budget.pairs + 400), "room for {held} pairs");
        assert_eq!(
            (world.touches().len(), world.solvers.conjugate.contacts.constraints.len()),
            (0, 0)
        );
        let positions = world.bodies.center.clone();
        world.step();
        assert_eq!(world.bodies.center, positions, "the world stands still");
    }
}

#[test]
fn a_heap_that_grows_ends_at_the_same_step_each_time() {
    let budget = StepBudget { pairs: 300, ..StepBudget::UNLIMITED };
    for solver in solvers() {
        let ends = || {
            let mut world = heap(solver, 0, 1.0, budget);
            let steps = (0..300).find(|step| {
                let position = Vec2::new((step % 5) as f32, 10.0);
                let def = BodyDef { shape: Shape::circle(1.0), position, ..BodyDef::default() };
                add(&mut world, def);
                world.step();
                world.is_over_budget()
            });
            (steps, world.hash())
        };
        let (steps, hash) = ends();
        assert!(steps.is_some_and(|steps| steps > 20), "it ended at {steps:?}");
        assert_eq!(ends(), (steps, hash));
    }
}

#[test]
fn impacts_and_sweeps_take_no_more_work_than_the_budget_has() {
    let budget = StepBudget { work: 20_000, ..StepBudget::UNLIMITED };
    let mut world = heap(solvers()[1], 400, 3.0, budget);
    world.step();
    assert!(world.is_over_budget());
    let mut free = heap(solvers()[1], 400, 3.0, StepBudget::UNLIMITED);
    free.step();
    assert!(
        free.step_counts().solves > 10 * budget.work,
        "{} without a budget",
        free.step_counts().solves
    );
    assert!(
        world.step_counts().solves < 2 * budget.work,
        "{} with one",
        world.step_counts().solves
    );
}

/// Columns of crates side by side, which fall a little at first.
fn columns(height: u32, columns: u32, work: u64) -> World {
    let budget = StepBudget { work, ..StepBudget::UNLIMITED };
    let mut world = heap(solvers()[1], 0, 1.0, budget);
    for (column, row) in (0..columns).flat_map(|column| (0..height).map(move |row| (column, row))) {
        let position = Vec2::new(column as f32 * 1.98 - 20.0, row as f32 * 1.99 - 27.0);
        let velocity = Vec2::new(0.0, -0.5 * row as f32);
        add(
            &mut world,
            BodyDef { shape: Shape::rect(2.0, 2.0), position, velocity, ..BodyDef::default() },
        );
    }
    world
}

#[test]
fn an_island_that_needs_more_than_the_budget_is_over_and_never_solved_less_well() {
    // Tests a single column, and a calm heap.
    for (height, count) in [(20, 1), (12, 10)] {
        let mut free = columns(height, count, u64::MAX);
        free.step();
        let corrections = free.solvers.conjugate.work.corrections;
        let needed = free.step_counts().solves + corrections + 2 * u64::from(height * count) * 8;
        let (mut over, mut kept) = (0, 0);
        for part in 1..=200 {
            let mut world = columns(height, count, needed * part / 200);
            world.step();
            match world.is_over_budget() {
                true => over += 1,
                false => {
                    kept += 1;
                    assert_eq!(world.hash(), free.hash(), "{part}/200 of {needed}, {height} high");
                }
            }
        }
        assert!(over > 10 && kept > 10, "{over} over, {kept} kept, {height} high");
    }
}

#[test]
fn corrections_of_positions_count_too() {
    let (height, count) = (12, 10);
    let mut free = columns(height, count, u64::MAX);
    free.step();
    // This includes the most work that finding the pairs can take.
    let solved = free.step_counts().solves + 2 * u64::from(height * count) * 8;
    let corrections = free.solvers.conjugate.work.corrections;
    let is_over = |work| {
        let mut world = columns(height, count, work);
        world.step();
        world.is_over_budget()
    };
    assert!(is_over(solved), "{corrections} corrections");
    assert!(!is_over(solved + corrections));
}

#[test]
fn a_budget_that_is_kept_changes_nothing() {
    let budget = StepBudget { pairs: 5000, work: 1_000_000, obstacle_cells: 1 };
    for solver in solvers() {
        let mut world = heap(solver, 60, 1.0, budget);
        let mut free = heap(solver, 60, 1.0, StepBudget::UNLIMITED);
        for _ in 0..120 {
            world.step();
            free.step();
        }
        assert!(!world.is_over_budget());
        assert_eq!(world.hash(), free.hash());
    }
}

#[test]
fn obstacles_that_cover_each_other_end_a_world_before_their_cells_are_listed() {
    let budget = StepBudget { obstacle_cells: 10_000, ..StepBudget::UNLIMITED };
    let mut world = World::new(WorldSettings {
        recipes: vec![Recipe::default()],
        particles_max: 10,
        budget,
        ..WorldSettings::default()
    });
    let cover = |world: &mut World, count| {
        for _ in 0..count {
            let shape = Shape::rect(100.0, 100.0);
            add(world, BodyDef { shape, motion: Motion::Static, ..BodyDef::default() });
        }
    };
    let emitter = EmitterDef { recipe: 0, count: 5, seed: 1, source: Source::Point(Vec2::ZERO) };
    assert!(world.start_emitter(emitter));
    cover(&mut world, 2);
    (0..9).for_each(|_| world.step_particles());
    assert!(!world.is_over_budget());
    cover(&mut world, 1);
    world.step_particles();
    assert!(world.is_over_budget());
}

#[test]
fn particles_that_are_all_in_a_cell_full_of_obstacles_end_a_world() {
    let budget = StepBudget { obstacle_cells: 1000, ..StepBudget::UNLIMITED };
    let mut world = World::new(WorldSettings {
        recipes: vec![Recipe::default()],
        particles_max: 1000,
        gravity: Vec2::ZERO,
        budget,
        ..WorldSettings::default()
    });
    let tiny = |world: &mut World, position| {
        let shape = Shape::circle(0.01);
        add(world, BodyDef { shape, position, motion: Motion::Static, ..BodyDef::default() });
    };
    // Two bodies far away make the cells wide, and a hundred more share a single cell.
    tiny(&mut world, Vec2::new(-1000.0, 0.0));
    tiny(&mut world, Vec2::new(1000.0, 0.0));
    (0..100).for_each(|index| tiny(&mut world, Vec2::new(5.0 + 0.03 * index as f32, 0.0)));
    let emitter = |count| EmitterDef {
        recipe: 0,
        count,
        seed: 1,
        source: Source::Point(Vec2::new(6.0, 0.5)),
    };
    assert!(world.start_emitter(emitter(150)));
    (0..5).for_each(|_| world.step_particles());
    assert!(!world.is_over_budget(), "{} particles", world.particles().len());
    assert!(world.start_emitter(emitter(150)));
    (0..5).for_each(|_| world.step_particles());
    assert!(world.is_over_budget(), "{} particles", world.particles().len());
}
