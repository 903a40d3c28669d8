//! The lobby: open rooms, scenes, replays, and the note under the form.

use crate::language::{fill, say};
use crate::net::api::{self, bots_alone};
use crate::page::app::App;
use crate::page::bests;
use crate::page::lobby::Lobby;
use crate::page::panels::round::is_raced;
use crate::page::strings;
use crate::page::view::{View, word};
use crate::world::daily;
use jostle_protocol::web::{RecordCard, ReplayCard, RoomCard, SceneCard};
use jostle_sim::TICKS_PER_SECOND;

/// Categories and the lists that show their scenes.
const CATEGORIES: [(&str, &str); 4] = [
    ("games", "#game-list"),
    ("gallery", "#gallery-list"),
    ("playgrounds", "#playground-list"),
    ("book", "#book-list"),
];

/// The number of replays in a folded list; the style sheet hides the others.
pub const FOLDED: usize = 6;

/// The lobby at this time, in seconds since 1970.
pub fn view(app: &App, unix_s: f64) -> View {
    let lobby = &app.lobby;
    let view = CATEGORIES.into_iter().fold(View::panel("lobby"), |view, (category, list)| {
        let on_it = lobby.scenes.iter().filter(|scene| category_of(scene) == category);
        let entries = on_it.map(|scene| scene_entry(scene, app));
        let track = Some(()).filter(|()| category == "games" && !lobby.scenes.is_empty());
        view.list(list, track.map(|()| track_entry(app)).into_iter().chain(entries))
    });
    let streaks = Some(bests::streaks(&app.ctx)).filter(|text| !text.is_empty());
    let counts = lobby.scenes.iter().any(|scene| app.records.table(&scene.name).is_some());
    view.text_or_hide("#streak", streaks)
        .show("#counts", counts)
        .list("#room-list", lobby.rooms.iter().map(|room| room_entry(lobby, room)))
        .list("#replay-list", lobby.replays.iter().map(|it| replay_entry(lobby, it, unix_s)))
        .text("#lobby-note", say(&lobby.note.text).to_owned())
        .with("#lobby-note", "class", if lobby.note.bad { "note bad" } else { "note" })
        .with_or_without("#name", "aria-invalid", lobby.name_invalid.then_some("true"))
        .with_or_without("#play", "aria-busy", lobby.busy.then_some("true"))
        .show("#no-rooms", lobby.rooms_known && lobby.rooms.is_empty())
        .show("#all-replays", lobby.replays.len() > FOLDED)
}

fn replay_entry(lobby: &Lobby, replay: &ReplayCard, unix_s: f64) -> View {
    let scene = lobby.scenes.iter().find(|scene| scene.name == replay.scene);
    let title = scene.map_or(&replay.scene, |scene| &scene.title);
    let ago = strings::ago(unix_s - replay.unix_s as f64);
    let length = match replay.seconds {
        Some(seconds) => strings::clock(f64::from(seconds) * f64::from(TICKS_PER_SECOND), false),
        None => strings::size(replay.bytes),
    };
    let length = match replay.players {
        0 => length,
        1 => fill("1 player, {length}", &[("length", &length)]),
        many => {
            let count = many.to_string();
            fill("{count} players, {length}", &[("count", &count), ("length", &length)])
        }
    };
    let when = if replay.unix_s == 0 { &replay.name } else { &ago };
    link(View::item("replay-item", &replay.name), &format!("replay/{}", replay.name), scene)
        .text("strong", say(title).to_owned())
        .text(".code", format!("/{} \u{b7} {when}", replay.room))
        .text(".seats span", length)
        .show(".live", replay.recording)
}

fn room_entry(lobby: &Lobby, room: &RoomCard) -> View {
    let scene = lobby.scenes.iter().find(|scene| scene.name == room.scene);
    let full = room.players >= room.players_max;
    let [players, players_max] = [room.players, room.players_max].map(|count| count.to_string());
    let seats = fill("{count} of {all}", &[("count", &players), ("all", &players_max)]);
    let watching = strings::watching(room.spectators);
    let share = 100.0 * f64::from(room.players) / f64::from(room.players_max.max(1));
    link(View::item("room-item", &room.code), &room.code, scene)
        .with_or_without("a", "aria-disabled", full.then_some("true"))
        .text("strong", say(&room.title).to_owned())
        .text(".code", format!("/{}", room.code))
        .with(".seats", "aria-label", fill("{seats} seats taken", &[("seats", &seats)]))
        .text(".seats span", seats + &watching)
        .with(".watch", "href", format!("/{}?watch=1", room.code))
        .with(".watch", "data-value", room.code.clone())
        .with(".watch", "aria-label", fill("Watch {scene}", &[("scene", say(&room.title))]))
        .style(".bar", "--share", format!("{share:.0}%"))
}

/// Adds a link to a path on this server, and the picture of a scene.
fn link(item: View, word: &str, scene: Option<&SceneCard>) -> View {
    let picture = scene.and_then(|scene| scene.picture.as_ref());
    let picture = picture.map_or_else(String::new, |picture| format!("url({picture:?})"));
    item.with("a", "href", format!("/{word}")).with("a", "data-value", word.to_owned()).style(
        ".thumb",
        "--picture",
        picture,
    )
}

/// The category under which a scene is shown. The server may have categories unknown to this page.
fn category_of(scene: &SceneCard) -> &'static str {
    let mut known = CATEGORIES.iter().map(|(category, _)| *category);
    known.find(|category| *category == scene.category).unwrap_or("playgrounds")
}

