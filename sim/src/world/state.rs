//! The World's state: visited word by word, saved as bytes, and restored from them.
//!
//! Only what the next step depends on is saved: the pair list as the pairs that hold or touch,
//! since it is only an accelerator, and properties shared by many bodies (size, mass, material)
//! once in a palette. A body takes 26 bytes of its own and 27 in the palette at worst, and 6 more
//! in a world that sleeps; a contact 17.

use super::{World, WorldSettings};
use crate::bodies::Bodies;
use crate::body::{GROUPS_MAX, Motion};
use crate::broad_phase::pairs::{Axis, Pair, key};
use crate::features::Features;
use crate::forces::Forces;
use crate::hash::StateHasher;
use crate::material::Material;
use crate::narrow_phase::overlap::overlap;
use crate::particles::Particles;
use crate::shape::Shape;
use crate::sleep::Rest;
use crate::state::bytes::{PLAUSIBLE_MAX, StateError, StateReader, StateWriter};
use crate::state::{Difference, StateDump, StateVisitor, Subject};
use crate::touches::Touch;
use glam::Vec2;
use std::collections::BTreeMap;

/// Properties shared by many bodies.
#[derive(Clone, Copy, PartialEq)]
struct BodyPrototype {
    shape: Shape,
    inverse_mass: f32,
    gravity_scale: f32,
    material: Material,
    motion: Motion,
    group: u8,
}

const PROTOTYPE_BYTES: usize = 27;
const SLOT_BYTES_MIN: usize = 6;
const CONTACT_BYTES: usize = 17;
/// Above every impulse: the heaviest stack of the heaviest bodies.
const IMPULSE_MAX: f32 = 1e15;
/// In place of a prototype: the slot is free.
const FREE: u16 = u16::MAX;
/// Flags of a contact.
const TOUCHING: u8 = 1;
const ALONG_X: u8 = 2;
const ALONG_Y: u8 = 4;

impl World {
    /// Digest of the raw bits of all state in id order: bodies, generations of free slots, resting
    /// impulses, particles and emitters.
    pub fn hash(&self) -> u64 {
        let mut hasher = StateHasher::default();
        self.visit(&mut hasher);
        hasher.finish()
    }

    /// Digest of the state within a step: [`World::hash`], and the pairs that take part.
    pub fn hash_in_step(&self) -> u64 {
        let mut hasher = StateHasher::default();
        self.visit_in_step(&mut hasher);
        hasher.finish()
    }

    /// Returns the first difference between two worlds within a step: of state, then of the pairs.
    pub fn first_difference(&self, other: &World) -> Option<Difference> {
        let (mut one, mut two) = (StateDump::default(), StateDump::default());
        self.visit_in_step(&mut one);
        other.visit_in_step(&mut two);
        one.first_difference(&two)
    }

    fn visit_in_step(&self, visitor: &mut impl StateVisitor) {
        self.visit(visitor);
        let relaxed = self.relaxation.constraints.iter().map(|pair| (pair.a, pair.b));
        let solved = self.conjugate.contacts.constraints.iter().map(|pair| (pair.a, pair.b));
        for (a, b) in relaxed.chain(solved) {
            visitor.bits(Subject::Contact(a, b), "taking part", 1);
        }
    }

    /// Visits all state in id order.
    pub fn visit(&self, visitor: &mut impl StateVisitor) {
        let bodies = &self.bodies;
        visitor.bits(Subject::WORLD, "slots", bodies.alive.len() as u32);
        for slot in 0..bodies.alive.len() as u32 {
            let (id, alive) = (bodies.id(slot), bodies.alive[slot as usize]);
            visitor.bits(Subject::Body(id), "life", id.generation << 1 | u32::from(alive));
        }
        bodies.slots().for_each(|slot| visit_body(bodies, slot, visitor));
        self.pairs.pairs.iter().for_each(|pair| visit_pair(pair, visitor));
        if self.settings.sleeping {
            self.visit_sleep(visitor);
        }
        self.particles.visit(visitor);
        if let Some(forces) = &self.forces {
            forces.visit(bodies, visitor);
        }
    }

    /// Visits, for every body that can move, its sleeping island or its still steps; the impulses
    /// of each sleeping island with its lowest slot.
    fn visit_sleep(&self, visitor: &mut impl StateVisitor) {
        let bodies = &self.bodies;
        for slot in bodies.slots() {
            if bodies.motion[slot as usize] == Motion::Static {
                continue;
            }
            let subject = Subject::Body(bodies.id(slot));
            let (lowest, still_steps) = self.sleep.rest_of(slot);
            visitor.bits(subject, "lowest body of its sleeping island", lowest);
            visitor.bits(subject, "steps at rest", u32::from(still_steps));
            if let Some(sleeping) = self.sleep.sleeping(slot).filter(|_| lowest == slot) {
                sleeping.pairs.iter().for_each(|pair| visit_pair(pair, visitor));
            }
        }
    }

