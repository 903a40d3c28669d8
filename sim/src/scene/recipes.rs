//! Particle recipes: the named presets and what a scene file changes about them.

use super::SceneError;
use super::document::{Field, Range, Table, one_of};
use crate::particle::Recipe;
use glam::Vec2;

/// Recipes that a file may define; the presets in use join them.
pub const RECIPES_MAX: usize = 64;
/// Longest life of a particle, ticks.
const LIFE_TICKS_MAX: u32 = 3600;
const FIELDS: &[&str] = &[
    "like",
    "life_ticks",
    "color_start",
    "color_end",
    "size",
    "size_factor",
    "velocity",
    "round",
    "acceleration",
    "drag",
];
const COLOR: Range = Range::from(0.0, 16.0);
const SIZE: Range = Range::above(0.0, 64.0);
const SIZE_FACTOR: Range = Range::above(0.0, 1.1);
const SPEED: Range = Range::from(-1000.0, 1000.0);
const DRAG: Range = Range::from(0.0, 1.0);

/// Recipes that every scene may use by name.
pub fn presets() -> Vec<Recipe> {
    vec![fire(), ember(), torch(), explosion(), spark(), fountain()]
}

/// The chapter's recipe (row A3.18): discs that flare up, turn pink and sink.
fn fire() -> Recipe {
    Recipe {
        name: "fire".into(),
        life_ticks: [30, 230],
        color_start: [1.0, 0.0, 0.0, 1.0],
        color_end: [[3.5, 0.4, 0.3, 0.6], [4.5, 0.5, 0.4, 0.6]],
        size: [5.5, 6.0],
        size_factor: 0.98,
        velocity: [Vec2::new(-10.0, 0.0), Vec2::new(10.0, 10.0)],
        round: false,
        acceleration: Vec2::new(0.0, -50.0),
        drag: 0.95,
    }
}

/// Glowing flakes that drift upwards for long.
fn ember() -> Recipe {
    Recipe {
        name: "ember".into(),
        life_ticks: [60, 160],
        color_start: [1.0, 0.6, 0.2, 1.0],
        color_end: [[0.5, 0.05, 0.0, 0.0], [0.8, 0.12, 0.0, 0.0]],
        size: [1.2, 2.2],
        size_factor: 0.995,
        velocity: [Vec2::new(-5.0, 4.0), Vec2::new(5.0, 16.0)],
        round: true,
        acceleration: Vec2::new(0.0, 9.0),
        drag: 0.98,
    }
}

/// A flame that burns upwards.
fn torch() -> Recipe {
    Recipe {
        name: "torch".into(),
        life_ticks: [26, 62],
        color_start: [0.9, 0.4, 0.12, 0.8],
        color_end: [[0.8, 0.05, 0.0, 0.0], [1.0, 0.1, 0.05, 0.0]],
        size: [5.0, 7.5],
        size_factor: 0.96,
        velocity: [Vec2::new(-5.0, 8.0), Vec2::new(5.0, 22.0)],
        round: false,
        acceleration: Vec2::new(0.0, 24.0),
        drag: 0.96,
    }
}

/// A dye pack's burst, flung to all sides alike.
fn explosion() -> Recipe {
    Recipe {
        name: "explosion".into(),
        life_ticks: [30, 110],
        color_start: [1.0, 0.45, 0.1, 1.0],
        color_end: [[1.6, 0.1, 0.05, 0.0], [2.4, 0.3, 0.1, 0.0]],
        size: [4.0, 6.5],
        size_factor: 0.97,
        velocity: [Vec2::new(-60.0, -45.0), Vec2::new(60.0, 70.0)],
        round: true,
        acceleration: Vec2::new(0.0, -40.0),
        drag: 0.95,
    }
}

/// Small, fast and soon gone.
fn spark() -> Recipe {
    Recipe {
        name: "spark".into(),
        life_ticks: [10, 34],
        color_start: [1.5, 1.3, 0.8, 1.0],
        color_end: [[1.0, 0.3, 0.0, 0.0], [1.2, 0.5, 0.1, 0.0]],
        size: [1.0, 1.8],
        size_factor: 0.97,
        velocity: [Vec2::new(-50.0, -20.0), Vec2::new(50.0, 60.0)],
        round: true,
        acceleration: Vec2::new(0.0, -80.0),
        drag: 0.98,
    }
}

/// A cool jet that rises and falls back.
fn fountain() -> Recipe {
    Recipe {
        name: "fountain".into(),
        life_ticks: [70, 110],
        color_start: [0.25, 0.6, 1.0, 0.7],
        color_end: [[0.05, 0.2, 0.7, 0.0], [0.1, 0.4, 0.9, 0.0]],
        size: [2.0, 3.4],
        size_factor: 0.995,
        velocity: [Vec2::new(-8.0, 50.0), Vec2::new(8.0, 66.0)],
        round: false,
        acceleration: Vec2::new(0.0, -50.0),
        drag: 0.995,
    }
}

