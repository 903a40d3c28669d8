//! Heroes, minions, marbles and dye packs in a scene file.

use super::groups::Groups;
use super::kind::Kind;
use super::limits::{SPEED_MAX, TICKS_MAX};
use super::recipes::Recipes;
use super::rules::{self, LaneAxis};
use super::sources;
use super::table::{POSITION, Range, SECONDS, Table};
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
    /// Where heroes appear, tried in turn from the seat's own; clear of static and kinematic bodies.
    pub spawns: Vec<Vec2>,
    /// Acceleration with A and D, and with W and S.
    pub thrust: Vec2,
    /// Speed beyond which thrust adds nothing.
    pub speed_max: f32,
    /// Instead of thrust: A and D run at this speed along what the hero stands on, and W jumps off it at this speed,
    /// both above 0, at most 10000; needs gravity that pulls down. The default of `friction` is then 0. Default: heroes fly.
    pub walk: Option<WalkSpec>,
    /// The only axis along which heroes move. Default: none.
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
    /// Initial speed to either side.
    pub speed: f32,
    /// Maximum number of marbles at a time, beyond which Z makes no more.
    pub count_max: u32,
}

/// Packs of dye thrown by players. Times are ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct PackSpec {
    /// The body, at the origin.
    pub body: BodyDef,
    /// Speed by its own drive.
    pub speed: f32,
    /// Share of the angle to its target by which it turns in a tick, however small; the chapter's packs stop turning within
    /// 0.08 degrees.
    pub turn: f32,
    /// Ticks until it is gone.
    pub life_ticks: u32,
    /// Share of the velocity from a bounce that remains after a tick.
    pub drift: f32,
    /// Particles when it hits a hero.
    pub burst: u16,
    /// Recipe of these particles. Default: `"explosion"`.
    pub recipe: u8,
    /// Players throw packs from their heroes towards the pointer, as long as the button is down, with at least this time from
    /// one to the next; without it a click launches one at the pointer. A thrown pack never hits its owner.
    /// Default: not thrown.
    pub throw_every: Option<u32>,
    /// Speed that a hit adds to the hero, along the pack's own motion.
    pub push: f32,
    /// Maximum number of packs of a player at a time.
    pub count_max: u32,
}

/// The actors defined in a scene file, without their caps.
pub(super) struct Actors {
    pub kinds: Kinds,
    pub hero: Option<HeroSpec>,
    pub minion_recovery: f32,
    pub marble: Option<MarbleSpec>,
    pub pack: Option<PackSpec>,
}

/// Reads `[hero]`, `[minion]`, `[dumb]` and `[pack]`.
pub(super) fn actors(root: &Table, tools: Tools, groups: &Groups, recipes: &mut Recipes) -> Actors {
    // Slows down all dynamic bodies: see [Drag and wind](#drag-and-wind). Default: none.
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
        // The keys hold the hero on the ground; friction would make it stick to walls that it runs against.
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

/// The traits of minions, and their acceleration back to their speed.
fn read_minion(table: &Table, mut traits: Traits) -> (Traits, f32) {
    // Wander speed.
    traits.start_speed = table.get("speed").number(traits.start_speed, SPEED);
    // Acceleration back to the wander speed, or to rest, after a bounce. A lighter dye pack does not change the minion's
    // heading.
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
