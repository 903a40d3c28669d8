//! What a scene file says about those who act: heroes, minions, dye packs, emitters.

use super::bodies::{Kinds, PLACE, Traits, VELOCITY};
use super::document::{Field, Range, Table};
use super::forces;
use super::groups::Groups;
use super::recipes::Recipes;
use super::{Kind, Placed, SPEED_MAX, SceneError, Tools};
use crate::forces::Drag;
use crate::particle::{EmitterDef, Source};
use crate::world::BodyDef;
use glam::Vec2;

/// Heroes of players.
#[derive(Clone, Debug, PartialEq)]
pub struct HeroSpec {
    /// The body, at the origin.
    pub body: BodyDef,
    /// Acceleration by A and D on x and by W and S on y, units/s^2.
    pub thrust: Vec2,
    /// Speed past which thrust adds nothing, units/s.
    pub speed_max: f32,
    /// Where heroes appear, tried from the seat's own on.
    pub spawns: Vec<Vec2>,
}

/// How minions wander.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinionSpec {
    /// Wander speed of minions without a velocity of their own, units/s.
    pub speed: f32,
    /// How fast a minion returns to its wander speed, units/s^2.
    pub recovery: f32,
}

/// Dye packs.
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
    /// Share of what a contact changed of the velocity that is left after a tick, 0..1.
    pub drift: f32,
    /// Particles of the burst.
    pub burst: u16,
    /// Recipe of the burst.
    pub recipe: u8,
}

/// Where an emitter of the scene stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A point.
    Point(Vec2),
    /// The centre of this entry of [`super::Scene::bodies`].
    Body(usize),
}

/// An emitter that runs by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeater {
    /// Index into the recipes.
    pub recipe: u8,
    /// Particles each time.
    pub count: u16,
    /// Tick of the first time.
    pub start: u32,
    /// Ticks from one time to the next; `None` runs once.
    pub every: Option<u32>,
    /// Where.
    pub place: Place,
}

impl Repeater {
    /// Whether it starts in the tick with this number, from 0.
    pub fn starts_at(&self, tick: u32) -> bool {
        match self.every {
            Some(every) => tick >= self.start && (tick - self.start).is_multiple_of(every),
            None => tick == self.start,
        }
    }

    /// The emitter that it starts at a place.
    pub fn at(&self, point: Vec2, seed: u32) -> EmitterDef {
        EmitterDef { recipe: self.recipe, count: self.count, seed, source: Source::Point(point) }
    }
}

const HERO_FIELDS: &[&str] = &[
    "radius",
    "size",
    "mass",
    "restitution",
    "friction",
    "gravity_scale",
    "drag",
    "group",
    "thrust",
    "speed_max",
    "spawns",
];
const MINION_FIELDS: &[&str] = &[
    "radius",
    "size",
    "mass",
    "restitution",
    "friction",
    "gravity_scale",
    "drag",
    "group",
    "speed",
    "recovery",
];
const DUMB_FIELDS: &[&str] = &[
    "radius",
    "size",
    "mass",
    "restitution",
    "friction",
    "gravity_scale",
    "drag",
    "group",
    "speed",
];
const PACK_FIELDS: &[&str] = &[
    "radius",
    "size",
    "mass",
    "restitution",
    "friction",
    "gravity_scale",
    "drag",
    "group",
    "speed",
    "turn",
    "life_ticks",
    "drift",
    "burst",
    "recipe",
];
const EMITTER_FIELDS: &[&str] = &["recipe", "position", "follow", "count", "start", "every"];
const SPAWNS_MAX: usize = 256;
const TICKS_MAX: u32 = 1_000_000;

/// All that acts, as far as the file has it.
pub(super) struct Actors {
    pub kinds: Kinds,
    pub hero: Option<HeroSpec>,
    pub minion: MinionSpec,
    pub dumb: Option<BodyDef>,
    pub dumb_speed: f32,
    pub pack: Option<PackSpec>,
}

