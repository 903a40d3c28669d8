//! The plain data of a scene that is ready to be played, and how its top level is read.

use super::actors::{self, HeroSpec, MarbleSpec, PackSpec};
use super::bodies::{self, Layout, Placed};
use super::error::{SceneError, line_at, locate};
use super::field::{POSITION, Range};
use super::groups::Groups;
use super::limits::{
    BODIES_MAX, EMITTERS_MAX, FOLLOWERS_MAX, GRAVITY_MAX, PACKS_MAX, PARTICLES_MAX, QUANTUM_MIN,
    SEATS_MAX, SIZE_MAX, SPEED_MAX, SPRINGS_MAX, WIND_MAX,
};
use super::marks::{self, MARKS_MAX, Mark};
use super::recipes::Recipes;
use super::rules::{Condition, LaneAxis, Names, RuleNames, RuleSet};
use super::sling::{self, SlingSpec};
use super::solver;
use super::sources::{self, LAUNCHERS_MAX, Launcher, Location, ScheduledEmitter};
use super::springs::{self, PlacedSpring};
use super::table::{Field, Table, read_list};
use super::theme::Theme;
use super::tools::Tools;
use glam::Vec2;
use jostle_sim::{
    Aabb, Drag, EmitterDef, EulerGroups, ForceSettings, Solver, Source, WorldSettings,
};

/// A component of gravity.
const GRAVITY: Range = Range::from(-GRAVITY_MAX, GRAVITY_MAX);
const WIND: Range = Range::from(-WIND_MAX, WIND_MAX);
const TITLE_CHARS_MAX: usize = 40;
const ABOUT_CHARS_MAX: usize = 200;

/// Section of the lobby in which a scene is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// Scenes that can be won.
    Games,
    /// Scenes to play around in.
    Playgrounds,
    /// Scenes that each teach one thing.
    Book,
}

impl Category {
    /// Every category with its name in scene files.
    pub const NAMES: [(&str, Category); 3] = [
        ("games", Category::Games),
        ("playgrounds", Category::Playgrounds),
        ("book", Category::Book),
    ];

    /// Name of the category in scene files.
    pub fn name(self) -> &'static str {
        Category::NAMES.iter().find(|(_, category)| *category == self).map_or("", |(name, _)| name)
    }
}

/// How the camera frames the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Camera {
    /// The view shows the whole world. On an upright screen this would make everything tiny, so there the view
    /// moves sideways with the player's own hero.
    Fit,
    /// Every view shows the whole world.
    Whole,
    /// The view follows the player's own hero and is this many world units high.
    Follow {
        /// Height of the view, world units.
        height: f32,
    },
}

impl Camera {
    /// Whether the whole world is sent to every player.
    pub fn sees_all(self) -> bool {
        !matches!(self, Camera::Follow { .. })
    }
}

/// A scene whose values have all been checked.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name, used in links. It is the file's stem, and consists of lower-case letters, digits and dashes.
    pub name: String,
    /// Name shown to players. Label: Title.
    pub title: String,
    /// One-sentence description for the lobby. Default: empty. Label: Description.
    pub about: String,
    /// Section of the lobby that shows it; `book` is collapsed. Default: `games` with a `[round]`, else `playgrounds`.
    /// Label: Section of the lobby, for experts.
    pub category: Category,
    /// How it looks: a workshop at night, dunes, a rink, hills of grass, bright lines in the dark, or squared paper.
    /// Default: `"ink"`. Label: Look.
    pub theme: Theme,
    /// The TOML source text.
    pub source: String,
    /// Width and height of the world. Label: Size.
    pub size: Vec2,
    /// Settings of its World except for the features; see [`Scene::world_settings`].
    pub world: WorldSettings,
    /// What players can do; see [Tools](#tools). Default: `[]`.
    pub tools: Tools,
    /// What the spray tool sprays. Default: `"fire"`.
    pub spray: Option<u8>,
    /// Shows the whole world (with `fit`, an upright phone, where that would be tiny, shows a part around the hero), or
    /// follows the player's hero with a view of this height, in which case each player is sent little more than the
    /// view shows. Default: `"fit"`.
    pub camera: Camera,
    /// Contacts that close faster than this are reported, and make sparks. Label: Speed that makes sparks, for experts.
    pub impact_speed: f32,
    /// While this holds, bodies fall and contacts are solved exactly as in the chapter's printed solver, including its
    /// mistakes ([physics.md](physics.md), C01 to C22a); only with the relaxation solver and without forces. Default:
    /// never.
    pub listed: Option<Condition>,
    /// Names of the collision groups, each listed once.
    pub groups: Vec<String>,
    /// Maximum number of concurrent players.
    pub players_max: u16,
    /// Bodies at fixed positions.
    pub bodies: Vec<Placed>,
    /// Bodies at positions derived from the seed.
    pub layouts: Vec<Layout>,
    /// Springs between bodies at fixed positions.
    pub springs: Vec<PlacedSpring>,
    /// Emitters that start by themselves.
    pub emitters: Vec<ScheduledEmitter>,
    /// Dots drawn on the wall.
    pub marks: Vec<Mark>,
    /// Launchers, which make packs and marbles by themselves.
    pub launchers: Vec<Launcher>,
    /// The players' heroes; `None` if players have no heroes.
    pub hero: Option<HeroSpec>,
    /// Acceleration that returns a minion to its wander speed, units/s^2.
    pub minion_recovery: f32,
    /// Marbles that Z makes, if players have that tool.
    pub marble: Option<MarbleSpec>,
    /// Dye packs, if players have the launch tool.
    pub pack: Option<PackSpec>,
    /// The sling, if players have that tool.
    pub sling: Option<SlingSpec>,
    /// Rounds, teams, zones, signals and rules; empty in a plain playground.
    pub rules: RuleSet,
}