    /// Saves everything that the next step depends on, except the settings.
    pub fn save(&self, out: &mut StateWriter) {
        self.save_bodies(out);
        self.save_contacts(out);
        self.particles.save(out);
        if let Some(forces) = &self.forces {
            forces.save(out);
        }
    }

    fn save_bodies(&self, out: &mut StateWriter) {
        let bodies = &self.bodies;
        let mut palette = Palette::default();
        let prototypes: Vec<u16> = bodies
            .slots()
            .map(|slot| palette.index(BodyPrototype::of(bodies, slot as usize)))
            .collect();
        out.word(palette.indices.len() as u32);
        out.0.extend(palette.bytes.0);
        out.word(bodies.alive.len() as u32);
        let mut prototypes = prototypes.into_iter();
        for slot in 0..bodies.alive.len() {
            out.word(bodies.generation[slot]);
            let prototype = if bodies.alive[slot] { prototypes.next() } else { None };
            out.short(prototype.unwrap_or(FREE));
            if prototype.is_some() {
                out.vector(bodies.center[slot]);
                out.vector(bodies.velocity[slot]);
                out.number(bodies.warm_start_scale[slot]);
            }
            if prototype.is_some() && self.settings.sleeping {
                let (lowest, still_steps) = self.sleep.rest_of(slot as u32);
                out.word(lowest);
                out.short(still_steps);
            }
        }
    }

    /// Saves pairs that hold or touch, in (a, b) order.
    fn save_contacts(&self, out: &mut StateWriter) {
        let asleep = || self.sleep.islands.iter();
        let pairs = self.pairs.pairs.iter().chain(asleep().flat_map(|sleeping| &sleeping.pairs));
        let pairs = || pairs.clone().filter(|pair| pair.normal_impulse > 0.0);
        let touches = self.touches.now.iter();
        let touches = touches.chain(asleep().flat_map(|sleeping| &sleeping.touches));
        let touching = || touches.clone().map(|touch| key(touch.a.index, touch.b.index));
        let mut keys: Vec<u64> =
            pairs().map(|pair| key(pair.a, pair.b)).chain(touching()).collect();
        keys.sort_unstable();
        keys.dedup();
        let at = |key: u64| keys.binary_search(&key).expect("every key is listed");
        let mut contacts = vec![(0, 0.0, 0.0); keys.len()];
        for pair in pairs() {
            let flags = match pair.axis {
                Axis::Free => 0,
                Axis::X => ALONG_X,
                Axis::Y => ALONG_Y,
            };
            contacts[at(key(pair.a, pair.b))] = (flags, pair.normal_impulse, pair.tangent_impulse);
        }
        for touch in touching() {
            contacts[at(touch)].0 |= TOUCHING;
        }
        out.word(contacts.len() as u32);
        for (key, (flags, normal_impulse, tangent_impulse)) in keys.into_iter().zip(contacts) {
            out.word((key >> 32) as u32);
            out.word(key as u32);
            out.byte(flags);
            out.number(normal_impulse);
            out.number(tangent_impulse);
        }
    }

    /// Restores a saved world, with the settings it had. Any bytes are safe: bytes that are no
    /// state of such a world are refused.
    pub fn restore(settings: WorldSettings, bytes: &mut StateReader) -> Result<World, StateError> {
        let mut world = World::new(settings);
        let mut rests = world.settings.sleeping.then(Vec::new);
        world.bodies = read_bodies(world.settings.bodies_max, rests.as_mut(), bytes)?;
        if let Some(rests) = rests {
            for (slot, rest) in rests {
                let World { sleep, bodies, pairs, settings, .. } = &mut world;
                let fits = sleep.restore_rest(bodies, pairs, slot, rest, settings);
                bytes.check(fits, "sleep")?;
            }
            world.sleep.finish_restore(&mut world.bodies, &mut world.pairs);
        }
        world.read_contacts(bytes)?;
        let (recipes, limit) = (world.settings.recipes.clone(), world.settings.particles_max);
        world.particles = Particles::restore(recipes, limit, bytes)?;
        world.particles.limit_obstacle_cells(world.settings.budget.obstacle_cells);
        if let Some(settings) = &world.settings.forces {
            world.forces = Some(Forces::restore(settings, &world.bodies, bytes)?);
        }
        world.widen_for_restored();
        world.pairs.invalidate();
        Ok(world)
    }

