//! Saved state of drag and springs (12 bytes for a body with drag, 29 for a spring).

use super::drag::{Drag, FORCE_MAX};
use super::springs::{Spring, SpringEnd};
use super::{ForceSettings, Forces};
use crate::bodies::Bodies;
use crate::body::BodyId;
use crate::state::bytes::{StateError, StateReader, StateWriter};
use crate::state::{StateVisitor, Subject};

const DRAG_BYTES: usize = 12;
const SPRING_BYTES: usize = 29;

impl Forces {
    pub fn visit(&self, bodies: &Bodies, visitor: &mut impl StateVisitor) {
        for &(slot, drag) in &self.dragged {
            let subject = Subject::Body(bodies.id(slot));
            visitor.number(subject, "linear drag", drag.linear);
            visitor.number(subject, "quadratic drag", drag.quadratic);
        }
        visitor.bits(Subject::WORLD, "springs", self.springs.len() as u32);
        for (index, spring) in (0u32..).zip(&self.springs) {
            let subject = Subject::Numbered("spring", index);
            visitor.name(subject, "body", spring.body);
            match spring.end {
                SpringEnd::Point(point) => visitor.vector(subject, ["end.x", "end.y"], point),
                SpringEnd::Body(id) => visitor.name(subject, "other body", id),
            }
            visitor.number(subject, "rest length", spring.rest_length);
            visitor.number(subject, "stiffness", spring.stiffness);
            visitor.number(subject, "damping", spring.damping);
        }
    }

    pub fn save(&self, out: &mut StateWriter) {
        out.word(self.dragged.len() as u32);
        for &(slot, drag) in &self.dragged {
            out.word(slot);
            out.number(drag.linear);
            out.number(drag.quadratic);
        }
        out.word(self.springs.len() as u32);
        for spring in &self.springs {
            out.body(Some(spring.body));
            match spring.end {
                SpringEnd::Point(point) => {
                    out.byte(0);
                    out.vector(point);
                }
                SpringEnd::Body(id) => {
                    out.byte(1);
                    out.body(Some(id));
                }
            }
            out.number(spring.rest_length);
            out.number(spring.stiffness);
            out.number(spring.damping);
        }
    }

    /// Restores the forces; the bodies are restored already.
    pub fn restore(
        settings: &ForceSettings,
        bodies: &Bodies,
        bytes: &mut StateReader,
    ) -> Result<Forces, StateError> {
        let mut forces = Forces::new(settings);
        for _ in 0..bytes.count(bodies.alive.len(), DRAG_BYTES, "number of bodies with drag")? {
            let slot = bytes.word("body with drag")?;
            let alive = bodies.alive.get(slot as usize) == Some(&true);
            let last = forces.dragged.last().map(|&(last, _)| last);
            bytes.check(alive && last < Some(slot), "body with drag")?;
            let (linear, quadratic) = (force(bytes, "drag")?, force(bytes, "drag")?);
            forces.dragged.push((slot, Drag { linear, quadratic }));
        }
        for _ in 0..bytes.count(settings.springs_max, SPRING_BYTES, "number of springs")? {
            let body = living(bodies, bytes)?;
            let end = match bytes.byte("end of a spring")? {
                0 => SpringEnd::Point(bytes.plausible("end of a spring")?),
                1 => SpringEnd::Body(living(bodies, bytes)?),
                _ => return Err(bytes.wrong("end of a spring")),
            };
            bytes.check(end != SpringEnd::Body(body), "end of a spring")?;
            let rest_length = force(bytes, "rest length")?;
            let (stiffness, damping) = (force(bytes, "stiffness")?, force(bytes, "damping")?);
            forces.springs.push(Spring { body, end, rest_length, stiffness, damping });
        }
        Ok(forces)
    }
}

fn force(bytes: &mut StateReader, field: &'static str) -> Result<f32, StateError> {
    let value = bytes.number(field)?;
    bytes.check((0.0..=FORCE_MAX).contains(&value), field)?;
    Ok(value)
}

fn living(bodies: &Bodies, bytes: &mut StateReader) -> Result<BodyId, StateError> {
    let id = bytes.body("body of a spring")?.filter(|&id| bodies.contains(id));
    id.ok_or_else(|| bytes.wrong("body of a spring"))
}
