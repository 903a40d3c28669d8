//! The Plan: what a scene can ever bring, by its file and by the tools of its players, and so what
//! its game, its messages and its page need. Each part says whether it is in, and which field of the
//! file decides.
//!
//! [`Plan::features`] is what a World's step is prepared for; a body that a program adds beside the
//! scene widens that (see [`crate::features`]).

use super::{Kind, Scene, Tools};
use crate::body::{BodyDef, Motion};
use crate::features::Features;
use crate::forces::Drag;
use crate::math::min;
use crate::shape::Shape;
use crate::solver::Solver;

/// What a scene needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Bodies that it can bring, alike ones together.
    pub bodies: Vec<Bodies>,
    /// Pairs of groups that collide and both have bodies, lower index first, in order.
    pub pairs: Vec<[u8; 2]>,
    /// Every part that a scene can lack, in the order of [`Part::ALL`].
    pub verdicts: Vec<Verdict>,
    /// What the World's step is prepared for.
    pub features: Features,
}

/// Bodies that differ in their places only.
#[derive(Clone, Debug, PartialEq)]
pub struct Bodies {
    /// What they are.
    pub kind: Kind,
    /// Collision group.
    pub group: u8,
    /// How they move.
    pub motion: Motion,
    /// Whether they are, or the seed may make them, circles.
    pub circles: bool,
    /// The same of boxes.
    pub boxes: bool,
    /// How many, of what [`Bodies::per`] says.
    pub count: u32,
    /// What `count` counts.
    pub per: Per,
    /// Where the file has the first of them, like `bodies[3]`.
    pub field: String,
}

/// Where bodies come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// There from the start, for good or until something removes them.
    Scene,
    /// At most so many for each player.
    Player,
    /// At most so many made with a tool.
    Tool,
}

/// A part that a scene can lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Contacts of two circles.
    CircleCircle,
    /// Contacts of a circle and a box.
    CircleBox,
    /// Contacts of two boxes.
    BoxBox,
    /// Contacts that rub.
    Friction,
    /// Contacts that bounce.
    Restitution,
    /// Bodies that move by their own velocity only.
    Kinematic,
    /// Pairs that may pass each other within a step.
    Continuous,
    /// Drag, wind and springs.
    Forces,
    /// Bodies at rest fall asleep.
    Sleeping,
    /// Particles, whoever makes them: their state, their events, their pipeline and sprite.
    Particles,
    /// Bodies that push particles out.
    Obstacles,
    /// Emitters that run by themselves.
    Emitters,
    /// Places of bodies that change.
    Moves,
    /// Reports of hard contacts.
    Impacts,
    /// Reports of packs that found a hero.
    PackHits,
}

impl Part {
    /// All of them, in the order in which a plan lists them.
    pub const ALL: [Part; 15] = [
        Part::CircleCircle,
        Part::CircleBox,
        Part::BoxBox,
        Part::Friction,
        Part::Restitution,
        Part::Kinematic,
        Part::Continuous,
        Part::Forces,
        Part::Sleeping,
        Part::Particles,
        Part::Obstacles,
        Part::Emitters,
        Part::Moves,
        Part::Impacts,
        Part::PackHits,
    ];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Part::CircleCircle => "circle-circle",
            Part::CircleBox => "circle-box",
            Part::BoxBox => "box-box",
            Part::Friction => "friction",
            Part::Restitution => "restitution",
            Part::Kinematic => "kinematic bodies",
            Part::Continuous => "continuous collision",
            Part::Forces => "forces",
            Part::Sleeping => "sleeping",
            Part::Particles => "particles",
            Part::Obstacles => "particles pushed out",
            Part::Emitters => "emitters",
            Part::Moves => "moves",
            Part::Impacts => "impact events",
            Part::PackHits => "pack events",
        }
    }

    /// What it costs where it is in: stages of a step, sections of a message, things on the page.
    pub fn costs(self) -> &'static str {
        match self {
            Part::CircleCircle | Part::CircleBox | Part::BoxBox => "narrow phase",
            Part::Friction => "tangent rows",
            Part::Restitution => "impacts",
            Part::Kinematic => "paths",
            Part::Continuous => "doubts",
            Part::Forces => "force state, paths of their own",
            Part::Sleeping => "steps at rest, a grid of who lies still",
            Part::Particles => "particle state, emitter events, one pipeline, one sprite",
            Part::Obstacles => "obstacle grid",
            Part::Emitters => "emitter events",
            Part::Moves => "moves section",
            Part::Impacts | Part::PackHits => "events section",
        }
    }
}

