//! From the text of a scene file to a [`Scene`].

use super::actors;
use super::error::SceneError;
use super::field::FieldInfo;
use super::groups::Groups;
use super::launchers::{self, LAUNCHERS_MAX};
use super::limits::{
    BODIES_MAX, EMITTERS_MAX, FOLLOWERS_MAX, GRAVITY_MAX, PACKS_MAX, PARTICLES_MAX, QUANTUM_MIN,
    SCENE_BYTES_MAX, SEATS_MAX, SIZE_MAX, SPEED_MAX, SPRINGS_MAX,
};
use super::marks::{self, MARKS_MAX};
use super::name::{NAME_ALLOWED, is_name};
use super::recipes::Recipes;
use super::rules::{Known, Names, RuleSet};
use super::spec::{Camera, Category, Scene};
use super::table::{Document, POSITION, Range, Table, read_list};
use super::tools::Tools;
use super::{bodies, checks, drag, sling, solver, springs};
use glam::Vec2;
use jostle_sim::{Aabb, EulerGroups, ForceSettings, Solver, WorldSettings};

/// A component of gravity.
const GRAVITY: Range = Range::from(-GRAVITY_MAX, GRAVITY_MAX);
const TITLE_CHARS_MAX: usize = 40;
const ABOUT_CHARS_MAX: usize = 200;

/// File and text of every shipped scene.
pub(crate) const BUILT_IN: [(&str, &str); 24] = [
    ("arena.toml", include_str!("../../../assets/scenes/arena.toml")),
    ("splash.toml", include_str!("../../../assets/scenes/splash.toml")),
    ("hockey.toml", include_str!("../../../assets/scenes/hockey.toml")),
    ("hill.toml", include_str!("../../../assets/scenes/hill.toml")),
    ("race.toml", include_str!("../../../assets/scenes/race.toml")),
    ("pong.toml", include_str!("../../../assets/scenes/pong.toml")),
    ("flags.toml", include_str!("../../../assets/scenes/flags.toml")),
    ("herd.toml", include_str!("../../../assets/scenes/herd.toml")),
    ("roundup.toml", include_str!("../../../assets/scenes/roundup.toml")),
    ("lock.toml", include_str!("../../../assets/scenes/lock.toml")),
    ("lamp.toml", include_str!("../../../assets/scenes/lamp.toml")),
    ("slingshot.toml", include_str!("../../../assets/scenes/slingshot.toml")),
    ("tower.toml", include_str!("../../../assets/scenes/tower.toml")),
    ("bridge.toml", include_str!("../../../assets/scenes/bridge.toml")),
    ("hall.toml", include_str!("../../../assets/scenes/hall.toml")),
    ("bounds.toml", include_str!("../../../assets/scenes/bounds.toml")),
    ("bounce.toml", include_str!("../../../assets/scenes/bounce.toml")),
    ("planets.toml", include_str!("../../../assets/scenes/planets.toml")),
    ("euler.toml", include_str!("../../../assets/scenes/euler.toml")),
    ("listing.toml", include_str!("../../../assets/scenes/listing.toml")),
    ("impulse.toml", include_str!("../../../assets/scenes/impulse.toml")),
    ("particles.toml", include_str!("../../../assets/scenes/particles.toml")),
    ("emitters.toml", include_str!("../../../assets/scenes/emitters.toml")),
    ("pile.toml", include_str!("../../../assets/scenes/pile.toml")),
];

impl Scene {
    /// Parses and checks a scene. `file` is used in errors, and its stem is the scene's name.
    pub fn parse(file: &str, source: &str) -> Result<Scene, SceneError> {
        let document = Document::new(file, source);
        let name = name_of(&document)?;
        if source.len() > SCENE_BYTES_MAX {
            let found = format!("{} bytes", source.len());
            return Err(document.error(0, "file", found, format!("at most {SCENE_BYTES_MAX}")));
        }
        let entries = toml::de::DeTable::parse(source).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            let found = error.message().lines().next().unwrap_or("an error").to_owned();
            let found = format!("a line that is not TOML ({found})");
            document.error(at, "file", found, "TOML".to_owned())
        })?;
        let root = document.root(entries.get_ref());
        let scene = document.checked(root.read(|root| read(name, source, root)))?;
        checks::check(&root, &scene);
        document.checked(scene)
    }

    /// The fields that a file has or may have, as far as it can be read: its errors do not matter, unless it is no TOML.
    pub fn fields(source: &str) -> Vec<FieldInfo> {
        let document = Document::noting("fields.toml", source);
        if let Ok(entries) = toml::de::DeTable::parse(source) {
            let root = document.root(entries.get_ref());
            root.read(|root| read(String::new(), source, root));
        }
        document.into_asked()
    }

    /// The scenes that Jostle ships, embedded from `assets/scenes`, `arena` first.
    pub fn built_in() -> Vec<Scene> {
        let files = BUILT_IN.iter();
        files
            .map(|(file, source)| Scene::parse(file, source).expect("a test parses every one"))
            .collect()
    }
}

