//! Peers of Jostle behind the report's `Engine`: rotation locked, sleep off, their defaults
//! otherwise, speed caps raised out of the way.

mod box2d;
mod rapier;

use box2d::Box2d;
use jostle_report::methods::{Family, Field, Method, boxed};
use rapier::Rapier;

/// Sub-steps of a tick; both peers take 4 unless told otherwise.
const SUB_STEPS: &[f64] = &[1.0, 2.0, 4.0, 8.0, 16.0];

/// Entries for the report's table of methods.
pub const PEERS: [Method; 2] = [
    Method {
        name: "Box2D 3.2",
        family: Family::Peer,
        knob: "sub-steps",
        settings: SUB_STEPS,
        default: Some(4.0),
        divides_step: true,
        field: Field::All,
        in_stability: true,
        build: |scene, sub_steps| boxed(Box2d::new(scene, sub_steps as i32)),
    },
    Method {
        name: "rapier2d 0.36.1",
        family: Family::Peer,
        knob: "sub-steps",
        settings: SUB_STEPS,
        default: Some(4.0),
        divides_step: true,
        field: Field::All,
        in_stability: true,
        build: |scene, sub_steps| boxed(Rapier::new(scene, sub_steps as usize)),
    },
];
