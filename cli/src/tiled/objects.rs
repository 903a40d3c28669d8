//! Turns a map's objects into scene file entries.

use super::map::{Corner, Layer, Map, Object, Origin, Property, Wrong};
use jostle_game::Kind;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// Map property that gives the number of pixels per world unit.
const SCALE: &str = "pixels_per_unit";
const DEPTH_MAX: usize = 16;
/// Number of pixels by which two lengths that are meant to be equal may differ.
const EQUAL: f64 = 0.01;
/// Classes whose objects become list entries, in addition to the kinds of bodies.
pub(super) const LISTS: [(&str, &str); 10] = [
    ("zone", "zones"),
    ("launcher", "launchers"),
    ("emitter", "emitters"),
    ("layout", "layouts"),
    ("spring", "springs"),
    ("mark", "marks"),
    ("signal", "signals"),
    ("rule", "rules"),
    ("team", "teams"),
    ("spawn", "spawns"),
];
/// Kinds of bodies in scene files.
pub(super) const KINDS: [Kind; 5] =
    [Kind::Wall, Kind::Platform, Kind::Block, Kind::Minion, Kind::Marble];
/// Lists whose entries have names. In other lists, an object's name is only for the author's own use.
const NAMED: [&str; 4] = ["bodies", "zones", "signals", "teams"];

/// A scene file, and the map objects from which its list entries came.
pub struct Written {
    pub scene: Table,
    pub origins: BTreeMap<&'static str, Vec<Origin>>,
}

/// Converts pixels to world units.
struct Scale {
    pixels: f64,
    /// The map's height in pixels.
    height: f64,
}

impl Scale {
    fn length(&self, pixels: f64) -> Value {
        rounded(pixels / self.pixels)
    }

    fn point(&self, [x, y]: [f64; 2]) -> Value {
        Value::Array(vec![self.length(x), self.length(self.height - y)])
    }
}

/// Rounds to a ten-thousandth of a unit, which is much finer than anyone draws.
fn rounded(number: f64) -> Value {
    Value::Float((number * 1e4).round() / 1e4)
}

/// Converts a map to a scene file.
pub fn write(map: &Map) -> Result<Written, Box<Wrong>> {
    let scale = check(map)?;
    let mut written = Written { scene: Table::new(), origins: BTreeMap::new() };
    for property in map.properties.iter().filter(|property| property.name != SCALE) {
        set_at(&mut written.scene, &property.name, value(property, &Origin::Map)?)?;
    }
    let size = [map.width * map.tilewidth, map.height * map.tileheight];
    let size = Value::Array(size.map(|length| scale.length(length)).to_vec());
    written.scene.entry("size").or_insert(size);
    write_layers(&map.layers, [0.0; 2], 0, &scale, &mut written)?;
    Ok(written)
}

fn check(map: &Map) -> Result<Scale, Box<Wrong>> {
    let origin = Origin::Map;
    if map.infinite {
        let allowed = "false: a scene has a fixed size (Map > Map Properties > Infinite)";
        return Err(origin.wrong("infinite", "true", allowed));
    }
    if !matches!(map.orientation.as_str(), "" | "orthogonal") {
        let found = format!("{:?}", map.orientation);
        return Err(origin.wrong("orientation", found, "\"orthogonal\""));
    }
    let given = map.properties.iter().find(|property| property.name == SCALE);
    let pixels = match given {
        Some(property) => property.value.as_f64().unwrap_or(f64::NAN),
        None if map.tilewidth == map.tileheight => map.tilewidth,
        None => {
            let found = format!("none, and tiles of {} x {}", map.tilewidth, map.tileheight);
            return Err(origin.wrong(SCALE, found, "a number where tiles are not square"));
        }
    };
    if !(pixels.is_finite() && pixels > 0.0) {
        let found = given.map_or_else(|| pixels.to_string(), |given| given.value.to_string());
        return Err(origin.wrong(SCALE, found, "a number of pixels above 0"));
    }
    Ok(Scale { pixels, height: map.height * map.tileheight })
}