/// Whether a part is in, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The part.
    pub part: Part,
    /// Whether the scene can need it.
    pub used: bool,
    /// The field that decides, and what it says.
    pub why: String,
}

impl Plan {
    /// Compiles a scene.
    pub fn of(scene: &Scene) -> Plan {
        let sources = sources(scene);
        let emits = what_emits(scene);
        let brought = sources.iter().flat_map(Source::defs).map(|def| Features::of(&def));
        let features = brought.fold(Features::NONE, Features::with);
        let judged = Judged { scene, sources: &sources, emits: &emits };
        Plan {
            bodies: alike(&sources),
            pairs: pairs(scene, &sources),
            verdicts: Part::ALL.map(|part| judged.verdict(part)).to_vec(),
            features: Features { particles: emits.is_some(), ..features },
        }
    }

    /// Whether a part is in.
    pub fn uses(&self, part: Part) -> bool {
        self.verdicts.iter().any(|verdict| verdict.part == part && verdict.used)
    }
}

/// An entry of the file that brings bodies.
struct Source {
    field: String,
    kind: Kind,
    def: BodyDef,
    /// What the seed chooses from; else the shape of `def` alone.
    shapes: Vec<Shape>,
    count: u32,
    per: Per,
}

impl Source {
    fn one(field: String, kind: Kind, def: BodyDef) -> Source {
        Source { field, kind, def, shapes: vec![def.shape], count: 1, per: Per::Scene }
    }

    /// Its bodies, one a shape.
    fn defs(&self) -> impl Iterator<Item = BodyDef> + '_ {
        self.shapes.iter().map(|&shape| BodyDef { shape, ..self.def })
    }

    fn circles(&self) -> bool {
        self.shapes.iter().any(|shape| matches!(shape, Shape::Circle { .. }))
    }

    fn boxes(&self) -> bool {
        self.shapes.iter().any(|shape| matches!(shape, Shape::Box { .. }))
    }

    fn is_dynamic(&self) -> bool {
        self.def.motion == Motion::Dynamic
    }
}

/// Everything that can bring bodies: the file's and the tools'.
fn sources(scene: &Scene) -> Vec<Source> {
    let mut sources = Vec::new();
    for (index, body) in scene.bodies.iter().enumerate() {
        sources.push(Source::one(format!("bodies[{index}]"), body.kind, body.def));
    }
    for (index, layout) in scene.layouts.iter().enumerate() {
        let one = Source::one(format!("layouts[{index}]"), layout.kind, layout.def);
        sources.push(Source { shapes: layout.shapes.clone(), count: layout.count, ..one });
    }
    if let Some(hero) = &scene.hero {
        let one = Source::one("hero".to_owned(), Kind::Hero, hero.body);
        sources.push(Source { per: Per::Player, ..one });
    }
    if let Some(pack) = scene.pack.as_ref().filter(|_| scene.tools.contains(Tools::LAUNCH)) {
        let one = Source::one("pack".to_owned(), Kind::Pack, pack.body);
        sources.push(Source { count: scene.packs_max as u32, per: Per::Player, ..one });
    }
    if let Some(dumb) = scene.dumb {
        let one = Source::one("dumb".to_owned(), Kind::Dumb, dumb);
        sources.push(Source { count: scene.dumb_max as u32, per: Per::Tool, ..one });
    }
    sources
}

fn alike(sources: &[Source]) -> Vec<Bodies> {
    let mut bodies: Vec<Bodies> = Vec::new();
    for source in sources {
        let new = Bodies {
            kind: source.kind,
            group: source.def.group,
            motion: source.def.motion,
            circles: source.circles(),
            boxes: source.boxes(),
            count: source.count,
            per: source.per,
            field: source.field.clone(),
        };
        let same = |old: &&mut Bodies| {
            **old == Bodies { count: old.count, field: old.field.clone(), ..new.clone() }
        };
        match bodies.iter_mut().find(same) {
            Some(old) => old.count += new.count,
            None => bodies.push(new),
        }
    }
    bodies
}

