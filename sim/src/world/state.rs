//! The World's state: listed word by word, kept as bytes, and made again from them.
//!
//! What is kept is what the next step depends on, and no more: the pair list comes back as the
//! pairs that hold or touch, since it is only an accelerator, and what most bodies share (size,
//! mass, material) is kept once in a palette. A body takes 26 bytes of its own and 28 in the
//! palette at worst, and 6 more in a world that sleeps; a contact 17.

use super::sleep::Rest;
use super::{Touch, World, WorldSettings};
use crate::bodies::{Bodies, Material};
use crate::body::{GROUPS_MAX, Motion};
use crate::features::Features;
use crate::forces::Forces;
use crate::hash::StateHasher;
use crate::pairs::{Axis, Pair, overlap};
use crate::particle::Particles;
use crate::shape::Shape;
use crate::state::bytes::{PLAUSIBLE_MAX, StateError, StateReader, StateWriter};
use crate::state::{Difference, Listing, Subject, Words};
use glam::Vec2;
use std::collections::BTreeMap;

/// What bodies of one sort share.
#[derive(Clone, Copy, PartialEq)]
struct Sort {
    shape: Shape,
    inverse_mass: f32,
    gravity_scale: f32,
    material: Material,
    motion: Motion,
    group: u8,
}

const SORT_BYTES: usize = 27;
const SLOT_BYTES_MIN: usize = 6;
const CONTACT_BYTES: usize = 17;
/// Above every impulse: the heaviest stack of the heaviest bodies.
const IMPULSE_MAX: f32 = 1e15;
/// In place of a sort: the slot is free.
const FREE: u16 = u16::MAX;
/// Flags of a contact.
const TOUCHING: u8 = 1;
const ALONG_X: u8 = 2;
const ALONG_Y: u8 = 4;

impl World {
    /// Digest of the raw bits of all state in id order: bodies, what free slots remember, resting
    /// impulses, particles and emitters.
    pub fn hash(&self) -> u64 {
        let mut hasher = StateHasher::default();
        self.words(&mut hasher);
        hasher.finish()
    }

    /// Digest of the state within a step: [`World::hash`], and the pairs that take part.
    pub fn hash_in_step(&self) -> u64 {
        let mut hasher = StateHasher::default();
        self.words_in_step(&mut hasher);
        hasher.finish()
    }

    /// The first difference between two worlds within a step: of state, then of the pairs.
    pub fn first_difference(&self, other: &World) -> Option<Difference> {
        let (mut one, mut two) = (Listing::default(), Listing::default());
        self.words_in_step(&mut one);
        other.words_in_step(&mut two);
        one.first_difference(&two)
    }

    fn words_in_step(&self, words: &mut impl Words) {
        self.words(words);
        let rows = self.rows.iter().map(|row| (row.a, row.b));
        for (a, b) in rows.chain(self.workspace.rows.iter().map(|row| (row.a, row.b))) {
            words.bits(Subject::Contact { a, b }, "taking part", 1);
        }
    }

    pub(crate) fn words(&self, words: &mut impl Words) {
        let bodies = &self.bodies;
        words.bits(Subject::World, "slots", bodies.alive.len() as u32);
        for slot in 0..bodies.alive.len() as u32 {
            let (id, alive) = (bodies.id(slot), bodies.alive[slot as usize]);
            words.bits(Subject::Body(id), "life", id.generation << 1 | u32::from(alive));
        }
        bodies.slots().for_each(|slot| body_words(bodies, slot, words));
        self.pairs.pairs.iter().for_each(|pair| pair_words(pair, words));
        if self.settings.sleeping {
            self.rest_words(words);
        }
        self.particles.words(words);
        if let Some(forces) = &self.forces {
            forces.words(bodies, words);
        }
    }

    /// Of every body that can move, with whom it sleeps or for how long it was still; the impulses
    /// of each sleeping island with its lowest slot.
    fn rest_words(&self, words: &mut impl Words) {
        let bodies = &self.bodies;
        for slot in bodies.slots() {
            if bodies.motion[slot as usize] == Motion::Static {
                continue;
            }
            let subject = Subject::Body(bodies.id(slot));
            let (lowest, rested) = self.rest_of(slot);
            words.bits(subject, "lowest body of its sleeping island", lowest);
            words.bits(subject, "steps at rest", u32::from(rested));
            if let Some(dormant) = self.dormant(slot).filter(|_| lowest == slot) {
                dormant.pairs.iter().for_each(|pair| pair_words(pair, words));
            }
        }
    }

