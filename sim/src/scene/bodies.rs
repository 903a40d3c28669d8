//! What a scene file says about bodies: defaults by kind, single bodies, seeded layouts.

use super::document::{Field, Range, Table, one_of};
use super::forces;
use super::groups::Groups;
use super::path::Path;
use super::{
    EXTENT_MIN, Kind, LAYOUT_COUNT_MAX, MASS_MAX, MASS_MIN, SIZE_MAX, SPEED_MAX, SceneError,
};
use crate::forces::Drag;
use crate::shape::{Aabb, Shape};
use crate::world::{BodyDef, Motion};
use crate::{DT, TICKS_PER_SECOND};
use glam::Vec2;

/// A body at a fixed place.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// What it is.
    pub kind: Kind,
    /// The body. Its velocity counts only if `velocity_given`.
    pub def: BodyDef,
    /// Whether the file gives a velocity; else minions and dumb minions set off to either side.
    pub velocity_given: bool,
    /// Name by which emitters follow it.
    pub name: Option<String>,
    /// The way of a kinematic body.
    pub path: Option<Path>,
}

/// Bodies at places that the seed decides, clear of each other and of all that is placed.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// What they are.
    pub kind: Kind,
    /// The body, at the origin.
    pub def: BodyDef,
    /// As in [`Placed`].
    pub velocity_given: bool,
    /// One of these is drawn for each body.
    pub shapes: Vec<Shape>,
    /// How many; those that find no free place are left out.
    pub count: u32,
    /// Region of the centres.
    pub area: Aabb,
    /// Columns and rows into which the area is cut; bodies take the cells in turn.
    pub grid: [u32; 2],
    /// Free space around each, world units.
    pub gap: f32,
}

/// Lowest and highest coordinate of anything in a scene.
pub(super) const PLACE: Range = Range::from(-2.0 * SIZE_MAX, 2.0 * SIZE_MAX);
/// A component of a velocity.
pub(super) const VELOCITY: Range = Range::from(-SPEED_MAX, SPEED_MAX);
const EXTENT: Range = Range::from(EXTENT_MIN, SIZE_MAX);
const MASS: Range = Range::from(MASS_MIN, MASS_MAX);
const PERIOD: Range = Range::from(0.1, 3600.0);
const POINTS_MAX: usize = 64;
const NAME_CHARS_MAX: usize = 32;

const BODY_FIELDS: &[&str] = &[
    "kind",
    "name",
    "position",
    "radius",
    "size",
    "velocity",
    "motion",
    "mass",
    "restitution",
    "friction",
    "gravity_scale",
    "drag",
    "group",
    "path",
    "period",
    "phase",
];
const LAYOUT_FIELDS: &[&str] = &[
    "kind",
    "count",
    "area",
    "grid",
    "gap",
    "shapes",
    "radius",
    "size",
    "velocity",
    "motion",
    "mass",
    "restitution",
    "friction",
    "gravity_scale",
    "drag",
    "group",
];

/// Kinds that a file may place, with their words.
const PLACEABLE: [Kind; 6] =
    [Kind::Hero, Kind::Minion, Kind::Dumb, Kind::Platform, Kind::Wall, Kind::Block];
const MOTIONS: [(&str, Motion); 3] =
    [("static", Motion::Static), ("kinematic", Motion::Kinematic), ("dynamic", Motion::Dynamic)];

/// What is known about a body before its place: the chapter's values, changed by the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Traits {
    pub kind: Kind,
    shape: Option<Shape>,
    motion: Motion,
    mass: f32,
    restitution: f32,
    friction: f32,
    gravity_scale: f32,
    drag: Drag,
    group: Option<u8>,
}