impl Scene {
    /// The emitter started by entry `index` with this seed; `None` if there is no such entry, or if it follows a
    /// body.
    pub fn emitter(&self, index: u8, seed: u32) -> Option<EmitterDef> {
        let scheduled = self.emitters.get(usize::from(index))?;
        match scheduled.location {
            Location::Point(point) => Some(scheduled.emitter(Source::Point(point), seed)),
            Location::Body(_) => None,
        }
    }

    /// Returns whether any body of the scene has drag.
    pub(super) fn has_drag(&self) -> bool {
        let placed = self.bodies.iter().map(|body| &body.def);
        let layouts = self.layouts.iter().map(|layout| &layout.def);
        let hero = self.hero.iter().map(|hero| &hero.body);
        let pack = self.pack.iter().map(|pack| &pack.body);
        let marble = self.marble.iter().map(|marble| &marble.body);
        let mut all = placed.chain(layouts).chain(hero).chain(pack).chain(marble);
        all.any(|def| def.drag != Drag::NONE)
    }

    /// Returns whether the scene has rules, so that bodies come and go and its clock restarts.
    pub fn is_game(&self) -> bool {
        !self.rules.is_empty()
            || self.has_conditions()
            || self.sling.is_some()
            || self.has_breakables()
    }

    /// Returns whether the scene is a game, or has lanes that its heroes must keep to.
    pub(crate) fn has_rules(&self) -> bool {
        self.is_game() || self.lane(None).is_some()
    }

    /// The axis on which the heroes of a team stay.
    pub fn lane(&self, team: Option<u8>) -> Option<LaneAxis> {
        let team = team.and_then(|team| self.rules.teams.get(usize::from(team)));
        team.and_then(|team| team.lane).or(self.hero.as_ref()?.lane)
    }

    /// Returns whether bodies, paths or emitters depend on a condition.
    pub(crate) fn has_conditions(&self) -> bool {
        let bodies = self.bodies.iter().flat_map(|body| [&body.presence, &body.runs]);
        let emitters = self.emitters.iter().map(|emitter| &emitter.condition);
        let launchers = self.launchers.iter().map(|launcher| &launcher.condition);
        bodies.chain(emitters).chain(launchers).any(|condition| !condition.is_none())
    }

    /// Returns whether there is any way to get points.
    pub fn counts_points(&self) -> bool {
        let worth = |body: &Placed| body.breaks.is_some_and(|breaks| breaks.points != 0);
        self.rules.rules.iter().any(|rule| rule.effects.score != 0)
            || self.bodies.iter().any(worth)
            || self.sling.is_some_and(|sling| sling.spare != 0)
    }

    /// Returns whether hard blows break bodies.
    pub(crate) fn has_breakables(&self) -> bool {
        self.bodies.iter().any(|body| body.breaks.is_some())
    }

    /// Returns whether players throw dye packs from their heroes.
    pub fn throws_packs(&self) -> bool {
        self.pack.as_ref().is_some_and(|pack| pack.throw_every.is_some())
    }

    /// Returns whether bodies of the two groups collide.
    pub fn groups_meet(&self, a: u8, b: u8) -> bool {
        self.world.meets[usize::from(a)] >> b & 1 == 1
    }

    /// All texts that the author wrote for players, each with the path of its field.
    pub fn texts(&self) -> Vec<(String, &str)> {
        let mut texts = vec![("title".to_owned(), self.title.as_str())];
        texts.push(("about".to_owned(), &self.about));
        texts.extend(self.rules.round.iter().map(|round| ("round.task".to_owned(), &*round.task)));
        let zones = self.rules.zones.iter().enumerate();
        texts.extend(zones.map(|(index, zone)| (format!("zones[{index}].label"), &*zone.label)));
        let rules = self.rules.rules.iter().enumerate();
        texts.extend(rules.filter_map(|(index, rule)| {
            let line = rule.effects.say.as_ref()?;
            Some((format!("rules[{index}].say"), line.text.as_str()))
        }));
        texts.retain(|(_, text)| !text.is_empty());
        texts
    }
}

