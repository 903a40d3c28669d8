//! A scene's particle recipes: its own, and the presets that it uses.

use super::field::Range;
use super::limits::{NAME_ALLOWED, RECIPES_MAX, SCENE_NAME_BYTES_MAX, is_name};
use super::table::{Document, Field, Table, one_of};
use jostle_sim::Recipe;
use jostle_sim::short_sort::sort_few;
use toml::de::DeTable;

/// Longest life of a particle, ticks.
const LIFE_TICKS_MAX: u32 = 3600;
const COLOR: Range = Range::from(0.0, 16.0);
const SIZE: Range = Range::above(0.0, 64.0);
const SPEED: Range = Range::from(-1000.0, 1000.0);

/// All presets except fire.
const PRESETS: &str = include_str!("../../../assets/recipes.toml");

/// Recipes that every scene may use by name, fire first.
pub fn presets() -> Vec<Recipe> {
    let document = Document::new("recipes.toml", PRESETS);
    let entries = DeTable::parse(PRESETS).expect("a test parses it");
    let tables = document.root(entries.get_ref()).get("recipes").items();
    let others = tables.iter().map(|field| {
        let name = |table: &Table| table.get("name").text(SCENE_NAME_BYTES_MAX);
        field.table(|table| recipe(&name(table), table, Recipe::default()))
    });
    let presets = [Recipe::default()].into_iter().chain(others).collect();
    document.checked(presets).expect("a test reads it")
}

/// The recipes of a scene, to which presets are added when they are used.
pub(super) struct Recipes {
    pub list: Vec<Recipe>,
}

impl Recipes {
    /// Reads `[recipes.NAME]` tables.
    pub fn read(root: &Table) -> Recipes {
        let field = root.get("recipes");
        let entries = field.named();
        if entries.len() > RECIPES_MAX {
            let found = format!("{} recipes", entries.len());
            field.refuse_as(found, format!("at most {RECIPES_MAX}"));
        }
        let list = entries.iter().map(|(name, field)| {
            if !is_name(name) {
                field.refuse_as(format!("a recipe named {name:?}"), NAME_ALLOWED);
            }
            // Preset that supplies the other defaults. Default: the preset with the same name as the recipe, else
            // `"fire"`.
            field.table(|table| recipe(name, table, base(name, &table.get("like"))))
        });
        Recipes { list: list.collect() }
    }

    /// Index of the recipe named by a field, from the file or a preset; `default` is used if the file names none.
    pub fn index(&mut self, field: &Field, default: &str) -> u8 {
        field.describe("a recipe");
        let name = if field.is_given() { field.word() } else { Some(default) };
        name.and_then(|name| self.resolve(name)).unwrap_or_else(|| {
            field.refuse(self.known());
            0
        })
    }

    /// Index of the recipe with this name; a preset is added to the scene's recipes. The indices of a file's
    /// recipes and all presets together fit in a byte.
    fn resolve(&mut self, name: &str) -> Option<u8> {
        let index = self.list.iter().position(|recipe| recipe.name == name).or_else(|| {
            let preset = presets().into_iter().find(|preset| preset.name == name)?;
            self.list.push(preset);
            Some(self.list.len() - 1)
        })?;
        u8::try_from(index).ok()
    }

    fn known(&self) -> String {
        let all = self.list.iter().cloned().chain(presets());
        let mut names: Vec<String> = all.map(|recipe| recipe.name).collect();
        sort_few(&mut names, |one, other| one < other);
        names.dedup();
        one_of(names)
    }
}

/// Reads a recipe whose defaults are those of `base`.
fn recipe(name: &str, table: &Table, base: Recipe) -> Recipe {
    let ends = || "[low, high], each [red, green, blue, alpha]".to_owned();
    Recipe {
        name: name.to_owned(),
        // Lifetime. Default: the preset's.
        life_ticks: life_ticks(&table.get("life_ticks"), base.life_ticks),
        // Colour at birth; colours are added to the picture, so values above 1 are brighter. Default: the preset's.
        color_start: color(&table.get("color_start"), base.color_start),
        // Colour at the end of its life, between these two. Default: the preset's.
        color_end: table.get("color_end").array(base.color_end, ends, color),
        // Width at birth. Default: the preset's.
        size: size(&table.get("size"), base.size),
        // Factor applied to the width every tick. Default: the preset's.
        size_factor: table.get("size_factor").number(base.size_factor, Range::above(0.0, 1.1)),
        // Velocity at birth, from the box with these corners. Default: the preset's.
        velocity: table.get("velocity").corners(base.velocity, SPEED),
        // Whether velocities come from the ellipse within that box instead. Default: the preset's.
        round: table.get("round").truth(base.round),
        // Acceleration, which replaces the world's gravity. Default: the preset's.
        acceleration: table.get("acceleration").vector(base.acceleration, SPEED),
        // Factor applied to the velocity every tick. Default: the preset's.
        drag: table.get("drag").number(base.drag, Range::from(0.0, 1.0)),
    }
}

/// The recipe that provides the defaults: the one named by `like`, otherwise the preset with this name, otherwise fire.
fn base(name: &str, like: &Field) -> Recipe {
    let mut all = presets();
    let names: Vec<String> = all.iter().map(|preset| preset.name.clone()).collect();
    let index = like.index_in(&names).or_else(|| names.iter().position(|known| known == name));
    index.map_or_else(Recipe::default, |index| all.swap_remove(index))
}

fn life_ticks(field: &Field, base: [u16; 2]) -> [u16; 2] {
    let allowed = || format!("[low, high], whole numbers from 1 to {LIFE_TICKS_MAX}, low first");
    let whole = |item: &Field, base| item.whole(base, 1..=LIFE_TICKS_MAX);
    ordered(field, base.map(u32::from), allowed, whole).map(|ticks| ticks as u16)
}

fn size(field: &Field, base: [f32; 2]) -> [f32; 2] {
    let allowed = || format!("[low, high], low first, each {SIZE}");
    ordered(field, base, allowed, |item, base| item.number(base, SIZE))
}

/// Two values, the lower one first.
fn ordered<T: Copy + PartialOrd>(
    field: &Field,
    base: [T; 2],
    allowed: impl Fn() -> String,
    read: impl Fn(&Field, T) -> T,
) -> [T; 2] {
    let values = field.array(base, &allowed, read);
    if values[0] > values[1] {
        field.refuse(allowed());
    }
    values
}

fn color(field: &Field, base: [f32; 4]) -> [f32; 4] {
    let allowed = || format!("[red, green, blue, alpha], each {COLOR}");
    field.array(base, allowed, |item, base| item.number(base, COLOR))
}