fn write_layers(
    layers: &[Layer],
    moved: [f64; 2],
    depth: usize,
    scale: &Scale,
    written: &mut Written,
) -> Result<(), Box<Wrong>> {
    for layer in layers.iter().filter(|layer| layer.visible) {
        let moved = [moved[0] + layer.offsetx, moved[1] + layer.offsety];
        if layer.kind == "group" && depth == DEPTH_MAX {
            let allowed = format!("at most {DEPTH_MAX} within each other");
            return Err(Origin::Map.wrong("layers", "more groups of layers", allowed));
        }
        write_layers(&layer.layers, moved, depth + 1, scale, written)?;
        for object in layer.objects.iter().filter(|object| object.visible) {
            let (id, name) = (object.id, object.name.clone());
            let origin = Origin::Object { layer: layer.name.clone(), id, name };
            write_object(object, moved, &origin, scale, written)?;
        }
    }
    Ok(())
}

fn write_object(
    object: &Object,
    moved: [f64; 2],
    origin: &Origin,
    scale: &Scale,
    written: &mut Written,
) -> Result<(), Box<Wrong>> {
    if object.template.is_some() {
        let allowed = "objects of the map (right click > Detach Selected Template Instances)";
        return Err(origin.wrong("template", "an instance of a template", allowed));
    }
    let (list, kind) = list_of(&object.class, origin)?;
    let drawing = drawing(object, moved, origin)?;
    if list == "spawns" {
        return write_spawn(&drawing, origin, scale, &mut written.scene);
    }
    let mut entry = Table::new();
    for (field, value) in geometry(list, &drawing, origin, scale)? {
        entry.insert(field.to_owned(), value);
    }
    if let Some(kind) = kind {
        entry.insert("kind".to_owned(), kind.name().into());
    }
    if NAMED.contains(&list) && !object.name.is_empty() {
        entry.insert("name".to_owned(), object.name.as_str().into());
    }
    for property in &object.properties {
        let value = value(property, origin)?;
        // An empty text property counts as unset.
        if value.as_str() != Some("") {
            entry.insert(property.name.clone(), value);
        }
    }
    if matches!(list, "launchers" | "emitters") && entry.contains_key("follow") {
        // An entry that follows a body has no position, so it does not matter where it was drawn.
        entry.remove("position");
    }
    let entries = written.scene.entry(list).or_insert_with(|| Value::Array(Vec::new()));
    let Some(entries) = entries.as_array_mut() else {
        return Err(Origin::Map.wrong(list, "a property", "none: objects are its entries"));
    };
    let origins = written.origins.entry(list).or_default();
    // Earlier entries without an object come from one of the map's properties.
    origins.resize(entries.len(), Origin::Map);
    origins.push(origin.clone());
    entries.push(Value::Table(entry));
    Ok(())
}

/// The scene list for objects of a class, and the kind if the class belongs to a body.
fn list_of(class: &str, origin: &Origin) -> Result<(&'static str, Option<Kind>), Box<Wrong>> {
    if let Some(kind) = KINDS.into_iter().find(|kind| kind.name() == class) {
        return Ok(("bodies", Some(kind)));
    }
    if let Some((_, list)) = LISTS.into_iter().find(|(known, _)| *known == class) {
        return Ok((list, None));
    }
    let kinds = KINDS.iter().map(|kind| kind.name());
    let classes: Vec<_> = kinds.chain(LISTS.iter().map(|(class, _)| *class)).collect();
    let found = if class.is_empty() { "none".to_owned() } else { format!("{class:?}") };
    Err(origin.wrong("class", found, format!("one of {}", classes.join(", "))))
}

/// An object's shape, in map pixels.
enum DrawnShape {
    Point([f64; 2]),
    /// The lowest and highest coordinates of the box.
    Box([f64; 2], [f64; 2]),
    Circle([f64; 2], f64),
    Line(Vec<[f64; 2]>),
}

