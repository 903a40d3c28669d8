//! Bodies in a scene file: individual ones, and layouts that depend on the seed.

use super::field::{POSITION, Range, VELOCITY};
use super::groups::Groups;
use super::kind::Kind;
use super::limits::{LAYOUT_COUNT_MAX, SIZE_MAX};
use super::path::Path;
use super::recipes::Recipes;
use super::rules::{Condition, POINTS_MAX, RuleNames};
use super::table::Table;
use super::traits::{Kinds, Traits, shape};
use glam::Vec2;
use jostle_sim::{Aabb, BodyDef, DT, Motion, Shape, TICKS_PER_SECOND};

const PERIOD: Range = Range::from(0.1, 3600.0);
const PATH_POINTS_MAX: usize = 64;
const NAME_CHARS_MAX: usize = 32;
const STRENGTH: Range = Range::above(0.0, 1.0e9);

/// A body at a fixed position.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// Kind of the body.
    pub kind: Kind,
    /// Definition of the body.
    pub def: BodyDef,
    /// Speed at which it sets off to a random side, units/s; 0 if the file gives a velocity.
    pub start_speed: f32,
    /// The path of a kinematic body.
    pub path: Option<Path>,
    /// Name by which emitters, zones, springs and rules refer to it; no two bodies may share a name. Label: Name.
    pub name: Option<String>,
    /// It is present only while this holds. It comes back at its start as soon as nothing that can move is in the
    /// way. Default: always.
    #[doc(alias = "while")]
    pub presence: Condition,
    /// It moves along its path only while this holds; only with `path`. Default: always.
    pub runs: Condition,
    /// The impact that breaks it, if it is breakable.
    pub breaks: Option<Breakable>,
}

/// Strength of a breakable body, and the points for breaking it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakable {
    /// It breaks under a blow harder than this, and cracks under one more than half as hard; only for dynamic bodies. A
    /// blow is the closing speed of a contact times the reduced mass of the two bodies: m1 m2 / (m1 + m2), or m1
    /// against something immovable. Slow pressure breaks nothing. Label: Strength.
    pub strength: f32,
    /// Points for the side that broke it: that of the player whose hero or pack hit it, or who last touched what hit
    /// it; with `strength`. Label: Points for breaking it.
    pub points: i32,
    /// Recipe of the particles emitted where it breaks; with `strength`.
    pub splash: Option<u8>,
}

/// Bodies in a grid, either at positions derived from the seed, clear of each other and of all fixed bodies, or
/// exactly at the centres of the cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Kind of the bodies.
    pub kind: Kind,
    /// Definition of each body, at the origin.
    pub def: BodyDef,
    /// As in [`Placed`].
    pub start_speed: f32,
    /// Number of bodies; those for which there is no free position are omitted. Label: Number of bodies.
    pub count: u32,
    /// Where their centres may be, as two corners inside the kill zone.
    pub area: Aabb,
    /// Number of columns and rows of cells into which the area is divided; they are filled one after another. Default:
    /// `[1, 1]`.
    pub grid: [u32; 2],
    /// Minimum distance from other bodies; not with `exact`. Label: Gap between bodies, for experts.
    pub gap: f32,
    /// Puts each body at the centre of its own cell, row by row from the lower left; `count` must then be at most the
    /// number of cells. Label: In exact rows, for experts.
    pub exact: bool,
    /// Shapes from which one is chosen at random for each body, instead of `radius` and `size`. Default: none.
    pub shapes: Vec<Shape>,
}

impl Layout {
    /// The grid cell for the body with this number.
    pub fn cell(&self, number: u32) -> Aabb {
        let [columns, rows] = self.grid;
        let number = number % (columns * rows);
        let size = (self.area.high - self.area.low) / Vec2::new(columns as f32, rows as f32);
        let corner = Vec2::new((number % columns) as f32, (number / columns) as f32) * size;
        let low = self.area.low + corner;
        Aabb { low, high: low + size }
    }

    /// Centre of the cell for the body with this number.
    pub fn cell_center(&self, number: u32) -> Vec2 {
        let cell = self.cell(number);
        (cell.low + cell.high) * 0.5
    }
}

/// Reads one entry of `bodies`.
pub(super) fn placed(
    table: &Table,
    kinds: &Kinds,
    known: &RuleNames,
    recipes: &mut Recipes,
) -> Placed {
    let RuleNames { names, groups } = known;
    let name = table.get("name");
    let mut traits = kinds.traits_of(table, groups);
    // Centre, inside the kill zone. Default: this or `path`. Label: Position.
    let position = table.get("position");
    let path = path(table);
    if path.is_some() {
        traits.def.motion = Motion::Kinematic;
    } else if !position.is_given() {
        position.refuse("[x, y] of the centre");
    }
    let position = match &path {
        Some(path) => path.at(0),
        None => position.vector(Vec2::ZERO, POSITION),
    };
    let (velocity, start_speed) = velocity(table, &traits);
    let runs = table.get("runs");
    if path.is_none() {
        runs.refuse_if_given("nothing: only a path has it");
    }
    Placed {
        kind: traits.kind,
        def: BodyDef { position, velocity, ..traits.def(table, groups) },
        start_speed,
        name: name.given(|name| name.text(NAME_CHARS_MAX)),
        runs: names.any_condition(&runs),
        presence: names.any_condition(&table.get("while")),
        breaks: breakable(table, traits.def.motion, recipes),
        path,
    }
}

