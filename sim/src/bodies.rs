//! Bodies, stored as plain vectors by slot, and the list of those that move.
//!
//! After its body is removed, a slot is reused with a new generation. All loops visit slots in ascending order, so
//! the order in which bodies were created matters only through the slots they received.

use crate::body::{BodyDef, BodyId, GROUPS_MAX, Material, Motion};
use crate::check;
use crate::math::min;
use crate::shape::{Aabb, Shape};
use glam::Vec2;

/// Reach of a body at rest, world units. A pair takes part in a step if the distance between its bounding boxes is
/// below the sum of their reaches when the solver starts. This leaves room for motion that the solver itself causes.
pub(crate) const REACH_MIN: f32 = 0.125;

/// All bodies; every vector has one entry per slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bodies {
    pub shape: Vec<Shape>,
    /// Half extent of `shape`; for a circle, the radius on both axes.
    pub half: Vec<Vec2>,
    pub center: Vec<Vec2>,
    pub velocity: Vec<Vec2>,
    /// 1 / mass; 0 for static and kinematic bodies and for free slots.
    pub inverse_mass: Vec<f32>,
    /// Factor in [0, 1] applied to this step's impulses when they warm-start the next one; see `relaxation`.
    pub warm_start_scale: Vec<f32>,
    /// Distance within which the step looks for other bodies, world units; see `pairs`.
    pub reach: Vec<f32>,
    /// Number of times the solver has moved the body. It is not part of the state, since it is only compared to detect
    /// changes.
    pub moves: Vec<u32>,
    pub gravity_scale: Vec<f32>,
    pub material: Vec<Material>,
    pub motion: Vec<Motion>,
    pub group: Vec<u8>,
    pub generation: Vec<u32>,
    pub alive: Vec<bool>,
    /// Smallest half-size among all bodies; `None` until it is next needed.
    thinnest: Option<f32>,
    /// Slots of the dynamic and kinematic bodies that a step visits, ascending. These are all except sleeping and
    /// steady ones.
    pub moving: Vec<u32>,
    /// Free slots in descending order, so that the lowest is taken first.
    free: Vec<u32>,
}

/// A body's properties and its position.
#[derive(Clone, Copy)]
pub(crate) struct Body {
    pub shape: Shape,
    pub center: Vec2,
    pub velocity: Vec2,
    pub inverse_mass: f32,
    pub warm_start_scale: f32,
    pub gravity_scale: f32,
    pub material: Material,
    pub motion: Motion,
    pub group: u8,
}

impl Bodies {
    pub fn add(&mut self, def: &BodyDef) -> BodyId {
        check_def(def);
        let slot = self.free.pop().unwrap_or_else(|| self.grow(0));
        let inverse_mass = match def.motion {
            Motion::Dynamic => 1.0 / def.mass,
            Motion::Static | Motion::Kinematic => 0.0,
        };
        let body = Body {
            shape: def.shape,
            center: def.position,
            velocity: def.velocity,
            inverse_mass,
            warm_start_scale: 1.0,
            gravity_scale: def.gravity_scale,
            material: Material { restitution: def.restitution, friction: def.friction },
            motion: def.motion,
            group: def.group,
        };
        self.put(slot, &body);
        self.id(slot)
    }

