//! From the tables of a scene file to a [`Scene`]: the top level, and the checks that need more
//! than one field.

use super::actors::{self, Actors};
use super::bodies::{self, PLACE};
use super::document::{Field, Range, Table};
use super::forces;
use super::groups::Groups;
use super::recipes::Recipes;
use super::solver;
use super::{
    BODIES_MAX, Camera, EMITTERS_MAX, FOLLOWERS_MAX, GRAVITY_MAX, Layout, PACKS_MAX, PARTICLES_MAX,
    Placed, PlacedSpring, QUANTA_MAX, QUANTUM_MIN, Repeater, SEATS_MAX, SIZE_MAX, SPEED_MAX, Scene,
    SceneError, Tools,
};
use crate::contact::collide;
use crate::math::max;
use crate::shape::Aabb;
use crate::world::{BodyDef, Motion};
use glam::Vec2;

/// Fields of a scene file.
pub(super) const FIELDS: &[&str] = &[
    "title",
    "about",
    "size",
    "gravity",
    "response",
    "drag",
    "wind",
    "solver",
    "sleeping",
    "relaxation",
    "conjugate",
    "groups",
    "pairs",
    "particles_meet",
    "tools",
    "spray",
    "camera",
    "kill_zone",
    "quantum",
    "speed_max",
    "impact_speed",
    "limits",
    "hero",
    "minion",
    "dumb",
    "pack",
    "bodies",
    "layouts",
    "springs",
    "recipes",
    "emitters",
];
const LIMIT_FIELDS: &[&str] = &["players", "bodies", "particles", "dumb", "packs"];
/// A component of gravity.
const GRAVITY: Range = Range::from(-GRAVITY_MAX, GRAVITY_MAX);
const TITLE_CHARS_MAX: usize = 40;
const ABOUT_CHARS_MAX: usize = 200;

/// Caps of a scene.
struct Limits {
    players: u32,
    bodies: u32,
    particles: u32,
    dumb: u32,
    packs: u32,
}

/// Builds the scene from the file's top level.
pub(super) fn scene(name: String, source: &str, root: &Table) -> Result<Scene, SceneError> {
    let title = root.need("title", "a name for people")?.text(TITLE_CHARS_MAX)?;
    let size = root.need("size", "[width, height]")?.vector(Range::from(1.0, SIZE_MAX))?;
    let solver = solver::solver(root)?;
    let sleeping = solver::sleeping(root, solver)?;
    let groups = Groups::read(root)?;
    let tools = tools(root)?;
    let mut recipes = Recipes::read(root)?;
    let actors = actors::actors(root, tools, &groups, &mut recipes)?;
    let places = Places::read(root, &actors, &groups, &mut recipes)?;
    let camera = camera(root)?;
    let limits = limits(root, camera, &places, &actors)?;
    let spray = spray(root, tools, &mut recipes)?;
    let mut scene = Scene {
        name,
        title,
        about: root.get("about").map_or(Ok(String::new()), |field| field.text(ABOUT_CHARS_MAX))?,
        source: source.to_owned(),
        size,
        gravity: root.vector("gravity", Vec2::new(0.0, -50.0), GRAVITY)?,
        wind: Vec2::ZERO,
        solver,
        sleeping,
        groups: groups.names,
        meets: groups.meets,
        meets_particles: groups.meets_particles,
        tools,
        camera,
        kill_zone: kill_zone(root, size)?,
        quantum: quantum(root)?,
        speed_max: root.number("speed_max", 150.0, Range::from(1.0, SPEED_MAX))?,
        impact_speed: root.number("impact_speed", 12.0, Range::from(0.0, 1.0e6))?,
        players_max: limits.players as u16,
        bodies_max: limits.bodies as usize,
        particles_max: limits.particles as usize,
        dumb_max: limits.dumb as usize,
        packs_max: limits.packs as usize,
        recipes: recipes.list,
        spray,
        bodies: places.bodies,
        layouts: places.layouts,
        springs: places.springs,
        emitters: places.emitters,
        hero: actors.hero,
        minion: actors.minion,
        dumb: actors.dumb,
        dumb_speed: actors.dumb_speed,
        pack: actors.pack,
    };
    scene.wind = forces::wind(root, &scene)?;
    check_quanta(root, &scene)?;
    check_tools(root, &scene)?;
    check_places(root, &scene)?;
    check_speeds(root, &scene)?;
    check_clear(root, &scene)?;
    Ok(scene)
}

