//! Heroes, minions, marbles and dye packs in a scene file.

use super::field::{POSITION, Range, SECONDS};
use super::groups::Groups;
use super::kind::Kind;
use super::limits::{SPEED_MAX, TICKS_MAX};
use super::recipes::Recipes;
use super::rules::{self, LaneAxis};
use super::sources;
use super::table::Table;
use super::tools::Tools;
use super::traits::{Kinds, Traits, drag};
use glam::Vec2;
use jostle_sim::{BodyDef, Drag};

const SPEED: Range = Range::from(0.0, SPEED_MAX);
const SPAWNS_MAX: usize = 256;

/// Heroes, one for each player.
#[derive(Clone, Debug, PartialEq)]
pub struct HeroSpec {
    /// Definition of the body, at the origin.
    pub body: BodyDef,
    /// Where heroes appear. Each seat has its own point and tries the others after it; all must be clear of static and
    /// kinematic bodies.
    pub spawns: Vec<Vec2>,
    /// Acceleration from A and D, and from W and S. Label: Thrust.
    pub thrust: Vec2,
    /// Speed above which thrust does not accelerate the hero any further. Label: Top speed.
    pub speed_max: f32,
    /// Replaces thrust: A and D make the hero run at `speed` along whatever it stands on, and W makes it jump off at
    /// `jump`, both above 0 and at most 10000. Requires gravity that pulls down, and makes `friction` default to 0.
    /// Default: heroes fly.
    pub walk: Option<WalkSpec>,
    /// The only axis along which heroes move. Default: none. Label: Moves only along, for experts.
    pub lane: Option<LaneAxis>,
}

/// How heroes run and jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkSpec {
    /// Speed along the ground, units/s.
    pub speed: f32,
    /// Upward speed at the start of a jump, units/s.
    pub jump: f32,
}

/// Marbles that players make.
#[derive(Clone, Debug, PartialEq)]
pub struct MarbleSpec {
    /// Definition of the body, at the origin.
    pub body: BodyDef,
    /// Initial speed, to the left or right at random.
    pub speed: f32,
    /// Maximum number of marbles at any time; at this limit, Z makes no more.
    pub count_max: u32,
}

/// Dye packs that players launch or throw. Times are in ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct PackSpec {
    /// The body, at the origin.
    pub body: BodyDef,
    /// Speed of its own motion.
    pub speed: f32,
    /// Share of the angle to its target by which it turns in each tick, however small; the chapter's packs stop turning
    /// once they are within 0.08 degrees.
    pub turn: f32,
    /// Ticks until it disappears.
    pub life_ticks: u32,
    /// Share of the velocity gained in a bounce that remains after each tick.
    pub drift: f32,
    /// Number of particles when it hits a hero.
    pub burst: u16,
    /// Recipe of these particles. Default: `"explosion"`.
    pub recipe: u8,
    /// If given, players throw packs from their heroes towards the pointer for as long as the button is down, with at
    /// least this much time between throws; otherwise a click launches a pack at the pointer. A thrown pack never hits
    /// its owner. Default: not thrown.
    pub throw_every: Option<u32>,
    /// Speed that a hit adds to the hero, in the direction of the pack's own motion.
    pub push: f32,
    /// Maximum number of packs that a player can have at any time.
    pub count_max: u32,
}

/// The actors defined in a scene file, without their limits.
pub(super) struct Actors {
    pub kinds: Kinds,
    pub hero: Option<HeroSpec>,
    pub minion_recovery: f32,
    pub marble: Option<MarbleSpec>,
    pub pack: Option<PackSpec>,
}

