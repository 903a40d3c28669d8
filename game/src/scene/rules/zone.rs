//! Zones in a scene file.

use super::condition::Condition;
use super::names::{self, COLORS, RuleNames, SENTENCE_CHARS_MAX};
use crate::scene::field::{POSITION, Range, SECONDS};
use crate::scene::groups::Groups;
use crate::scene::limits::{BODIES_MAX, EXTENT_MIN, SIZE_MAX};
use crate::scene::table::Table;
use glam::Vec2;
use jostle_sim::Aabb;

const SPEED: Range = Range::above(0.0, 1.0e6);

/// A place that detects the bodies inside it.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoneSpec {
    /// Name, which nothing else may have.
    pub name: String,
    /// Area of the zone, relative to the body that it follows, if any.
    pub area: ZoneArea,
    /// It moves along with this body, and its place is relative to the body.
    pub follow: Option<usize>,
    /// Groups whose bodies count. Default: `["hero"]`.
    pub who: u32,
    /// Whether bodies are in it as soon as their outline touches it; otherwise their centre must be inside. Label:
    /// Counts on touch.
    pub touch: bool,
    /// Only bodies slower than this count, units/s. Label: Only below this speed, for experts.
    pub slower: Option<f32>,
    /// This many bodies turn it on; `"all"` means all bodies of its groups, and at least one. Default: `1`. Label:
    /// Bodies needed.
    pub need: Need,
    /// The zone counts bodies only while this holds. Default: always.
    #[doc(alias = "while")]
    pub condition: Condition,
    /// A side holds the zone once it has been alone in it for longer than this. Default: none. Label: Seconds until it
    /// is held, for experts.
    pub take: Option<Take>,
    /// Text written on it; a zone with neither label nor colour is not drawn. Label: Text on it.
    pub label: String,
    /// Colour from the players' palette. Label: Colour.
    pub color: Option<u8>,
}

impl ZoneSpec {
    /// Returns whether a point is in the zone, relative to the body that it follows, if any.
    pub fn holds(&self, point: Vec2) -> bool {
        match self.area {
            ZoneArea::Everywhere => true,
            ZoneArea::Box(area) => area.contains(point),
            ZoneArea::Circle { center, radius } => {
                (point - center).length_squared() <= radius * radius
            }
        }
    }

    /// Returns whether players can see the zone.
    pub fn is_drawn(&self) -> bool {
        self.color.is_some() || !self.label.is_empty()
    }
}

/// Area of a zone, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ZoneArea {
    /// The whole world and beyond.
    Everywhere,
    /// An axis-aligned rectangle, world units.
    Box(Aabb),
    /// A disc, world units.
    Circle {
        /// Centre of the disc.
        center: Vec2,
        /// Radius of the disc.
        radius: f32,
    },
}

/// Number of bodies that turns a zone's level on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// This many or more.
    Count(u32),
    /// All existing bodies of its groups, and at least one.
    All,
}

/// How a side becomes the holder of a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Take {
    /// Ticks for which a side must be alone in the zone.
    pub ticks: u32,
    /// Whether the holder keeps it until another side takes it, instead of only while the holder is alone there.
    /// Default: `false`. Label: Stays held, for experts.
    pub keep: bool,
}

/// Reads one entry of `zones`.
pub(super) fn zone(table: &Table, known: &RuleNames) -> ZoneSpec {
    let name = names::name(table);
    let [follow, slower] = ["follow", "slower"].map(|field| table.get(field));
    let [label, color] = ["label", "color"].map(|field| table.get(field));
    ZoneSpec {
        name,
        area: area(table),
        follow: follow.given(|follow| known.names.body(follow)).flatten(),
        who: who(table, known.groups),
        touch: table.get("touch").truth(false),
        slower: slower.given(|slower| slower.number(1.0, SPEED)),
        need: need(table),
        condition: known.names.any_condition(&table.get("while")),
        take: take(table),
        label: label.given(|label| label.text(SENTENCE_CHARS_MAX)).unwrap_or_default(),
        color: color.given(|color| color.whole(0, 0..=COLORS - 1) as u8),
    }
}

fn area(table: &Table) -> ZoneArea {
    // Where it is, as two corners. Default: everywhere.
    let area = table.get("area");
    // Where it is, as the centre of a disc. Label: Position.
    let position = table.get("position");
    table.not_both("area", "position");
    // Radius of that disc. Default: required with `position`. Label: Radius.
    let radius = table.get("radius");
    let disc = position.given(|position| {
        if !radius.is_given() {
            radius.refuse("the radius around the position");
        }
        ZoneArea::Circle {
            center: position.vector(Vec2::ZERO, POSITION),
            radius: radius.number(1.0, Range::from(EXTENT_MIN, SIZE_MAX)),
        }
    });
    if disc.is_none() {
        radius.refuse_if_given("nothing: only a position has it");
    }
    let rectangle = area.given(|area| {
        let [low, high] = area.corners([Vec2::ZERO; 2], POSITION);
        ZoneArea::Box(Aabb { low, high })
    });
    disc.or(rectangle).unwrap_or(ZoneArea::Everywhere)
}

/// The groups that count; heroes by default.
fn who(table: &Table, groups: &Groups) -> u32 {
    let field = table.get("who");
    field.describe("groups");
    if !field.is_given() {
        return match groups.names.iter().position(|name| name == "hero") {
            Some(index) => 1 << index,
            None => {
                field.refuse("a list of groups: none of them is called \"hero\"");
                0
            }
        };
    }
    let items = field.items();
    items.iter().filter_map(|item| groups.given(item)).fold(0, |all, group| all | 1 << group)
}

fn need(table: &Table) -> Need {
    let field = table.get("need");
    field.describe(format_args!("a whole number from 1 to {BODIES_MAX}, or `\"all\"`"));
    if field.word() == Some("all") {
        return Need::All;
    }
    if field.word().is_some() {
        field.refuse("a number of bodies, or \"all\"");
    }
    Need::Count(field.whole(1, 1..=BODIES_MAX))
}

fn take(table: &Table) -> Option<Take> {
    let [take, keep] = ["take", "keep"].map(|field| table.get(field));
    if !take.is_given() {
        keep.refuse_if_given("nothing: only a zone that can be taken has it");
    }
    take.given(|take| Take { ticks: take.ticks(1.0, SECONDS), keep: keep.truth(false) })
}