/// Reads the initial velocity, or the speed at which the body sets off to a random side instead.
fn velocity(table: &Table, traits: &Traits) -> (Vec2, f32) {
    // Velocity with which it starts and comes back, at most `speed_max` overall. A minion keeps this speed, and one
    // that starts at rest and does not fall comes to rest again. Default: 0; minions and marbles move to either side.
    // Label: Velocity at the start.
    let field = table.get("velocity");
    let velocity = field.vector(Vec2::ZERO, VELOCITY);
    if traits.def.motion == Motion::Static && velocity != Vec2::ZERO {
        field.refuse("nothing: a static body never moves; make it kinematic or dynamic");
    }
    let sets_off = !field.is_given() && traits.def.motion == Motion::Dynamic;
    (velocity, if sets_off { traits.start_speed } else { 0.0 })
}

/// Reads `path`, `period` and `phase`.
fn path(table: &Table) -> Option<Path> {
    // Makes the body kinematic. It moves from the first point to the last and back, repeatedly. Default: none.
    let path = table.get("path");
    // Time there and back, seconds; every point is reached at a whole tick. Default: required with `path`. Label:
    // Seconds there and back.
    let period = table.get("period");
    // Share of the period that has already passed at the start. Label: Share of the path at the start, for experts.
    let phase = table.get("phase");
    if !path.is_given() {
        for field in [period, phase] {
            field.refuse_if_given("nothing: only a path has it");
        }
        return None;
    }
    for field in ["position", "velocity"].map(|name| table.get(name)) {
        field.refuse_if_given("nothing: the path decides it");
    }
    let motion = table.get("motion");
    if motion.is_given() && motion.word() != Some("kinematic") {
        motion.refuse("\"kinematic\", because the body has a path");
    }
    let allowed =
        format!("a list of 2 to {PATH_POINTS_MAX} points [x, y], each unlike the one before");
    let items = path.some_items(2..=PATH_POINTS_MAX, &allowed);
    let points: Vec<Vec2> = items.iter().map(|item| item.vector(Vec2::ZERO, POSITION)).collect();
    let distinct = points.windows(2).all(|leg| (leg[1] - leg[0]).length() > 0.0);
    if points.len() < 2 || !distinct {
        path.refuse(allowed);
        return None;
    }
    let period = table.need("period", &format!("{PERIOD}: seconds there and back"));
    let half = (period.number(1.0, PERIOD) * (0.5 * TICKS_PER_SECOND as f32) + 0.5) as u32;
    if (half as usize) < points.len() - 1 {
        let least = (points.len() - 1) as f32 * 2.0 * DT;
        period.refuse(format!("at least {least}: a tick for each leg"));
        return None;
    }
    let phase = phase.number(0.0, Range::from(0.0, 1.0));
    let phase_ticks = (phase * (2 * half) as f32 + 0.5) as u32;
    Some(Path::new(points, half, phase_ticks))
}

/// Reads one entry of `layouts`.
pub(super) fn layout(table: &Table, kinds: &Kinds, groups: &Groups) -> Layout {
    let mut traits = kinds.traits_of(table, groups);
    let shapes = shapes(table);
    traits.shape = shapes.first().copied().or(traits.shape);
    let def = traits.def(table, groups);
    let grid = table.get("grid").array(
        [1, 1],
        || "[columns, rows]".to_owned(),
        |item, base| item.whole(base, 1..=LAYOUT_COUNT_MAX),
    );
    let count = table.need("count", "how many bodies");
    let (exact, gap) = (table.get("exact").truth(false), table.get("gap"));
    if exact {
        gap.refuse_if_given("nothing: the grid decides it where exact = true");
    }
    let count_max = if exact { grid[0] * grid[1] } else { LAYOUT_COUNT_MAX };
    let area = table.need("area", "[[x, y], [x, y]]: corners");
    let [low, high] = area.corners([Vec2::ZERO; 2], POSITION);
    let (velocity, start_speed) = velocity(table, &traits);
    Layout {
        kind: traits.kind,
        def: BodyDef { velocity, ..def },
        start_speed,
        shapes: if shapes.is_empty() { vec![def.shape] } else { shapes },
        count: count.whole(1, 1..=count_max.min(LAYOUT_COUNT_MAX)),
        area: Aabb { low, high },
        grid,
        gap: gap.number(1.0, Range::from(0.0, SIZE_MAX)),
        exact,
    }
}

fn shapes(table: &Table) -> Vec<Shape> {
    let field = table.get("shapes");
    let allowed = "a list of 1 to 16 entries { radius = r } or { size = [width, height] }";
    if field.is_given() && ["radius", "size"].iter().any(|name| table.get(name).is_given()) {
        field.refuse_as("shapes beside radius or size", "only one of them");
    }
    let items = field.some_items(1..=16, allowed);
    let shapes = items.iter().filter_map(|item| {
        let shape = item.table(shape);
        if shape.is_none() {
            item.refuse(allowed);
        }
        shape
    });
    shapes.collect()
}

/// Reads `strength`, `points` and `splash` of a body.
fn breakable(table: &Table, motion: Motion, recipes: &mut Recipes) -> Option<Breakable> {
    let strength = table.get("strength");
    let [points, splash] = ["points", "splash"].map(|name| table.get(name));
    if !strength.is_given() {
        for field in [&points, &splash] {
            field.refuse_if_given("nothing: only a body with a strength has it");
        }
    } else if motion != Motion::Dynamic {
        strength.refuse("nothing: only a dynamic body breaks");
    }
    strength.given(|strength| Breakable {
        strength: strength.number(1.0, STRENGTH),
        points: points.signed(0, POINTS_MAX),
        splash: splash.given(|splash| recipes.index(splash, "spark")),
    })
}
