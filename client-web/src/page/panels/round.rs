//! The round panel over the canvas: scoreboard, clock, task, countdown and result.

use crate::language::{fill, say};
use crate::net::api;
use crate::page::app::App;
use crate::page::game::GameScreen;
use crate::page::panels::players::color_var;
use crate::page::round::{LIVES_SHOWN_MAX, ResultView, RoundContext, RoundView, SideView};
use crate::page::strings;
use crate::page::view::View;
use crate::world::replica::Replica;
use crate::world::replica::moments::{Best, Moment, MomentKind};
use jostle_game::Side;
use jostle_protocol::web::RecordTable;

/// Number of sides on the podium; further ones are listed below it.
const PODIUM_MAX: usize = 3;

/// The round at the displayed moment; empty in a scene without rounds.
pub fn view(app: &App) -> View {
    let replica = app.screen.replica();
    let round = replica.and_then(round_of);
    let is_on = round.is_some();
    let mut round = round.unwrap_or_default();
    // The result stays while the next round is counted down.
    let past = replica.filter(|_| round.result.is_none()).and_then(past_result);
    let is_past = past.is_some();
    round.result = round.result.or(past);
    let goal = |side: &SideView| {
        let goal = side.goal.filter(|_| side.time.is_none());
        goal.map_or_else(String::new, |goal| format!(" / {goal}"))
    };
    let sides = round.sides.iter().map(|side| entry("side-item", side).text(".goal", goal(side)));
    let view = View::panel("round")
        .show("#round", is_on)
        .list("#sides", sides)
        .text("#round-clock", round.clock)
        .yes("#round-clock", "data-late", round.is_late)
        .text("#round-task", round.task)
        .text_or_hide("#round-progress", round.progress.map(steps))
        .show("#switch-team", round.switches)
        .with_or_without("#round", "data-task", round.is_task_new.then_some("new"))
        .text("#round-said", round.spoken)
        .yes("#round-large", "data-late", round.is_late)
        .text_or_hide("#round-large", Some(round.large).filter(|large| !large.is_empty()));
    let bests = replica.filter(|_| round.result.is_some()).map_or_else(Vec::new, bests);
    result(view, round.result.as_ref()).list("#result-bests", bests).yes(
        "#result",
        "data-past",
        is_past,
    )
}

fn past_result(replica: &Replica) -> Option<ResultView> {
    let round = replica.moments.end.as_ref()?;
    RoundContext { round, ..context(replica)? }.result_view()
}

/// The best achievements of the round.
fn bests(replica: &Replica) -> Vec<View> {
    let players = replica.room.players();
    let bests = replica.moments.best().filter_map(|(seat, best)| {
        let player = players.iter().find(|player| player.seat == seat)?;
        let (label, figure) = match best {
            Best::Lap(ticks) => (say("Fastest lap"), strings::clock(f64::from(ticks), true)),
            Best::Goals(count) => (say("Most goals"), count.to_string()),
            Best::Hits(count) => (say("Most hits"), count.to_string()),
            Best::Splashed(count) => (say("Most splashed"), count.to_string()),
        };
        let item = View::item("best-item", label)
            .text("span", label)
            .text("bdi", player.appearance.name.to_string())
            .style("bdi", "--color", color_var(replica.room.color_of(player)));
        Some(item.text("b", figure))
    });
    bests.collect()
}

/// The podium of the best three sides.
fn podium(result: &ResultView) -> impl Iterator<Item = View> {
    let count = if result.sides.len() > 1 { PODIUM_MAX } else { 0 };
    result.sides.iter().take(count).enumerate().map(|(index, side)| {
        let place = if index < result.winners { 1 } else { index + 1 };
        entry("podium-item", side).with("", "data-place", place.to_string())
    })
}

fn result(view: View, result: Option<&ResultView>) -> View {
    let view = view.show("#result", result.is_some());
    let Some(result) = result else {
        return view.list("#result-sides", []).list("#podium", []);
    };
    let stars = result.stars.map(|stars| "\u{2605}".repeat(stars) + &"\u{2606}".repeat(3 - stars));
    let sentence = match result.goes_on {
        true => say("Waiting for the others: {count} s"),
        false => say("Next round: {count} s"),
    };
    let is_podium = result.sides.len() > 1;
    let listed = result.sides.iter().skip(if is_podium { PODIUM_MAX } else { 0 });
    let mood = result.own_won.map(|won| if won { "won" } else { "lost" });
    let winner = result.sides.first().filter(|_| result.winners > 0);
    view.list("#result-sides", listed.map(|side| entry("result-item", side)))
        .list("#podium", podium(result))
        .with_or_without("#result", "data-mood", mood)
        .style("#result", "--color", winner.map_or_else(String::new, |it| color_var(it.color)))
        .text("#result-detail", result.detail.clone())
        .text("#result-title", result.title.clone())
        .text_or_hide("#result-stars", stars)
        .text("#result-next", fill(sentence, &[("count", &result.next_s.to_string())]))
        .flag("#again", "disabled", result.goes_on)
}

/// The number of the current highlight, shown instead of the result.
pub fn highlights(app: &App) -> View {
    let game = app.screen.game();
    let showing = game.and_then(|game| game.showing.as_ref());
    let text = showing.map(|showing| {
        let [number, count] = [showing.player.number, showing.player.count].map(|n| n.to_string());
        fill("Highlight {number} of {count}", &[("number", &number), ("count", &count)])
    });
    let how = showing.map(|showing| if showing.is_auto { "auto" } else { "yes" });
    View::panel("highlights")
        .show("#highlights", game.is_some_and(GameScreen::has_highlights))
        .with_or_without("", "data-highlights", how)
        .show("#highlight-bar", text.is_some())
        .text("#highlight", text.unwrap_or_default())
}