    pub(crate) fn save(&self, out: &mut StateWriter) {
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
        let sorts: Vec<u16> =
            bodies.slots().map(|slot| palette.place(Sort::of(bodies, slot as usize))).collect();
        out.word(palette.sorts.len() as u32);
        palette.sorts.iter().for_each(|sort| sort.save(out));
        out.word(bodies.alive.len() as u32);
        let mut sorts = sorts.into_iter();
        for slot in 0..bodies.alive.len() {
            out.word(bodies.generation[slot]);
            let sort = if bodies.alive[slot] { sorts.next() } else { None };
            out.short(sort.unwrap_or(FREE));
            if sort.is_some() {
                out.vector(bodies.center[slot]);
                out.vector(bodies.velocity[slot]);
                out.number(bodies.calm[slot]);
            }
            if sort.is_some() && self.settings.sleeping {
                let (lowest, rested) = self.rest_of(slot as u32);
                out.word(lowest);
                out.short(rested);
            }
        }
    }

    /// Pairs that hold or touch, in (a, b) order.
    fn save_contacts(&self, out: &mut StateWriter) {
        let mut contacts = BTreeMap::new();
        let asleep = self.sleep.islands.iter().flat_map(|dormant| &dormant.pairs);
        let pairs = self.pairs.pairs.iter().chain(asleep);
        for pair in pairs.filter(|pair| pair.normal_impulse > 0.0) {
            let flags = match pair.axis {
                Axis::Free => 0,
                Axis::X => ALONG_X,
                Axis::Y => ALONG_Y,
            };
            contacts.insert((pair.a, pair.b), (flags, pair.normal_impulse, pair.tangent_impulse));
        }
        let asleep = self.sleep.islands.iter().flat_map(|dormant| &dormant.touches);
        for touch in self.touches.iter().chain(asleep) {
            contacts.entry((touch.a.index, touch.b.index)).or_insert((0, 0.0, 0.0)).0 |= TOUCHING;
        }
        out.word(contacts.len() as u32);
        for ((a, b), (flags, normal_impulse, tangent_impulse)) in contacts {
            out.word(a);
            out.word(b);
            out.byte(flags);
            out.number(normal_impulse);
            out.number(tangent_impulse);
        }
    }

    pub(crate) fn restore(
        settings: WorldSettings,
        bytes: &mut StateReader,
    ) -> Result<World, StateError> {
        let mut world = World::new(settings);
        let mut rests = world.settings.sleeping.then(Vec::new);
        world.bodies = read_bodies(world.settings.bodies_max, rests.as_mut(), bytes)?;
        if let Some(rests) = rests {
            for (slot, rest) in rests {
                bytes.check(world.restore_rest(slot, rest), "sleep")?;
            }
            world.settle_rest();
        }
        world.read_contacts(bytes)?;
        let (recipes, limit) = (world.settings.recipes.clone(), world.settings.particles_max);
        world.particles = Particles::restore(recipes, limit, bytes)?;
        if let Some(settings) = &world.settings.forces {
            world.forces = Some(Forces::restore(settings, &world.bodies, bytes)?);
        }
        world.widen_for_all();
        world.pairs.invalidate();
        Ok(world)
    }

    /// What the restored bodies, impulses and particles bring.
    fn widen_for_all(&mut self) {
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
                let warm_normal = Vec2::ZERO;
                let pair = Pair { a, b, normal_impulse, tangent_impulse, axis, warm_normal };
                match self.dormant_of(a, b) {
                    Some(dormant) => dormant.pairs.push(pair),
                    None => self.pairs.pairs.push(pair),
                }
            }
            if flags & TOUCHING != 0 {
                let touch = touch_again(&self.bodies, a, b);
                match self.dormant_of(a, b) {
                    Some(dormant) => dormant.touches.push(touch),
                    None => self.touches.push(touch),
                }
            }
        }
        Ok(())
    }
}

/// A touch of the last step; how fast it closed is not kept, since no later step asks.
fn touch_again(bodies: &Bodies, a: u32, b: u32) -> Touch {
    let contact = overlap(bodies, a, b);
    Touch {
        a: bodies.id(a),
        b: bodies.id(b),
        normal: contact.map_or(Vec2::ZERO, |contact| contact.normal),
        depth: contact.map_or(0.0, |contact| contact.depth),
        closing: 0.0,
        began: false,
    }
}

fn pair_words(pair: &Pair, words: &mut impl Words) {
    if pair.normal_impulse <= 0.0 {
        return;
    }
    let subject = Subject::Contact { a: pair.a, b: pair.b };
    words.bits(subject, "bodies", pair.a);
    words.bits(subject, "bodies", pair.b);
    words.number(subject, "normal impulse", pair.normal_impulse);
    words.number(subject, "tangent impulse", pair.tangent_impulse);
    if pair.axis != Axis::Free {
        words.bits(subject, "axis", pair.axis as u32);
    }
}