    /// Returns the body in a slot. It is always inlined, so that fields that the caller does not read cost nothing.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub fn body(&self, slot: u32) -> Body {
        let slot = slot as usize;
        Body {
            shape: self.shape[slot],
            center: self.center[slot],
            velocity: self.velocity[slot],
            inverse_mass: self.inverse_mass[slot],
            warm_start_scale: self.warm_start_scale[slot],
            gravity_scale: self.gravity_scale[slot],
            material: self.material[slot],
            motion: self.motion[slot],
            group: self.group[slot],
        }
    }

    /// Puts a body into an empty slot.
    pub fn put(&mut self, slot: u32, body: &Body) {
        let index = slot as usize;
        self.shape[index] = body.shape;
        self.half[index] = body.shape.half_extent();
        self.center[index] = body.center;
        self.velocity[index] = body.velocity;
        self.inverse_mass[index] = body.inverse_mass;
        self.warm_start_scale[index] = body.warm_start_scale;
        self.reach[index] = REACH_MIN;
        self.gravity_scale[index] = body.gravity_scale;
        self.material[index] = body.material;
        self.motion[index] = body.motion;
        self.group[index] = body.group;
        self.alive[index] = true;
        self.thinnest = None;
        if body.motion != Motion::Static {
            let at = self.moving.partition_point(|&other| other < slot);
            self.moving.insert(at, slot);
        }
    }

    /// Appends an empty slot, which [`Bodies::put`] fills.
    pub fn grow(&mut self, generation: u32) -> u32 {
        let slot = u32::try_from(self.alive.len()).expect("bodies_max is far below 2^32");
        self.shape.push(Shape::Circle { radius: 1.0 });
        self.half.push(Vec2::ONE);
        self.center.push(Vec2::ZERO);
        self.velocity.push(Vec2::ZERO);
        self.inverse_mass.push(0.0);
        self.warm_start_scale.push(1.0);
        self.reach.push(REACH_MIN);
        self.moves.push(0);
        self.gravity_scale.push(0.0);
        self.material.push(Material { restitution: 0.0, friction: 0.0 });
        self.motion.push(Motion::Static);
        self.group.push(0);
        self.generation.push(generation);
        self.alive.push(false);
        slot
    }

    /// Rebuilds the list of free slots once all bodies are restored.
    pub fn list_free(&mut self) {
        let slots = (0u32..).zip(&self.alive).filter_map(|(slot, &alive)| (!alive).then_some(slot));
        self.free = slots.collect();
        self.free.reverse();
    }

    /// Smaller half-size of the body in a slot, world units.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn thickness(&self, index: usize) -> f32 {
        min(self.half[index].x, self.half[index].y)
    }

    /// Whether bodies with this motion are affected by contacts and gravity.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn is_pushed(motion: Motion) -> bool {
        motion == Motion::Dynamic
    }

    pub fn remove(&mut self, id: BodyId) {
        let Some(index) = self.find(id) else { return };
        self.alive[index] = false;
        self.thinnest = None;
        self.generation[index] = self.generation[index].wrapping_add(1);
        self.inverse_mass[index] = 0.0;
        self.velocity[index] = Vec2::ZERO;
        if let Ok(at) = self.moving.binary_search(&id.index) {
            self.moving.remove(at);
        }
        let at = self.free.partition_point(|&other| other > id.index);
        self.free.insert(at, id.index);
    }

    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn contains(&self, id: BodyId) -> bool {
        let index = id.index as usize;
        index < self.alive.len() && self.alive[index] && self.generation[index] == id.generation
    }

    /// Returns the slot of a body. Looking up a removed body is a bug in the caller: debug builds panic, other
    /// builds return `None`.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn find(&self, id: BodyId) -> Option<usize> {
        let exists = self.contains(id);
        debug_assert!(exists, "body {}.{} does not exist", id.index, id.generation);
        exists.then_some(id.index as usize)
    }

    pub fn id(&self, slot: u32) -> BodyId {
        BodyId { index: slot, generation: self.generation[slot as usize] }
    }

    pub fn slots(&self) -> impl Iterator<Item = u32> + '_ {
        (0u32..).zip(&self.alive).filter_map(|(slot, &alive)| alive.then_some(slot))
    }

    pub fn count(&self) -> usize {
        self.alive.len() - self.free.len()
    }

    /// Smallest half-size among all bodies, world units; infinite if there are none.
    pub fn thinnest(&mut self) -> f32 {
        *self.thinnest.get_or_insert_with(|| {
            let alive = self.alive.iter().zip(&self.shape).filter(|(alive, _)| **alive);
            alive.fold(f32::INFINITY, |least, (_, shape)| min(least, shape.thickness()))
        })
    }

    /// Whether the position and velocity of a body are finite.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn is_finite(&self, slot: usize) -> bool {
        let (center, velocity) = (self.center[slot], self.velocity[slot]);
        (center.x + velocity.x + center.y + velocity.y).is_finite()
    }

    /// Moves a body and counts the move. A shift of zero, as for a body of infinite mass, is not counted.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn shift(&mut self, slot: usize, shift: Vec2) {
        if shift != Vec2::ZERO {
            self.center[slot] += shift;
            self.moves[slot] = self.moves[slot].wrapping_add(1);
        }
    }

    /// Bounding box of a body, grown by `margin` on every side.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    pub fn bounds(&self, slot: usize, margin: f32) -> Aabb {
        Aabb::around(self.center[slot], self.half[slot] + Vec2::splat(margin))
    }
}

/// Panics unless every field of a definition is in its documented range.
fn check_def(def: &BodyDef) {
    let half = def.shape.half_extent();
    let BodyDef { position, velocity, mass, restitution, friction, gravity_scale, .. } = *def;
    check::vector(half.is_finite() && half.x > 0.0 && half.y > 0.0, "body size", half);
    check::vector(position.is_finite(), "body position", position);
    let still = def.motion != Motion::Static || velocity == Vec2::ZERO;
    check::vector(velocity.is_finite() && still, "body velocity", velocity);
    let inverse = 1.0 / mass;
    let is_invertible = mass > 0.0 && mass.is_finite() && inverse > 0.0 && inverse.is_finite();
    check::number(is_invertible, "body mass", mass);
    check::number((0.0..=1.0).contains(&restitution), "restitution", restitution);
    check::number((0.0..=10.0).contains(&friction), "friction", friction);
    check::number(gravity_scale.is_finite(), "gravity scale", gravity_scale);
    assert!(usize::from(def.group) < GROUPS_MAX, "group {} not below {GROUPS_MAX}", def.group);
}