impl Traits {
    /// The chapter's values for a kind (B3), and the scene's drag.
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
        };
        let minion = Traits { shape: Some(Shape::circle(6.5)), mass: 2.0, friction: 0.0, ..base };
        match kind {
            Kind::Hero => {
                Traits { shape: Some(Shape::rect(16.0, 22.0)), mass: 0.7, restitution: 0.3, ..base }
            }
            Kind::Minion => Traits { gravity_scale: 0.0, ..minion },
            Kind::Dumb => Traits { gravity_scale: 0.5, ..minion },
            Kind::Platform => {
                Traits { shape: Some(Shape::rect(30.0, 3.0)), motion: Motion::Static, ..base }
            }
            Kind::Wall => Traits { motion: Motion::Static, ..base },
            Kind::Pack => {
                Traits { shape: Some(Shape::circle(1.5)), mass: 0.1, gravity_scale: 0.0, ..base }
            }
            Kind::Block => Traits { restitution: 0.2, friction: 0.4, ..base },
        }
    }

    /// The traits with what a table changes about them.
    pub fn changed_by(self, table: &Table, groups: &Groups) -> Result<Traits, SceneError> {
        Ok(Traits {
            shape: shape(table)?.or(self.shape),
            mass: table.number("mass", self.mass, MASS)?,
            restitution: table.number("restitution", self.restitution, Range::from(0.0, 1.0))?,
            friction: table.number("friction", self.friction, Range::from(0.0, 10.0))?,
            gravity_scale: table.number(
                "gravity_scale",
                self.gravity_scale,
                Range::from(-10.0, 10.0),
            )?,
            drag: forces::drag(table, self.drag)?,
            group: table.get("group").map(|field| groups.index(&field)).transpose()?.or(self.group),
            ..self
        })
    }

    /// The body at the origin, at rest.
    pub fn def(&self, table: &Table, groups: &Groups) -> Result<BodyDef, SceneError> {
        let shape = self.shape.ok_or_else(|| {
            table.error("size", "nothing".into(), "radius = r or size = [width, height]".into())
        })?;
        let group = match self.group {
            Some(group) => group,
            None => groups.default_of(self.kind, table)?,
        };
        Ok(BodyDef {
            shape,
            position: Vec2::ZERO,
            velocity: Vec2::ZERO,
            motion: self.motion,
            mass: self.mass,
            restitution: self.restitution,
            friction: self.friction,
            gravity_scale: self.gravity_scale,
            drag: if self.motion == Motion::Dynamic { self.drag } else { Drag::NONE },
            group,
        })
    }
}

/// `radius` or `size`, if the table has one of them.
fn shape(table: &Table) -> Result<Option<Shape>, SceneError> {
    match (table.get("radius"), table.get("size")) {
        (Some(_), Some(size)) => Err(size.refuse_as("radius and size", "only one of the two")),
        (Some(radius), None) => Ok(Some(Shape::circle(radius.number(EXTENT)?))),
        (None, Some(size)) => {
            let full = size.vector(EXTENT)?;
            Ok(Some(Shape::rect(full.x, full.y)))
        }
        (None, None) => Ok(None),
    }
}

/// The kinds' traits as changed by `[hero]`, `[minion]` and `[dumb]`.
pub(super) struct Kinds {
    pub drag: Drag,
    pub hero: Traits,
    pub minion: Traits,
    pub dumb: Traits,
}

impl Kinds {
    fn of(&self, kind: Kind) -> Traits {
        match kind {
            Kind::Hero => self.hero,
            Kind::Minion => self.minion,
            Kind::Dumb => self.dumb,
            Kind::Platform | Kind::Wall | Kind::Pack | Kind::Block => Traits::of(kind, self.drag),
        }
    }

    /// Kind and traits of a body's or layout's table.
    fn read(&self, table: &Table, groups: &Groups) -> Result<Traits, SceneError> {
        let names = PLACEABLE.map(Kind::name);
        let kind = PLACEABLE[table.need("kind", &one_of(&names))?.choice(&names)?];
        let mut traits = self.of(kind).changed_by(table, groups)?;
        if let Some(field) = table.get("motion") {
            traits.motion = MOTIONS[field.choice(&MOTIONS.map(|(name, _)| name))?].1;
        }
        Ok(traits)
    }
}

/// Reads one entry of `bodies`.
pub(super) fn placed(field: &Field, kinds: &Kinds, groups: &Groups) -> Result<Placed, SceneError> {
    let table = field.table(BODY_FIELDS)?;
    let mut traits = kinds.read(&table, groups)?;
    let path = path(&table)?;
    let position = match &path {
        Some(path) => {
            refuse_beside_path(&table)?;
            traits.motion = Motion::Kinematic;
            path.at(0)
        }
        None => table.need("position", "[x, y] of the centre")?.vector(PLACE)?,
    };
    let velocity = velocity(&table, traits.motion)?;
    let name = table.get("name").map(|field| field.text(NAME_CHARS_MAX)).transpose()?;
    Ok(Placed {
        kind: traits.kind,
        def: BodyDef { position, velocity, ..traits.def(&table, groups)? },
        velocity_given: table.has("velocity"),
        name,
        path,
    })
}