fn drawing(object: &Object, moved: [f64; 2], origin: &Origin) -> Result<DrawnShape, Box<Wrong>> {
    let (x, y) = (object.x + moved[0], object.y + moved[1]);
    let [low, high] = [[x, y], [x + object.width, y + object.height]];
    let shapes = "a rectangle, a circle, a point or a polyline";
    let other = match object {
        Object { gid: Some(_), .. } => Some("a tile"),
        Object { text: Some(_), .. } => Some("a text"),
        Object { capsule: true, .. } => Some("a capsule"),
        _ => None,
    };
    if let Some(found) = other {
        return Err(origin.wrong("shape", found, shapes));
    }
    let turns = object.rotation / 360.0;
    // A circle is rotated about its corner too, so only whole turns leave it where it is.
    if (turns - turns.round()).abs() * 360.0 > EQUAL && !object.point {
        let found = format!("{} degrees", object.rotation);
        return Err(origin.wrong("rotation", found, "0: bodies and zones do not rotate"));
    }
    let points = |corners: &[Corner]| corners.iter().map(|at| [x + at.x, y + at.y]).collect();
    if let Some(corners) = &object.polygon {
        let corners: Vec<[f64; 2]> = points(corners);
        return box_of(&corners).ok_or_else(|| {
            let found = format!("a polygon of {} corners", corners.len());
            origin.wrong("polygon", found, format!("an upright rectangle, or {shapes}"))
        });
    }
    if let Some(corners) = &object.polyline {
        return Ok(DrawnShape::Line(points(corners)));
    }
    if object.point || (object.width == 0.0 && object.height == 0.0) {
        return Ok(DrawnShape::Point([x, y]));
    }
    if !object.ellipse {
        return Ok(DrawnShape::Box(low, high));
    }
    if (object.width - object.height).abs() > EQUAL {
        let found = format!("an ellipse of {} x {}", object.width, object.height);
        return Err(origin.wrong("ellipse", found, "a circle: as wide as high"));
    }
    Ok(DrawnShape::Circle(middle(low, high), object.width / 2.0))
}

/// The box that a polygon with four corners forms, if it forms one.
fn box_of(corners: &[[f64; 2]]) -> Option<DrawnShape> {
    let of = |axis: usize, pick: fn(f64, f64) -> f64| {
        corners.iter().map(|corner| corner[axis]).reduce(pick).unwrap_or_default()
    };
    let (low, high) = ([of(0, f64::min), of(1, f64::min)], [of(0, f64::max), of(1, f64::max)]);
    let near = |a: f64, b: f64| (a - b).abs() <= EQUAL;
    let has = |x: f64, y: f64| corners.iter().any(|[a, b]| near(*a, x) && near(*b, y));
    let all = [low[0], high[0]].iter().all(|&x| has(x, low[1]) && has(x, high[1]));
    // Edges must be parallel to the axes. Four corners in the wrong order would form a bow tie.
    let upright = (0..corners.len()).all(|at| {
        let [[ax, ay], [bx, by]] = [corners[at], corners[(at + 1) % corners.len()]];
        near(ax, bx) || near(ay, by)
    });
    (corners.len() == 4 && all && upright).then_some(DrawnShape::Box(low, high))
}

fn middle(low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
    [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0]
}

