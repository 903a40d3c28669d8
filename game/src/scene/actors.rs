//! Heroes, minions, marbles, dye packs and emitters in a scene file.

use super::drag;
use super::groups::Groups;
use super::kind::Kind;
use super::launchers;
use super::limits::SPEED_MAX;
use super::recipes::Recipes;
use super::rules::{self, Names, SECONDS, ticks};
use super::spec::{HeroSpec, MarbleSpec, PackSpec, Placed, ScheduledEmitter, WalkSpec};
use super::springs::location;
use super::table::{POSITION, Range, Table};
use super::tools::Tools;
use super::traits::{Kinds, Traits};
use glam::Vec2;
use jostle_sim::{BodyDef, Drag};

const SPEED: Range = Range::from(0.0, SPEED_MAX);
const SPAWNS_MAX: usize = 256;
const TICKS_MAX: u32 = 1_000_000;

/// The actors of a scene, as far as the file has them, without their caps.
pub(super) struct Actors {
    pub kinds: Kinds,
    pub hero: Option<HeroSpec>,
    pub minion_recovery: f32,
    pub marble: Option<MarbleSpec>,
    pub pack: Option<PackSpec>,
}

/// Reads `[hero]`, `[minion]`, `[dumb]` and `[pack]`.
pub(super) fn actors(root: &Table, tools: Tools, groups: &Groups, recipes: &mut Recipes) -> Actors {
    let drag = drag::drag(&root.get("drag"), Drag::NONE);
    let traits = |kind, table: &Table| Traits::of(kind, drag).changed_by(table, groups);
    let field = root.get("hero");
    let hero = field.is_given().then(|| {
        field.table(|table| {
            let traits = traits(Kind::Hero, table);
            (traits, read_hero(table, &traits, groups))
        })
    });
    let (hero_traits, hero_spec) = hero.unzip();
    let (minion, minion_recovery) = root.get("minion").table(|table| {
        let mut traits = traits(Kind::Minion, table);
        traits.speed = table.get("speed").number(traits.speed, SPEED);
        (traits, table.get("recovery").number(30.0, Range::from(0.0, 1.0e5)))
    });
    let (marble_traits, marble) = root.get("dumb").table(|table| {
        let mut traits = traits(Kind::Marble, table);
        traits.speed = table.get("speed").number(traits.speed, SPEED);
        let spec =
            || MarbleSpec { body: traits.def(table, groups), speed: traits.speed, count_max: 0 };
        let is_made = tools.contains(Tools::MARBLE) || launchers::make(root, Kind::Marble);
        (traits, is_made.then(spec))
    });
    let field = root.get("pack");
    let is_launched = tools.contains(Tools::LAUNCH) || launchers::make(root, Kind::Pack);
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
        // Keys hold it on the ground; friction would hold it on walls that it runs against.
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

/// `walk`, beside which there is no thrust.
fn walk(table: &Table) -> Option<WalkSpec> {
    let field = table.get("walk");
    if !field.is_given() {
        return None;
    }
    for field in ["thrust", "speed_max"].map(|name| table.get(name)) {
        if field.is_given() {
            field.refuse("nothing: a hero that walks has no thrust");
        }
    }
    let speed = Range::above(0.0, SPEED_MAX);
    Some(field.table_or("{ speed = 25, jump = 40 }", |walk| WalkSpec {
        speed: walk.need("speed", "its speed along the ground").number(1.0, speed),
        jump: walk.need("jump", "its speed upwards").number(1.0, speed),
    }))
}

fn read_pack(table: &Table, body: BodyDef, recipes: &mut Recipes) -> PackSpec {
    let share = Range::from(0.0, 1.0);
    let throw_every = table.get("throw_every");
    PackSpec {
        body,
        speed: table.get("speed").number(30.0, Range::from(-SPEED_MAX, SPEED_MAX)),
        turn: table.get("turn").number(0.8, share),
        life_ticks: table.get("life_ticks").whole(300, 1..=TICKS_MAX),
        drift: table.get("drift").number(0.9, share),
        burst: table.get("burst").whole(200, 0..=u32::from(u16::MAX)) as u16,
        recipe: recipes.index(&table.get("recipe"), "explosion"),
        throw_every: throw_every.is_given().then(|| ticks(throw_every.number(0.6, SECONDS)).max(1)),
        push: table.get("push").number(0.0, SPEED),
        count_max: 0,
    }
}

/// Reads one entry of `emitters`.
pub(super) fn emitter(
    table: &Table,
    bodies: &[Placed],
    names: &Names,
    recipes: &mut Recipes,
) -> ScheduledEmitter {
    let recipe = table.need("recipe", "the name of a recipe");
    let location = location(table, bodies);
    let every = table.get("every");
    ScheduledEmitter {
        recipe: recipes.index(&recipe, "fire"),
        count: table.need("count", "particles each time").whole(1, 1..=10_000) as u16,
        start: table.get("start").whole(0, 0..=TICKS_MAX),
        every: every.is_given().then(|| every.whole(1, 1..=TICKS_MAX)),
        location,
        condition: names.any_condition(&table.get("while")),
    }
}