/// What stands where.
struct Places {
    bodies: Vec<Placed>,
    layouts: Vec<Layout>,
    springs: Vec<PlacedSpring>,
    emitters: Vec<Repeater>,
}

impl Places {
    fn read(
        root: &Table,
        actors: &Actors,
        groups: &Groups,
        recipes: &mut Recipes,
    ) -> Result<Places, SceneError> {
        let bodies = root.list("bodies")?;
        refuse_long(root, "bodies", &bodies, BODIES_MAX as usize)?;
        let placed = |field: &Field| bodies::placed(field, &actors.kinds, groups);
        let bodies = bodies.iter().map(placed).collect::<Result<Vec<_>, _>>()?;
        let layouts = root.list("layouts")?;
        refuse_long(root, "layouts", &layouts, BODIES_MAX as usize)?;
        let layout = |field: &Field| bodies::layout(field, &actors.kinds, groups);
        let layouts = layouts.iter().map(layout).collect::<Result<Vec<_>, _>>()?;
        let emitters = root.list("emitters")?;
        refuse_long(root, "emitters", &emitters, EMITTERS_MAX)?;
        let repeater = |field: &Field| actors::repeater(field, &bodies, recipes);
        let emitters = emitters.iter().map(repeater).collect::<Result<Vec<_>, _>>()?;
        let springs = forces::springs(root, &bodies)?;
        Ok(Places { bodies, layouts, springs, emitters })
    }
}

fn refuse_long(root: &Table, name: &str, list: &[Field], max: usize) -> Result<(), SceneError> {
    if list.len() <= max {
        return Ok(());
    }
    Err(root.error(name, format!("{} entries", list.len()), format!("at most {max}")))
}

fn tools(root: &Table) -> Result<Tools, SceneError> {
    let names = Tools::NAMES.map(|(name, _)| name);
    let mut tools = Tools::default();
    for field in root.list("tools")? {
        tools.0 |= Tools::NAMES[field.choice(&names)?].1.0;
    }
    Ok(tools)
}

fn spray(root: &Table, tools: Tools, recipes: &mut Recipes) -> Result<Option<u8>, SceneError> {
    match root.get("spray") {
        Some(field) => Ok(Some(recipes.index(&field)?)),
        None if tools.contains(Tools::SPRAY) => Ok(recipes.resolve("fire")),
        None => Ok(None),
    }
}

fn camera(root: &Table) -> Result<Camera, SceneError> {
    let Some(field) = root.get("camera") else { return Ok(Camera::Fit) };
    if field.word() == Some("fit") {
        return Ok(Camera::Fit);
    }
    let allowed = "\"fit\" or { follow = height }";
    let table = field
        .table(&["follow"])
        .map_err(|error| SceneError { allowed: allowed.to_owned(), ..error })?;
    let height = table.need("follow", "the height of the view")?;
    Ok(Camera::Follow { height: height.number(Range::from(1.0, SIZE_MAX))? })
}

/// By default half a world more on every side.
fn kill_zone(root: &Table, size: Vec2) -> Result<Aabb, SceneError> {
    let Some(field) = root.get("kill_zone") else {
        return Ok(Aabb { low: size * -0.5, high: size * 1.5 });
    };
    let [low, high] = field.corners(PLACE)?;
    let zone = Aabb { low, high };
    if zone.contains(Vec2::ZERO) && zone.contains(size) {
        return Ok(zone);
    }
    Err(field.refuse("corners around the whole world"))
}