/// Sources whose bodies can collide: their groups meet, and one of them can be pushed, or contacts
/// are only found.
fn meeting<'a>(
    scene: &'a Scene,
    sources: &'a [Source],
) -> impl Iterator<Item = (&'a Source, &'a Source)> {
    let all = sources.iter().enumerate();
    let pairs = all.flat_map(move |(at, a)| sources[at..].iter().map(move |b| (a, b)));
    pairs.filter(move |(a, b)| {
        let alone = std::ptr::eq(*a, *b) && a.count == 1 && a.per == Per::Scene;
        !alone
            && scene.groups_meet(a.def.group, b.def.group)
            && (a.is_dynamic() || b.is_dynamic() || scene.solver.is_none())
    })
}

fn pairs(scene: &Scene, sources: &[Source]) -> Vec<[u8; 2]> {
    let groups = |(a, b): (&Source, &Source)| {
        let (a, b) = (a.def.group, b.def.group);
        [a.min(b), a.max(b)]
    };
    let mut pairs: Vec<[u8; 2]> = meeting(scene, sources).map(groups).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// What makes particles, or `None`.
fn what_emits(scene: &Scene) -> Option<String> {
    if !scene.emitters.is_empty() {
        return Some("emitters[0]".to_owned());
    }
    if scene.tools.contains(Tools::SPRAY) {
        return Some("tools has \"spray\"".to_owned());
    }
    let pack = scene.pack.as_ref().filter(|_| scene.tools.contains(Tools::LAUNCH))?;
    (pack.burst > 0).then(|| format!("pack.burst is {}, and tools has \"launch\"", pack.burst))
}

/// What verdicts are made from.
struct Judged<'a> {
    scene: &'a Scene,
    sources: &'a [Source],
    emits: &'a Option<String>,
}

