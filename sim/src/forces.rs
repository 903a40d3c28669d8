//! Forces beside gravity: drag against the air, wind, and springs. Only worlds whose settings ask
//! for them have them; elsewhere there is no state, no loop and no word of this in the hash.
//!
//! A step asks for the [`Move`]s of all bodies that feel a force: where free flight through the whole
//! step would lead, and how fast the body then is. Contacts act on that. One file a way to find it:
//! - `flight`: a body by itself, in closed form: drag, wind, springs of no length to fixed points;
//! - `network`: bodies that springs tie together, by an implicit step, solved by `elimination`.
//!
//! Reckoned in double precision, which is as exact everywhere as single: a stiff spring multiplies
//! the rounding of the places that it joins by its stiffness.

mod elimination;
mod flight;
mod network;
mod state;

use crate::bodies::Bodies;
use crate::body::{BodyId, Motion};
use flight::Flight;
use glam::{DVec2, Vec2};
use network::Network;

/// Largest rate of drag, 1/s and 1/unit, and largest stiffness and damping of a spring.
pub const FORCE_MAX: f32 = 1e18;

/// What slows a body down: its velocity u against the wind changes by -(linear + quadratic |u|) u.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drag {
    /// 1/s, 0..=[`FORCE_MAX`].
    pub linear: f32,
    /// 1/unit, 0..=[`FORCE_MAX`].
    pub quadratic: f32,
}

impl Drag {
    /// No drag.
    pub const NONE: Drag = Drag { linear: 0.0, quadratic: 0.0 };

    fn is_valid(self) -> bool {
        let range = 0.0..=FORCE_MAX;
        range.contains(&self.linear) && range.contains(&self.quadratic)
    }
}

/// What a world needs to know to have forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSettings {
    /// Velocity of the air, units/s.
    pub wind: Vec2,
    /// Springs at a time.
    pub springs_max: usize,
}

/// The far end of a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpringEnd {
    /// A fixed place.
    Point(Vec2),
    /// The centre of another body.
    Body(BodyId),
}

/// A spring from the centre of a body. It passes through everything, pulls when it is longer than at
/// rest and pushes when it is shorter; it goes with the first of its bodies that goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// The body that it holds.
    pub body: BodyId,
    /// What it is held to.
    pub end: SpringEnd,
    /// Length at which it neither pulls nor pushes, world units, not negative.
    pub rest_length: f32,
    /// Force a unit of length, 0..=[`FORCE_MAX`].
    pub stiffness: f32,
    /// Force against a unit of speed along it (along any direction, if it has no length at rest),
    /// 0..=[`FORCE_MAX`].
    pub damping: f32,
}

impl Spring {
    /// A spring of no length at which `mass` swings `frequency` times a second; damped so that 1 is
    /// just no swing at all. Between two bodies the mass to give is m1 m2 / (m1 + m2).
    pub fn tuned(
        body: BodyId,
        end: SpringEnd,
        frequency: f32,
        damping_ratio: f32,
        mass: f32,
    ) -> Spring {
        let turn = std::f32::consts::TAU * frequency;
        let (stiffness, damping) = (turn * turn * mass, 2.0 * damping_ratio * turn * mass);
        Spring { body, end, rest_length: 0.0, stiffness, damping }
    }

    fn holds(&self, id: BodyId) -> bool {
        self.body == id || self.end == SpringEnd::Body(id)
    }

    /// Panics unless every number is in its documented range.
    fn check(&self) {
        let Spring { rest_length, stiffness, damping, .. } = *self;
        let range = 0.0..=FORCE_MAX;
        assert!(range.contains(&rest_length), "rest length {rest_length} of a spring");
        assert!(range.contains(&stiffness), "stiffness {stiffness} of a spring");
        assert!(range.contains(&damping), "damping {damping} of a spring");
        match self.end {
            SpringEnd::Point(point) => assert!(point.is_finite(), "a spring held to {point}"),
            SpringEnd::Body(other) => assert!(other != self.body, "a spring from a body to itself"),
        }
    }
}

/// Where a step takes a body that nothing touches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    pub slot: u32,
    /// At the end of the step.
    pub velocity: Vec2,
    pub path: Vec2,
}

/// What acts on all bodies in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings {
    pub gravity: Vec2,
    pub dt: f32,
    pub speed_max: f32,
}

/// All drag and springs of a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forces {
    wind: Vec2,
    springs_max: usize,
    /// Bodies with drag, by ascending slot.
    dragged: Vec<(u32, Drag)>,
    springs: Vec<Spring>,
    /// Whether `flights` and `network` say who there is now.
    is_sorted: bool,
    flights: Vec<Flight>,
    network: Network,
    /// Where all of them go in this step.
    pub moves: Vec<Move>,
}

