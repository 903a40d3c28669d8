//! An engine-independent scene in f64: bodies, gravity, drag, springs, and the random number generator of the shared
//! scenes.

use crate::engine::State;
use glam::DVec2;

/// Default length of a tick in seconds.
pub const TICK_S: f64 = 1.0 / 60.0;

/// A body's shape, centred on its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    Circle {
        radius: f64,
    },
    Box {
        /// Half the width and height, in units.
        half: DVec2,
    },
}

impl Shape {
    /// Creates a box with the given half-sizes.
    pub fn rect(half_width: f64, half_height: f64) -> Shape {
        Shape::Box { half: DVec2::new(half_width, half_height) }
    }

    /// Half the extent along x and y.
    pub fn half_extent(self) -> DVec2 {
        match self {
            Shape::Circle { radius } => DVec2::splat(radius),
            Shape::Box { half } => half,
        }
    }

    /// Area in square units; equals the mass at density 1.
    pub fn area(self) -> f64 {
        match self {
            Shape::Circle { radius } => std::f64::consts::PI * radius * radius,
            Shape::Box { half } => 4.0 * half.x * half.y,
        }
    }
}

/// How a body moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    Static,
    /// Moved only by its own velocity.
    Kinematic,
    /// Moved by gravity and contacts.
    Dynamic,
}

/// Initial state of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    pub shape: Shape,
    pub position: DVec2,
    /// Velocity in units/s.
    pub velocity: DVec2,
    pub motion: Motion,
    /// Mass; only used for dynamic bodies.
    pub mass: f64,
    /// Coulomb friction coefficient, always the same for both bodies of a contact.
    pub friction: f64,
    /// Coefficient of restitution, always the same for both bodies of a contact.
    pub restitution: f64,
}

impl Body {
    /// Creates a dynamic body at rest with density 1, friction 0.3 and restitution 0.
    pub fn new(shape: Shape, x: f64, y: f64) -> Body {
        Body {
            shape,
            position: DVec2::new(x, y),
            velocity: DVec2::ZERO,
            motion: Motion::Dynamic,
            mass: shape.area(),
            friction: 0.3,
            restitution: 0.0,
        }
    }

    /// Creates a static body with the same defaults.
    pub fn fixed(shape: Shape, x: f64, y: f64) -> Body {
        Body { motion: Motion::Static, ..Body::new(shape, x, y) }
    }

    /// Returns the body with the given velocity.
    pub fn moving(self, x: f64, y: f64) -> Body {
        Body { velocity: DVec2::new(x, y), ..self }
    }

    /// Returns the body with the given mass.
    pub fn of_mass(self, mass: f64) -> Body {
        Body { mass, ..self }
    }

    /// Returns the body with the given friction and restitution.
    pub fn of_stuff(self, friction: f64, restitution: f64) -> Body {
        Body { friction, restitution, ..self }
    }

    /// Returns the body, made kinematic.
    pub fn kinematic(self) -> Body {
        Body { motion: Motion::Kinematic, ..self }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drag {
    None,
    /// Linear drag, -k v, with k in 1/s.
    Linear(f64),
    /// Quadratic drag, -k |v| v, with k in 1/unit.
    Quadratic(f64),
}

/// The other end of a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hook {
    Point(DVec2),
    /// Another body, given by its index.
    Body(usize),
}

/// A spring between two centres, which does not collide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Index of the body at the spring's first end.
    pub body: usize,
    pub to: Hook,
    /// Rest length in units.
    pub length: f64,
    /// Force per unit of length.
    pub stiffness: f64,
    /// Force per unit of speed along the spring, or in any direction if the rest length is 0.
    pub damping: f64,
}

impl Spring {
    /// The force on the spring's body, given the states of both ends.
    pub fn force(&self, own: State, far: State) -> DVec2 {
        let (offset, speed) = (own.position - far.position, own.velocity - far.velocity);
        if self.length == 0.0 {
            return -offset * self.stiffness - speed * self.damping;
        }
        let direction = offset.normalize_or_zero();
        let stretch = offset.length() - self.length;
        -direction * (self.stiffness * stretch + self.damping * speed.dot(direction))
    }

