//! Springs in a scene file.

use super::bodies::Placed;
use super::field::{POSITION, Range};
use super::limits::SIZE_MAX;
use super::rules::Names;
use super::sources::Location;
use super::table::Table;
use glam::Vec2;
use jostle_sim::Motion;

const STIFFNESS: Range = Range::above(0.0, 1.0e9);
const DAMPING: Range = Range::from(0.0, 1.0e9);
/// Frequencies of up to ten oscillations per tick; nothing may be stiffer.
const FREQUENCY: Range = Range::above(0.0, 600.0);
const DAMPING_RATIO: Range = Range::from(0.0, 100.0);

/// A spring between a body and another body or a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSpring {
    /// The body at one end.
    pub body: usize,
    /// The other end; at least one end must be a dynamic body.
    pub to: Location,
    /// Rest length. Default: the initial distance.
    pub length: f32,
    /// Force per unit of length. Default: this or `frequency`.
    pub stiffness: f32,
    /// Force per unit of speed along the spring.
    pub damping: f32,
}

/// Reads one entry of `springs`; `None` if it is invalid.
pub(super) fn spring(table: &Table, bodies: &[Placed], names: &Names) -> Option<PlacedSpring> {
    let holder = table.need("body", "the name of a body");
    let end = table.need("to", "[x, y], or the name of another body");
    end.describe("[x, y], or the name of another body");
    let length = table.get("length");
    let [stiffness, damping] = ["stiffness", "damping"].map(|name| table.get(name));
    // Frequency at which the joined bodies oscillate without other forces, per second. Default: this or `stiffness`.
    let frequency = table.get("frequency");
    table.not_both("stiffness", "frequency");
    // Damping relative to critical damping; below 1, the spring oscillates. Not with `damping`. Default: `0`.
    let damping_ratio = table.get("damping_ratio");
    table.not_both("damping", "damping_ratio");
    if !stiffness.is_given() && !frequency.is_given() {
        stiffness.refuse("stiffness or frequency");
    }
    let body = names.body(&holder)?;
    let to = match end.word() {
        Some(_) => Location::Body(names.body(&end)?),
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
    let (stiffness, damping) = (stiffness.number(0.0, STIFFNESS), damping.number(0.0, DAMPING));
    let stiffness = frequency.given(|field| field.number(0.0, FREQUENCY)).map_or(stiffness, |hz| {
        let turn = std::f32::consts::TAU * hz;
        turn * turn * mass
    });
    let ratio = damping_ratio.given(|field| field.number(0.0, DAMPING_RATIO));
    let damping = ratio.map_or(damping, |ratio| 2.0 * ratio * (stiffness * mass).sqrt());
    Some(PlacedSpring { body, to, length, stiffness, damping })
}

/// The effective oscillating mass, m1 m2 / (m1 + m2), where an immovable body has infinite mass.
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

#[cfg(test)]
mod tests;