/// The recipes that a scene names; presets join when they are used.
pub(super) struct Recipes {
    pub list: Vec<Recipe>,
}

impl Recipes {
    /// Reads `[recipes.NAME]` tables.
    pub fn read(root: &Table) -> Result<Recipes, SceneError> {
        let Some(field) = root.get("recipes") else { return Ok(Recipes { list: Vec::new() }) };
        let entries = field.named()?;
        if entries.len() > RECIPES_MAX {
            return Err(field.refuse_as(
                format!("{} recipes", entries.len()),
                format!("at most {RECIPES_MAX}"),
            ));
        }
        let list =
            entries.iter().map(|(name, field)| recipe(name, field)).collect::<Result<_, _>>()?;
        Ok(Recipes { list })
    }

    /// Index of the recipe that a field names: one of the file's, else a preset.
    pub fn index(&mut self, field: &Field) -> Result<u8, SceneError> {
        let found = field.word().and_then(|name| self.resolve(name));
        found.ok_or_else(|| field.refuse(self.known()))
    }

    /// Index of the recipe with this name, which joins the scene's if it is a preset. A file's
    /// own recipes and all presets together fit in a byte.
    pub fn resolve(&mut self, name: &str) -> Option<u8> {
        let at = self.list.iter().position(|recipe| recipe.name == name).or_else(|| {
            let preset = presets().into_iter().find(|preset| preset.name == name)?;
            self.list.push(preset);
            Some(self.list.len() - 1)
        })?;
        u8::try_from(at).ok()
    }

    fn known(&self) -> String {
        let mut names: Vec<String> = self.list.iter().map(|recipe| recipe.name.clone()).collect();
        names.extend(presets().into_iter().map(|preset| preset.name));
        names.sort();
        names.dedup();
        one_of(&names)
    }
}

fn recipe(name: &str, field: &Field) -> Result<Recipe, SceneError> {
    if !super::is_name(name) {
        return Err(field.refuse_as(format!("a recipe named {name:?}"), super::NAME_ALLOWED));
    }
    let table = field.table(FIELDS)?;
    let base = match table.get("like") {
        Some(like) => preset(&like)?,
        None => presets().into_iter().find(|preset| preset.name == name).unwrap_or_else(fire),
    };
    Ok(Recipe {
        name: name.to_owned(),
        life_ticks: life(&table, base.life_ticks)?,
        color_start: table
            .get("color_start")
            .map_or(Ok(base.color_start), |field| color(&field))?,
        color_end: color_end(&table, base.color_end)?,
        size: low_high(&table, "size", base.size)?,
        size_factor: table.number("size_factor", base.size_factor, SIZE_FACTOR)?,
        velocity: table.get("velocity").map_or(Ok(base.velocity), |field| field.corners(SPEED))?,
        round: table.get("round").map_or(Ok(base.round), |field| field.truth())?,
        acceleration: table.vector("acceleration", base.acceleration, SPEED)?,
        drag: table.number("drag", base.drag, DRAG)?,
    })
}

fn preset(like: &Field) -> Result<Recipe, SceneError> {
    let mut all = presets();
    let names: Vec<String> = all.iter().map(|preset| preset.name.clone()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Ok(all.swap_remove(like.choice(&names)?))
}

fn life(table: &Table, base: [u16; 2]) -> Result<[u16; 2], SceneError> {
    let Some(field) = table.get("life_ticks") else { return Ok(base) };
    let allowed = format!("[low, high], whole numbers from 1 to {LIFE_TICKS_MAX}, low first");
    let [low, high] = field.items(&allowed)?;
    let (low, high) = (low.whole(1, LIFE_TICKS_MAX)?, high.whole(1, LIFE_TICKS_MAX)?);
    if low > high {
        return Err(field.refuse(allowed));
    }
    Ok([low as u16, high as u16])
}

fn low_high(table: &Table, name: &str, base: [f32; 2]) -> Result<[f32; 2], SceneError> {
    let Some(field) = table.get(name) else { return Ok(base) };
    let allowed = format!("[low, high], low first, each {SIZE}");
    let [low, high] = field.items(&allowed)?;
    let pair = [low.number(SIZE)?, high.number(SIZE)?];
    if pair[0] <= pair[1] { Ok(pair) } else { Err(field.refuse(allowed)) }
}

fn color(field: &Field) -> Result<[f32; 4], SceneError> {
    let [r, g, b, a] = field.items(&format!("[red, green, blue, alpha], each {COLOR}"))?;
    Ok([r.number(COLOR)?, g.number(COLOR)?, b.number(COLOR)?, a.number(COLOR)?])
}

fn color_end(table: &Table, base: [[f32; 4]; 2]) -> Result<[[f32; 4]; 2], SceneError> {
    let Some(field) = table.get("color_end") else { return Ok(base) };
    let [low, high] = field.items("[low, high], each [red, green, blue, alpha]")?;
    Ok([color(&low)?, color(&high)?])
}