    /// Adds the features of the restored bodies, impulses and particles.
    fn widen_for_restored(&mut self) {
        let Bodies { shape, motion, material, .. } = &self.bodies;
        for slot in self.bodies.slots().map(|slot| slot as usize) {
            let Material { friction, restitution } = material[slot];
            let brought = Features::of_parts(shape[slot], motion[slot], friction, restitution);
            self.features = self.features.with(brought);
        }
        self.features.friction |= self.pairs.pairs.iter().any(|pair| pair.tangent_impulse != 0.0);
        self.features.particles |= !self.particles.is_empty() || self.particles.emitter_count() > 0;
    }

    fn read_contacts(&mut self, bytes: &mut StateReader) -> Result<(), StateError> {
        let mut last = None;
        for _ in 0..bytes.count(usize::MAX, CONTACT_BYTES, "number of contacts")? {
            let (a, b) = (bytes.word("contact")?, bytes.word("contact")?);
            let slots = self.bodies.alive.len() as u32;
            let lives = |slot: u32| slot < slots && self.bodies.alive[slot as usize];
            bytes.check(a < b && lives(a) && lives(b) && last < Some((a, b)), "contact")?;
            last = Some((a, b));
            let flags = bytes.byte("contact flags")?;
            let axis = match flags & (ALONG_X | ALONG_Y) {
                0 => Axis::Free,
                ALONG_X => Axis::X,
                ALONG_Y => Axis::Y,
                _ => return Err(bytes.wrong("contact flags")),
            };
            let normal_impulse = bytes.number("normal impulse")?;
            bytes.check((0.0..IMPULSE_MAX).contains(&normal_impulse), "normal impulse")?;
            let tangent_impulse = bytes.number("tangent impulse")?;
            bytes.check(tangent_impulse.abs() < IMPULSE_MAX, "tangent impulse")?;
            if normal_impulse > 0.0 {
                let pair = Pair { a, b, normal_impulse, tangent_impulse, axis };
                match self.sleep.island_of(&self.bodies, a, b) {
                    Some(sleeping) => sleeping.pairs.push(pair),
                    None => self.pairs.pairs.push(pair),
                }
            }
            if flags & TOUCHING != 0 {
                let touch = restored_touch(&self.bodies, a, b);
                match self.sleep.island_of(&self.bodies, a, b) {
                    Some(sleeping) => sleeping.touches.push(touch),
                    None => self.touches.now.push(touch),
                }
            }
        }
        Ok(())
    }
}

/// A touch of the last step; its closing speed is not saved, since no later step needs it.
fn restored_touch(bodies: &Bodies, a: u32, b: u32) -> Touch {
    let manifold = overlap(bodies, a, b);
    Touch {
        a: bodies.id(a),
        b: bodies.id(b),
        normal: manifold.map_or(Vec2::ZERO, |manifold| manifold.normal),
        depth: manifold.map_or(0.0, |manifold| -manifold.separation),
        closing: 0.0,
        began: false,
    }
}

fn visit_pair(pair: &Pair, visitor: &mut impl StateVisitor) {
    if pair.normal_impulse <= 0.0 {
        return;
    }
    let subject = Subject::Contact(pair.a, pair.b);
    visitor.bits(subject, "bodies", pair.a);
    visitor.bits(subject, "bodies", pair.b);
    visitor.number(subject, "normal impulse", pair.normal_impulse);
    visitor.number(subject, "tangent impulse", pair.tangent_impulse);
    if pair.axis != Axis::Free {
        visitor.bits(subject, "axis", pair.axis as u32);
    }
}

fn visit_body(bodies: &Bodies, slot: u32, visitor: &mut impl StateVisitor) {
    let (index, subject) = (slot as usize, Subject::Body(bodies.id(slot)));
    let round = matches!(bodies.shape[index], Shape::Circle { .. });
    let tags = [u8::from(round), bodies.motion[index] as u8, bodies.group[index], 0];
    visitor.bits(subject, "shape, motion and group", u32::from_le_bytes(tags));
    let half = bodies.shape[index].half_extent();
    visitor.vector(subject, ["half width", "half height"], half);
    visitor.vector(subject, ["position.x", "position.y"], bodies.center[index]);
    visitor.vector(subject, ["velocity.x", "velocity.y"], bodies.velocity[index]);
    visitor.number(subject, "warm start scale", bodies.warm_start_scale[index]);
    visitor.number(subject, "inverse mass", bodies.inverse_mass[index]);
    visitor.number(subject, "gravity scale", bodies.gravity_scale[index]);
    visitor.number(subject, "restitution", bodies.material[index].restitution);
    visitor.number(subject, "friction", bodies.material[index].friction);
}

/// The saved prototypes, in the order of their first body.
#[derive(Default)]
struct Palette {
    bytes: StateWriter,
    indices: BTreeMap<Vec<u8>, u16>,
}

impl Palette {
    fn index(&mut self, prototype: BodyPrototype) -> u16 {
        let mut saved = StateWriter::default();
        prototype.save(&mut saved);
        let next = self.indices.len() as u16;
        *self.indices.entry(saved.0).or_insert_with_key(|saved| {
            self.bytes.0.extend(saved);
            next
        })
    }
}

