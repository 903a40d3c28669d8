//! Properties of bodies: the defaults for each kind (B3), and the scene file fields that change them.

use super::field::Range;
use super::groups::Groups;
use super::kind::Kind;
use super::limits::{EXTENT_MIN, GRAVITY_SCALE_MAX, MASS_MAX, MASS_MIN, SIZE_MAX};
use super::table::{Field, Table, one_of};
use glam::Vec2;
use jostle_sim::{BodyDef, Drag, Motion, Shape};

const EXTENT: Range = Range::from(EXTENT_MIN, SIZE_MAX);
const MASS: Range = Range::from(MASS_MIN, MASS_MAX);
/// Allowed values for linear drag, per second, and quadratic drag, per unit.
const DRAG: Range = Range::from(0.0, 1000.0);

/// Kinds that a file may place.
const PLACEABLE: [Kind; 6] =
    [Kind::Hero, Kind::Minion, Kind::Marble, Kind::Platform, Kind::Wall, Kind::Block];
const MOTIONS: [(&str, Motion); 3] =
    [("static", Motion::Static), ("kinematic", Motion::Kinematic), ("dynamic", Motion::Dynamic)];

/// Properties of a body other than its position, which are the defaults of its kind (B3) as changed by the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Traits {
    pub kind: Kind,
    pub shape: Option<Shape>,
    group: Option<u8>,
    /// Speed of minions and marbles that are given no velocity, units/s.
    pub start_speed: f32,
    /// The other properties, for a body at rest at the origin.
    pub def: BodyDef,
}

impl Traits {
    /// The defaults of a kind (B3), with the scene's drag.
    pub fn of(kind: Kind, drag: Drag) -> Traits {
        let base = BodyDef { drag, ..BodyDef::default() };
        let fixed = BodyDef { motion: Motion::Static, ..base };
        let ball = BodyDef { mass: 2.0, friction: 0.0, ..base };
        let (radius, box_size) = (|r| Some(Shape::circle(r)), |x, y| Some(Shape::rect(x, y)));
        let (shape, start_speed, def) = match kind {
            Kind::Hero => {
                (box_size(16.0, 22.0), 0.0, BodyDef { mass: 0.7, restitution: 0.3, ..base })
            }
            Kind::Minion => (radius(6.5), 5.0, BodyDef { gravity_scale: 0.0, ..ball }),
            Kind::Marble => (radius(6.5), 5.0, BodyDef { gravity_scale: 0.5, ..ball }),
            Kind::Platform => (box_size(30.0, 3.0), 0.0, fixed),
            Kind::Wall => (None, 0.0, fixed),
            // Friction would brake the pack's own motion, and stop it where it meets a platform (C39).
            Kind::Pack => (radius(1.5), 0.0, BodyDef { mass: 0.1, gravity_scale: 0.0, ..ball }),
            Kind::Block => (None, 0.0, BodyDef { restitution: 0.2, friction: 0.4, ..base }),
        };
        Traits { kind, shape, group: None, start_speed, def }
    }

    /// Returns the traits with the changes made by a table.
    pub fn changed_by(self, table: &Table, groups: &Groups) -> Traits {
        let Traits { def, .. } = self;
        let share = Range::from(0.0, 1.0);
        let gravity = Range::from(-GRAVITY_SCALE_MAX, GRAVITY_SCALE_MAX);
        let shape = shape(table).or(self.shape);
        let def = BodyDef {
            // Mass of a dynamic body. Default: by kind. Label: Mass.
            mass: table.get("mass").number(def.mass, MASS),
            // Bounciness: 1 keeps all speed; a pair uses the smaller of its two values. Default: by kind. Label:
            // Bounciness.
            restitution: table.get("restitution").number(def.restitution, share),
            // Coulomb friction coefficient; a pair uses the geometric mean. Default: by kind. Label: Friction.
            friction: table.get("friction").number(def.friction, Range::from(0.0, 10.0)),
            // Factor applied to gravity; 0 for none. Default: by kind. Label: Share of gravity.
            gravity_scale: table.get("gravity_scale").number(def.gravity_scale, gravity),
            // Drag, as described [below](#drag-and-wind); `0` for none. Default: the scene's. Label: Air drag, for
            // experts.
            drag: drag(&table.get("drag"), def.drag),
            ..def
        };
        // Collision group. Default: by kind. Label: Collision group, for experts.
        let group = groups.given(&table.get("group")).or(self.group);
        Traits { shape, group, def, ..self }
    }