fn quantum(root: &Table) -> Result<f32, SceneError> {
    let Some(field) = root.get("quantum") else { return Ok(1.0 / 64.0) };
    let range = Range::from(QUANTUM_MIN, 1.0);
    let quantum = field.number(range)?;
    // A power of two has no mantissa bits.
    if quantum.to_bits() & 0x007f_ffff == 0 {
        return Ok(quantum);
    }
    Err(field.refuse("a power of two from 1/65536 to 1, like 0.015625"))
}

/// Bodies stay inside the kill zone, and messages carry whole quanta up to [`QUANTA_MAX`].
fn check_quanta(root: &Table, scene: &Scene) -> Result<(), SceneError> {
    let Aabb { low, high } = scene.kill_zone;
    let furthest = max(max(low.x.abs(), low.y.abs()), max(high.x.abs(), high.y.abs()));
    let reach = QUANTA_MAX as f32 * scene.quantum;
    if furthest <= reach {
        return Ok(());
    }
    let field = if root.has("kill_zone") { "kill_zone" } else { "size" };
    let found = format!("a kill zone that reaches to {furthest}");
    let quantum = scene.quantum;
    let allowed = format!(
        "at most {reach}: {QUANTA_MAX} quanta of {quantum}, which is what messages carry; a larger \
         quantum reaches further"
    );
    Err(root.error(field, found, allowed))
}

fn limits(
    root: &Table,
    camera: Camera,
    places: &Places,
    actors: &Actors,
) -> Result<Limits, SceneError> {
    let table = actors::table_or_empty(root, "limits", LIMIT_FIELDS)?;
    let seats_max = match camera {
        Camera::Fit => SEATS_MAX as u32,
        Camera::Follow { .. } => FOLLOWERS_MAX,
    };
    let players = table.whole("players", 16, 1, seats_max)?;
    let packs = table.whole("packs", 8, 0, PACKS_MAX)?;
    let dumb = table.whole("dumb", 200, 0, BODIES_MAX)?;
    let laid_out: u64 = places.layouts.iter().map(|layout| u64::from(layout.count)).sum();
    let heroes = if actors.hero.is_some() { u64::from(players) } else { 0 };
    let least = places.bodies.len() as u64 + laid_out + heroes;
    let made = if actors.pack.is_some() { u64::from(players * packs) } else { 0 };
    let dropped = if actors.dumb.is_some() { u64::from(dumb) } else { 0 };
    let roomy = (least + made + dropped).clamp(1, u64::from(BODIES_MAX)) as u32;
    let bodies = table.whole("bodies", roomy, 1, BODIES_MAX)?;
    if least > u64::from(bodies) {
        let found = format!("{bodies} for {least} bodies with layouts and heroes of all players");
        return Err(table.error("bodies", found, format!("{least} or more, up to {BODIES_MAX}")));
    }
    let particles = table.whole("particles", 4096, 0, PARTICLES_MAX)?;
    Ok(Limits { players, bodies, particles, dumb, packs })
}

/// Tools that share a key, and tools that lack what they act on.
fn check_tools(root: &Table, scene: &Scene) -> Result<(), SceneError> {
    let both = |a: Tools, b: Tools| scene.tools.contains(a) && scene.tools.contains(b);
    let refuse =
        |found: &str, allowed: &str| Err(root.error("tools", found.to_owned(), allowed.to_owned()));
    if both(Tools::DUMB, Tools::SPRAY) {
        return refuse("dumb and spray, which are both on Z", "one of them");
    }
    if both(Tools::LAUNCH, Tools::SELECT) {
        return refuse("launch and select, which both use the left button", "one of them");
    }
    if scene.tools.contains(Tools::STEER) && scene.hero.is_none() {
        return refuse("steer, but no [hero] table", "steer only where players have heroes");
    }
    Ok(())
}

