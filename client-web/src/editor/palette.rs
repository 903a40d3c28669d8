//! The palette's pieces, which can be added to a scene as text.

use super::edit::{appended, apply};
use super::field;
use super::groups::{with_group, words};
use super::number::{decimals_of, rounded};
use super::references::free_name;
use super::rule_pieces::{CHECKPOINT, FINISH, GOAL, HOME, LAVA, RulePiece};
use super::snap::unit_of;
use super::templates::EMPTY;
use super::text::{List, PieceId, ScenePieces};
use jostle_sim::Vec2;

/// The kind of a palette piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Make {
    /// A slab to stand on.
    Platform,
    Wall,
    Block,
    Ball,
    Minion,
    /// A spawn point for heroes.
    Spawn,
    Zone,
    Emitter,
    /// A launcher that throws dye packs.
    Launcher,
    /// A platform that moves back and forth.
    Path,
    Goal,
    Lava,
    Checkpoint,
    /// A flag and its team's home.
    Home,
    Finish,
}

/// The world height for which the pieces' default sizes are designed, units.
const WORLD_HEIGHT: f32 = 180.0;
/// Width and height of heroes in a newly added `[hero]`; [`HERO_WALK`] says how they walk.
const HERO: Vec2 = Vec2::new(9.0, 12.0);
const HERO_WALK: &str = "{ speed = 40, jump = 50 }";

impl Make {
    /// Every piece in palette order, with the name that the page's buttons use for it.
    pub const ALL: [(Make, &str); 15] = [
        (Make::Platform, "platform"),
        (Make::Wall, "wall"),
        (Make::Block, "block"),
        (Make::Ball, "ball"),
        (Make::Minion, "minion"),
        (Make::Spawn, "spawn"),
        (Make::Zone, "zone"),
        (Make::Emitter, "emitter"),
        (Make::Launcher, "launcher"),
        (Make::Path, "path"),
        (Make::Goal, GOAL.base),
        (Make::Lava, LAVA.base),
        (Make::Checkpoint, CHECKPOINT.base),
        (Make::Home, HOME.base),
        (Make::Finish, FINISH.base),
    ];

    /// The piece with this name.
    pub fn named(name: &str) -> Option<Make> {
        Make::ALL.iter().find(|(_, known)| *known == name).map(|(make, _)| *make)
    }

    /// The list to which the piece is added.
    pub fn list(self) -> List {
        match self {
            Make::Spawn => List::Spawns,
            _ if self.rules().is_some() => List::Zones,
            Make::Zone => List::Zones,
            Make::Emitter => List::Emitters,
            Make::Launcher => List::Launchers,
            _ => List::Bodies,
        }
    }

    /// The rules that the piece carries.
    fn rules(self) -> Option<&'static RulePiece> {
        Some(match self {
            Make::Goal => &GOAL,
            Make::Lava => &LAVA,
            Make::Checkpoint => &CHECKPOINT,
            Make::Home => &HOME,
            Make::Finish => &FINISH,
            _ => return None,
        })
    }

    /// The collision group that the piece needs.
    fn group(self) -> Option<&'static str> {
        match self {
            Make::Platform | Make::Wall | Make::Path => Some("platform"),
            Make::Block | Make::Ball => Some("block"),
            Make::Minion => Some("minion"),
            Make::Spawn | Make::Zone => Some("hero"),
            Make::Launcher => Some("pack"),
            _ => None,
        }
    }

    /// The piece's width and height in a world of height [`WORLD_HEIGHT`].
    fn size(self) -> Vec2 {
        match self {
            Make::Platform | Make::Path => Vec2::new(40.0, 4.0),
            Make::Wall => Vec2::new(8.0, 40.0),
            Make::Zone => Vec2::new(40.0, 30.0),
            Make::Ball => Vec2::new(8.0, 8.0),
            Make::Goal => Vec2::new(16.0, 40.0),
            Make::Lava => Vec2::new(40.0, 6.0),
            Make::Checkpoint => Vec2::new(16.0, 30.0),
            Make::Home => Vec2::new(40.0, 20.0),
            Make::Finish => Vec2::new(12.0, 60.0),
            _ => Vec2::new(10.0, 10.0),
        }
    }
}

