//! The World's state, which can be visited word by word, saved as bytes, and restored from bytes.
//!
//! Only what the next step depends on is saved. Of the pair list, which merely speeds up the search, only the pairs
//! that hold an impulse or touch are saved, and properties shared by many bodies (size, mass, material) are saved
//! once in a palette. A body takes 26 bytes plus at most 27 in the palette, and 6 more in a world that sleeps; a
//! contact takes 17.

use super::{World, WorldSettings};
use crate::bodies::{Bodies, Body};
use crate::body::{GROUPS_MAX, Material, Motion};
use crate::broad_phase::pairs::{Axis, Pair, PairList, key};
use crate::features::Features;
use crate::hash::StateHasher;
use crate::narrow_phase::overlap::overlap;
use crate::particles::Particles;
use crate::shape::Shape;
use crate::sleep::{RestState, Sleep};
use crate::state::bytes::{StateError, StateReader, StateWriter};
use crate::state::io::{PLAUSIBLE_MAX, StateIo, plausible};
use crate::state::{Difference, StateDump, Subject};
use crate::touches::{Touch, Touches};
use glam::Vec2;
use std::collections::BTreeMap;

const PROTOTYPE_BYTES: usize = 27;
const SLOT_BYTES_MIN: usize = 6;
const CONTACT_BYTES: usize = 17;
/// Exceeds every possible impulse, even in the heaviest stack of the heaviest bodies.
const IMPULSE_MAX: f32 = 1e15;
/// Takes the place of the prototype's index in a free slot.
const FREE: u16 = u16::MAX;

/// A pair that holds an impulse or touches, and whether it touches.
type Contact = (Pair, bool);

impl World {
    /// Digest of the raw bits of all state in id order, including bodies, generations of free
    /// slots, resting impulses, particles and emitters.
    pub fn hash(&self) -> u64 {
        let mut hasher = StateHasher::default();
        self.visit(&mut hasher);
        hasher.finish()
    }

    /// Returns the first difference between two worlds within a step, looking first at the state, then at the pairs.
    pub fn first_difference(&self, other: &World) -> Option<Difference> {
        let (mut one, mut two) = (StateDump::default(), StateDump::default());
        self.visit_in_step(&mut one);
        other.visit_in_step(&mut two);
        one.first_difference(&two)
    }

    /// Visits the state within a step, which is all of [`World::visit`] and the pairs that take part.
    pub fn visit_in_step(&self, io: &mut impl StateIo) {
        self.visit(io);
        for (a, b) in self.solvers.pairs() {
            io.subject(Subject::Contact(a, b));
            io.bits("taking part", 1);
        }
    }

    /// Visits all state in id order, for a hash or a list.
    pub fn visit(&self, io: &mut impl StateIo) {
        let bodies = &self.bodies;
        io.subject(Subject::WORLD);
        io.bits("slots", bodies.alive.len() as u32);
        for slot in 0..bodies.alive.len() as u32 {
            let (id, alive) = (bodies.id(slot), bodies.alive[slot as usize]);
            io.subject(Subject::Body(id));
            io.bits("life", id.generation << 1 | u32::from(alive));
        }
        for slot in bodies.slots() {
            io.subject(Subject::Body(bodies.id(slot)));
            bodies.body(slot).form(io).state(io).substance(io);
        }
        visit_pairs(&self.pairs.pairs, io);
        if self.settings.sleeping {
            visit_sleep(&self.sleep, bodies, io);
        }
        self.particles.state(io);
        if self.settings.forces.is_some() {
            self.forces.state(bodies, io);
        }
    }

    /// Saves everything that the next step depends on, except the settings.
    pub fn save(&self, out: &mut StateWriter) {
        self.bodies.saved(&self.sleep, &self.settings, out);
        saved_contacts(contacts(&self.pairs, &self.touches, &self.sleep), &self.bodies, out);
        self.particles.state(out);
        if self.settings.forces.is_some() {
            self.forces.state(&self.bodies, out);
        }
    }