/// Everything starts inside the kill zone, no path is faster than a body may be, names are unique.
fn check_places(root: &Table, scene: &Scene) -> Result<(), SceneError> {
    let zone = scene.kill_zone;
    let inside = "a place inside the kill zone";
    for (field, body) in root.list("bodies")?.iter().zip(&scene.bodies) {
        let outside = match &body.path {
            Some(path) => !path.points().iter().all(|&point| zone.contains(point)),
            None => !zone.contains(body.def.position),
        };
        if outside {
            return Err(field
                .inner(if body.path.is_some() { "path" } else { "position" })
                .refuse(inside));
        }
        if body.def.velocity.length() > scene.speed_max {
            let allowed = format!("a speed of at most speed_max = {}", scene.speed_max);
            return Err(field.inner("velocity").refuse(allowed));
        }
        let fastest = body.path.as_ref().map_or(0.0, |path| path.speed_max());
        if fastest > scene.speed_max {
            let found = format!("a speed of {fastest} on the fastest leg");
            let allowed = format!("a period that needs at most speed_max = {}", scene.speed_max);
            return Err(field.inner("period").refuse_as(found, allowed));
        }
        let same = |other: &&Placed| other.name.is_some() && other.name == body.name;
        if scene.bodies.iter().filter(same).count() > 1 {
            return Err(field.inner("name").refuse("each name once"));
        }
    }
    let spawns = scene.hero.as_ref().map_or(&[][..], |hero| &hero.spawns);
    if let Some(table) = root.get("hero") {
        for (field, &spawn) in table.inner("spawns").list()?.iter().zip(spawns) {
            if !zone.contains(spawn) {
                return Err(field.refuse(inside));
            }
        }
    }
    for (field, layout) in root.list("layouts")?.iter().zip(&scene.layouts) {
        if !zone.contains(layout.area.low) || !zone.contains(layout.area.high) {
            return Err(field.inner("area").refuse(inside));
        }
    }
    Ok(())
}

/// What moves by itself moves no faster than a body may.
fn check_speeds(root: &Table, scene: &Scene) -> Result<(), SceneError> {
    let own = scene.pack.as_ref().map_or(0.0, |pack| pack.speed);
    if own <= scene.speed_max {
        return Ok(());
    }
    let allowed = format!("at most speed_max = {}", scene.speed_max);
    match root.get("pack") {
        Some(pack) => Err(pack.inner("speed").refuse_as(format!("a speed of {own}"), allowed)),
        None => {
            Err(root.error("speed_max", scene.speed_max.to_string(), format!("at least {own}")))
        }
    }
}

/// Dynamic bodies and heroes start clear of the immovable ones that they collide with.
fn check_clear(root: &Table, scene: &Scene) -> Result<(), SceneError> {
    if scene.solver.is_none() {
        return Ok(());
    }
    for (field, body) in root.list("bodies")?.iter().zip(&scene.bodies) {
        if body.def.motion != Motion::Dynamic {
            continue;
        }
        if let Some(other) = blocking(scene, &body.def) {
            let found = format!("a start inside bodies[{other}]");
            return Err(field.inner("position").refuse_as(found, "a place clear of it"));
        }
    }
    let Some(hero) = &scene.hero else { return Ok(()) };
    let Some(table) = root.get("hero") else { return Ok(()) };
    for (field, &position) in table.inner("spawns").list()?.iter().zip(&hero.spawns) {
        if let Some(other) = blocking(scene, &BodyDef { position, ..hero.body }) {
            let found = format!("a hero inside bodies[{other}]");
            return Err(field.refuse_as(found, "a place clear of it"));
        }
    }
    Ok(())
}

/// The first immovable body that overlaps `def` and collides with it.
fn blocking(scene: &Scene, def: &BodyDef) -> Option<usize> {
    scene.bodies.iter().position(|other| {
        other.def.motion != Motion::Dynamic
            && scene.groups_meet(def.group, other.def.group)
            && collide(def.shape, def.position, other.def.shape, other.def.position, (0, 1))
                .is_some()
    })
}