fn name_of(document: &Document) -> Result<String, SceneError> {
    let stem = std::path::Path::new(document.file).file_stem().and_then(|stem| stem.to_str());
    let stem = stem.unwrap_or_default();
    if is_name(stem) {
        return Ok(stem.to_owned());
    }
    Err(document.error(0, "file name", format!("{stem:?}"), NAME_ALLOWED.to_owned()))
}

/// Reads the top level.
fn read(name: String, source: &str, root: &Table) -> Scene {
    let title = root.need("title", "a name for people").text(TITLE_CHARS_MAX);
    let about = root.get("about").text(ABOUT_CHARS_MAX);
    let size = root.need("size", "[width, height]").vector(Vec2::ONE, Range::from(1.0, SIZE_MAX));
    let groups = Groups::read(root);
    let world = world_settings(root, size, &groups);
    let tools = tools(root);
    let mut recipes = Recipes::read(root);
    let actors = actors::actors(root, tools, &groups, &mut recipes);
    let names = Names::read(root);
    let placed =
        |table: &Table| bodies::placed(table, &actors.kinds, &groups, &names, &mut recipes);
    let bodies = read_list(root, "bodies", BODIES_MAX as usize, placed);
    let layout = |table: &Table| bodies::layout(table, &actors.kinds, &groups);
    let layouts = read_list(root, "layouts", BODIES_MAX as usize, layout);
    let spring = |table: &Table| springs::spring(table, &bodies);
    let springs = read_list(root, "springs", SPRINGS_MAX, spring);
    let emitter = |table: &Table| actors::emitter(table, &bodies, &names, &mut recipes);
    let emitters = read_list(root, "emitters", EMITTERS_MAX, emitter);
    let launcher = |table: &Table| launchers::launcher(table, &bodies, &names);
    let launchers = read_list(root, "launchers", LAUNCHERS_MAX, launcher);
    let marks = read_list(root, "marks", MARKS_MAX, |table: &Table| marks::mark(table, &names));
    let sling = sling::sling(root, tools, &bodies, &names);
    let known = Known { names: &names, groups: &groups };
    let rules = RuleSet::read(root, &known, &mut recipes);
    let camera = camera(root);
    let wind = drag::wind(&root.get("wind"));
    let euler = groups.euler(&root.get("integrators"));
    let listed = root.get("listed");
    let mut scene = Scene {
        name,
        title,
        about,
        category: category(root),
        source: source.to_owned(),
        size,
        world,
        groups: groups.names,
        tools,
        camera,
        impact_speed: root.get("impact_speed").number(12.0, Range::from(0.0, 1.0e6)),
        players_max: 0,
        spray: spray(root, tools, &mut recipes),
        bodies,
        layouts,
        springs: springs.into_iter().flatten().collect(),
        emitters,
        marks,
        launchers,
        hero: actors.hero,
        minion_recovery: actors.minion_recovery,
        marble: actors.marble,
        pack: actors.pack,
        listed: listed.is_given().then(|| names.any_condition(&listed)),
        sling,
        rules,
    };
    scene.world.recipes = recipes.list;
    let settings = ForceSettings { wind, springs_max: scene.springs.len(), euler };
    let has_forces = !scene.springs.is_empty() || scene.has_drag() || euler != EulerGroups::NONE;
    scene.world.forces = has_forces.then_some(settings);
    let is_plain = matches!(scene.world.solver, Some(Solver::Relaxation(_))) && !has_forces;
    if scene.listed.is_some() && !is_plain {
        listed.refuse_as("another solver, or forces", "only the relaxation, without forces");
    }
    root.get("limits").table(|table| limits(table, &mut scene));
    scene
}

/// By default what has a round is a game.
fn category(root: &Table) -> Category {
    let base = if root.get("round").is_given() { Category::Games } else { Category::Playgrounds };
    root.get("category").choice(&Category::NAMES).unwrap_or(base)
}