/// The fields of an entry that follow from how it is drawn.
fn geometry(
    list: &str,
    drawing: &DrawnShape,
    origin: &Origin,
    scale: &Scale,
) -> Result<Vec<(&'static str, Value)>, Box<Wrong>> {
    // Entries without a position in the world may be drawn as a point anywhere.
    if matches!(list, "signals" | "rules" | "teams") {
        return Ok(Vec::new());
    }
    let size = |low: [f64; 2], high: [f64; 2]| {
        Value::Array(vec![scale.length(high[0] - low[0]), scale.length(high[1] - low[1])])
    };
    let position = |at: [f64; 2]| ("position", scale.point(at));
    // The lower corner in the world has the larger y in the map.
    let area = |low: [f64; 2], high: [f64; 2]| {
        let corners = [[low[0], high[1]], [high[0], low[1]]];
        ("area", Value::Array(corners.map(|corner| scale.point(corner)).to_vec()))
    };
    match (list, drawing) {
        ("bodies", DrawnShape::Point(at)) => Ok(vec![position(*at)]),
        ("bodies", DrawnShape::Box(low, high)) => {
            Ok(vec![position(middle(*low, *high)), ("size", size(*low, *high))])
        }
        ("bodies" | "zones", DrawnShape::Circle(center, radius)) => {
            Ok(vec![position(*center), ("radius", scale.length(*radius))])
        }
        ("bodies", DrawnShape::Line(points)) => {
            let points = points.iter().map(|point| scale.point(*point)).collect();
            Ok(vec![("path", Value::Array(points))])
        }
        ("zones" | "layouts", DrawnShape::Box(low, high)) => Ok(vec![area(*low, *high)]),
        ("zones", DrawnShape::Point(at)) => Ok(vec![position(*at)]),
        ("marks", DrawnShape::Circle(center, radius)) => {
            Ok(vec![position(*center), ("size", scale.length(2.0 * radius))])
        }
        ("springs", DrawnShape::Point(at)) => Ok(vec![("to", scale.point(*at))]),
        ("launchers" | "emitters" | "marks", DrawnShape::Point(at)) => Ok(vec![position(*at)]),
        (_, drawing) => {
            let found = match drawing {
                DrawnShape::Point(_) => "a point",
                DrawnShape::Box(..) => "a rectangle",
                DrawnShape::Circle(..) => "a circle",
                DrawnShape::Line(_) => "a polyline",
            };
            let allowed = match list {
                "zones" => "a rectangle, a circle, or a point with a radius",
                "layouts" => "a rectangle",
                "marks" => "a point or a circle",
                _ => "a point",
            };
            Err(origin.wrong("shape", found, allowed))
        }
    }
}

/// One of the heroes' spawn points.
fn write_spawn(
    drawing: &DrawnShape,
    origin: &Origin,
    scale: &Scale,
    scene: &mut Table,
) -> Result<(), Box<Wrong>> {
    let DrawnShape::Point(at) = drawing else {
        return Err(origin.wrong("shape", "another shape", "a point"));
    };
    let hero = scene.entry("hero").or_insert_with(|| Value::Table(Table::new()));
    let spawns = hero
        .as_table_mut()
        .map(|hero| hero.entry("spawns").or_insert_with(|| Value::Array(Vec::new())));
    match spawns.and_then(Value::as_array_mut) {
        Some(spawns) => spawns.push(scale.point(*at)),
        None => return Err(Origin::Map.wrong("hero", "another property", "hero.FIELD only")),
    }
    Ok(())
}

/// Converts a property's value. Text that contains a TOML list or table is parsed.
fn value(property: &Property, origin: &Origin) -> Result<Value, Box<Wrong>> {
    let other = || {
        let allowed = "a number, true or false, or a text; lists as [1, 2], tables as { a = 1 }";
        origin.wrong(&property.name, property.value.to_string(), allowed)
    };
    match &property.value {
        serde_json::Value::Bool(truth) => Ok(Value::Boolean(*truth)),
        serde_json::Value::Number(number) => match number.as_i64() {
            Some(whole) => Ok(Value::Integer(whole)),
            None => number.as_f64().map(Value::Float).ok_or_else(other),
        },
        serde_json::Value::String(text) if text.trim_start().starts_with(['[', '{']) => {
            text.trim().parse().map_err(|_| other())
        }
        serde_json::Value::String(text) => Ok(Value::String(text.clone())),
        _ => Err(other()),
    }
}

/// Sets the field at a path such as `limits.players`.
fn set_at(scene: &mut Table, path: &str, value: Value) -> Result<(), Box<Wrong>> {
    let Some((name, rest)) = path.split_once('.') else {
        scene.insert(path.to_owned(), value);
        return Ok(());
    };
    let table = scene.entry(name).or_insert_with(|| Value::Table(Table::new()));
    let both = || Origin::Map.wrong(path, format!("a property {name:?} too"), "one of the two");
    let table = table.as_table_mut().ok_or_else(both)?;
    // Tables in scene files are nested only a few levels deep.
    if rest.split('.').count() > DEPTH_MAX {
        return Err(Origin::Map.wrong(path, "many dots", "the path of a field"));
    }
    set_at(table, rest, value)
}