/// Adds a piece at this point; returns the new text and the piece's id. `None` if the text is not valid TOML.
pub fn added(text: &str, make: Make, at: Vec2) -> Option<(String, PieceId)> {
    let text = match is_bare(text) {
        true => format!("{text}{EMPTY}"),
        false => text.to_owned(),
    };
    let text = make.group().map_or(text.clone(), |group| with_group(&text, group));
    let sheet = ScenePieces::read(&text)?;
    let world = sheet.world.unwrap_or(Vec2::new(320.0, WORLD_HEIGHT));
    let list = make.list();
    let index = sheet.pieces.iter().filter(|piece| piece.id.list == list).count();
    let id = PieceId { list, index };
    let draft = PieceDraft { at, world, text: &text };
    let new = match make {
        Make::Spawn => spawned(&draft)?,
        _ if let Some(rules) = make.rules() => {
            rules.added(&text, &draft.area(draft.scaled(make.size())), &draft.point(at))?
        }
        _ => {
            let fields = draft.fields(make);
            let inline = field::push(&text, list.path(), &format!("{{ {} }}", fields.join(", ")))
                .filter(|_| sheet.pieces.iter().any(|piece| piece.id.list == list && piece.inline));
            let table = format!("[[{}]]\n{}\n", list.path(), fields.join("\n"));
            apply(&text, vec![inline.unwrap_or_else(|| appended(&text, &sheet, list, &table))])
        }
    };
    Some((new, id))
}

/// Whether a text contains only comments and empty lines.
pub fn is_bare(text: &str) -> bool {
    text.lines().all(|line| line.trim().is_empty() || line.trim_start().starts_with('#'))
}

struct PieceDraft<'a> {
    at: Vec2,
    world: Vec2,
    text: &'a str,
}

impl PieceDraft<'_> {
    fn number(&self, value: f32) -> String {
        rounded(value, decimals_of(unit_of(self.world)) + 1)
    }

    fn point(&self, at: Vec2) -> String {
        format!("[{}, {}]", self.number(at.x), self.number(at.y))
    }

    /// The corners of an area of this size around the piece's point.
    fn area(&self, size: Vec2) -> String {
        let [low, high] = [-0.5, 0.5].map(|share| self.point(self.at + size * share));
        format!("[{low}, {high}]")
    }

    /// Scales a size to suit the world, but never below one unit.
    fn scaled(&self, size: Vec2) -> Vec2 {
        let unit = unit_of(self.world);
        let scale = self.world.y / WORLD_HEIGHT;
        let scale = if (0.5..2.5).contains(&scale) { 1.0 } else { scale };
        ((size * scale / unit).round() * unit).max(Vec2::splat(unit))
    }

    fn fields(&self, make: Make) -> Vec<String> {
        let size = self.scaled(make.size());
        let position = format!("position = {}", self.point(self.at));
        let kind = |kind: &str| format!("kind = \"{kind}\"");
        let sized = format!("size = {}", self.point(size));
        match make {
            Make::Platform => vec![kind("platform"), position, sized],
            Make::Wall => vec![kind("wall"), position, sized],
            Make::Block => vec![kind("block"), position, sized],
            Make::Ball => {
                vec![kind("block"), position, format!("radius = {}", self.number(0.5 * size.y))]
            }
            Make::Minion => {
                vec![kind("minion"), position, format!("radius = {}", self.number(0.5 * size.y))]
            }
            Make::Zone => {
                let name = format!("name = \"{}\"", free_name(self.text, "zone"));
                vec![name, format!("area = {}", self.area(size)), "color = 1".to_owned()]
            }
            Make::Emitter => {
                let every = ["count = 6", "every = 12"].map(str::to_owned);
                [vec!["recipe = \"fire\"".to_owned(), position], every.to_vec()].concat()
            }
            Make::Launcher => vec![position, "every = 3".to_owned()],
            Make::Path => {
                let reach = Vec2::new(self.scaled(Vec2::new(30.0, 0.0)).x, 0.0);
                let [from, to] = [self.at - reach, self.at + reach].map(|at| self.point(at));
                vec![kind("platform"), format!("path = [{from}, {to}]"), "period = 4".into(), sized]
            }
            _ => Vec::new(),
        }
    }
}

/// Adds a spawn point to `[hero]`. If that table is missing, it is added with a size and `walk` values, and the `steer`
/// tool is enabled.
fn spawned(draft: &PieceDraft) -> Option<String> {
    let point = draft.point(draft.at);
    if let Some(splice) = field::push(draft.text, "hero.spawns", &point) {
        return Some(apply(draft.text, vec![splice]));
    }
    let mut text = draft.text.to_owned();
    let is_new = words(&text, "hero").is_none() && field::is_missing(&text, "hero");
    let mut set = |path: &str, value: &str| {
        text = apply(&text, vec![field::set(&text, path, value)?]);
        Some(())
    };
    set("hero.spawns", &format!("[{point}]"))?;
    if is_new {
        set("hero.size", &draft.point(draft.scaled(HERO)))?;
        set("hero.walk", HERO_WALK)?;
        if !words(&text, "tools").is_some_and(|tools| tools.iter().any(|tool| tool == "steer")) {
            let steer = "\"steer\"";
            let splice = field::push(&text, "tools", steer);
            let splice = splice.or_else(|| field::set(&text, "tools", &format!("[{steer}]")))?;
            text = apply(&text, vec![splice]);
        }
    }
    Some(text)
}
