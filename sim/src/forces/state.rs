//! Serialization of drag and springs (12 bytes per body with drag, 29 per spring).

use super::Forces;
use super::air::{Drag, FORCE_MAX};
use super::springs::{Spring, SpringEnd};
use crate::bodies::Bodies;
use crate::state::Subject;
use crate::state::io::{NOBODY, StateIo, plausible};
use glam::Vec2;

const DRAG_BYTES: usize = 12;
const SPRING_BYTES: usize = 29;

impl Forces {
    /// Describes the bodies' drag, and the springs.
    pub fn state(&self, bodies: &Bodies, io: &mut impl StateIo) -> (Vec<(u32, Drag)>, Vec<Spring>) {
        (self.drag_state(bodies, io), self.spring_state(bodies, io))
    }

    fn drag_state(&self, bodies: &Bodies, io: &mut impl StateIo) -> Vec<(u32, Drag)> {
        let limits = [bodies.alive.len(), DRAG_BYTES];
        let (name, given) = ("number of bodies with drag", self.dragged.iter().copied());
        let mut last = None;
        io.list(name, limits, given, (0, Drag::NONE), |io, _, (slot, drag)| {
            let slot = io.saved_word("body with drag", slot);
            let lives = bodies.alive.get(slot as usize) == Some(&true);
            io.check("body with drag", || lives && last < Some(slot));
            if lives {
                io.subject(Subject::Body(bodies.id(slot)));
            }
            last = Some(slot);
            let linear = io.number("linear drag", drag.linear, is_force);
            let quadratic = io.number("quadratic drag", drag.quadratic, is_force);
            (slot, Drag { linear, quadratic })
        })
    }

    fn spring_state(&self, bodies: &Bodies, io: &mut impl StateIo) -> Vec<Spring> {
        io.subject(Subject::WORLD);
        io.bits("springs", self.springs.len() as u32);
        let (body, end) = (NOBODY, SpringEnd::Body(NOBODY));
        let blank = Spring { body, end, rest_length: 0.0, stiffness: 0.0, damping: 0.0 };
        let (limits, given) = ([self.springs_max, SPRING_BYTES], self.springs.iter().copied());
        io.list("number of springs", limits, given, blank, |io, index, mut it| {
            io.subject(Subject::Numbered("spring", index));
            it.body = io.id("body", it.body);
            io.check("body", || bodies.contains(it.body));
            let [end] = io.saved("end", [u8::from(matches!(it.end, SpringEnd::Body(_)))]);
            let end = io.checked("end", it.end, || match end {
                0 => Some(SpringEnd::Point(Vec2::ZERO)),
                1 => Some(SpringEnd::Body(NOBODY)),
                _ => None,
            });
            it.end = match end {
                SpringEnd::Point(end) => {
                    SpringEnd::Point(io.vector(["end.x", "end.y"], end, plausible))
                }
                SpringEnd::Body(other) => {
                    let other = io.id("other body", other);
                    io.check("other body", || bodies.contains(other) && other != it.body);
                    SpringEnd::Body(other)
                }
            };
            it.rest_length = io.number("rest length", it.rest_length, is_force);
            it.stiffness = io.number("stiffness", it.stiffness, is_force);
            it.damping = io.number("damping", it.damping, is_force);
            it
        })
    }
}

fn is_force(value: f32) -> bool {
    (0.0..=FORCE_MAX).contains(&value)
}
