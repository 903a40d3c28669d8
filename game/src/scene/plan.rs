//! The Plan lists everything that a scene can ever contain, through its file and its players' tools, and thus
//! what its game, its messages and its page need. Each part states whether it is used, and which field of the
//! file decides that.
//!
//! A World's step is prepared for [`Plan::features`]; a body that a program adds to the scene may widen them (see
//! [`Features`]).

use super::bodies::Placed;
use super::kind::Kind;
use super::spec::Scene;
use super::tools::Tools;
use jostle_sim::WorldSettings;
use jostle_sim::math::min;
use jostle_sim::{BodyDef, Drag, Features, Motion, Shape};

/// The needs of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Bodies that the scene can contain, with similar ones combined.
    pub bodies: Vec<Bodies>,
    /// Pairs of groups that collide and both have bodies, each with the lower index first, in order.
    pub pairs: Vec<[u8; 2]>,
    /// Every part that a scene can do without, used or not.
    pub parts: Vec<Part>,
    /// Features for which the World's step is prepared.
    pub features: Features,
}

/// Bodies that differ only in their positions.
#[derive(Clone, Debug, PartialEq)]
pub struct Bodies {
    /// Kind of the bodies.
    pub kind: Kind,
    /// Definition of the body.
    pub def: BodyDef,
    /// Shapes from which the seed chooses, or only the shape of `def`.
    pub shapes: Vec<Shape>,
    /// Number of bodies, as counted by [`Bodies::per`].
    pub count: u32,
    /// What the bodies come from; `count` refers to this.
    pub per: Per,
    /// Field of the file that adds the first of them, like `bodies[3]`.
    pub field: String,
}

/// The origin of the bodies of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// Present from the start, permanently or until something removes them.
    Scene,
    /// Up to this many for each player.
    Player,
    /// Up to this many made with a tool.
    Tool,
}

/// A part that a scene can do without.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Lower-case name, for reports.
    pub name: &'static str,
    /// What the part costs where it is used: stages of a step, sections of a message, elements of the page.
    pub costs: &'static str,
    /// Whether the scene can need it.
    pub used: bool,
    /// The field that decides this, and its content.
    pub why: String,
}

impl Scene {
    /// The settings of a World for this scene.
    pub fn world_settings(&self) -> WorldSettings {
        WorldSettings { features: self.features(), ..self.world.clone() }
    }

    /// Features for which its World's step is prepared. They are the same as [`Plan::features`], but without the
    /// reasons.
    pub fn features(&self) -> Features {
        features(self, &sources(self))
    }
}

impl Plan {
    /// Determines the needs of a scene.
    pub fn of(scene: &Scene) -> Plan {
        let sources = sources(scene);
        Plan {
            pairs: pairs(scene, &sources),
            features: features(scene, &sources),
            parts: Reasons { scene, sources: &sources }.parts(emits(scene)),
            bodies: alike(sources),
        }
    }
}

impl Bodies {
    fn one(field: String, kind: Kind, def: BodyDef) -> Bodies {
        Bodies { field, kind, def, shapes: vec![def.shape], count: 1, per: Per::Scene }
    }

    /// Definitions of these bodies, one for each shape.
    fn defs(&self) -> impl Iterator<Item = BodyDef> + '_ {
        self.shapes.iter().map(|&shape| BodyDef { shape, ..self.def })
    }

    /// Whether some are circles, or can become circles depending on the seed.
    pub fn circles(&self) -> bool {
        self.shapes.iter().any(|shape| matches!(shape, Shape::Circle { .. }))
    }

    /// Whether some are boxes, or can become boxes depending on the seed.
    pub fn boxes(&self) -> bool {
        self.shapes.iter().any(|shape| matches!(shape, Shape::Box { .. }))
    }

    /// Number of bodies with this many players.
    pub(super) fn total(&self, players: u16) -> u32 {
        match self.per {
            Per::Player => self.count * u32::from(players),
            Per::Scene | Per::Tool => self.count,
        }
    }

    /// Field of the file that sets their number, or the list that contains them. If this is a limit, the file may
    /// omit it, in which case the default applies.
    pub(super) fn count_field(&self) -> String {
        match self.field.as_str() {
            "hero" => "limits.players".to_owned(),
            "pack" => "limits.packs".to_owned(),
            "dumb" => "limits.dumb".to_owned(),
            field if field.starts_with("layouts") => format!("{field}.count"),
            field if field.starts_with("launchers") => format!("{field}.limit"),
            field if field.starts_with("bodies") => "bodies".to_owned(),
            field => field.to_owned(),
        }
    }

    fn is_dynamic(&self) -> bool {
        self.def.motion == Motion::Dynamic
    }
}