impl BodyPrototype {
    fn of(bodies: &Bodies, slot: usize) -> BodyPrototype {
        BodyPrototype {
            shape: bodies.shape[slot],
            inverse_mass: bodies.inverse_mass[slot],
            gravity_scale: bodies.gravity_scale[slot],
            material: bodies.material[slot],
            motion: bodies.motion[slot],
            group: bodies.group[slot],
        }
    }

    fn save(&self, out: &mut StateWriter) {
        out.byte(u8::from(matches!(self.shape, Shape::Circle { .. })));
        out.byte(self.motion as u8);
        out.byte(self.group);
        out.vector(self.shape.half_extent());
        out.number(self.inverse_mass);
        out.number(self.gravity_scale);
        out.number(self.material.restitution);
        out.number(self.material.friction);
    }

    /// The ranges are those of [`crate::BodyDef`].
    fn read(bytes: &mut StateReader) -> Result<BodyPrototype, StateError> {
        let round = bytes.byte("shape")?;
        bytes.check(round <= 1, "shape")?;
        let motion = match bytes.byte("motion")? {
            0 => Motion::Static,
            1 => Motion::Kinematic,
            2 => Motion::Dynamic,
            _ => return Err(bytes.wrong("motion")),
        };
        let group = bytes.byte("group")?;
        bytes.check(usize::from(group) < GROUPS_MAX, "group")?;
        let half = bytes.vector("size")?;
        bytes.check(half.x > 0.0 && half.y > 0.0 && (round == 0 || half.x == half.y), "size")?;
        let shape = if round == 1 { Shape::Circle { radius: half.x } } else { Shape::Box { half } };
        let inverse_mass = bytes.number("inverse mass")?;
        let movable = inverse_mass > 0.0 && inverse_mass < PLAUSIBLE_MAX;
        let fits = if motion == Motion::Dynamic { movable } else { inverse_mass == 0.0 };
        bytes.check(fits, "inverse mass")?;
        let gravity_scale = bytes.plausible_number("gravity scale")?;
        let restitution = bytes.number("restitution")?;
        bytes.check((0.0..=1.0).contains(&restitution), "restitution")?;
        let friction = bytes.number("friction")?;
        bytes.check((0.0..=10.0).contains(&friction), "friction")?;
        let material = Material { restitution, friction };
        Ok(BodyPrototype { shape, inverse_mass, gravity_scale, material, motion, group })
    }
}

/// Reads all bodies; in a world that sleeps, `rests` gets the [`Rest`] of each.
fn read_bodies(
    bodies_max: usize,
    mut rests: Option<&mut Vec<(u32, Rest)>>,
    bytes: &mut StateReader,
) -> Result<Bodies, StateError> {
    let count = bytes.count(bodies_max, PROTOTYPE_BYTES, "number of prototypes")?;
    let prototypes =
        (0..count).map(|_| BodyPrototype::read(bytes)).collect::<Result<Vec<_>, _>>()?;
    let mut bodies = Bodies::default();
    for _ in 0..bytes.count(bodies_max, SLOT_BYTES_MIN, "number of bodies")? {
        let generation = bytes.word("generation")?;
        let prototype = bytes.short("prototype")?;
        let slot = bodies.grow(generation) as usize;
        if prototype == FREE {
            continue;
        }
        let prototype =
            *prototypes.get(usize::from(prototype)).ok_or_else(|| bytes.wrong("prototype"))?;
        let center = bytes.plausible("position")?;
        let velocity = bytes.plausible("velocity")?;
        let still = prototype.motion != Motion::Static || velocity == Vec2::ZERO;
        bytes.check(still, "velocity of a static body")?;
        let warm_start_scale = bytes.number("warm start scale")?;
        bytes.check((0.0..=1.0).contains(&warm_start_scale), "warm start scale")?;
        if let Some(rests) = &mut rests {
            let rest = (bytes.word("sleep")?, bytes.short("steps at rest")?);
            rests.push((slot as u32, rest));
        }
        bodies.shape[slot] = prototype.shape;
        bodies.half[slot] = prototype.shape.half_extent();
        bodies.center[slot] = center;
        bodies.velocity[slot] = velocity;
        bodies.warm_start_scale[slot] = warm_start_scale;
        bodies.inverse_mass[slot] = prototype.inverse_mass;
        bodies.gravity_scale[slot] = prototype.gravity_scale;
        bodies.material[slot] = prototype.material;
        bodies.motion[slot] = prototype.motion;
        bodies.group[slot] = prototype.group;
        bodies.activate(slot as u32);
    }
    bodies.list_free();
    Ok(bodies)
}
