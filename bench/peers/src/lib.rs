//! Jostle's peers behind the report's `Engine` trait. They run with their defaults, except that rotation is locked,
//! sleep is off unless a scene asks for it, and speed caps are raised so that they have no effect.

mod box2d;
mod forces;
mod rapier;
pub mod traffic;

use box2d::Box2d;
use jostle_report::engine::Build;
use jostle_report::methods::{Family, Field, Method, boxed};
use rapier::Rapier;

/// Sub-steps per tick; both peers default to 4.
const SUB_STEPS: &[f64] = &[1.0, 2.0, 4.0, 8.0, 16.0];

/// The length unit of the second configuration, as chosen by a game with a gravity of 50 units/s^2: five units per
/// metre.
const LONG: f32 = 5.0;

/// Entries for the report's table of methods.
pub const PEERS: [Method; 4] = [
    peer("Box2D 3.2", Field::All, |scene, sub_steps| {
        boxed(Box2d::new(scene, sub_steps as i32, 1.0))
    }),
    peer("rapier2d 0.36.1", Field::All, |scene, sub_steps| {
        boxed(Rapier::new(scene, sub_steps as usize, 1.0))
    }),
    peer("Box2D 3.2, length unit 5", Field::StrongGravity, |scene, sub_steps| {
        boxed(Box2d::new(scene, sub_steps as i32, LONG))
    }),
    peer("rapier2d 0.36.1, length unit 5", Field::StrongGravity, |scene, sub_steps| {
        boxed(Rapier::new(scene, sub_steps as usize, LONG))
    }),
];

const fn peer(name: &'static str, field: Field, build: Build) -> Method {
    Method {
        name,
        family: Family::Peer,
        knob: "sub-steps",
        settings: SUB_STEPS,
        default: Some(4.0),
        divides_step: true,
        field,
        in_stability: matches!(field, Field::All),
        build,
    }
}
