//! Zones in a scene file.

use super::condition::Condition;
use super::known::{Known, SECONDS, SENTENCE_CHARS_MAX, ticks};
use crate::scene::groups::Groups;
use crate::scene::limits::{BODIES_MAX, EXTENT_MIN, SIZE_MAX};
use crate::scene::table::{POSITION, Range, Table};
use glam::Vec2;
use jostle_sim::Aabb;

const SPEED: Range = Range::above(0.0, 1.0e6);
const COLORS: u32 = 8;

/// A place that knows who is in it.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoneSpec {
    /// Name, unique among the zones.
    pub name: String,
    /// Where it is; relative to the body that it follows, if it follows one.
    pub area: ZoneArea,
    /// Entry of the scene's bodies that it moves along with.
    pub follow: Option<usize>,
    /// Groups that count, a bit each.
    pub who: u32,
    /// Whether a body is in as soon as its outline touches the area; else its centre must be inside.
    pub touch: bool,
    /// Bodies count only below this speed, units/s.
    pub slower: Option<f32>,
    /// How many make it a yes.
    pub need: Need,
    /// It counts nobody while this does not hold.
    pub condition: Condition,
    /// How it gets a holder; `None` if it has none.
    pub take: Option<Take>,
    /// What is written on it; may be empty.
    pub label: String,
    /// One of the players' colours; a zone without label and colour is not drawn.
    pub color: Option<u8>,
}

impl ZoneSpec {
    /// Returns whether a point is in it, relative to the body that it follows, if it follows one.
    pub fn holds(&self, point: Vec2) -> bool {
        match self.area {
            ZoneArea::Everywhere => true,
            ZoneArea::Box(area) => area.contains(point),
            ZoneArea::Circle { center, radius } => {
                (point - center).length_squared() <= radius * radius
            }
        }
    }

    /// Returns whether players see it.
    pub fn is_drawn(&self) -> bool {
        self.color.is_some() || !self.label.is_empty()
    }
}

/// Where a zone is, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ZoneArea {
    /// All of the world and beyond.
    Everywhere,
    /// An axis-aligned rectangle, world units.
    Box(Aabb),
    /// A disc, world units.
    Circle {
        /// Centre of the disc.
        center: Vec2,
        /// Its radius.
        radius: f32,
    },
}

/// How many bodies make a zone a yes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// So many or more.
    Count(u32),
    /// All that exist of its groups, and at least one.
    All,
}

/// How a zone gets a holder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Take {
    /// Ticks for which a side must be alone in it.
    pub ticks: u32,
    /// Whether the holder stays while others are in it, or nobody is.
    pub keep: bool,
}

/// Reads one entry of `zones`.
pub(super) fn zone(table: &Table, known: &Known) -> ZoneSpec {
    let name = table.get("name").word().unwrap_or_default().to_owned();
    let follow = table.get("follow");
    let slower = table.get("slower");
    let [label, color] = ["label", "color"].map(|field| table.get(field));
    ZoneSpec {
        name,
        area: area(table),
        follow: if follow.is_given() { known.names.body(&follow) } else { None },
        who: who(table, known.groups),
        touch: table.get("touch").truth(false),
        slower: slower.is_given().then(|| slower.number(1.0, SPEED)),
        need: need(table),
        condition: known.names.any_condition(&table.get("while")),
        take: take(table),
        label: if label.is_given() { label.text(SENTENCE_CHARS_MAX) } else { String::new() },
        color: color.is_given().then(|| color.whole(0, 0..=COLORS - 1) as u8),
    }
}

fn area(table: &Table) -> ZoneArea {
    let [area, position] = table.either("area", "position");
    let radius = table.get("radius");
    if position.is_given() {
        let radius = table.need("radius", "the radius around the position");
        return ZoneArea::Circle {
            center: position.vector(Vec2::ZERO, POSITION),
            radius: radius.number(1.0, Range::from(EXTENT_MIN, SIZE_MAX)),
        };
    }
    if radius.is_given() {
        radius.refuse("nothing: only a position has it");
    }
    if !area.is_given() {
        return ZoneArea::Everywhere;
    }
    let [low, high] = area.corners([Vec2::ZERO; 2], POSITION);
    ZoneArea::Box(Aabb { low, high })
}

/// Heroes unless the file says otherwise.
fn who(table: &Table, groups: &Groups) -> u32 {
    let field = table.get("who");
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
    if !take.is_given() && keep.is_given() {
        keep.refuse("nothing: only a zone that can be taken has it");
    }
    take.is_given()
        .then(|| Take { ticks: ticks(take.number(1.0, SECONDS)), keep: keep.truth(false) })
}