/// All sources of bodies: entries in the file, and tools.
pub(super) fn sources(scene: &Scene) -> Vec<Bodies> {
    let mut sources = Vec::new();
    for (index, body) in scene.bodies.iter().enumerate() {
        sources.push(Bodies::one(format!("bodies[{index}]"), body.kind, body.def));
    }
    for (index, layout) in scene.layouts.iter().enumerate() {
        let one = Bodies::one(format!("layouts[{index}]"), layout.kind, layout.def);
        sources.push(Bodies { shapes: layout.shapes.clone(), count: layout.count, ..one });
    }
    if let Some(hero) = &scene.hero {
        let one = Bodies::one("hero".to_owned(), Kind::Hero, hero.body);
        sources.push(Bodies { per: Per::Player, ..one });
    }
    if let Some(pack) = scene.pack.as_ref().filter(|_| scene.tools.contains(Tools::LAUNCH)) {
        let one = Bodies::one("pack".to_owned(), Kind::Pack, pack.body);
        sources.push(Bodies { count: pack.count_max, per: Per::Player, ..one });
    }
    for (index, launcher) in scene.launchers.iter().enumerate() {
        let def = match launcher.makes {
            Kind::Pack => scene.pack.as_ref().map(|pack| pack.body),
            _ => scene.marble.as_ref().map(|marble| marble.body),
        };
        let one = def.map(|def| Bodies::one(format!("launchers[{index}]"), launcher.makes, def));
        sources.extend(one.map(|one| Bodies { count: launcher.limit, per: Per::Tool, ..one }));
    }
    if let Some(marble) = scene.marble.as_ref().filter(|_| scene.tools.contains(Tools::MARBLE)) {
        let one = Bodies::one("dumb".to_owned(), Kind::Marble, marble.body);
        sources.push(Bodies { count: marble.count_max, per: Per::Tool, ..one });
    }
    sources
}

fn features(scene: &Scene, sources: &[Bodies]) -> Features {
    let brought = sources.iter().flat_map(Bodies::defs).map(|def| Features::of(&def));
    Features { particles: has_particles(scene), ..brought.fold(Features::NONE, Features::with) }
}

/// Combines sources with the same kind, group, motion and shapes.
fn alike(sources: Vec<Bodies>) -> Vec<Bodies> {
    let key =
        |of: &Bodies| (of.kind, of.def.group, of.def.motion, of.circles(), of.boxes(), of.per);
    let mut bodies: Vec<Bodies> = Vec::new();
    for source in sources {
        match bodies.iter_mut().find(|known| key(known) == key(&source)) {
            Some(known) => known.count += source.count,
            None => bodies.push(source),
        }
    }
    bodies
}

/// Pairs of sources whose bodies can collide: their groups meet, and either one of them can be pushed or contacts are
/// only detected.
fn meeting<'a>(
    scene: &'a Scene,
    sources: &'a [Bodies],
) -> impl Iterator<Item = (&'a Bodies, &'a Bodies)> {
    let all = sources.iter().enumerate();
    let pairs = all.flat_map(move |(at, a)| sources[at..].iter().map(move |b| (a, b)));
    pairs.filter(move |(a, b)| {
        let alone = std::ptr::eq(*a, *b) && a.count == 1 && a.per == Per::Scene;
        !alone
            && scene.groups_meet(a.def.group, b.def.group)
            && (a.is_dynamic() || b.is_dynamic() || scene.world.solver.is_none())
    })
}