/// The best run, and the outcome of the player's run.
pub fn record(app: &App) -> View {
    let own = Some(app.own_result.said.clone()).filter(|said| !said.is_empty());
    let game = app.screen.game();
    let room = game.filter(|game| own.is_some() && !game.is_in_page());
    let is_kept = room.and_then(|game| app.records.table(&game.replica()?.room.scene.name));
    let said = Some(&*app.records.said).filter(|said| !said.is_empty());
    let said = said.or(is_kept.map(|_| strings::COUNTS_ALONE));
    let scene = game.and_then(|game| game.ranked_scene(&app.ctx));
    let best = scene.and_then(|scene| Some((scene, app.records.best(scene)?)));
    let view = View::panel("record")
        .text_or_hide("#result-own", own)
        .text_or_hide("#result-said", said.map(|said| say(said).to_owned()))
        .show("#result-best", best.is_some());
    let Some((scene, (table, run))) = best else { return view };
    let heroes = app.screen.replica().is_some_and(|replica| replica.room.scene.hero.is_some());
    let race = is_raced(table, heroes).then(|| api::race(run, scene));
    view.text("#best-run", strings::best_run(table, run))
        .with("#best-watch", "href", api::watch(run))
        .show("#best-race", race.is_some())
        .with_or_without("#best-race", "href", race)
}

/// Whether players can race a scene's best run. Scenes without heroes have no ghosts.
pub fn is_raced(table: &RecordTable, heroes: bool) -> bool {
    heroes && api::is_timed(table)
}

fn round_of(replica: &Replica) -> Option<RoundView> {
    context(replica)?.view()
}

fn context(replica: &Replica) -> Option<RoundContext<'_>> {
    Some(RoundContext {
        scene: &replica.room.scene,
        round: replica.room.round()?,
        players: replica.room.players(),
        own: replica.room.seat,
        tick: replica.room.display,
        race: replica.moments.race.as_ref(),
    })
}

/// The banner of what just happened: a word or two, and whom it concerns.
pub fn banner(app: &App) -> View {
    let replica = app.screen.pictured_replica();
    let moment = replica.and_then(|it| Some((it, it.moments.banner(it.room.display)?)));
    let shown = moment.and_then(|(replica, moment)| banner_of(replica, moment));
    let view = View::panel("moment").show("#moment", shown.is_some());
    let Some((words, name, color)) = shown else { return view };
    let is_small = moment.is_some_and(|(_, moment)| {
        matches!(moment.kind, MomentKind::Leader | MomentKind::Lap | MomentKind::LifeLost)
    });
    view.text("#moment b", words)
        .text("#moment bdi", name)
        .style("#moment", "--color", color_var(color))
        .yes("#moment", "data-small", is_small)
        // Another banner starts its animation again.
        .with("#moment", "data-turn", (moment.map_or(0, |it| it.1.tick as u32) % 2).to_string())
}

/// The words of a banner, the name below them and its colour.
fn banner_of(replica: &Replica, moment: &Moment) -> Option<(&'static str, String, u8)> {
    let words = match moment.kind {
        MomentKind::Leader => say("In the lead"),
        MomentKind::Lap => say("Lap!"),
        MomentKind::LifeLost => say("A life less"),
        MomentKind::Out => say("Out!"),
        MomentKind::Captured => say("Captured!"),
        MomentKind::Goal => say("Goal!"),
        MomentKind::OwnGoal => say("Own goal!"),
        // The panel with the result has the words for the end.
        MomentKind::Hit | MomentKind::Points | MomentKind::Over => return None,
    };
    let context = context(replica)?;
    let doer = moment.by.filter(|_| moment.kind == MomentKind::OwnGoal).map(Side::Player);
    let side = context.side_view(doer.or(moment.side)?)?;
    let is_home = side.goal.is_some_and(|goal| side.score >= Some(goal));
    let words = if moment.kind == MomentKind::Lap && is_home { say("Finish!") } else { words };
    Some((words, side.name, side.color))
}

fn entry(template: &'static str, side: &SideView) -> View {
    let (key, emblem) = match side.side {
        Side::Team(team) => (u32::from(team), Some(team.to_string())),
        Side::Player(seat) => (1000 + u32::from(seat.0), None),
    };
    let class = match (side.is_own, side.is_in) {
        (true, true) => "own",
        (true, false) => "own out",
        (false, true) => "",
        (false, false) => "out",
    };
    let score = side.score.map(|score| score.to_string());
    View::item(template, key)
        .with("", "class", class)
        .style("", "--color", color_var(side.color))
        .with_or_without("i", "data-emblem", emblem)
        .text("bdi", side.name.clone())
        .text(".steps", side.progress.map_or_else(String::new, steps))
        .text(".score", side.time.clone().or(score).unwrap_or_default())
        .text(".lives", side.lives.map_or_else(String::new, lives))
}

/// A filled dot for each completed step and an empty one for each remaining step.
fn steps((done, all): (usize, usize)) -> String {
    "\u{25cf}".repeat(done.min(all)) + &"\u{25cb}".repeat(all.saturating_sub(done))
}

/// A heart for each life, or a count if there are many.
fn lives(lives: i32) -> String {
    match lives {
        ..=0 => String::new(),
        1..=LIVES_SHOWN_MAX => "\u{2665}".repeat(lives as usize),
        many => format!("\u{2665} {many}"),
    }
}