fn velocity(table: &Table, motion: Motion) -> Result<Vec2, SceneError> {
    let velocity = table.vector("velocity", Vec2::ZERO, VELOCITY)?;
    match table.get("velocity") {
        Some(field) if motion == Motion::Static && velocity != Vec2::ZERO => {
            Err(field.refuse("nothing: a static body never moves; make it kinematic or dynamic"))
        }
        _ => Ok(velocity),
    }
}

fn refuse_beside_path(table: &Table) -> Result<(), SceneError> {
    for name in ["position", "velocity"] {
        if let Some(field) = table.get(name) {
            return Err(field.refuse("nothing: the path decides it"));
        }
    }
    match table.get("motion") {
        Some(field) if field.word() != Some("kinematic") => {
            Err(field.refuse("\"kinematic\", because the body has a path"))
        }
        _ => Ok(()),
    }
}

fn path(table: &Table) -> Result<Option<Path>, SceneError> {
    let Some(field) = table.get("path") else {
        return match ["period", "phase"].iter().find_map(|name| table.get(name)) {
            Some(field) => Err(field.refuse("nothing: only a path has it")),
            None => Ok(None),
        };
    };
    let allowed = format!("a list of 2 to {POINTS_MAX} points [x, y], each unlike the one before");
    let items = field.list()?;
    let points = items.iter().map(|item| item.vector(PLACE)).collect::<Result<Vec<_>, _>>()?;
    let distinct = points.windows(2).all(|leg| (leg[1] - leg[0]).length() > 0.0);
    if !(2..=POINTS_MAX).contains(&points.len()) || !distinct {
        return Err(field.refuse(allowed));
    }
    let seconds = table.need("period", &format!("{PERIOD}: seconds there and back"))?;
    let half = (seconds.number(PERIOD)? * (0.5 * TICKS_PER_SECOND as f32) + 0.5) as u32;
    if (half as usize) < points.len() - 1 {
        let least = (points.len() - 1) as f32 * 2.0 * DT;
        return Err(seconds.refuse(format!("at least {least}: a tick for each leg")));
    }
    let phase = table.number("phase", 0.0, Range::from(0.0, 1.0))?;
    let phase_ticks = (phase * (2 * half) as f32 + 0.5) as u32;
    Ok(Some(Path::new(points, half, phase_ticks)))
}

/// Reads one entry of `layouts`.
pub(super) fn layout(field: &Field, kinds: &Kinds, groups: &Groups) -> Result<Layout, SceneError> {
    let table = field.table(LAYOUT_FIELDS)?;
    let mut traits = kinds.read(&table, groups)?;
    let shapes = shapes(&table)?;
    if let Some(&first) = shapes.first() {
        traits.shape = Some(first);
    }
    let def = traits.def(&table, groups)?;
    let grid = match table.get("grid") {
        Some(field) => {
            let [columns, rows] = field.items("[columns, rows]")?;
            [columns.whole(1, LAYOUT_COUNT_MAX)?, rows.whole(1, LAYOUT_COUNT_MAX)?]
        }
        None => [1, 1],
    };
    let count = table.need("count", "how many bodies")?.whole(1, LAYOUT_COUNT_MAX)?;
    let [low, high] = table.need("area", "[[x, y], [x, y]]: corners")?.corners(PLACE)?;
    let velocity = velocity(&table, traits.motion)?;
    Ok(Layout {
        kind: traits.kind,
        def: BodyDef { velocity, ..def },
        velocity_given: table.has("velocity"),
        shapes: if shapes.is_empty() { vec![def.shape] } else { shapes },
        count,
        area: Aabb { low, high },
        grid,
        gap: table.number("gap", 1.0, Range::from(0.0, SIZE_MAX))?,
    })
}

fn shapes(table: &Table) -> Result<Vec<Shape>, SceneError> {
    let Some(field) = table.get("shapes") else { return Ok(Vec::new()) };
    let allowed = "a list of 1 to 16 entries { radius = r } or { size = [width, height] }";
    if table.has("radius") || table.has("size") {
        return Err(field.refuse_as("shapes beside radius or size", "only one of them"));
    }
    let items = field.list()?;
    if !(1..=16).contains(&items.len()) {
        return Err(field.refuse(allowed));
    }
    let entry = |item: &Field| {
        shape(&item.table(&["radius", "size"])?)?.ok_or_else(|| item.refuse(allowed))
    };
    items.iter().map(entry).collect()
}