impl Forces {
    pub fn new(settings: &ForceSettings) -> Forces {
        let ForceSettings { wind, springs_max } = *settings;
        Forces { wind, springs_max, ..Forces::default() }
    }

    /// Takes note of a new body.
    pub fn added(&mut self, slot: u32, drag: Drag) {
        assert!(drag.is_valid(), "{drag:?} not in 0..={FORCE_MAX}");
        if drag != Drag::NONE {
            let at = self.dragged.partition_point(|&(other, _)| other < slot);
            self.dragged.insert(at, (slot, drag));
            self.is_sorted = false;
        }
    }

    /// A body is about to go; so do its springs.
    pub fn removed(&mut self, id: BodyId) {
        self.dragged.retain(|&(slot, _)| slot != id.index);
        self.springs.retain(|spring| !spring.holds(id));
        self.is_sorted = false;
    }

    pub fn drag(&self, slot: u32) -> Drag {
        let at = self.dragged.binary_search_by_key(&slot, |&(other, _)| other);
        at.map_or(Drag::NONE, |at| self.dragged[at].1)
    }

    /// Adds a spring, unless there are too many.
    pub fn add_spring(&mut self, spring: Spring) -> bool {
        spring.check();
        let fits = self.springs.len() < self.springs_max;
        if fits {
            self.springs.push(spring);
            self.is_sorted = false;
        }
        fits
    }

    pub fn springs(&self) -> &[Spring] {
        &self.springs
    }

    /// Finds the moves of a step from where the bodies are and how they move.
    pub fn find_moves(&mut self, bodies: &Bodies, around: Surroundings) {
        if !self.is_sorted {
            self.sort(bodies);
        }
        self.moves.clear();
        let air = Air {
            gravity: around.gravity.as_dvec2(),
            wind: self.wind.as_dvec2(),
            dt: f64::from(around.dt),
            speed_max: f64::from(around.speed_max),
        };
        for flight in &mut self.flights {
            self.moves.push(flight.fly(bodies, &air));
        }
        self.network.fly(bodies, &air, &mut self.moves);
    }

    /// Tells who flies alone and who is tied to others.
    fn sort(&mut self, bodies: &Bodies) {
        let is_dynamic = |slot: u32| bodies.motion[slot as usize] == Motion::Dynamic;
        let mut tied: Vec<u32> = Vec::new();
        for spring in &self.springs {
            match spring.end {
                SpringEnd::Point(_) if spring.rest_length > 0.0 => tied.push(spring.body.index),
                SpringEnd::Point(_) => {}
                SpringEnd::Body(other) => tied.extend([spring.body.index, other.index]),
            }
        }
        tied.retain(|&slot| is_dynamic(slot));
        tied.sort_unstable();
        tied.dedup();
        let anchored = self.springs.iter().map(|spring| spring.body.index);
        let mut alone: Vec<u32> = self.dragged.iter().map(|&(slot, _)| slot).collect();
        alone.extend(anchored);
        alone.retain(|&slot| is_dynamic(slot) && tied.binary_search(&slot).is_err());
        alone.sort_unstable();
        alone.dedup();
        let flight = |&slot: &u32| Flight::new(slot, self.drag(slot), &self.springs);
        self.flights = alone.iter().map(flight).collect();
        let drag: Vec<Drag> = tied.iter().map(|&slot| self.drag(slot)).collect();
        self.network = Network::new(&tied, &drag, &self.springs);
        self.is_sorted = true;
    }
}

/// What acts on all, in double precision.
#[derive(Clone, Copy, Debug)]
struct Air {
    gravity: DVec2,
    wind: DVec2,
    dt: f64,
    speed_max: f64,
}

impl Air {
    /// The move of a body, no faster than a body may be.
    fn allow(&self, slot: u32, velocity: DVec2, path: DVec2) -> Move {
        let velocity = limited(velocity, self.speed_max).as_vec2();
        Move { slot, velocity, path: limited(path, self.speed_max * self.dt).as_vec2() }
    }
}

/// Also of what is out of the range of numbers, which is nothing then.
fn limited(vector: DVec2, most: f64) -> DVec2 {
    let squared = vector.length_squared();
    if squared <= most * most {
        vector
    } else if squared.is_finite() {
        vector * (most / squared.sqrt())
    } else {
        DVec2::ZERO
    }
}

#[cfg(test)]
mod tests;
