//! Drag and wind in a scene file.

use super::limits::WIND_MAX;
use super::spec::Scene;
use super::table::{Field, Range};
use glam::Vec2;
use jostle_sim::Drag;

const LINEAR: Range = Range::from(0.0, 1000.0);
const QUADRATIC: Range = Range::from(0.0, 1000.0);

/// The `drag` of a table: a rate, or both rates.
pub(super) fn drag(field: &Field, default: Drag) -> Drag {
    if !field.is_given() {
        return default;
    }
    if field.is_number() {
        return Drag { linear: field.number(0.0, LINEAR), quadratic: 0.0 };
    }
    let allowed = format!("{LINEAR}, or {{ linear = k, quadratic = q }}");
    field.table_or(&allowed, |rates| Drag {
        linear: rates.get("linear").number(0.0, LINEAR),
        quadratic: rates.get("quadratic").number(0.0, QUADRATIC),
    })
}

pub(super) fn wind(field: &Field) -> Vec2 {
    field.vector(Vec2::ZERO, Range::from(-WIND_MAX, WIND_MAX))
}

/// Refuses wind without drag: no body would feel it.
pub(super) fn check_wind(field: &Field, scene: &Scene) {
    if field.is_given() && !scene.has_drag() {
        field.refuse("nothing: no body has drag, by which it would feel the wind");
    }
}
