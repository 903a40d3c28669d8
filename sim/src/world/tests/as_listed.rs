//! Tests that the chapter's solver as printed has the defects that docs/physics.md describes.

use super::*;
use crate::state::bytes::{StateReader, StateWriter};

fn listed(gravity: f32) -> World {
    let mut world = world(Relaxation::default(), gravity);
    world.set_listed(true);
    world
}

#[test]
fn light_bodies_fall_faster() {
    for (mass, fall) in [(0.1, 254.2), (0.7, 36.3), (2.0, 12.7), (10.0, 2.54)] {
        let mut world = listed(50.0);
        let id = add(&mut world, BodyDef { mass, ..BodyDef::default() });
        steps(&mut world, 60);
        close(-world.position(id).y, fall, 0.1);
    }
}

#[test]
fn friction_brakes_the_first_body_alike_under_every_load_and_drives_the_second() {
    for gravity in [5.0, 50.0, 500.0] {
        let mut world = listed(gravity);
        let sliding =
            BodyDef { velocity: Vec2::new(30.0, 0.0), friction: 0.3, ..crate_at(0.0, 0.99) };
        let id = add(&mut world, BodyDef { restitution: 0.0, ..sliding });
        floor(&mut world, 0.3);
        steps(&mut world, 60);
        close(30.0 - world.velocity(id).x, 16.8, 0.3);
    }
    let mut world = listed(50.0);
    floor(&mut world, 0.3);
    let sliding = BodyDef { velocity: Vec2::new(5.0, 0.0), friction: 0.3, ..crate_at(-40.0, 0.99) };
    let id = add(&mut world, BodyDef { restitution: 0.0, ..sliding });
    steps(&mut world, 120);
    close(world.velocity(id).x, 38.6, 0.5);
}

#[test]
fn a_resting_body_keeps_a_velocity() {
    let mut world = listed(50.0);
    floor(&mut world, 0.0);
    let id = add(&mut world, BodyDef { restitution: 0.8, ..crate_at(0.0, 1.0) });
    steps(&mut world, 300);
    close(world.velocity(id).y, 0.370, 0.01);
    world.set_listed(false);
    steps(&mut world, 60);
    close(world.velocity(id).y, 0.0, 1e-5);
}

#[test]
fn a_rider_stays_behind() {
    let mut world = listed(50.0);
    let rider = add(&mut world, BodyDef { restitution: 0.0, ..crate_at(0.0, 1.5) });
    let lift =
        BodyDef { motion: Motion::Kinematic, shape: Shape::rect(60.0, 1.0), ..BodyDef::default() };
    add(&mut world, BodyDef { velocity: Vec2::new(20.0, 0.0), ..lift });
    steps(&mut world, 60);
    close(world.velocity(rider).x, 0.0, 1e-3);
}

#[test]
fn a_pass_less_than_asked_for_is_made_and_one_alone_is_none() {
    for (iterations, passes) in [(15, 14), (1, 0)] {
        let mut world = world(Relaxation { iterations, ..Relaxation::default() }, 50.0);
        world.set_listed(true);
        floor(&mut world, 0.0);
        let id = add(&mut world, crate_at(0.0, 1.0));
        steps(&mut world, 60);
        assert_eq!(world.solvers.passes(), passes);
        assert_eq!(world.position(id).y < -1.0, passes == 0, "it falls through the floor");
    }
}

#[test]
fn circles_that_touch_are_a_contact_and_those_with_one_centre_part_slowly() {
    let circle = BodyDef { shape: Shape::circle(1.0), ..BodyDef::default() };
    let mut world = listed(0.0);
    add(&mut world, circle);
    add(&mut world, BodyDef { position: Vec2::new(2.0, 0.0), ..circle });
    steps(&mut world, 1);
    assert_eq!(world.solvers.passes(), 14);
    let mut same = super::world(Relaxation { iterations: 2, ..Relaxation::default() }, 0.0);
    same.set_listed(true);
    let [a, b] = [add(&mut same, circle), add(&mut same, circle)];
    steps(&mut same, 1);
    close(same.position(b).y - same.position(a).y, 0.2 * 0.8, 1e-5);
}

#[test]
fn a_circle_in_the_left_of_a_box_leaves_by_a_far_side() {
    let out_of = |x: f32| {
        let mut world = listed(0.0);
        let wall = BodyDef {
            motion: Motion::Static,
            shape: Shape::rect(16.0, 22.0),
            ..BodyDef::default()
        };
        add(&mut world, wall);
        let position = Vec2::new(x, 4.0);
        let id =
            add(&mut world, BodyDef { shape: Shape::circle(1.0), position, ..BodyDef::default() });
        steps(&mut world, 30);
        world.position(id)
    };
    assert!(out_of(7.9).x > 8.0, "right: {}", out_of(7.9));
    let left = out_of(-7.9);
    assert!(left.y > 11.0 && left.x < -7.0, "it was 0.1 from the left side: {left}");
}

#[test]
fn it_holds_nothing_over_and_stays_finite() {
    let mut listed_first = listed(50.0);
    floor(&mut listed_first, 0.3);
    let mut ids = Vec::new();
    for row in 0..10 {
        let def = BodyDef { shape: Shape::circle(1.0), ..crate_at(0.0, 1.0 + row as f32) };
        ids.push(add(&mut listed_first, BodyDef { mass: 0.1 + row as f32, ..def }));
    }
    steps(&mut listed_first, 200);
    assert!(listed_first.is_finite());
    let mut saved = StateWriter::default();
    listed_first.save(&mut saved);
    let settings = listed_first.settings().clone();
    let mut copy =
        World::restore(settings, &mut StateReader::new(&saved.0)).expect("what it saved");
    copy.set_listed(true);
    for _ in 0..20 {
        steps(&mut listed_first, 1);
        steps(&mut copy, 1);
        assert_eq!(listed_first.hash(), copy.hash());
    }
}