    /// Returns the definition of the body, at rest at the origin.
    pub fn def(&self, table: &Table, groups: &Groups) -> BodyDef {
        let shape = self.shape.unwrap_or_else(|| {
            table.get("size").refuse("radius = r or size = [width, height]");
            Shape::circle(1.0)
        });
        let drag = if self.def.motion == Motion::Dynamic { self.def.drag } else { Drag::NONE };
        let group = self.group.unwrap_or_else(|| groups.default_of(self.kind, table));
        BodyDef { shape, drag, group, ..self.def }
    }
}

/// Reads `radius` or `size`, if the table has either.
pub(super) fn shape(table: &Table) -> Option<Shape> {
    // Makes the body a circle with this radius. Default: by kind. Label: Radius.
    let radius = table.get("radius");
    // Makes the body a box with this width and height. Default: by kind. Label: Size.
    let size = table.get("size");
    table.not_both("radius", "size");
    let circle = radius.given(|radius| Shape::circle(radius.number(1.0, EXTENT)));
    if circle.is_some() {
        return circle;
    }
    let full = size.vector(Vec2::ONE, EXTENT);
    size.is_given().then(|| Shape::rect(full.x, full.y))
}

/// Reads the `drag` of a table: a single rate, or both rates.
pub(super) fn drag(field: &Field, default: Drag) -> Drag {
    field.describe(format_args!("{DRAG}, or {{ linear = k, quadratic = q }}"));
    let drag = field.given(|field| {
        if field.is_number() || !field.is_given() {
            return Drag { linear: field.number(0.0, DRAG), quadratic: 0.0 };
        }
        let allowed = format!("{DRAG}, or {{ linear = k, quadratic = q }}");
        field.table_or(&allowed, |rates| Drag {
            linear: rates.get("linear").number(0.0, DRAG),
            quadratic: rates.get("quadratic").number(0.0, DRAG),
        })
    });
    drag.unwrap_or(default)
}

/// The kinds' traits as changed by `[hero]`, `[minion]` and `[dumb]`.
pub(super) struct Kinds {
    pub drag: Drag,
    pub hero: Traits,
    pub minion: Traits,
    pub marble: Traits,
}

impl Kinds {
    /// Reads the kind and traits from a body's or layout's table.
    pub fn traits_of(&self, table: &Table, groups: &Groups) -> Traits {
        // The kind of body, which determines how rules treat it, and its defaults. Label: Kind.
        let kind = table.need("kind", &one_of(PLACEABLE.map(Kind::name)));
        let placeable = PLACEABLE.map(|kind| (kind.name(), kind));
        let base = match kind.choice(&placeable).unwrap_or(Kind::Block) {
            Kind::Hero => self.hero,
            Kind::Minion => self.minion,
            Kind::Marble => self.marble,
            other => Traits::of(other, self.drag),
        };
        // A static body never moves, a kinematic one moves only by its velocity or path, and a dynamic one is moved by
        // forces and contacts. Default: `static` for platforms and walls, else `dynamic`. Label: How it moves, for
        // experts.
        let motion = table.get("motion").choice(&MOTIONS).unwrap_or(base.def.motion);
        let traits = base.changed_by(table, groups);
        Traits { def: BodyDef { motion, ..traits.def }, ..traits }
    }
}
