//! The sling, and bodies that break, in a scene file.

use super::recipes::Recipes;
use super::rules::{Names, POINTS_MAX, SECONDS, ticks};
use super::spec::{Breakable, Placed, SlingSpec};
use super::table::{Field, Range, Table};
use super::tools::Tools;
use jostle_sim::Motion;

const PULL: Range = Range::from(1.0, 1.0e3);
const SPEED: Range = Range::from(0.1, 100.0);
const SHOTS_MAX: u32 = 255;
const STRENGTH: Range = Range::above(0.0, 1.0e9);

/// Reads `[sling]`; nothing where it is wrong, or not there.
pub(super) fn sling(
    root: &Table,
    tools: Tools,
    bodies: &[Placed],
    names: &Names,
) -> Option<SlingSpec> {
    let field = root.get("sling");
    let is_used = tools.contains(Tools::SLING);
    match (field.is_given(), is_used) {
        (false, false) => return None,
        (false, true) => field.refuse("a table [sling] for the tool sling"),
        (true, false) => field.refuse("nothing without \"sling\" among the tools"),
        (true, true) => {}
    }
    field.table(|table| {
        let ball = table.need("ball", "the name of a body");
        let index = names.body(&ball);
        let movable = |index: &usize| bodies.get(*index).map(|body| body.def.motion);
        if index.as_ref().and_then(movable).is_some_and(|motion| motion != Motion::Dynamic) {
            ball.refuse("the name of a dynamic body");
        }
        let over = table.get("over");
        Some(SlingSpec {
            ball: index?,
            pull: table.get("pull").number(20.0, PULL),
            speed: table.get("speed").number(5.0, SPEED),
            shots: table.get("shots").whole(5, 1..=SHOTS_MAX) as u8,
            over: over.is_given().then(|| names.any_condition(&over)),
            over_time: ticks(table.get("over_time").number(10.0, SECONDS)).max(1),
            spare: table.get("spare").signed(0, POINTS_MAX),
        })
    })
}

/// Reads `strength`, `points` and `splash` of a body.
pub(super) fn breakable(table: &Table, motion: Motion, recipes: &mut Recipes) -> Option<Breakable> {
    let strength = table.get("strength");
    let [points, splash] = ["points", "splash"].map(|name| table.get(name));
    let refuse = |field: &Field| field.refuse("nothing: only a body with a strength has it");
    if !strength.is_given() {
        [points, splash].iter().filter(|field| field.is_given()).for_each(refuse);
        return None;
    }
    if motion != Motion::Dynamic {
        strength.refuse("nothing: only a dynamic body breaks");
    }
    Some(Breakable {
        strength: strength.number(1.0, STRENGTH),
        points: points.signed(0, POINTS_MAX),
        splash: splash.is_given().then(|| recipes.index(&splash, "spark")),
    })
}