    /// Restores a saved world, given the settings that it had. Any bytes are safe to pass: anything but the
    /// state of such a world is refused.
    pub fn restore(settings: WorldSettings, bytes: &mut StateReader) -> Result<World, StateError> {
        let mut world = World::new(settings);
        let World { settings, bodies, sleep, pairs, touches, particles, forces, .. } = &mut world;
        let slots = bodies.saved(sleep, settings, bytes);
        bytes.ok()?;
        *bodies = restored_bodies(&slots);
        if settings.sleeping {
            for (slot, it) in (0..).zip(&slots).filter(|(_, it)| it.prototype != FREE) {
                let fits = sleep.restore_rest(bodies, pairs, slot, it.rest, settings);
                bytes.check("sleep", || fits);
                bytes.ok()?;
            }
            sleep.finish_restore(bodies, pairs);
        }
        let contacts = saved_contacts(Vec::new(), bodies, bytes);
        let (emitters, moving) = particles.state(bytes);
        if settings.forces.is_some() {
            (forces.dragged, forces.springs) = forces.state(bodies, bytes);
        }
        bytes.ok()?;
        for (pair, touching) in contacts {
            let touch = touching.then(|| restored_touch(bodies, pair.a, pair.b));
            let (pairs, touches) = match sleep.island_of(bodies, pair.a, pair.b) {
                Some(sleeping) => (&mut sleeping.pairs, &mut sleeping.touches),
                None => (&mut pairs.pairs, &mut touches.now),
            };
            pairs.extend(Some(pair).filter(|pair| pair.normal_impulse > 0.0));
            touches.extend(touch);
        }
        particles.fill(emitters, &moving);
        settings.features = settings.features.with(features(bodies, pairs, particles));
        pairs.invalidate();
        Ok(world)
    }
}

impl Bodies {
    /// Describes how bodies are saved: first the shared properties, once each, and then the individual values of
    /// each slot.
    fn saved(&self, sleep: &Sleep, settings: &WorldSettings, io: &mut impl StateIo) -> Vec<Slot> {
        let (palette, slots) = self.prototypes(sleep);
        let most = settings.bodies_max;
        let (limits, given) = ([most.min(usize::from(FREE)), PROTOTYPE_BYTES], palette.into_iter());
        let palette = io.list("number of prototypes", limits, given, BLANK.body, |io, _, it| {
            it.form(io).substance(io)
        });
        let (limits, given) = ([most, SLOT_BYTES_MIN], slots.into_iter());
        io.list("number of bodies", limits, given, BLANK, |io, _, mut it| {
            it.generation = io.saved_word("generation", it.generation);
            it.prototype = io.saved_short("prototype", it.prototype);
            if it.prototype == FREE {
                return it;
            }
            let prototype = || palette.get(usize::from(it.prototype)).copied();
            it.body = io.checked("prototype", it.body, prototype).state(io);
            let may_move = it.body.motion != Motion::Static;
            io.check("velocity of a static body", || may_move || it.body.velocity == Vec2::ZERO);
            if settings.sleeping {
                it.rest = rest(it.rest, io);
            }
            it
        })
    }

    /// Returns the prototypes in the order of their first body, and all slots.
    fn prototypes(&self, sleep: &Sleep) -> (Vec<Body>, Vec<Slot>) {
        let (mut palette, mut indices) = (Vec::new(), BTreeMap::new());
        let slots = (0u32..).zip(&self.alive).map(|(slot, &alive)| {
            let (generation, body) = (self.id(slot).generation, self.body(slot));
            if !alive {
                return Slot { generation, ..BLANK };
            }
            let mut bytes = StateWriter::default();
            body.form(&mut bytes).substance(&mut bytes);
            let prototype = *indices.entry(bytes.0).or_insert_with(|| {
                palette.push(body);
                palette.len() as u16 - 1
            });
            Slot { generation, prototype, rest: sleep.rest_of(slot), body }
        });
        let slots = slots.collect();
        (palette, slots)
    }
}