fn pairs(scene: &Scene, sources: &[Bodies]) -> Vec<[u8; 2]> {
    let groups = |(a, b): (&Bodies, &Bodies)| {
        let (a, b) = (a.def.group, b.def.group);
        u64::from(a.min(b)) << 8 | u64::from(a.max(b))
    };
    let mut pairs: Vec<u64> = meeting(scene, sources).map(groups).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs.into_iter().map(|pair| [(pair >> 8) as u8, pair as u8]).collect()
}

/// The field that launches dye packs.
fn launches_packs(scene: &Scene) -> Reason {
    if scene.tools.contains(Tools::LAUNCH) {
        return Ok("tools has \"launch\"".to_owned());
    }
    let launcher = scene.launchers.iter().position(|launcher| launcher.makes == Kind::Pack);
    let none = || "no \"launch\" in tools, and no launcher of packs".to_owned();
    launcher.map(|index| format!("launchers[{index}] makes packs")).ok_or_else(none)
}

/// Whether anything makes particles, by the same criteria as [`emits`].
fn has_particles(scene: &Scene) -> bool {
    let launches = || {
        scene.tools.contains(Tools::LAUNCH)
            || scene.launchers.iter().any(|launcher| launcher.makes == Kind::Pack)
    };
    let splashes = |body: &Placed| body.breaks.is_some_and(|breaks| breaks.splash.is_some());
    !scene.emitters.is_empty()
        || scene.tools.contains(Tools::SPRAY)
        || scene.rules.rules.iter().any(|rule| rule.effects.splash.is_some())
        || scene.bodies.iter().any(splashes)
        || scene.pack.as_ref().is_some_and(|pack| pack.burst > 0) && launches()
}

/// The field that makes particles.
fn emits(scene: &Scene) -> Reason {
    if !scene.emitters.is_empty() {
        return Ok("emitters[0]".to_owned());
    }
    if scene.tools.contains(Tools::SPRAY) {
        return Ok("tools has \"spray\"".to_owned());
    }
    let rules = scene.rules.rules.iter();
    if let Some(index) = rules.clone().position(|rule| rule.effects.splash.is_some()) {
        return Ok(format!("rules[{index}] has splash"));
    }
    let splashes = |body: &Placed| body.breaks.is_some_and(|breaks| breaks.splash.is_some());
    if let Some(index) = scene.bodies.iter().position(splashes) {
        return Ok(format!("bodies[{index}] has splash"));
    }
    match &scene.pack {
        Some(pack) if pack.burst > 0 && launches_packs(scene).is_ok() => {
            let why = launches_packs(scene).unwrap_or_default();
            Ok(format!("pack.burst is {}, and {why}", pack.burst))
        }
        _ => Err("no emitters, no \"spray\" in tools, no pack with a burst, no splash".to_owned()),
    }
}

/// The fields that cause a scene to use a part (`Ok`) or not (`Err`).
type Reason = Result<String, String>;

fn given(is_given: bool, has: &str, lacks: &str) -> Reason {
    if is_given { Ok(has.to_owned()) } else { Err(lacks.to_owned()) }
}

struct Reasons<'a> {
    scene: &'a Scene,
    sources: &'a [Bodies],
}

