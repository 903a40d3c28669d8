//! The controls of a replay: timeline, transport, speeds, players to follow, and the result of comparing hashes.

use crate::language::{fill, say};
use crate::page::app::App;
use crate::page::panels::hud::length;
use crate::page::panels::players::color_of;
use crate::page::strings;
use crate::page::view::{Set, Text, View, word};
use crate::replay::chapters::Chapter;
use crate::replay::player::ReplayPlayer;
use jostle_protocol::PlayerState;
use std::fmt::Write;

/// Width of the timeline in the units of its marks.
const MARKS_WIDTH: f64 = 1000.0;

pub fn view(app: &App) -> View {
    let view = View::panel("deck");
    let Some(replay) = app.screen.replay() else { return view.list("#cast", []) };
    let player = &replay.player;
    let cast = (0..)
        .zip(player.players())
        .map(|(place, shown)| chip(place, shown, player.followed == Some(shown.seat)));
    let yes = |on| if on { "yes" } else { "no" };
    let does = if player.playing { say("Pause") } else { say("Play the replay") };
    let view = view
        .list("#cast", cast)
        .with("#deck", "data-seeking", yes(player.is_seeking()))
        .with("#deck", "data-playing", yes(player.playing))
        .with("#play-pause", "aria-label", does)
        .with("#play-pause", "title", format!("{does} ({})", say("Space")))
        .set("#speeds", Set::Choice(player.speed.to_string().into()));
    verdict(timeline(view, player), player)
}

fn timeline(view: View, player: &ReplayPlayer) -> View {
    let (first, last, goal) = (player.first_tick(), player.last_tick(), player.goal());
    let since = |tick: u32| f64::from(tick - first);
    let time = strings::clock(since(goal), true);
    let spoken = fill("{time}, tick {tick}", &[("time", &time), ("tick", &goal.to_string())]);
    let whole = since(last).max(1.0);
    let share = |share: f64| format!("{:.2}%", 100.0 * share);
    view.with("#seek", "min", first.to_string())
        .with("#seek", "max", last.to_string())
        .set("#seek", Set::Value(goal.to_string().into()))
        .with("#seek", "aria-valuetext", spoken)
        .text("#time", time)
        .text("#length", length(player))
        .style("#deck", "--played", share(since(player.tick()) / whole))
        .style("#deck", "--goal", share(since(goal) / whole))
        .style("#deck", "--progress", share(player.progress()))
}

/// The result of comparing the state hashes.
fn verdict(view: View, player: &ReplayPlayer) -> View {
    let (checks, first, tick) = (&player.checks, player.first_tick(), player.tick());
    let compared = || checks.ranges.iter().any(|&[from, to]| (from..=to).contains(&tick));
    let (verdict, text): (_, Text) = match (checks.differs_at, player.hash()) {
        (Some(tick), _) => {
            let at = strings::clock(f64::from(tick - first), false);
            let text = fill("Doesn't match the recording after {time}", &[("time", &at)]);
            ("differs", text.into())
        }
        (None, _) if checks.all_equal() && player.is_at_end() => {
            ("whole", say("Fully verified").into())
        }
        (None, Some(_)) if compared() => ("equal", say("Verified").into()),
        // There is nothing to compare at the start.
        (None, Some(_)) => ("none", say("Start").into()),
        (None, None) => ("none", say("Seeking\u{2026}").into()),
    };
    view.with("#check", "data-verdict", verdict).text("#check-text", text).with(
        "#check",
        "title",
        details(player),
    )
}

/// Details of the comparison: the tick, its hash, and the first tick that differs.
fn details(player: &ReplayPlayer) -> String {
    let checks = &player.checks;
    let hash = player.hash().map_or(String::new(), |hash| {
        fill(", state hash {hash}", &[("hash", &format!("{hash:016x}"))])
    });
    let differs = checks.differs_at.map_or(String::new(), |tick| {
        fill("; differs from tick {tick}", &[("tick", &tick.to_string())])
    });
    let all = player.last_tick() - player.first_tick();
    let [count, all] = [checks.count(), all].map(|count| count.to_string());
    let compared = fill("{count} of {all} ticks compared", &[("count", &count), ("all", &all)]);
    format!("{}{hash}; {compared}{differs}", tick_in_words(player.tick()))
}

pub fn tick_in_words(tick: u32) -> String {
    fill("tick {tick}", &[("tick", &tick.to_string())])
}

/// The button that follows a player.
fn chip(place: usize, player: &PlayerState, followed: bool) -> View {
    let PlayerState { seat, appearance, .. } = player;
    let label = fill("Follow {player}", &[("player", &*appearance.name)]);
    let key = if place < 9 { format!(" ({})", place + 1) } else { String::new() };
    View::item("chip-item", seat.0)
        .with("button", "data-value", seat.0.to_string())
        .with("button", "title", label.clone() + &key)
        .with("button", "aria-label", label)
        .with("button", "aria-pressed", word(followed))
        .style("button", "--color", color_of(appearance))
        .text("bdi", appearance.name.to_string())
}

/// Marks on the timeline for compared ranges and for events.
pub fn marks(app: &App) -> View {
    let view = View::panel("marks");
    let Some(replay) = app.screen.replay() else { return view };
    let player = &replay.player;
    let (checks, chapters) = (&player.checks, &player.chapters.known);
    let first = f64::from(player.first_tick());
    let scale = MARKS_WIDTH / (f64::from(player.last_tick()) - first).max(1.0);
    let at = |tick: u32| (f64::from(tick) - first) * scale;
    let [mut checked, mut players, mut bursts, mut goals] = [const { String::new() }; 4];
    for &[from, to] in &checks.ranges {
        let (from, to) = (at(from - 1), at(to));
        // Writing to a string cannot fail.
        let _ = write!(checked, "M{from:.1} 0V8H{to:.1}V0z");
    }
    for &(tick, chapter) in chapters {
        let marks = match chapter {
            Chapter::Burst => &mut bursts,
            Chapter::Join | Chapter::Leave => &mut players,
            Chapter::Round | Chapter::Goal | Chapter::Result => &mut goals,
        };
        let _ = write!(marks, "M{:.1} 0V8", at(tick));
    }
    let wrong = checks.differs_at.map_or(String::new(), |t| format!("M{:.1} 0V8", at(t)));
    view.with("#mark-checked", "d", checked)
        .with("#mark-players", "d", players)
        .with("#mark-bursts", "d", bursts)
        .with("#mark-goals", "d", goals)
        .with("#mark-wrong", "d", wrong)
}
