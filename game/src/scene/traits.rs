//! Properties of bodies: defaults by kind (B3), and the fields of a scene file that change them.

use super::drag;
use super::groups::Groups;
use super::kind::Kind;
use super::limits::{EXTENT_MIN, GRAVITY_SCALE_MAX, MASS_MAX, MASS_MIN, SIZE_MAX};
use super::table::{Range, Table, one_of};
use glam::Vec2;
use jostle_sim::{BodyDef, Drag, Motion, Shape};

const EXTENT: Range = Range::from(EXTENT_MIN, SIZE_MAX);
const MASS: Range = Range::from(MASS_MIN, MASS_MAX);

/// Kinds that a file may place, by their words.
const PLACEABLE: [(&str, Kind); 6] = [
    (Kind::Hero.name(), Kind::Hero),
    (Kind::Minion.name(), Kind::Minion),
    (Kind::Marble.name(), Kind::Marble),
    (Kind::Platform.name(), Kind::Platform),
    (Kind::Wall.name(), Kind::Wall),
    (Kind::Block.name(), Kind::Block),
];
const MOTIONS: [(&str, Motion); 3] =
    [("static", Motion::Static), ("kinematic", Motion::Kinematic), ("dynamic", Motion::Dynamic)];

/// Properties of a body apart from its position: those of its kind (B3), changed by the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Traits {
    pub kind: Kind,
    pub shape: Option<Shape>,
    pub motion: Motion,
    mass: f32,
    restitution: f32,
    friction: f32,
    gravity_scale: f32,
    drag: Drag,
    group: Option<u8>,
    /// Speed of minions and marbles without a velocity of their own, units/s.
    pub speed: f32,
}

impl Traits {
    /// The values of a kind (B3), and the scene's drag.
    pub fn of(kind: Kind, drag: Drag) -> Traits {
        let base = Traits {
            kind,
            shape: None,
            motion: Motion::Dynamic,
            mass: 1.0,
            restitution: 0.8,
            friction: 0.3,
            gravity_scale: 1.0,
            drag,
            group: None,
            speed: 0.0,
        };
        let ball = Shape::circle(6.5);
        let minion = Traits { shape: Some(ball), mass: 2.0, friction: 0.0, speed: 5.0, ..base };
        match kind {
            Kind::Hero => {
                Traits { shape: Some(Shape::rect(16.0, 22.0)), mass: 0.7, restitution: 0.3, ..base }
            }
            Kind::Minion => Traits { gravity_scale: 0.0, ..minion },
            Kind::Marble => Traits { gravity_scale: 0.5, ..minion },
            Kind::Platform => {
                Traits { shape: Some(Shape::rect(30.0, 3.0)), motion: Motion::Static, ..base }
            }
            Kind::Wall => Traits { motion: Motion::Static, ..base },
            // Friction would brake its own motion, and hold it where it meets a platform (C39).
            Kind::Pack => Traits {
                shape: Some(Shape::circle(1.5)),
                mass: 0.1,
                friction: 0.0,
                gravity_scale: 0.0,
                ..base
            },
            Kind::Block => Traits { restitution: 0.2, friction: 0.4, ..base },
        }
    }

    /// The traits with the changes of a table.
    pub fn changed_by(self, table: &Table, groups: &Groups) -> Traits {
        Traits {
            shape: shape(table).or(self.shape),
            mass: table.get("mass").number(self.mass, MASS),
            restitution: table.get("restitution").number(self.restitution, Range::from(0.0, 1.0)),
            friction: table.get("friction").number(self.friction, Range::from(0.0, 10.0)),
            gravity_scale: table
                .get("gravity_scale")
                .number(self.gravity_scale, Range::from(-GRAVITY_SCALE_MAX, GRAVITY_SCALE_MAX)),
            drag: drag::drag(&table.get("drag"), self.drag),
            group: groups.given(&table.get("group")).or(self.group),
            ..self
        }
    }

    /// The body at the origin, at rest.
    pub fn def(&self, table: &Table, groups: &Groups) -> BodyDef {
        let shape = self.shape.unwrap_or_else(|| {
            table.get("size").refuse("radius = r or size = [width, height]");
            Shape::circle(1.0)
        });
        BodyDef {
            shape,
            position: Vec2::ZERO,
            velocity: Vec2::ZERO,
            motion: self.motion,
            mass: self.mass,
            restitution: self.restitution,
            friction: self.friction,
            gravity_scale: self.gravity_scale,
            drag: if self.motion == Motion::Dynamic { self.drag } else { Drag::NONE },
            group: self.group.unwrap_or_else(|| groups.default_of(self.kind, table)),
        }
    }
}

/// `radius` or `size`, if the table has one of them.
pub(super) fn shape(table: &Table) -> Option<Shape> {
    let [radius, size] = table.either("radius", "size");
    if radius.is_given() {
        return Some(Shape::circle(radius.number(1.0, EXTENT)));
    }
    let full = size.vector(Vec2::ONE, EXTENT);
    size.is_given().then(|| Shape::rect(full.x, full.y))
}

/// The kinds' traits as changed by `[hero]`, `[minion]` and `[dumb]`.
pub(super) struct Kinds {
    pub drag: Drag,
    pub hero: Traits,
    pub minion: Traits,
    pub marble: Traits,
}

impl Kinds {
    /// Kind and traits of a body's or layout's table.
    pub fn read(&self, table: &Table, groups: &Groups) -> Traits {
        let kind = table.need("kind", &one_of(PLACEABLE.map(|(name, _)| name)));
        let base = match kind.choice(&PLACEABLE).unwrap_or(Kind::Block) {
            Kind::Hero => self.hero,
            Kind::Minion => self.minion,
            Kind::Marble => self.marble,
            other => Traits::of(other, self.drag),
        };
        let motion = table.get("motion").choice(&MOTIONS).unwrap_or(base.motion);
        Traits { motion, ..base.changed_by(table, groups) }
    }
}
