//! Springs in a scene file.

use super::limits::SIZE_MAX;
use super::spec::{Location, Placed, PlacedSpring};
use super::table::{Field, POSITION, Range, Table, one_of};
use glam::Vec2;
use jostle_sim::Motion;

const STIFFNESS: Range = Range::above(0.0, 1.0e9);
const DAMPING: Range = Range::from(0.0, 1.0e9);
/// Ten swings a tick: nothing is stiffer.
const FREQUENCY: Range = Range::above(0.0, 600.0);
const DAMPING_RATIO: Range = Range::from(0.0, 100.0);

/// Reads `position` or `follow`, one of which must be there.
pub(super) fn location(table: &Table, bodies: &[Placed]) -> Location {
    let [position, follow] = table.either("position", "follow");
    if !position.is_given() && !follow.is_given() {
        position.refuse("[x, y], or follow = \"name\"");
    }
    match follow.is_given() {
        true => Location::Body(named(&follow, bodies).unwrap_or(0)),
        false => Location::Point(position.vector(Vec2::ZERO, POSITION)),
    }
}

/// Reads one entry of `springs`; nothing where it is wrong.
pub(super) fn spring(table: &Table, bodies: &[Placed]) -> Option<PlacedSpring> {
    let holder = table.need("body", "the name of a body");
    let end = table.need("to", "[x, y], or the name of another body");
    let length = table.get("length");
    let strength = Strength::read(table);
    let body = named(&holder, bodies)?;
    let to = match end.word() {
        Some(_) => Location::Body(named(&end, bodies)?),
        None => Location::Point(end.vector(Vec2::ZERO, POSITION)),
    };
    if to == Location::Body(body) {
        end.refuse("another body");
    }
    let Some(mass) = swinging_mass(bodies, body, to) else {
        holder.refuse("a spring with a dynamic body at one end");
        return None;
    };
    let far = match to {
        Location::Point(point) => point,
        Location::Body(other) => bodies[other].def.position,
    };
    let distance = (far - bodies[body].def.position).length();
    let length = length.number(distance, Range::from(0.0, 4.0 * SIZE_MAX));
    let (stiffness, damping) = strength.of(mass);
    Some(PlacedSpring { body, to, length, stiffness, damping })
}

/// The mass that swings: m1 m2 / (m1 + m2), where a body that does not move has infinite mass.
fn swinging_mass(bodies: &[Placed], body: usize, to: Location) -> Option<f32> {
    let inv_mass = |index: usize| match bodies[index].def.motion {
        Motion::Dynamic => 1.0 / bodies[index].def.mass,
        Motion::Static | Motion::Kinematic => 0.0,
    };
    let other = match to {
        Location::Point(_) => 0.0,
        Location::Body(other) => inv_mass(other),
    };
    let sum = inv_mass(body) + other;
    (sum > 0.0).then(|| 1.0 / sum)
}

/// Stiffness and damping, given as such or by how the spring swings.
struct Strength {
    stiffness: f32,
    frequency: Option<f32>,
    damping: f32,
    damping_ratio: Option<f32>,
}

impl Strength {
    fn read(table: &Table) -> Strength {
        let [stiffness, frequency] = table.either("stiffness", "frequency");
        let [damping, damping_ratio] = table.either("damping", "damping_ratio");
        if !stiffness.is_given() && !frequency.is_given() {
            stiffness.refuse("stiffness or frequency");
        }
        let given = |field: &Field, range| field.is_given().then(|| field.number(0.0, range));
        Strength {
            stiffness: stiffness.number(0.0, STIFFNESS),
            frequency: given(&frequency, FREQUENCY),
            damping: damping.number(0.0, DAMPING),
            damping_ratio: given(&damping_ratio, DAMPING_RATIO),
        }
    }

    fn of(&self, mass: f32) -> (f32, f32) {
        let stiffness = self.frequency.map_or(self.stiffness, |frequency| {
            let turn = std::f32::consts::TAU * frequency;
            turn * turn * mass
        });
        let damping = self
            .damping_ratio
            .map_or(self.damping, |ratio| 2.0 * ratio * (stiffness * mass).sqrt());
        (stiffness, damping)
    }
}

/// The index of the body that a field names.
pub(super) fn named(field: &Field, bodies: &[Placed]) -> Option<usize> {
    let is_it = |body: &Placed| body.name.is_some() && body.name.as_deref() == field.word();
    let index = bodies.iter().position(is_it);
    if index.is_none() {
        field.refuse(one_of(bodies.iter().filter_map(|body| body.name.as_deref())));
    }
    index
}

#[cfg(test)]
mod tests;