impl SceneError {
    /// Creates an error about a scene's field, given its path, such as `layouts[2].count`. The error's line is that
    /// of the field, or of the innermost enclosing table that the file has.
    pub fn in_scene(scene: &Scene, field: &str, found: String, allowed: String) -> SceneError {
        let (at, _) = locate(&scene.source, field);
        let line = line_at(scene.source.as_bytes(), at);
        let file = format!("{}.toml", scene.name);
        SceneError { file, line, field: field.to_owned(), found, allowed }
    }
}

/// Reads the top level.
pub(super) fn read(name: String, source: &str, root: &Table) -> Scene {
    let title = root.need("title", "a name for people").text(TITLE_CHARS_MAX);
    let about = root.get("about").text(ABOUT_CHARS_MAX);
    let size = root.need("size", "[width, height]").vector(Vec2::ONE, Range::from(1.0, SIZE_MAX));
    let groups = Groups::read(root);
    let world = world_settings(root, size, &groups);
    let tools = tools(root);
    let mut recipes = Recipes::read(root);
    let actors = actors::actors(root, tools, &groups, &mut recipes);
    let names = Names::read(root);
    let known = RuleNames { names: &names, groups: &groups };
    let bodies = read_list(root, "bodies", BODIES_MAX as usize, |table| {
        bodies::placed(table, &actors.kinds, &known, &mut recipes)
    });
    let layout = |table: &Table| bodies::layout(table, &actors.kinds, &groups);
    let layouts = read_list(root, "layouts", BODIES_MAX as usize, layout);
    let spring = |table: &Table| springs::spring(table, &bodies, &names);
    let springs = read_list(root, "springs", SPRINGS_MAX, spring);
    let emitter = |table: &Table| sources::emitter(table, &names, &mut recipes);
    let emitters = read_list(root, "emitters", EMITTERS_MAX, emitter);
    let launcher = |table: &Table| sources::launcher(table, &names);
    let mut scene = Scene {
        name,
        title,
        about,
        source: source.to_owned(),
        size,
        world,
        tools,
        players_max: 0,
        layouts,
        springs: springs.into_iter().flatten().collect(),
        emitters,
        launchers: read_list(root, "launchers", LAUNCHERS_MAX, launcher),
        marks: read_list(root, "marks", MARKS_MAX, |table| marks::mark(table, &names)),
        hero: actors.hero,
        minion_recovery: actors.minion_recovery,
        marble: actors.marble,
        pack: actors.pack,
        sling: sling::sling(root, tools, &bodies, &names),
        bodies,
        rules: RuleSet::read(root, &known, &mut recipes),
        camera: camera(root),
        category: category(root),
        theme: Theme::read(root),
        impact_speed: root.get("impact_speed").number(12.0, Range::from(0.0, 1.0e6)),
        spray: spray(root, tools, &mut recipes),
        listed: root.get("listed").given(|listed| names.any_condition(listed)),
        groups: groups.names.clone(),
    };
    scene.world.recipes = recipes.list;
    scene.world.forces = forces(root, &groups, &scene);
    check_listed(&root.get("listed"), &scene);
    root.get("limits").table(|table| limits(table, &mut scene));
    scene
}

/// Checks that `listed` is used only with the relaxation solver and without forces, since the chapter prints nothing
/// else.
fn check_listed(field: &Field, scene: &Scene) {
    let is_relaxation = matches!(scene.world.solver, Some(Solver::Relaxation(_)));
    if scene.listed.is_some() && (!is_relaxation || scene.world.forces.is_some()) {
        field.refuse_as("another solver, or forces", "only the relaxation, without forces");
    }
}

/// Reads `wind` and `integrators`; `None` in a scene without forces.
fn forces(root: &Table, groups: &Groups, scene: &Scene) -> Option<ForceSettings> {
    // Velocity of the air; only with drag. Label: Wind, for experts.
    let wind = root.get("wind").vector(Vec2::ZERO, WIND);
    // Groups whose bodies, including their drag and springs, are moved by one of Euler's methods instead of exactly,
    // for scenes that compare the methods; each group at most once. Stiff forces make both methods unstable. Default:
    // none.
    let euler = groups.euler(&root.get("integrators"));
    let has_forces = !scene.springs.is_empty() || scene.has_drag() || euler != EulerGroups::NONE;
    has_forces.then_some(ForceSettings { wind, springs_max: scene.springs.len(), euler })
}