/// Visits the sleeping island or the number of still steps of every movable body, and each sleeping island's
/// impulses along with its lowest slot.
fn visit_sleep(sleep: &Sleep, bodies: &Bodies, io: &mut impl StateIo) {
    for slot in bodies.slots().filter(|&slot| bodies.motion[slot as usize] != Motion::Static) {
        io.subject(Subject::Body(bodies.id(slot)));
        let (lowest, _) = rest(sleep.rest_of(slot), io);
        if let Some(sleeping) = sleep.sleeping(slot).filter(|_| lowest == slot) {
            visit_pairs(&sleeping.pairs, io);
        }
    }
}

/// Describes the pairs that hold an impulse or touch, in (a, b) order.
fn saved_contacts(given: Vec<Contact>, bodies: &Bodies, io: &mut impl StateIo) -> Vec<Contact> {
    let lives = |slot: u32| bodies.alive.get(slot as usize) == Some(&true);
    let limits = [usize::MAX, CONTACT_BYTES];
    let mut last = None;
    let (given, blank) = (given.into_iter(), (Pair::of(0), false));
    io.list("number of contacts", limits, given, blank, |io, _, given| {
        let contact = contact(given, io);
        let (a, b) = (contact.0.a, contact.0.b);
        io.check("bodies", || a < b && lives(a) && lives(b) && last < Some((a, b)));
        last = Some((a, b));
        contact
    })
}

/// The pairs that hold an impulse or touch, in (a, b) order.
fn contacts(pairs: &PairList, touches: &Touches, sleep: &Sleep) -> Vec<Contact> {
    let islands = &sleep.islands;
    let pairs = pairs.pairs.iter().chain(islands.iter().flat_map(|it| &it.pairs));
    let touches = touches.now.iter().chain(islands.iter().flat_map(|it| &it.touches));
    let holding = pairs.filter(|pair| pair.normal_impulse > 0.0).map(|&pair| (pair, false));
    let touching = touches.map(|it| (Pair::of(key(it.a.index, it.b.index)), true));
    let mut contacts: Vec<Contact> = holding.chain(touching).collect();
    contacts.sort_unstable_by_key(|(pair, touching)| (pair.key(), *touching));
    contacts.dedup_by(|(pair, touches), (first, first_touches)| {
        let is_same = pair.key() == first.key();
        *first_touches |= is_same && *touches;
        is_same
    });
    contacts
}

/// The features of restored bodies, impulses and particles.
fn features(bodies: &Bodies, pairs: &PairList, particles: &Particles) -> Features {
    let brought = bodies.slots().map(|slot| {
        let Body { shape, motion, material, .. } = bodies.body(slot);
        Features::of_parts(shape, motion, material.friction, material.restitution)
    });
    let mut features = brought.fold(Features::NONE, Features::with);
    features.friction |= pairs.pairs.iter().any(|pair| pair.tangent_impulse != 0.0);
    features.particles = particles.is_active();
    features
}

/// A touch from the previous step. Its closing speed is not saved, since no later step needs it.
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

/// Visits the pairs that hold an impulse.
fn visit_pairs(pairs: &[Pair], io: &mut impl StateIo) {
    for pair in pairs.iter().filter(|pair| pair.normal_impulse > 0.0) {
        contact((*pair, false), io);
    }
}

#[cfg_attr(not(target_arch = "wasm32"), inline)]
fn contact((mut it, touching): Contact, io: &mut impl StateIo) -> Contact {
    io.subject(Subject::Contact(it.a, it.b));
    it.a = io.word("bodies", it.a);
    it.b = io.word("bodies", it.b);
    let [flags] = io.saved("contact flags", [u8::from(touching) | (it.axis as u8) << 1]);
    it.axis = io.checked("contact flags", it.axis, || match flags >> 1 {
        0 => Some(Axis::Free),
        1 => Some(Axis::X),
        2 => Some(Axis::Y),
        _ => None,
    });
    let is_impulse = |impulse| (0.0..IMPULSE_MAX).contains(&impulse);
    it.normal_impulse = io.number("normal impulse", it.normal_impulse, is_impulse);
    let is_impulse = |impulse: f32| impulse.abs() < IMPULSE_MAX;
    it.tangent_impulse = io.number("tangent impulse", it.tangent_impulse, is_impulse);
    if it.axis != Axis::Free {
        io.bits("axis", it.axis as u32);
    }
    (it, flags & 1 != 0)
}