/// Reads `[hero]`, `[minion]`, `[dumb]` and `[pack]`.
pub(super) fn actors(
    root: &Table,
    tools: Tools,
    groups: &Groups,
    recipes: &mut Recipes,
) -> Result<Actors, SceneError> {
    let hero = root.table("hero", HERO_FIELDS)?;
    let minion = table_or_empty(root, "minion", MINION_FIELDS)?;
    let dumb = table_or_empty(root, "dumb", DUMB_FIELDS)?;
    let drag = forces::drag(root, Drag::NONE)?;
    let kinds = Kinds {
        drag,
        hero: match &hero {
            Some(table) => Traits::of(Kind::Hero, drag).changed_by(table, groups)?,
            None => Traits::of(Kind::Hero, drag),
        },
        minion: Traits::of(Kind::Minion, drag).changed_by(&minion, groups)?,
        dumb: Traits::of(Kind::Dumb, drag).changed_by(&dumb, groups)?,
    };
    let made = tools.contains(Tools::DUMB);
    let speed = Range::from(0.0, SPEED_MAX);
    Ok(Actors {
        hero: hero.map(|table| hero_spec(&table, kinds.hero, groups)).transpose()?,
        minion: MinionSpec {
            speed: minion.number("speed", 5.0, speed)?,
            recovery: minion.number("recovery", 30.0, Range::from(0.0, 1.0e5))?,
        },
        dumb: made.then(|| kinds.dumb.def(&dumb, groups)).transpose()?,
        dumb_speed: dumb.number("speed", 5.0, speed)?,
        pack: pack(root, tools, groups, recipes, drag)?,
        kinds,
    })
}

pub(super) fn table_or_empty<'a>(
    root: &Table<'a>,
    name: &str,
    known: &'static [&'static str],
) -> Result<Table<'a>, SceneError> {
    Ok(root.table(name, known)?.unwrap_or_else(|| root.as_if_empty(name, known)))
}

fn hero_spec(table: &Table, traits: Traits, groups: &Groups) -> Result<HeroSpec, SceneError> {
    let spawns = table.need("spawns", "a list of points [x, y]")?;
    let items = spawns.list()?;
    if !(1..=SPAWNS_MAX).contains(&items.len()) {
        return Err(spawns.refuse(format!("1 to {SPAWNS_MAX} points [x, y]")));
    }
    Ok(HeroSpec {
        body: traits.def(table, groups)?,
        thrust: table.vector("thrust", Vec2::new(60.0, 120.0), Range::from(0.0, 1.0e4))?,
        speed_max: table.number("speed_max", 80.0, Range::above(0.0, SPEED_MAX))?,
        spawns: items.iter().map(|item| item.vector(PLACE)).collect::<Result<_, _>>()?,
    })
}

fn pack(
    root: &Table,
    tools: Tools,
    groups: &Groups,
    recipes: &mut Recipes,
    drag: Drag,
) -> Result<Option<PackSpec>, SceneError> {
    if !root.has("pack") && !tools.contains(Tools::LAUNCH) {
        return Ok(None);
    }
    let table = table_or_empty(root, "pack", PACK_FIELDS)?;
    let body = Traits::of(Kind::Pack, drag).changed_by(&table, groups)?.def(&table, groups)?;
    let recipe = match table.get("recipe") {
        Some(field) => recipes.index(&field)?,
        None => recipes.resolve("explosion").expect("explosion is a preset"),
    };
    Ok(Some(PackSpec {
        body,
        speed: table.number("speed", 30.0, VELOCITY)?,
        turn: table.number("turn", 0.8, Range::from(0.0, 1.0))?,
        life_ticks: table.whole("life_ticks", 300, 1, TICKS_MAX)?,
        drift: table.number("drift", 0.9, Range::from(0.0, 1.0))?,
        burst: table.whole("burst", 200, 0, u32::from(u16::MAX))? as u16,
        recipe,
    }))
}

/// Reads one entry of `emitters`.
pub(super) fn repeater(
    field: &Field,
    bodies: &[Placed],
    recipes: &mut Recipes,
) -> Result<Repeater, SceneError> {
    let table = field.table(EMITTER_FIELDS)?;
    let place = match (table.get("position"), table.get("follow")) {
        (Some(_), Some(follow)) => {
            return Err(follow.refuse_as("position and follow", "only one of the two"));
        }
        (None, Some(follow)) => Place::Body(followed(&follow, bodies)?),
        _ => Place::Point(table.need("position", "[x, y], or follow = \"name\"")?.vector(PLACE)?),
    };
    Ok(Repeater {
        recipe: recipes.index(&table.need("recipe", "the name of a recipe")?)?,
        count: table.need("count", "particles each time")?.whole(1, 10_000)? as u16,
        start: table.whole("start", 0, 0, TICKS_MAX)?,
        every: table.get("every").map(|field| field.whole(1, TICKS_MAX)).transpose()?,
        place,
    })
}

fn followed(field: &Field, bodies: &[Placed]) -> Result<usize, SceneError> {
    let named = |body: &Placed| body.name.is_some() && body.name.as_deref() == field.word();
    bodies.iter().position(named).ok_or_else(|| {
        let names: Vec<&str> = bodies.iter().filter_map(|body| body.name.as_deref()).collect();
        field.refuse(super::document::one_of(&names))
    })
}