/// Reads the category. By default, a scene with a round is a game.
fn category(root: &Table) -> Category {
    let base = if root.get("round").is_given() { Category::Games } else { Category::Playgrounds };
    root.get("category").choice(&Category::NAMES).unwrap_or(base)
}

/// Reads the world settings that do not depend on the rest of the scene.
fn world_settings(root: &Table, size: Vec2, groups: &Groups) -> WorldSettings {
    // Acceleration of all falling bodies. Label: Gravity.
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
        // Largest speed of any body. Label: Speed limit, for experts.
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
    let tools = root.get("tools").items_of("names of tools");
    let tools = tools.iter().filter_map(|field| field.choice(&Tools::NAMES));
    tools.fold(Tools::default(), |all, tool| Tools(all.0 | tool.0))
}

fn camera(root: &Table) -> Camera {
    let field = root.get("camera");
    let allowed = "\"fit\", \"whole\" or { follow = height }";
    field.describe("`\"fit\"`, `\"whole\"`, `{ follow = height }`");
    match field.word() {
        _ if !field.is_given() => return Camera::Fit,
        Some("fit") => return Camera::Fit,
        Some("whole") => return Camera::Whole,
        _ => {}
    }
    let height = field.table_or(allowed, |table| {
        let height = table.need("follow", "the height of the view");
        height.number(1.0, Range::from(1.0, SIZE_MAX))
    });
    Camera::Follow { height }
}

/// Reads the kill zone, which by default extends half a world beyond every side.
fn kill_zone(root: &Table, size: Vec2) -> Aabb {
    // Bodies whose centre leaves it are removed; heroes respawn. It must enclose the whole world. Default: the world
    // and half its size more on each side.
    let field = root.get("kill_zone");
    let [low, high] = field.corners([size * -0.5, size * 1.5], POSITION);
    let zone = Aabb { low, high };
    if !zone.contains(Vec2::ZERO) || !zone.contains(size) {
        field.refuse("corners around the whole world");
    }
    zone
}

fn quantum(root: &Table) -> f32 {
    // Resolution of the positions that clients see. Messages can express up to 2^24 quanta on either side of 0, so the
    // kill zone may reach no further; with the default, that is 262144 units. Label: Resolution of positions, for
    // experts.
    let field = root.get("quantum");
    field.describe("a power of two, 1/65536 to 1");
    let quantum = field.number(1.0 / 64.0, Range::from(QUANTUM_MIN, 1.0));
    // A power of two has no mantissa bits.
    if quantum.to_bits() & 0x007f_ffff != 0 {
        field.refuse("a power of two from 1/65536 to 1, like 0.015625");
    }
    quantum
}

/// Reads a scene's limits into it.
fn limits(table: &Table, scene: &mut Scene) {
    let seats_max = if scene.camera.sees_all() { SEATS_MAX as u32 } else { FOLLOWERS_MAX };
    // Maximum number of concurrent players; at most 64 if the camera follows them. Label: Players at most.
    let players = table.get("players").whole(16, 1..=seats_max);
    // Maximum number of dye packs per player. Label: Dye packs per player, for experts.
    let packs = table.get("packs").whole(8, 0..=PACKS_MAX);
    // Number of marbles at which Z makes no more. Label: Marbles at most, for experts.
    let marbles = table.get("dumb").whole(200, 0..=BODIES_MAX);
    let laid_out: u64 = scene.layouts.iter().map(|layout| u64::from(layout.count)).sum();
    let if_any = |any, count: u32| if any { u64::from(count) } else { 0 };
    let least = scene.bodies.len() as u64 + laid_out + if_any(scene.hero.is_some(), players);
    let launched = if_any(scene.pack.is_some(), players * packs);
    let dropped = if_any(scene.marble.is_some(), marbles);
    let made = scene.launchers.iter().map(|launcher| u64::from(launcher.limit)).sum::<u64>();
    let roomy = (least + launched + dropped + made).clamp(1, u64::from(BODIES_MAX)) as u32;
    // Maximum number of bodies at any time; all bodies, layouts and heroes must fit. Default: enough for everything
    // that the file allows. Label: Bodies at most, for experts.
    let field = table.get("bodies");
    let bodies = field.whole(roomy, 1..=BODIES_MAX);
    if least > u64::from(bodies) {
        let found = format!("{bodies} for {least} bodies with layouts and heroes of all players");
        field.refuse_as(found, format!("{least} or more, up to {BODIES_MAX}"));
    }
    scene.players_max = players as u16;
    scene.world.bodies_max = bodies as usize;
    // Maximum number of particles at any time. Label: Particles at most, for experts.
    scene.world.particles_max = table.get("particles").whole(4096, 0..=PARTICLES_MAX) as usize;
    scene.marble.iter_mut().for_each(|marble| marble.count_max = marbles);
    scene.pack.iter_mut().for_each(|pack| pack.count_max = packs);
}
