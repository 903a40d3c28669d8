//! A checked scene: plain data, ready to be played.

use super::kind::Kind;
use super::path::Path;
use super::rules::{Condition, LaneAxis, RuleSet};
use super::tools::Tools;
use glam::Vec2;
use jostle_sim::{Aabb, BodyDef, Drag, EmitterDef, Shape, Source, WorldSettings};

/// Where a lobby shows a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// With what can be won.
    Games,
    /// With what is there to play around in.
    Playgrounds,
    /// With what teaches one thing each.
    Book,
}

impl Category {
    /// Every category with its word in scene files.
    pub const NAMES: [(&str, Category); 3] = [
        ("games", Category::Games),
        ("playgrounds", Category::Playgrounds),
        ("book", Category::Book),
    ];

    /// Its word in scene files.
    pub fn name(self) -> &'static str {
        Category::NAMES.iter().find(|(_, category)| *category == self).map_or("", |(name, _)| name)
    }
}

/// Framing of the world by the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Camera {
    /// The whole world fits the view, but on an upright screen, where that would make everything tiny, the view moves
    /// sideways with the own hero.
    Fit,
    /// The whole world fits every view.
    Whole,
    /// The view follows the own hero and is this many world units high.
    Follow {
        /// Height of the view, world units.
        height: f32,
    },
}

impl Camera {
    /// Whether all of the world is sent to everybody.
    pub fn sees_all(self) -> bool {
        !matches!(self, Camera::Follow { .. })
    }
}

/// A scene whose values have all been checked.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name: the file's stem, the word in links; lower case, digits and dashes.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// One sentence for the lobby.
    pub about: String,
    /// Where a lobby shows it.
    pub category: Category,
    /// The TOML text that it was made from.
    pub source: String,
    /// The world spans (0, 0) to this, world units.
    pub size: Vec2,
    /// The settings of its World, but for the features: see [`Scene::world_settings`].
    pub world: WorldSettings,
    /// Names of the collision groups.
    pub groups: Vec<String>,
    /// Tools that players have.
    pub tools: Tools,
    /// Framing of the world by the camera.
    pub camera: Camera,
    /// Closing speed above which a contact is reported, units/s.
    pub impact_speed: f32,
    /// Players at a time.
    pub players_max: u16,
    /// Recipe of the particles that Z sprays, with the spray tool.
    pub spray: Option<u8>,
    /// Bodies at fixed positions.
    pub bodies: Vec<Placed>,
    /// Bodies at positions that the seed decides.
    pub layouts: Vec<Layout>,
    /// Springs between bodies at fixed positions.
    pub springs: Vec<PlacedSpring>,
    /// Emitters that start by themselves.
    pub emitters: Vec<ScheduledEmitter>,
    /// Dots that are drawn on the wall.
    pub marks: Vec<Mark>,
    /// What makes packs and marbles by itself.
    pub launchers: Vec<Launcher>,
    /// The players' heroes; `None` where players have none.
    pub hero: Option<HeroSpec>,
    /// Acceleration of a minion back to its wander speed, units/s^2.
    pub minion_recovery: f32,
    /// Marbles that Z makes, with that tool.
    pub marble: Option<MarbleSpec>,
    /// Dye packs, with the launch tool.
    pub pack: Option<PackSpec>,
    /// While this holds, the solver is the chapter's as it is printed.
    pub listed: Option<Condition>,
    /// The sling, with that tool.
    pub sling: Option<SlingSpec>,
    /// Rounds, teams, zones, signals and rules; empty in a plain playground.
    pub rules: RuleSet,
}

impl Scene {
    /// The emitter that one of the scene's starts with the seed of this time; `None` if there is none
    /// with this index, or if it follows a body.
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

    /// Returns whether it has rules, so that bodies come and go and its clock begins again.
    pub fn is_game(&self) -> bool {
        !self.rules.is_empty()
            || self.has_conditions()
            || self.sling.is_some()
            || self.has_breakables()
    }

    /// Returns whether it is a game, or its heroes remember where they belong.
    pub(crate) fn has_rules(&self) -> bool {
        self.is_game() || self.lane(None).is_some()
    }

    /// The axis that the heroes of a team stay on.
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