impl Reasons<'_> {
    /// All parts, in the order in which a plan lists them.
    fn parts(&self, emits: Reason) -> Vec<Part> {
        let part = |name, costs, reason: Reason| {
            let used = reason.is_ok();
            let (Ok(why) | Err(why)) = reason;
            Part { name, costs, used, why }
        };
        let is_moved = |source: &Bodies| source.def.motion == Motion::Kinematic;
        let (by_path, no_path) =
            ("has a path or motion \"kinematic\"", "no path and no motion \"kinematic\" in bodies");
        let moves = |source: &Bodies| source.def.motion != Motion::Static;
        let circles = self.contact("two circles", |a, b| a.circles() && b.circles());
        let mixed = |a: &Bodies, b: &Bodies| a.circles() && b.boxes() || a.boxes() && b.circles();
        let mixed = self.contact("circle and box", mixed);
        let boxes = self.contact("two boxes", |a, b| a.boxes() && b.boxes());
        let friction = self.material("friction", |def| def.friction, |by| by.friction);
        let bounce = self.material("restitution", |def| def.restitution, |by| by.restitution);
        let obstacles = self.obstacles(emits.is_ok());
        vec![
            part("circle-circle", "narrow phase", circles),
            part("circle-box", "narrow phase", mixed),
            part("box-box", "narrow phase", boxes),
            part("friction", "tangent rows", friction),
            part("restitution", "impacts", bounce),
            part("kinematic bodies", "paths", self.source(is_moved, by_path, no_path)),
            part("continuous collision", "doubts", self.continuous()),
            part("forces", "force state, paths of their own", self.forces()),
            part("as listed", "the chapter's solver as it is printed", self.as_listed()),
            part("sleeping", "steps at rest, a grid of who lies still", self.sleeping()),
            part("particles", "particle state, emitter events, one pipeline, one sprite", emits),
            part("particles pushed out", "obstacle grid", obstacles),
            part(
                "emitters",
                "emitter events",
                self.count_of("emitters", self.scene.emitters.len()),
            ),
            part(
                "moves",
                "moves section",
                self.source(moves, "is not static", "every body is static"),
            ),
            part("marks", "drawn on the page", self.count_of("marks", self.scene.marks.len())),
            part("launchers", "bodies", self.count_of("launchers", self.scene.launchers.len())),
            part("rounds", "a clock, the round's part of the players section", self.rounds()),
            part("zones", "who is in each", self.count_of("zones", self.scene.rules.zones.len())),
            part("signals", "levels", self.count_of("signals", self.scene.rules.signals.len())),
            part("rules", "occasions", self.count_of("rules", self.scene.rules.rules.len())),
            part("breakage", "a look at each contact", self.breakage()),
            part("sling", "the ball, its part of the players section", self.sling()),
            part("impact events", "events section", self.impacts()),
            part("pack events", "events section", self.pack_hits()),
        ]
    }

    /// The first source that matches, described by `has`, or the reason `lacks`.
    fn source(&self, matches: impl Fn(&Bodies) -> bool, has: &str, lacks: &str) -> Reason {
        match self.sources.iter().find(|source| matches(source)) {
            Some(source) => Ok(format!("{} {has}", source.field)),
            None => Err(lacks.to_owned()),
        }
    }

    fn contact(&self, shapes: &str, matches: impl Fn(&Bodies, &Bodies) -> bool) -> Reason {
        match meeting(self.scene, self.sources).find(|(a, b)| matches(a, b)) {
            Some((a, b)) => Ok(format!("{} meets {} by pairs", a.field, b.field)),
            None => Err(format!("no {shapes} meet by pairs")),
        }
    }

    /// Decides whether a material property is used, by the rule given in [`Features`].
    fn material(
        &self,
        name: &str,
        of: impl Fn(&BodyDef) -> f32,
        brought: impl Fn(Features) -> bool,
    ) -> Reason {
        self.solved()?;
        match self.sources.iter().find(|source| brought(Features::of(&source.def))) {
            Some(source) => Ok(format!("{} has {name} {}", source.field, of(&source.def))),
            None => Err(format!("{name} is 0 for every body that can be pushed")),
        }
    }

    fn solved(&self) -> Result<(), String> {
        let none = || "response is \"none\": contacts are only found".to_owned();
        self.scene.world.solver.map(|_| ()).ok_or_else(none)
    }

    /// Continuous collision is not needed if two bodies at the speed limit cannot close by more than the smaller
    /// one's half-size.
    fn continuous(&self) -> Reason {
        if !self.scene.world.is_conjugate() {
            return Err("solver is not \"conjugate\": contacts are overlaps".to_owned());
        }
        let speed_max = self.scene.world.speed_max;
        let path = 2.0 * speed_max * jostle_sim::DT;
        let size = |source: &Bodies| {
            let halves = source.shapes.iter().map(Shape::half_extent);
            halves.fold(f32::INFINITY, |least, half| min(least, min(half.x, half.y)))
        };
        let sizes = self.sources.iter().map(|source| (source, size(source)));
        match sizes.min_by(|(_, a), (_, b)| a.total_cmp(b)) {
            Some((source, half)) if path > half => Ok(format!(
                "speed_max {speed_max} closes {path} a step; {} has a half-size of {half}",
                source.field
            )),
            _ => Err(format!("speed_max {speed_max} closes {path} a step at most")),
        }
    }

    fn forces(&self) -> Reason {
        let none = "no springs, no integrators, and drag is 0 for every body";
        let dragged = self.source(|source| source.def.drag != Drag::NONE, "has drag", none);
        match dragged {
            Err(_) if !self.scene.springs.is_empty() => Ok("springs[0]".to_owned()),
            Err(_) if self.scene.world.forces.is_some() => Ok("integrators".to_owned()),
            reason => reason,
        }
    }

    fn as_listed(&self) -> Reason {
        given(self.scene.listed.is_some(), "the scene has listed", "no listed")
    }

    fn sleeping(&self) -> Reason {
        let is = "sleeping = true, the default of the conjugate solver";
        given(self.scene.world.sleeping, is, "sleeping = false, the default of other solvers")
    }

    fn sling(&self) -> Reason {
        given(self.scene.sling.is_some(), "the scene has [sling]", "no [sling]")
    }

    fn breakage(&self) -> Reason {
        let first = self.scene.bodies.iter().position(|body| body.breaks.is_some());
        let has = first.map(|index| format!("bodies[{index}] has strength"));
        has.ok_or_else(|| "no strength in bodies".to_owned())
    }

    fn obstacles(&self, emits: bool) -> Reason {
        if !emits {
            return Err("no particles".to_owned());
        }
        let pushes =
            |source: &&Bodies| self.scene.world.meets_particles >> source.def.group & 1 == 1;
        match self.sources.iter().find(pushes) {
            Some(source) => {
                let group = &self.scene.groups[usize::from(source.def.group)];
                Ok(format!("particles_meet has \"{group}\", as of {}", source.field))
            }
            None => Err("particles_meet has no group with bodies".to_owned()),
        }
    }

    fn count_of(&self, list: &str, count: usize) -> Reason {
        match count {
            0 => Err(format!("{list} has no entry")),
            count => Ok(format!("{list} has {count}")),
        }
    }

    fn rounds(&self) -> Reason {
        match (&self.scene.rules.round, self.scene.rules.teams.len()) {
            (Some(_), _) => Ok("the scene has [round]".to_owned()),
            (None, 0) => Err("no [round] and no [[teams]]".to_owned()),
            (None, teams) => Ok(format!("teams has {teams}")),
        }
    }

    fn impacts(&self) -> Reason {
        self.solved()?;
        match meeting(self.scene, self.sources).next() {
            Some(_) => Ok(format!("impact_speed is {}", self.scene.impact_speed)),
            None => Err("no two groups with bodies meet by pairs".to_owned()),
        }
    }

    fn pack_hits(&self) -> Reason {
        let why = launches_packs(self.scene)?;
        match self.sources.iter().find(|source| source.kind == Kind::Hero) {
            Some(hero) => Ok(format!("{why}, and {} can be hit", hero.field)),
            None => Err("no hero in the scene".to_owned()),
        }
    }
}