impl Judged<'_> {
    fn verdict(&self, part: Part) -> Verdict {
        let found: Result<String, String> = match part {
            Part::CircleCircle => self.contact("two circles", |a, b| a.circles() && b.circles()),
            Part::CircleBox => self.contact("circle and box", |a, b| {
                a.circles() && b.boxes() || a.boxes() && b.circles()
            }),
            Part::BoxBox => self.contact("two boxes", |a, b| a.boxes() && b.boxes()),
            Part::Friction => self.material("friction", |def| def.friction, |by| by.friction),
            Part::Restitution => {
                self.material("restitution", |def| def.restitution, |by| by.restitution)
            }
            Part::Kinematic => self.kinematic(),
            Part::Continuous => self.continuous(),
            Part::Forces => self.forces(),
            Part::Sleeping => match self.scene.sleeping {
                true => Ok("sleeping = true, the default of the conjugate solver".to_owned()),
                false => Err("sleeping = false, the default of other solvers".to_owned()),
            },
            Part::Particles => self.emits.clone().ok_or_else(|| {
                "no emitters, no \"spray\" in tools, no pack with a burst".to_owned()
            }),
            Part::Obstacles => self.obstacles(),
            Part::Emitters => match self.scene.emitters.len() {
                0 => Err("emitters has no entry".to_owned()),
                count => Ok(format!("emitters has {count}")),
            },
            Part::Moves => self.moves(),
            Part::Impacts => self.impacts(),
            Part::PackHits => self.pack_hits(),
        };
        let used = found.is_ok();
        let (Ok(why) | Err(why)) = found;
        Verdict { part, used, why }
    }

    fn contact(
        &self,
        what: &str,
        wanted: impl Fn(&Source, &Source) -> bool,
    ) -> Result<String, String> {
        match meeting(self.scene, self.sources).find(|(a, b)| wanted(a, b)) {
            Some((a, b)) => Ok(format!("{} meets {} by pairs", a.field, b.field)),
            None => Err(format!("no {what} meet by pairs")),
        }
    }

    /// By the rule of [`Features`].
    fn material(
        &self,
        name: &str,
        of: impl Fn(&BodyDef) -> f32,
        brought: impl Fn(Features) -> bool,
    ) -> Result<String, String> {
        if self.scene.solver.is_none() {
            return Err("response is \"none\": contacts are only found".to_owned());
        }
        let has = |source: &&Source| brought(Features::of(&source.def));
        match self.sources.iter().find(has) {
            Some(source) => Ok(format!("{} has {name} {}", source.field, of(&source.def))),
            None => Err(format!("{name} is 0 for every body that can be pushed")),
        }
    }

    fn kinematic(&self) -> Result<String, String> {
        let moved = |source: &&Source| source.def.motion == Motion::Kinematic;
        match self.sources.iter().find(moved) {
            Some(source) => Ok(format!("{} has a path or motion \"kinematic\"", source.field)),
            None => Err("no path and no motion \"kinematic\" in bodies".to_owned()),
        }
    }

    /// Two bodies at the speed cap must not be able to move by more than the smaller's half-size.
    fn continuous(&self) -> Result<String, String> {
        if !matches!(self.scene.solver, Some(Solver::Conjugate(_))) {
            return Err("solver is not \"conjugate\": contacts are overlaps".to_owned());
        }
        let path = 2.0 * self.scene.speed_max * crate::DT;
        let size = |source: &Source| {
            let halves = source.shapes.iter().map(Shape::half_extent);
            halves.fold(f32::INFINITY, |least, half| min(least, min(half.x, half.y)))
        };
        let mut smallest: Option<(&Source, f32)> = None;
        for source in self.sources {
            let size = size(source);
            if smallest.is_none_or(|(_, least)| size < least) {
                smallest = Some((source, size));
            }
        }
        match smallest {
            Some((source, half)) if path > half => Ok(format!(
                "speed_max {} closes {path} a step; {} has a half-size of {half}",
                self.scene.speed_max, source.field
            )),
            _ => Err(format!("speed_max {} closes {path} a step at most", self.scene.speed_max)),
        }
    }

    fn forces(&self) -> Result<String, String> {
        let dragged = |source: &&Source| source.def.drag != Drag::NONE;
        match self.sources.iter().find(dragged) {
            Some(source) => Ok(format!("{} has drag", source.field)),
            None if !self.scene.springs.is_empty() => Ok("springs[0]".to_owned()),
            None => Err("no springs, and drag is 0 for every body".to_owned()),
        }
    }

    fn obstacles(&self) -> Result<String, String> {
        if self.emits.is_none() {
            return Err("no particles".to_owned());
        }
        let pushes = |source: &&Source| self.scene.meets_particles >> source.def.group & 1 == 1;
        match self.sources.iter().find(pushes) {
            Some(source) => {
                let group = &self.scene.groups[usize::from(source.def.group)];
                Ok(format!("particles_meet has \"{group}\", as of {}", source.field))
            }
            None => Err("particles_meet has no group with bodies".to_owned()),
        }
    }

    fn moves(&self) -> Result<String, String> {
        let moves = |source: &&Source| source.def.motion != Motion::Static;
        match self.sources.iter().find(moves) {
            Some(source) => Ok(format!("{} is not static", source.field)),
            None => Err("every body is static".to_owned()),
        }
    }

    fn impacts(&self) -> Result<String, String> {
        if self.scene.solver.is_none() {
            return Err("response is \"none\": contacts are only found".to_owned());
        }
        match meeting(self.scene, self.sources).next() {
            Some(_) => Ok(format!("impact_speed is {}", self.scene.impact_speed)),
            None => Err("no two groups with bodies meet by pairs".to_owned()),
        }
    }

    fn pack_hits(&self) -> Result<String, String> {
        if !self.scene.tools.contains(Tools::LAUNCH) {
            return Err("no \"launch\" in tools".to_owned());
        }
        match self.sources.iter().find(|source| source.kind == Kind::Hero) {
            Some(hero) => Ok(format!("tools has \"launch\", and {} can be hit", hero.field)),
            None => Err("no hero in the scene".to_owned()),
        }
    }
}