/// A short description of how a scene is played: player count, teams, duration. Without a server there is no
/// multiplayer, so the count is omitted.
fn manner(scene: &SceneCard, is_static: bool) -> String {
    let seats = match (scene.players_min, scene.players_max) {
        _ if is_static => String::new(),
        (_, 1) => say("1 player").to_owned(),
        (..=1, many) => fill("Up to {count} players", &[("count", &many.to_string())]),
        (few, many) => fill(
            "{count} to {most} players",
            &[("count", &few.to_string()), ("most", &many.to_string())],
        ),
    };
    let bots = if scene.fill > 0 && !is_static { say(" and bots") } else { "" };
    let teams =
        (scene.teams > 1).then(|| fill("{count} teams", &[("count", &scene.teams.to_string())]));
    let minutes = (scene.round_s > 0)
        .then(|| fill("{count} min", &[("count", &scene.round_s.div_ceil(60).to_string())]));
    let parts = [Some(seats + bots), teams, minutes].into_iter().flatten();
    parts.filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}

/// The card of the track of the day.
fn track_entry(app: &App) -> View {
    let date = daily::date(app.ctx.day());
    let race = app.lobby.scenes.iter().find(|scene| scene.name == "race");
    let card = SceneCard {
        name: daily::CARD.to_owned(),
        title: say("Track of the day").to_owned(),
        about: fill(
            "{date}: a new race every day, the same for everyone.",
            &[("date", &daily::written(date))],
        ),
        players_max: 8,
        heroes: true,
        players_min: 1,
        fill: 4,
        picture: race.and_then(|race| race.picture.clone()),
        ..SceneCard::default()
    };
    scene_entry(&card, app).show("a.edit", false)
}

fn scene_entry(scene: &SceneCard, app: &App) -> View {
    let is_static = app.ctx.site.is_static;
    let pictured = scene.picture.is_some();
    let (name, title) = (&scene.name, say(&scene.title));
    let bots = strings::bots(bots_alone(scene));
    let alone = fill("Play alone {bots}", &[("bots", &bots)]);
    let alone = alone.trim_end();
    let alone = match app.records.table(name).map(api::is_timed) {
        None => alone.to_owned(),
        Some(true) => fill("{alone}: your time counts", &[("alone", alone)]),
        Some(false) => fill("{alone}: your points count", &[("alone", alone)]),
    };
    let label = fill("Play {scene} alone {bots}", &[("scene", title), ("bots", &bots)]);
    let item = View::item("scene-item", name)
        .with("button", "data-value", name.clone())
        .with("a.edit", "data-value", name.clone())
        .with("a.edit", "href", format!("#edit={name}"))
        .with("a.edit", "aria-label", fill("Edit {scene}", &[("scene", title)]))
        .show("img", pictured)
        .with_or_without("img", "data-src", scene.picture.clone())
        .show("span.picture", !pictured)
        .text("strong", title.to_owned())
        .text(".about", say(&scene.about).to_owned())
        .text(".go span", manner(scene, is_static))
        .with_or_without(".go span", "data-bots", Some(bots).filter(|bots| !bots.is_empty()))
        .with(".alone", "data-value", name.clone())
        .with(".private", "data-value", name.clone())
        .with(".private", "aria-label", fill("Start {scene} privately", &[("scene", title)]))
        .with(".alone", "aria-label", label.trim_end().to_owned())
        .text(".alone", alone);
    own(best(item, app, name, scene.heroes), app, name)
}

/// Adds the player's own best and, if they are shown, the best runs.
fn own(item: View, app: &App, scene: &str) -> View {
    let shown = app.records.shown(scene);
    let runs = shown.map_or(&[][..], |table| &table.records);
    // The server too tells runs apart by their players' names.
    let is_own = |run: &RecordCard| run.players.iter().any(|name| **name == *app.appearance.name);
    let name = match scene {
        daily::CARD => &daily::name(daily::date(app.ctx.day())),
        scene => scene,
    };
    let best = bests::best(&app.ctx.storage, name);
    let best = best.map(|best| fill("Your best: {result}", &[("result", &best.words())]));
    let rank = runs.iter().position(is_own).map(|index| (index + 1).to_string());
    let rank = rank.map(|rank| fill("You are number {rank}", &[("rank", &rank)]));
    let text: Vec<String> = best.into_iter().chain(rank).collect();
    let entries =
        shown.into_iter().flat_map(|table| table.records.iter().map(move |run| (table, run)));
    let entries = entries.map(|(table, run)| {
        View::item("run-item", &run.name)
            .with("", "class", if is_own(run) { "own" } else { "" })
            .text("bdi", run.players.join(", "))
            .text("b", strings::result(table, run))
    });
    item.text_or_hide(".own", Some(text.join(" \u{b7} ")).filter(|text| !text.is_empty()))
        .list(".runs", entries)
}

/// Adds the scene's best run.
fn best(item: View, app: &App, scene: &str, heroes: bool) -> View {
    let best = app.records.best(scene);
    let raced = best.filter(|(table, _)| is_raced(table, heroes));
    let race = raced.map(|(_, run)| api::race(run, scene));
    item.show(".best", best.is_some())
        .text(
            ".best span",
            best.map_or_else(String::new, |(table, run)| strings::best_run(table, run)),
        )
        .with_or_without(".watch", "href", best.map(|(_, run)| api::watch(run)))
        .with(".tops", "data-value", scene.to_owned())
        .with(".tops", "aria-expanded", word(app.records.open.as_deref() == Some(scene)))
        .show(".race", race.is_some())
        .with_or_without(".race", "href", race)
}
