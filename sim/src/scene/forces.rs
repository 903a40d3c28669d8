//! What a scene file says about forces: drag, wind and springs.

use super::actors::Place;
use super::bodies::PLACE;
use super::document::{Field, Range, Table, one_of};
use super::{Placed, SIZE_MAX, SPRINGS_MAX, Scene, SceneError, WIND_MAX};
use crate::forces::Drag;
use crate::world::Motion;
use glam::Vec2;

/// A spring between two places of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSpring {
    /// Entry of [`Scene::bodies`] that it holds.
    pub body: usize,
    /// What it is held to.
    pub to: Place,
    /// Length at rest, world units.
    pub length: f32,
    /// Force a unit of length.
    pub stiffness: f32,
    /// Force against a unit of speed.
    pub damping: f32,
}

const WIND: Range = Range::from(-WIND_MAX, WIND_MAX);
const LINEAR: Range = Range::from(0.0, 1000.0);
const QUADRATIC: Range = Range::from(0.0, 1000.0);
const STIFFNESS: Range = Range::above(0.0, 1.0e9);
const DAMPING: Range = Range::from(0.0, 1.0e9);
/// Ten swings a tick: nothing is stiffer.
const FREQUENCY: Range = Range::above(0.0, 600.0);
const DAMPING_RATIO: Range = Range::from(0.0, 100.0);
const SPRING_FIELDS: &[&str] =
    &["body", "to", "length", "stiffness", "damping", "frequency", "damping_ratio"];

/// The `drag` of a table: a rate, or both rates.
pub(super) fn drag(table: &Table, default: Drag) -> Result<Drag, SceneError> {
    let Some(field) = table.get("drag") else { return Ok(default) };
    if let Ok(linear) = field.number(LINEAR) {
        return Ok(Drag { linear, quadratic: 0.0 });
    }
    let allowed = format!("{LINEAR}, or {{ linear = k, quadratic = q }}");
    let rates = field
        .table(&["linear", "quadratic"])
        .map_err(|error| SceneError { allowed: allowed.clone(), ..error })?;
    let linear = rates.number("linear", 0.0, LINEAR)?;
    Ok(Drag { linear, quadratic: rates.number("quadratic", 0.0, QUADRATIC)? })
}

/// Reads `wind`; without drag nobody would feel it.
pub(super) fn wind(root: &Table, scene: &Scene) -> Result<Vec2, SceneError> {
    let wind = root.vector("wind", Vec2::ZERO, WIND)?;
    match root.get("wind") {
        Some(field) if !defs_with_drag(scene) => {
            Err(field.refuse("nothing: no body has drag, by which it would feel the wind"))
        }
        _ => Ok(wind),
    }
}

/// Whether any body of the scene has drag.
pub(super) fn defs_with_drag(scene: &Scene) -> bool {
    let placed = scene.bodies.iter().map(|body| &body.def);
    let layouts = scene.layouts.iter().map(|layout| &layout.def);
    let hero = scene.hero.iter().map(|hero| &hero.body);
    let pack = scene.pack.iter().map(|pack| &pack.body);
    let mut all = placed.chain(layouts).chain(hero).chain(pack).chain(&scene.dumb);
    all.any(|def| def.drag != Drag::NONE)
}

/// Reads `springs`.
pub(super) fn springs(root: &Table, bodies: &[Placed]) -> Result<Vec<PlacedSpring>, SceneError> {
    let list = root.list("springs")?;
    if list.len() > SPRINGS_MAX {
        let found = format!("{} entries", list.len());
        return Err(root.error("springs", found, format!("at most {SPRINGS_MAX}")));
    }
    list.iter().map(|field| spring(field, bodies)).collect()
}

fn spring(field: &Field, bodies: &[Placed]) -> Result<PlacedSpring, SceneError> {
    let table = field.table(SPRING_FIELDS)?;
    let holder = table.need("body", "the name of a body")?;
    let body = named(&holder, bodies)?;
    let end = table.need("to", "[x, y], or the name of another body")?;
    let to = match end.word() {
        Some(_) => Place::Body(named(&end, bodies)?),
        None => Place::Point(end.vector(PLACE)?),
    };
    if to == Place::Body(body) {
        return Err(end.refuse("another body"));
    }
    let mass = mass(bodies, body, to)
        .ok_or_else(|| holder.refuse("a spring with a dynamic body at one end"))?;
    let place = |index: usize| bodies[index].def.position;
    let far = match to {
        Place::Point(point) => point,
        Place::Body(other) => place(other),
    };
    let length = (far - place(body)).length();
    let length = table.number("length", length, Range::from(0.0, 4.0 * SIZE_MAX))?;
    let (stiffness, damping) = strength(&table, mass)?;
    Ok(PlacedSpring { body, to, length, stiffness, damping })
}

/// The mass that swings: m1 m2 / (m1 + m2), where what does not move weighs infinitely much.
fn mass(bodies: &[Placed], body: usize, to: Place) -> Option<f32> {
    let weight = |index: usize| match bodies[index].def.motion {
        Motion::Dynamic => 1.0 / bodies[index].def.mass,
        Motion::Static | Motion::Kinematic => 0.0,
    };
    let other = match to {
        Place::Point(_) => 0.0,
        Place::Body(other) => weight(other),
    };
    let sum = weight(body) + other;
    (sum > 0.0).then(|| 1.0 / sum)
}

/// Stiffness and damping, given as such or by how the spring swings.
fn strength(table: &Table, mass: f32) -> Result<(f32, f32), SceneError> {
    let stiffness = match (table.get("stiffness"), table.get("frequency")) {
        (Some(_), Some(field)) => {
            return Err(field.refuse_as("stiffness and frequency", "only one of the two"));
        }
        (Some(field), None) => field.number(STIFFNESS)?,
        (None, Some(field)) => {
            let turn = std::f32::consts::TAU * field.number(FREQUENCY)?;
            turn * turn * mass
        }
        (None, None) => {
            return Err(table.error(
                "stiffness",
                "nothing".into(),
                "stiffness or frequency".into(),
            ));
        }
    };
    let damping = match (table.get("damping"), table.get("damping_ratio")) {
        (Some(_), Some(field)) => {
            return Err(field.refuse_as("damping and damping_ratio", "only one of the two"));
        }
        (Some(field), None) => field.number(DAMPING)?,
        (None, Some(field)) => 2.0 * field.number(DAMPING_RATIO)? * (stiffness * mass).sqrt(),
        (None, None) => 0.0,
    };
    Ok((stiffness, damping))
}

fn named(field: &Field, bodies: &[Placed]) -> Result<usize, SceneError> {
    let is_it = |body: &Placed| body.name.is_some() && body.name.as_deref() == field.word();
    bodies.iter().position(is_it).ok_or_else(|| {
        let names: Vec<&str> = bodies.iter().filter_map(|body| body.name.as_deref()).collect();
        field.refuse(one_of(&names))
    })
}

#[cfg(test)]
mod tests;