fn body_words(bodies: &Bodies, slot: u32, words: &mut impl Words) {
    let (index, subject) = (slot as usize, Subject::Body(bodies.id(slot)));
    let round = matches!(bodies.shape[index], Shape::Circle { .. });
    let tags = [u8::from(round), bodies.motion[index] as u8, bodies.group[index], 0];
    words.bits(subject, "shape, motion and group", u32::from_le_bytes(tags));
    let half = bodies.shape[index].half_extent();
    words.vector(subject, ["half width", "half height"], half);
    words.vector(subject, ["position.x", "position.y"], bodies.center[index]);
    words.vector(subject, ["velocity.x", "velocity.y"], bodies.velocity[index]);
    words.number(subject, "calmness", bodies.calm[index]);
    words.number(subject, "inverse mass", bodies.inverse_mass[index]);
    words.number(subject, "gravity scale", bodies.gravity_scale[index]);
    words.number(subject, "restitution", bodies.material[index].restitution);
    words.number(subject, "friction", bodies.material[index].friction);
}

/// Sorts in the order of their first body.
#[derive(Default)]
struct Palette {
    sorts: Vec<Sort>,
    places: BTreeMap<[u32; 7], u16>,
}

impl Palette {
    fn place(&mut self, sort: Sort) -> u16 {
        let next = self.sorts.len() as u16;
        let place = *self.places.entry(sort.key()).or_insert(next);
        if place == next {
            self.sorts.push(sort);
        }
        place
    }
}

impl Sort {
    fn of(bodies: &Bodies, slot: usize) -> Sort {
        Sort {
            shape: bodies.shape[slot],
            inverse_mass: bodies.inverse_mass[slot],
            gravity_scale: bodies.gravity_scale[slot],
            material: bodies.material[slot],
            motion: bodies.motion[slot],
            group: bodies.group[slot],
        }
    }

    fn is_round(&self) -> bool {
        matches!(self.shape, Shape::Circle { .. })
    }

    fn key(&self) -> [u32; 7] {
        let half = self.shape.half_extent();
        let tags = [u8::from(self.is_round()), self.motion as u8, self.group, 0];
        let Material { restitution, friction } = self.material;
        let numbers =
            [half.x, half.y, self.inverse_mass, self.gravity_scale, restitution, friction];
        let mut key = [u32::from_le_bytes(tags); 7];
        for (place, number) in key.iter_mut().zip(numbers) {
            *place = number.to_bits();
        }
        key
    }

    fn save(&self, out: &mut StateWriter) {
        out.byte(u8::from(self.is_round()));
        out.byte(self.motion as u8);
        out.byte(self.group);
        out.vector(self.shape.half_extent());
        out.number(self.inverse_mass);
        out.number(self.gravity_scale);
        out.number(self.material.restitution);
        out.number(self.material.friction);
    }

    /// The ranges are those of [`crate::BodyDef`].
    fn read(bytes: &mut StateReader) -> Result<Sort, StateError> {
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
        Ok(Sort { shape, inverse_mass, gravity_scale, material, motion, group })
    }
}

/// In a world that sleeps, `rests` takes of every body what [`Rest`] is.
fn read_bodies(
    bodies_max: usize,
    mut rests: Option<&mut Vec<(u32, Rest)>>,
    bytes: &mut StateReader,
) -> Result<Bodies, StateError> {
    let count = bytes.count(bodies_max, SORT_BYTES, "number of sorts")?;
    let sorts = (0..count).map(|_| Sort::read(bytes)).collect::<Result<Vec<_>, _>>()?;
    let mut bodies = Bodies::default();
    for _ in 0..bytes.count(bodies_max, SLOT_BYTES_MIN, "number of bodies")? {
        let generation = bytes.word("generation")?;
        let sort = bytes.short("sort")?;
        let slot = bodies.grow(generation) as usize;
        if sort == FREE {
            continue;
        }
        let sort = *sorts.get(usize::from(sort)).ok_or_else(|| bytes.wrong("sort"))?;
        let center = bytes.plausible("position")?;
        let velocity = bytes.plausible("velocity")?;
        let still = sort.motion != Motion::Static || velocity == Vec2::ZERO;
        bytes.check(still, "velocity of a static body")?;
        let calm = bytes.number("calmness")?;
        bytes.check((0.0..=1.0).contains(&calm), "calmness")?;
        if let Some(rests) = &mut rests {
            let rest = (bytes.word("sleep")?, bytes.short("steps at rest")?);
            rests.push((slot as u32, rest));
        }
        bodies.shape[slot] = sort.shape;
        bodies.half[slot] = sort.shape.half_extent();
        bodies.center[slot] = center;
        bodies.velocity[slot] = velocity;
        bodies.calm[slot] = calm;
        bodies.inverse_mass[slot] = sort.inverse_mass;
        bodies.gravity_scale[slot] = sort.gravity_scale;
        bodies.material[slot] = sort.material;
        bodies.motion[slot] = sort.motion;
        bodies.group[slot] = sort.group;
        bodies.settle(slot as u32);
    }
    bodies.list_free();
    Ok(bodies)
}