    /// Returns whether points are given for anything.
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
}

/// A body at a fixed position.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// Kind of the bodies.
    pub kind: Kind,
    /// Definition of each body.
    pub def: BodyDef,
    /// Speed at which it sets off to either side, units/s; 0 where the file gives a velocity.
    pub start_speed: f32,
    /// Name by which emitters follow it.
    pub name: Option<String>,
    /// The path of a kinematic body.
    pub path: Option<Path>,
    /// It is there only while this holds.
    pub presence: Condition,
    /// It moves along its path only while this holds.
    pub runs: Condition,
    /// The impact that breaks it, if one can.
    pub breaks: Option<Breakable>,
}

/// Bodies in a grid: at positions that the seed decides, clear of each other and of all fixed ones,
/// or exactly at the centres of its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Kind of the bodies.
    pub kind: Kind,
    /// The body, at the origin.
    pub def: BodyDef,
    /// As in [`Placed`].
    pub start_speed: f32,
    /// One of these is drawn for each body.
    pub shapes: Vec<Shape>,
    /// Number of bodies; those that find no free position are left out.
    pub count: u32,
    /// Region of the centres.
    pub area: Aabb,
    /// Columns and rows into which the area is cut; bodies take the cells in turn.
    pub grid: [u32; 2],
    /// Free space around each, world units; unused by an exact layout.
    pub gap: f32,
    /// Whether body number n is at the centre of cell number n, counted from the lower left, row by
    /// row. An exact layout has at most as many bodies as cells.
    pub exact: bool,
}

impl Layout {
    /// The cell of its grid that its body number `number` belongs to.
    pub fn cell(&self, number: u32) -> Aabb {
        let [columns, rows] = self.grid;
        let number = number % (columns * rows);
        let size = (self.area.high - self.area.low) / Vec2::new(columns as f32, rows as f32);
        let corner = Vec2::new((number % columns) as f32, (number / columns) as f32) * size;
        let low = self.area.low + corner;
        Aabb { low, high: low + size }
    }

    /// Centre of that cell.
    pub fn cell_center(&self, number: u32) -> Vec2 {
        let cell = self.cell(number);
        (cell.low + cell.high) * 0.5
    }
}

/// A spring between a body and another or a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSpring {
    /// Entry of [`Scene::bodies`] that it holds.
    pub body: usize,
    /// The end that is not at the body.
    pub to: Location,
    /// Length at rest, world units.
    pub length: f32,
    /// Force a unit of length.
    pub stiffness: f32,
    /// Force against a unit of speed.
    pub damping: f32,
}

/// Heroes, one for each player.
#[derive(Clone, Debug, PartialEq)]
pub struct HeroSpec {
    /// The body, at the origin.
    pub body: BodyDef,
    /// Acceleration by A and D on x and by W and S on y, units/s^2.
    pub thrust: Vec2,
    /// Speed past which thrust adds nothing, units/s.
    pub speed_max: f32,
    /// How they run and jump; `None` where they fly.
    pub walk: Option<WalkSpec>,
    /// The axis that they stay on, unless their team has one.
    pub lane: Option<LaneAxis>,
    /// Spawn points, tried from the seat's own on.
    pub spawns: Vec<Vec2>,
}

/// How heroes run and jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkSpec {
    /// Speed along what they stand on, units/s.
    pub speed: f32,
    /// Speed upwards at the start of a jump, units/s.
    pub jump: f32,
}

/// Marbles that players make.
#[derive(Clone, Debug, PartialEq)]
pub struct MarbleSpec {
    /// The body, at the origin.
    pub body: BodyDef,
    /// Speed at which they set off to either side, units/s.
    pub speed: f32,
    /// Most at a time, beyond which Z makes no more.
    pub count_max: u32,
}

