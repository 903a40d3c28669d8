//! Gaps and seams of immovable bodies, and what is shot at them.

use super::*;

/// docs/physics.md, A0.7.
#[test]
fn a_body_skips_a_platform_from_the_speed_at_which_its_center_may_miss_it() {
    let passes = |radius: f32, speed: f32| {
        let from = |share: f32| {
            let settings = WorldSettings {
                speed_max: 1000.0,
                gravity: Vec2::ZERO,
                ..WorldSettings::default()
            };
            let mut world = World::new(settings);
            let fixed = BodyDef { shape: Shape::rect(60.0, 3.0), ..crate_at(0.0, -1.5) };
            add(&mut world, BodyDef { motion: Motion::Static, ..fixed });
            let position = Vec2::new(0.0, radius + share * speed / 60.0);
            let def = BodyDef { shape: Shape::circle(radius), position, ..BodyDef::default() };
            let id = add(&mut world, BodyDef { velocity: Vec2::new(0.0, -speed), ..def });
            steps(&mut world, 10);
            world.position(id).y < -1.5
        };
        (1..100).any(|share| from(share as f32 / 100.0))
    };
    for (radius, speed) in [(1.5, 270.0), (6.5, 570.0), (11.0, 840.0)] {
        assert!(!passes(radius, speed * 0.99) && passes(radius, speed * 1.02), "radius {radius}");
    }
}