/// Reads `[hero]`, `[minion]`, `[dumb]` and `[pack]`.
pub(super) fn actors(root: &Table, tools: Tools, groups: &Groups, recipes: &mut Recipes) -> Actors {
    // Slows down all dynamic bodies; see [Drag and wind](#drag-and-wind). Default: none. Label: Air drag, for experts.
    let drag = drag(&root.get("drag"), Drag::NONE);
    let traits = |kind, table: &Table| Traits::of(kind, drag).changed_by(table, groups);
    let hero = root.get("hero").given(|field| {
        field.table(|table| {
            let traits = traits(Kind::Hero, table);
            (traits, read_hero(table, &traits, groups))
        })
    });
    let (hero_traits, hero_spec) = hero.unzip();
    let minion = |table: &Table| read_minion(table, traits(Kind::Minion, table));
    let (minion, minion_recovery) = root.get("minion").table(minion);
    let (marble_traits, marble) = root.get("dumb").table(|table| {
        let mut traits = traits(Kind::Marble, table);
        let speed = table.get("speed").number(traits.start_speed, SPEED);
        traits.start_speed = speed;
        let spec = || MarbleSpec { body: traits.def(table, groups), speed, count_max: 0 };
        let is_made = tools.contains(Tools::MARBLE) || sources::make(root, Kind::Marble);
        (traits, is_made.then(spec))
    });
    let field = root.get("pack");
    let is_launched = tools.contains(Tools::LAUNCH) || sources::make(root, Kind::Pack);
    let has_packs = field.is_given() || is_launched;
    let pack = has_packs.then(|| {
        field.table(|table| read_pack(table, traits(Kind::Pack, table).def(table, groups), recipes))
    });
    let hero = hero_traits.unwrap_or(Traits::of(Kind::Hero, drag));
    let kinds = Kinds { drag, hero, minion, marble: marble_traits };
    Actors { kinds, hero: hero_spec, minion_recovery, marble, pack }
}

fn read_hero(table: &Table, traits: &Traits, groups: &Groups) -> HeroSpec {
    let thrust = table.get("thrust").vector(Vec2::new(60.0, 120.0), Range::from(0.0, 1.0e4));
    let speed_max = table.get("speed_max").number(80.0, Range::above(0.0, SPEED_MAX));
    let spawns = table.need("spawns", "a list of points [x, y]");
    let spawns = spawns.some_items(1..=SPAWNS_MAX, &format!("1 to {SPAWNS_MAX} points [x, y]"));
    let walk = walk(table);
    let mut body = traits.def(table, groups);
    if walk.is_some() && !table.get("friction").is_given() {
        // The keys keep the hero in place on the ground, and friction would make it stick to walls that it runs into.
        body.friction = 0.0;
    }
    HeroSpec {
        body,
        thrust,
        speed_max,
        walk,
        lane: rules::lane(table),
        spawns: spawns.iter().map(|item| item.vector(Vec2::ZERO, POSITION)).collect(),
    }
}

/// Reads the traits of minions, and the acceleration that returns them to their wander speed.
fn read_minion(table: &Table, mut traits: Traits) -> (Traits, f32) {
    // Wander speed.
    traits.start_speed = table.get("speed").number(traits.start_speed, SPEED);
    // Acceleration with which it returns to its wander speed, or to rest, after a bounce. A lighter dye pack does not
    // change the minion's heading.
    let recovery = table.get("recovery").number(30.0, Range::from(0.0, 1.0e5));
    (traits, recovery)
}

/// Reads `walk`, which excludes thrust.
fn walk(table: &Table) -> Option<WalkSpec> {
    table.get("walk").given(|field| {
        for field in ["thrust", "speed_max"].map(|name| table.get(name)) {
            field.refuse_if_given("nothing: a hero that walks has no thrust");
        }
        let speed = Range::above(0.0, SPEED_MAX);
        field.table_or("{ speed = 25, jump = 40 }", |walk| WalkSpec {
            speed: walk.need("speed", "its speed along the ground").number(1.0, speed),
            jump: walk.need("jump", "its speed upwards").number(1.0, speed),
        })
    })
}

fn read_pack(table: &Table, body: BodyDef, recipes: &mut Recipes) -> PackSpec {
    let share = Range::from(0.0, 1.0);
    PackSpec {
        body,
        speed: table.get("speed").number(30.0, Range::from(-SPEED_MAX, SPEED_MAX)),
        turn: table.get("turn").number(0.8, share),
        life_ticks: table.get("life_ticks").whole(300, 1..=TICKS_MAX),
        drift: table.get("drift").number(0.9, share),
        burst: table.get("burst").whole(200, 0..=u32::from(u16::MAX)) as u16,
        recipe: recipes.index(&table.get("recipe"), "explosion"),
        throw_every: table.get("throw_every").given(|field| field.ticks(0.6, SECONDS).max(1)),
        push: table.get("push").number(0.0, SPEED),
        count_max: 0,
    }
}
