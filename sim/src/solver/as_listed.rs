//! The chapter's solver as printed, including its defects, for scenes that demonstrate them
//! ([docs/physics.md](../../../docs/physics.md) lists them as C01 to C22a). Divisions by zero are avoided (C03,
//! C15), and instead of a separate loop for each pair rule (C22f), all pairs are relaxed together.
//!
//! Of the relaxation solver's settings, it uses only the number of iterations and the correction.

use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::math::{clamp_length, max, min};
use crate::narrow_phase::Manifold;
use crate::narrow_phase::overlap::side;
use crate::shape::Shape;
use crate::solver::relaxation::constraint::RelaxationConstraint;
use crate::solver::settings::Relaxation;
use glam::Vec2;

/// Tangential speed below which there is no braking, units/s (A2.20).
const SLIDE_MIN: f32 = 0.01;
/// Overlap of two concentric circles, as a share of their radii (C04).
const SAME_CENTER_DEPTH: f32 = 0.1;

/// Multiplies each body's gravity by its inverse mass, although gravity has already been applied (C18).
pub(crate) fn weigh(bodies: &mut Bodies, gain: Vec2, speed_max: f32) {
    let Bodies { moving, velocity, gravity_scale, inverse_mass, motion, .. } = bodies;
    for &slot in moving.iter() {
        let slot = slot as usize;
        if Bodies::is_pushed(motion[slot]) {
            let more = gain * gravity_scale[slot] * (inverse_mass[slot] - 1.0);
            velocity[slot] = clamp_length(velocity[slot] + more, speed_max);
        }
    }
}

/// Runs the passes and returns their number, which is one less than the setting (C22a). Nothing is kept from one
/// step to the next.
pub(crate) fn solve(
    bodies: &mut Bodies,
    constraints: &mut [RelaxationConstraint],
    pairs: &mut [Pair],
    settings: &Relaxation,
) -> u32 {
    pairs.iter_mut().for_each(Pair::clear_impulses);
    for pass in 1..settings.iterations {
        let mut hits = false;
        for constraint in constraints.iter_mut() {
            let slots = (constraint.a as usize, constraint.b as usize);
            if let Some(manifold) = contact(bodies, slots) {
                hits = true;
                let closing = resolve(bodies, slots, manifold, settings);
                constraint.closing = max(constraint.closing, closing);
            }
        }
        if !hits {
            return pass;
        }
    }
    settings.iterations - 1
}

/// The contact between two bodies.
fn contact(bodies: &Bodies, (a, b): (usize, usize)) -> Option<Manifold> {
    let offset = bodies.center[b] - bodies.center[a];
    match (bodies.shape[a], bodies.shape[b]) {
        (Shape::Circle { radius: radius_a }, Shape::Circle { radius: radius_b }) => {
            circles(offset, radius_a + radius_b)
        }
        (Shape::Box { half: half_a }, Shape::Box { half: half_b }) => {
            boxes(offset, half_a + half_b)
        }
        (Shape::Box { half }, Shape::Circle { radius }) => box_circle(offset, half, radius),
        (Shape::Circle { radius }, Shape::Box { half }) => {
            box_circle(-offset, half, radius).map(Manifold::flipped)
        }
    }
}

/// For two circles, touching counts as contact (C01), and concentric circles overlap by a tenth of their radii (C04).
fn circles(offset: Vec2, reach: f32) -> Option<Manifold> {
    let distance = offset.length();
    if distance > reach {
        None
    } else if distance == 0.0 {
        Some(Manifold { normal: Vec2::Y, separation: -reach * SAME_CENTER_DEPTH })
    } else {
        Some(Manifold { normal: offset / distance, separation: distance - reach })
    }
}

/// For two boxes in double precision, as in the chapter, passes shrink an overlap forever (C19). Here it soon becomes
/// 0, so touching has to count as contact.
fn boxes(offset: Vec2, reach: Vec2) -> Option<Manifold> {
    let Vec2 { x, y } = offset.abs() - reach;
    if x > 0.0 || y > 0.0 {
        None
    } else if x > y {
        Some(Manifold { normal: Vec2::new(side(offset.x), 0.0), separation: x })
    } else {
        Some(Manifold { normal: Vec2::new(0.0, side(offset.y)), separation: y })
    }
}

/// For a box and a circle, touching counts as contact too. A centre inside the box leaves along the axis on which
/// it is nearest to the upper or right side, which is wrong for many points to the left of or below the middle
/// (C02).
fn box_circle(offset: Vec2, half: Vec2, radius: f32) -> Option<Manifold> {
    let outside = offset.abs() - half;
    let outside = Vec2::new(max(outside.x, 0.0), max(outside.y, 0.0));
    let distance = outside.length();
    if distance > radius {
        return None;
    }
    if distance > 0.0 {
        let normal = outside / distance * Vec2::new(side(offset.x), side(offset.y));
        return Some(Manifold { normal, separation: distance - radius });
    }
    let away = (offset - half).abs();
    let (normal, inside) = if away.x < away.y {
        (Vec2::new(side(offset.x), 0.0), half.x - offset.x.abs())
    } else {
        (Vec2::new(0.0, side(offset.y)), half.y - offset.y.abs())
    };
    Some(Manifold { normal, separation: -(radius + inside) })
}

/// Corrects the positions, applies friction, and then lets the bodies bounce (A2.19 to A2.21). Returns the closing
/// speed.
fn resolve(
    bodies: &mut Bodies,
    (a, b): (usize, usize),
    manifold: Manifold,
    settings: &Relaxation,
) -> f32 {
    let Manifold { normal, separation } = manifold;
    let (inv_mass_a, inv_mass_b) = (bodies.inverse_mass[a], bodies.inverse_mass[b]);
    let inv_mass = inv_mass_a + inv_mass_b;
    if inv_mass <= 0.0 {
        return 0.0;
    }
    let correction = normal * (-separation / inv_mass * settings.correction);
    bodies.shift(a, correction * -inv_mass_a);
    bodies.shift(b, correction * inv_mass_b);
    // The second body gains speed where it should lose it (C08).
    let share = 1.0 / settings.iterations as f32;
    brake(bodies, a, normal, share);
    brake(bodies, b, normal, -share);
    let speed = (bodies.velocity[b] - bodies.velocity[a]).dot(normal);
    if speed > 0.0 {
        return 0.0;
    }
    // Bodies bounce no matter how slowly they meet (C16).
    let (material_a, material_b) = (bodies.material[a], bodies.material[b]);
    let restitution = min(material_a.restitution, material_b.restitution);
    let impulse = normal * (-(1.0 + restitution) * speed / inv_mass);
    bodies.velocity[a] -= impulse * inv_mass_a;
    bodies.velocity[b] += impulse * inv_mass_b;
    -speed
}

/// Subtracts a fixed amount from the body's own tangential speed, once per pass (C14), regardless of how much is left
/// (C09), the normal force (C10), and the other body's speed (C11) and material (C12), and even while they separate
/// (C13).
fn brake(bodies: &mut Bodies, slot: usize, normal: Vec2, share: f32) {
    let along = normal.perp();
    let slide = bodies.velocity[slot].dot(along);
    if slide.abs() < SLIDE_MIN {
        return;
    }
    let loss = bodies.material[slot].friction * bodies.inverse_mass[slot] * share;
    bodies.velocity[slot] -= along * if slide < 0.0 { -loss } else { loss };
}
