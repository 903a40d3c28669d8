//! Bodies in a scene file: single ones, and layouts that the seed decides.

use super::groups::Groups;
use super::limits::{LAYOUT_COUNT_MAX, SIZE_MAX, SPEED_MAX};
use super::path::Path;
use super::recipes::Recipes;
use super::rules::Names;
use super::sling;
use super::spec::{Layout, Placed};
use super::table::{POSITION, Range, Table};
use super::traits::{Kinds, Traits, shape};
use glam::Vec2;
use jostle_sim::{Aabb, BodyDef, DT, Motion, Shape, TICKS_PER_SECOND};

/// A component of a velocity.
const VELOCITY: Range = Range::from(-SPEED_MAX, SPEED_MAX);
const PERIOD: Range = Range::from(0.1, 3600.0);
const POINTS_MAX: usize = 64;
const NAME_CHARS_MAX: usize = 32;

/// Reads one entry of `bodies`.
pub(super) fn placed(
    table: &Table,
    kinds: &Kinds,
    groups: &Groups,
    names: &Names,
    recipes: &mut Recipes,
) -> Placed {
    let name = table.get("name");
    let mut traits = kinds.read(table, groups);
    let position = table.get("position");
    let path = path(table);
    if path.is_some() {
        traits.motion = Motion::Kinematic;
    } else if !position.is_given() {
        position.refuse("[x, y] of the centre");
    }
    let position = match &path {
        Some(path) => path.at(0),
        None => position.vector(Vec2::ZERO, POSITION),
    };
    let (velocity, start_speed) = velocity(table, &traits);
    let runs = table.get("runs");
    if runs.is_given() && path.is_none() {
        runs.refuse("nothing: only a path has it");
    }
    let runs = names.any_condition(&runs);
    Placed {
        kind: traits.kind,
        def: BodyDef { position, velocity, ..traits.def(table, groups) },
        start_speed,
        name: name.is_given().then(|| name.text(NAME_CHARS_MAX)),
        presence: names.any_condition(&table.get("while")),
        runs,
        breaks: sling::breakable(table, traits.motion, recipes),
        path,
    }
}

/// The velocity at the start, and the speed at which the body sets off to either side instead.
fn velocity(table: &Table, traits: &Traits) -> (Vec2, f32) {
    let field = table.get("velocity");
    let velocity = field.vector(Vec2::ZERO, VELOCITY);
    if traits.motion == Motion::Static && velocity != Vec2::ZERO {
        field.refuse("nothing: a static body never moves; make it kinematic or dynamic");
    }
    let sets_off = !field.is_given() && traits.motion == Motion::Dynamic;
    (velocity, if sets_off { traits.speed } else { 0.0 })
}

/// `path`, `period` and `phase`.
fn path(table: &Table) -> Option<Path> {
    let [path, period, phase] = ["path", "period", "phase"].map(|name| table.get(name));
    if !path.is_given() {
        for field in [period, phase].iter().filter(|field| field.is_given()) {
            field.refuse("nothing: only a path has it");
        }
        return None;
    }
    refuse_beside_path(table);
    let allowed = format!("a list of 2 to {POINTS_MAX} points [x, y], each unlike the one before");
    let items = path.some_items(2..=POINTS_MAX, &allowed);
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

fn refuse_beside_path(table: &Table) {
    for field in ["position", "velocity"].map(|name| table.get(name)) {
        if field.is_given() {
            field.refuse("nothing: the path decides it");
        }
    }
    let motion = table.get("motion");
    if motion.is_given() && motion.word() != Some("kinematic") {
        motion.refuse("\"kinematic\", because the body has a path");
    }
}

/// Reads one entry of `layouts`.
pub(super) fn layout(table: &Table, kinds: &Kinds, groups: &Groups) -> Layout {
    let mut traits = kinds.read(table, groups);
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
    if exact && gap.is_given() {
        gap.refuse("nothing: the grid decides it where exact = true");
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