/// Reads the settings of the world, except for those that follow from the rest of the scene.
fn world_settings(root: &Table, size: Vec2, groups: &Groups) -> WorldSettings {
    let gravity = root.get("gravity").vector(Vec2::new(0.0, -50.0), GRAVITY);
    let solver = solver::solver(root);
    WorldSettings {
        gravity,
        solver,
        sleeping: solver::sleeping(root, solver),
        meets: groups.meets,
        meets_particles: groups.meets_particles,
        kill_zone: kill_zone(root, size),
        quantum: quantum(root),
        speed_max: root.get("speed_max").number(150.0, Range::from(1.0, SPEED_MAX)),
        ..WorldSettings::default()
    }
}

fn spray(root: &Table, tools: Tools, recipes: &mut Recipes) -> Option<u8> {
    let field = root.get("spray");
    let sprays = field.is_given() || tools.contains(Tools::SPRAY);
    sprays.then(|| recipes.index(&field, "fire"))
}

fn tools(root: &Table) -> Tools {
    let tools = root.get("tools").items();
    let tools = tools.iter().filter_map(|field| field.choice(&Tools::NAMES));
    tools.fold(Tools::default(), |all, tool| Tools(all.0 | tool.0))
}

fn camera(root: &Table) -> Camera {
    let field = root.get("camera");
    match field.word() {
        _ if !field.is_given() => return Camera::Fit,
        Some("fit") => return Camera::Fit,
        Some("whole") => return Camera::Whole,
        _ => {}
    }
    let height = field.table_or("\"fit\", \"whole\" or { follow = height }", |table| {
        let height = table.need("follow", "the height of the view");
        height.number(1.0, Range::from(1.0, SIZE_MAX))
    });
    Camera::Follow { height }
}

/// By default half a world more on every side.
fn kill_zone(root: &Table, size: Vec2) -> Aabb {
    let field = root.get("kill_zone");
    let [low, high] = field.corners([size * -0.5, size * 1.5], POSITION);
    let zone = Aabb { low, high };
    if !zone.contains(Vec2::ZERO) || !zone.contains(size) {
        field.refuse("corners around the whole world");
    }
    zone
}

fn quantum(root: &Table) -> f32 {
    let field = root.get("quantum");
    let quantum = field.number(1.0 / 64.0, Range::from(QUANTUM_MIN, 1.0));
    // A power of two has no mantissa bits.
    if quantum.to_bits() & 0x007f_ffff != 0 {
        field.refuse("a power of two from 1/65536 to 1, like 0.015625");
    }
    quantum
}

/// Reads the caps of a scene into it.
fn limits(table: &Table, scene: &mut Scene) {
    let seats_max = if scene.camera.sees_all() { SEATS_MAX as u32 } else { FOLLOWERS_MAX };
    let players = table.get("players").whole(16, 1..=seats_max);
    let packs = table.get("packs").whole(8, 0..=PACKS_MAX);
    let marbles = table.get("dumb").whole(200, 0..=BODIES_MAX);
    let laid_out: u64 = scene.layouts.iter().map(|layout| u64::from(layout.count)).sum();
    let if_any = |any, count: u32| if any { u64::from(count) } else { 0 };
    let least = scene.bodies.len() as u64 + laid_out + if_any(scene.hero.is_some(), players);
    let launched = if_any(scene.pack.is_some(), players * packs);
    let dropped = if_any(scene.marble.is_some(), marbles);
    let made = scene.launchers.iter().map(|launcher| u64::from(launcher.limit)).sum::<u64>();
    let roomy = (least + launched + dropped + made).clamp(1, u64::from(BODIES_MAX)) as u32;
    let field = table.get("bodies");
    let bodies = field.whole(roomy, 1..=BODIES_MAX);
    if least > u64::from(bodies) {
        let found = format!("{bodies} for {least} bodies with layouts and heroes of all players");
        field.refuse_as(found, format!("{least} or more, up to {BODIES_MAX}"));
    }
    scene.players_max = players as u16;
    scene.world.bodies_max = bodies as usize;
    scene.world.particles_max = table.get("particles").whole(4096, 0..=PARTICLES_MAX) as usize;
    scene.marble.iter_mut().for_each(|marble| marble.count_max = marbles);
    scene.pack.iter_mut().for_each(|pack| pack.count_max = packs);
}