/// Packs of dye, which players throw.
#[derive(Clone, Debug, PartialEq)]
pub struct PackSpec {
    /// The body, at the origin.
    pub body: BodyDef,
    /// Own speed, units/s.
    pub speed: f32,
    /// Share of the angle to the target that is turned a tick, 0..=1.
    pub turn: f32,
    /// Life, ticks.
    pub life_ticks: u32,
    /// Share of a change of velocity by a contact that is left after a tick, 0..1.
    pub drift: f32,
    /// Particles of the burst.
    pub burst: u16,
    /// Recipe of the burst.
    pub recipe: u8,
    /// Players throw packs from their heroes towards the pointer, with at least so many ticks from one to
    /// the next; `None`: they launch packs at the pointer.
    pub throw_every: Option<u32>,
    /// Speed that a burst adds to the hero, along the pack's own motion, units/s.
    pub push: f32,
    /// Most of one player at a time.
    pub count_max: u32,
}

/// A position in a scene file: the end of a spring, or where an emitter is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Location {
    /// A fixed point, world units.
    Point(Vec2),
    /// The centre of this entry of [`Scene::bodies`].
    Body(usize),
}

/// An emitter that starts by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduledEmitter {
    /// Index into the recipes.
    pub recipe: u8,
    /// Particles of one burst.
    pub count: u16,
    /// Tick of the first time.
    pub start: u32,
    /// Ticks from one time to the next; `None` runs once.
    pub every: Option<u32>,
    /// Where it is, fixed or with a body.
    pub location: Location,
    /// It starts only while this holds.
    pub condition: Condition,
}

impl ScheduledEmitter {
    /// Returns whether it starts in the tick with this number, from 0.
    pub fn starts_at(&self, tick: u32) -> bool {
        match self.every {
            Some(every) => tick >= self.start && (tick - self.start).is_multiple_of(every),
            None => tick == self.start,
        }
    }

    /// The emitter that it starts.
    pub fn emitter(&self, source: Source, seed: u32) -> EmitterDef {
        EmitterDef { recipe: self.recipe, count: self.count, seed, source }
    }
}

/// Makes a body at regular intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Launcher {
    /// What it makes: a pack or a marble.
    pub makes: Kind,
    /// Where it is, fixed or with a body.
    pub location: Location,
    /// A marble's velocity, units/s; the direction in which a pack sets off, by default the one to its
    /// target.
    pub velocity: Option<Vec2>,
    /// Tick of the first one.
    pub start: u32,
    /// Ticks from one to the next.
    pub every: u32,
    /// It waits while so many bodies that launchers made are there.
    pub limit: u32,
    /// It works only while this holds.
    pub condition: Condition,
}

impl Launcher {
    /// Returns whether it is due in the tick with this number, from 0.
    pub fn is_due(&self, tick: u32) -> bool {
        tick >= self.start && (tick - self.start).is_multiple_of(self.every)
    }
}

/// A sling: players pull its ball back and let go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlingSpec {
    /// Entry of [`Scene::bodies`] that it shoots.
    pub ball: usize,
    /// How far the ball can be pulled from its start, world units.
    pub pull: f32,
    /// Speed of the ball for each unit that it was pulled, units/s.
    pub speed: f32,
    /// Shots in a round.
    pub shots: u8,
    /// A shot is over when this comes to hold.
    pub over: Option<Condition>,
    /// And after so many ticks in any case.
    pub over_time: u32,
    /// Points to the winners for each shot that is left.
    pub spare: i32,
}

/// What breaks a body, and what that is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakable {
    /// The largest blow that it survives, units of mass times units/s; it cracks above half of it.
    pub strength: f32,
    /// Points for who broke it.
    pub points: i32,
    /// Recipe of the particles that are left of it.
    pub splash: Option<u8>,
}

impl SlingSpec {
    /// The velocity with which the ball sets off from where it was pulled to, by the way from its start;
    /// `None` if that is so short that nobody can have meant it.
    pub fn launch(&self, pull: Vec2) -> Option<Vec2> {
        const MEANT: f32 = 1.0;
        (pull.length() >= MEANT).then(|| pull * -self.speed)
    }
}

/// Dots on the wall, as on dice. Nothing but the page knows them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Centre, in world units.
    pub position: Vec2,
    /// How many dots, 1 to 6.
    pub dots: u8,
    /// Width and height, world units.
    pub size: f32,
    /// Entry of [`Scene::bodies`] in whose light alone it is seen.
    pub lamp: Option<usize>,
    /// How far that light reaches, world units.
    pub reach: f32,
}