    /// Returns the state of the other end.
    pub fn far(&self, states: &[State]) -> State {
        match self.to {
            Hook::Point(position) => State { position, velocity: DVec2::ZERO },
            Hook::Body(other) => states[other],
        }
    }
}

/// Bodies and their surroundings.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Gravity in units/s^2.
    pub gravity: DVec2,
    /// Seconds between two readings; an engine may subdivide this interval.
    pub tick_s: f64,
    /// Closing speed below which contacts do not bounce, in units/s.
    pub bounce_threshold: f64,
    /// Drag on every dynamic body.
    pub drag: Drag,
    /// Velocity of the air in units/s; without drag it has no effect.
    pub wind: DVec2,
    /// Springs between bodies, or between a body and a point.
    pub springs: Vec<Spring>,
    /// Whether bodies at rest fall asleep, in engines that support it.
    pub sleeping: bool,
    /// Whether bodies collide; otherwise they pass through each other.
    pub collides: bool,
    /// The bodies, in the order they are added to an engine.
    pub bodies: Vec<Body>,
}

impl Scene {
    /// Creates a scene without bodies, with gravity pointing downwards.
    pub fn new(gravity: f64) -> Scene {
        Scene {
            gravity: DVec2::new(0.0, -gravity),
            tick_s: TICK_S,
            bounce_threshold: 2.0,
            drag: Drag::None,
            wind: DVec2::ZERO,
            springs: Vec::new(),
            sleeping: false,
            collides: true,
            bodies: Vec::new(),
        }
    }

    /// Adds a body and returns its index.
    pub fn add(&mut self, body: Body) -> usize {
        self.bodies.push(body);
        self.bodies.len() - 1
    }

    /// Returns the indices of the dynamic bodies.
    pub fn dynamic(&self) -> impl Iterator<Item = usize> + '_ {
        let bodies = self.bodies.iter().enumerate();
        bodies.filter(|(_, body)| body.motion == Motion::Dynamic).map(|(index, _)| index)
    }

    /// The reduced mass of a spring's bodies: m1 m2 / (m1 + m2).
    pub fn swinging_mass(&self, spring: &Spring) -> f64 {
        let inverse_mass = |index: usize| match self.bodies[index].motion {
            Motion::Dynamic => 1.0 / self.bodies[index].mass,
            Motion::Static | Motion::Kinematic => 0.0,
        };
        let other = match spring.to {
            Hook::Point(_) => 0.0,
            Hook::Body(other) => inverse_mass(other),
        };
        1.0 / (inverse_mass(spring.body) + other)
    }

    /// Whether bodies can collide at all.
    pub fn has_contacts(&self) -> bool {
        self.collides && self.bodies.len() > 1
    }

    /// Adds the four walls of the shared scenes around (0, 0)-(w, h), 20 thick.
    pub fn contain(&mut self, w: f64, h: f64, friction: f64, restitution: f64) {
        let (across, upright) =
            (Shape::rect(w / 2.0 + 20.0, 10.0), Shape::rect(10.0, h / 2.0 + 20.0));
        let walls = [
            (across, w / 2.0, -10.0),
            (across, w / 2.0, h + 10.0),
            (upright, -10.0, h / 2.0),
            (upright, w + 10.0, h / 2.0),
        ];
        for (shape, x, y) in walls {
            self.add(Body::fixed(shape, x, y).of_stuff(friction, restitution));
        }
    }

    /// Adds a static floor whose upper face is y = 0.
    pub fn floor(&mut self, half_width: f64, friction: f64, restitution: f64) {
        let floor = Body::fixed(Shape::rect(half_width, 10.0), 0.0, -10.0);
        self.add(floor.of_stuff(friction, restitution));
    }
}

/// mulberry32, the random number generator that defines the shared scenes.
pub struct Mulberry(pub u32);

impl Mulberry {
    /// Returns a number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x6D2B_79F5);
        let mut t = self.0;
        t = (t ^ (t >> 15)).wrapping_mul(t | 1);
        t ^= t.wrapping_add((t ^ (t >> 7)).wrapping_mul(t | 61));
        f64::from(t ^ (t >> 14)) / 4_294_967_296.0
    }

    /// Returns a number in [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}