#[cfg_attr(not(target_arch = "wasm32"), inline)]
fn rest((lowest, still_steps): RestState, io: &mut impl StateIo) -> RestState {
    let lowest = io.word("lowest body of its sleeping island", lowest);
    (lowest, io.short("steps at rest", still_steps))
}

/// A slot. If it is free, only its generation matters.
#[derive(Clone, Copy)]
struct Slot {
    generation: u32,
    prototype: u16,
    rest: RestState,
    body: Body,
}

/// Initial value of an entry that is being restored.
const BLANK: Slot = Slot {
    generation: 0,
    prototype: FREE,
    rest: (0, 0),
    body: Body {
        shape: Shape::Circle { radius: 1.0 },
        center: Vec2::ZERO,
        velocity: Vec2::ZERO,
        inverse_mass: 0.0,
        warm_start_scale: 1.0,
        gravity_scale: 0.0,
        material: Material { restitution: 0.0, friction: 0.0 },
        motion: Motion::Static,
        group: 0,
    },
};

/// The valid ranges are those of [`crate::BodyDef`].
impl Body {
    /// Describes the fields that the hash visits before the motion.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn form(mut self, io: &mut impl StateIo) -> Body {
        let is_round = matches!(self.shape, Shape::Circle { .. });
        let tags = [u8::from(is_round), self.motion as u8, self.group];
        io.bits("shape, motion and group", u32::from_le_bytes([tags[0], tags[1], tags[2], 0]));
        let [is_round, motion, group] = io.saved("shape, motion and group", tags);
        io.check("shape or group", || is_round <= 1 && usize::from(group) < GROUPS_MAX);
        self.group = group;
        self.motion = io.checked("motion", self.motion, || match motion {
            0 => Some(Motion::Static),
            1 => Some(Motion::Kinematic),
            2 => Some(Motion::Dynamic),
            _ => None,
        });
        let (half, is_size) = (self.shape.half_extent(), |it: f32| it > 0.0 && it.is_finite());
        let half = io.vector(["half width", "half height"], half, is_size);
        io.check("half height", || is_round == 0 || half.x == half.y);
        self.shape = match is_round {
            1 => Shape::Circle { radius: half.x },
            _ => Shape::Box { half },
        };
        self
    }

    /// Describes position and motion.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn state(mut self, io: &mut impl StateIo) -> Body {
        self.center = io.vector(["position.x", "position.y"], self.center, plausible);
        self.velocity = io.vector(["velocity.x", "velocity.y"], self.velocity, plausible);
        let is_share = |scale| (0.0..=1.0).contains(&scale);
        self.warm_start_scale = io.number("warm start scale", self.warm_start_scale, is_share);
        self
    }

    /// Describes the fields that the hash visits after the motion.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn substance(mut self, io: &mut impl StateIo) -> Body {
        self.inverse_mass = io.number("inverse mass", self.inverse_mass, |it| match self.motion {
            Motion::Dynamic => it > 0.0 && it < PLAUSIBLE_MAX,
            Motion::Static | Motion::Kinematic => it == 0.0,
        });
        self.gravity_scale = io.number("gravity scale", self.gravity_scale, plausible);
        let Material { restitution, friction } = self.material;
        let restitution = io.number("restitution", restitution, |it| (0.0..=1.0).contains(&it));
        let friction = io.number("friction", friction, |it| (0.0..=10.0).contains(&it));
        self.material = Material { restitution, friction };
        self
    }
}

fn restored_bodies(slots: &[Slot]) -> Bodies {
    let mut bodies = Bodies::default();
    for it in slots {
        let slot = bodies.grow(it.generation);
        if it.prototype != FREE {
            bodies.put(slot, &it.body);
        }
    }
    bodies.list_free();
    bodies
}
