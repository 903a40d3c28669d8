//! The controls over the canvas: title, key caps, news and answers.

use crate::language::{around, fill, say};
use crate::page::app::App;
use crate::page::game::GameScreen;
use crate::page::panels::help;
use crate::page::panels::players::color_of;
use crate::page::replay_screen::OpenReplay;
use crate::page::settings::Settings;
use crate::page::view::{Set, Text, View};
use crate::page::{strings, tools};
use crate::replay::player::ReplayPlayer;
use crate::view::palette;
use crate::world::replica::News;
use jostle_game::{Buttons, Kind, Scene, Tools};
use jostle_protocol::replay::Ending;

/// How long after joining the key caps are large, milliseconds.
const CAPS_LARGE_MS: f64 = 10_000.0;
/// How long the answer to a clip request is shown, milliseconds.
const CLIP_MS: f64 = 8000.0;
/// How long the answer to a denied request is shown, milliseconds.
const DENIED_MS: f64 = 5000.0;
/// How long the page says that it uses HTTP, milliseconds.
const OVER_HTTP_MS: f64 = 15_000.0;

/// The title of the current game or replay, and the buttons for its link.
pub fn title(app: &App) -> View {
    let view = View::panel("title");
    let (game, replay) = (app.screen.game(), app.screen.replay());
    let replica = game.and_then(GameScreen::replica);
    let view = match (game.zip(replica), replay) {
        (Some((game, replica)), _) => game_title(view, app, game, &replica.room.scene),
        (_, Some(replay)) => replay_title(view, replay),
        _ => view
            .text("title", "Jostle")
            .text("#room-title", "")
            .text("#room-code", "")
            .text_or_hide("#hint", None::<Text>),
    };
    let steers = replica.is_none_or(|replica| replica.room.scene.tools.contains(Tools::STEER));
    let has_link = replay.is_none_or(|replay| replay.name.is_some());
    view.show("#turn", !steers)
        .show("#copy", has_link)
        .show("#qr-code", has_link)
        // A game played alone has no connection quality to show.
        .show("#signal", !(replica.is_some() && game.is_some_and(GameScreen::is_alone)))
}

fn game_title(view: View, app: &App, game: &GameScreen, scene: &Scene) -> View {
    let about = match game.is_in_page() {
        true if game.is_alone() => say("played alone").to_owned(),
        true => say("demo, offline").to_owned(),
        false => format!("/{}", game.connection.code),
    };
    let hint = match app.settings.touched {
        true => say("watching: tap a name to follow it"),
        false => say("watching: a digit follows a player, H hides all but the game"),
    };
    let watched = game.watches().then(|| format!("{about} \u{b7} {hint}"));
    view.text("title", format!("{} \u{b7} Jostle", say(&scene.title)))
        .text("#room-title", say(&scene.title).to_owned())
        .text("#room-code", watched.unwrap_or(about))
        .show("#join-room", game.watches())
        .with("#join-room", "data-value", game.connection.code.clone())
        .text_or_hide("#hint", help::hint(scene, &app.settings))
}

fn replay_title(view: View, replay: &OpenReplay) -> View {
    let OpenReplay { player, name, file, .. } = replay;
    let (scene, start) = (player.scene(), player.replay().start());
    let title = say(&scene.title);
    let about = match (start.unix_s, file.as_str()) {
        (0, "") => Set::Text(name.clone().unwrap_or_default().into()),
        (0, file) => Set::Text(file.to_owned().into()),
        (unix_s, _) => Set::Moment(unix_s as f64 * 1000.0),
    };
    let cut = match player.ending() {
        Ending::Whole => None,
        Ending::Cut(_) | Ending::Damaged(_) => {
            Some(fill("Incomplete: plays to {length}", &[("length", &length(player))]))
        }
    };
    view.text("title", fill("{scene} \u{b7} replay \u{b7} Jostle", &[("scene", title)]))
        .text("#room-title", title.to_owned())
        .set("#room-code", about)
        .text_or_hide("#hint", cut)
}

/// The length of a replay.
pub fn length(player: &ReplayPlayer) -> String {
    strings::clock(f64::from(player.last_tick() - player.first_tick()), false)
}

/// The key caps of a game. Those of pressed buttons or of the selected body are highlighted.
pub fn caps(app: &App) -> View {
    let game = app.screen.game();
    let joined_ms = game.and_then(|game| game.connection.status.joined_ms);
    let small = joined_ms.is_some_and(|joined| app.ctx.now_ms - joined > CAPS_LARGE_MS);
    let caps = game.and_then(|game| {
        let replica = game.replica()?;
        let lit = (game.input.controls.buttons(), replica.room.selected_kind());
        Some(
            tools::caps(&replica.room.scene)
                .into_iter()
                .map(move |cap| cap_of(&cap, lit, &app.settings)),
        )
    });
    View::panel("caps")
        .with("#caps", "class", if small { "hud caps small" } else { "hud caps" })
        .list("#caps", caps.into_iter().flatten())
}

fn cap_of(cap: &tools::Cap, lit: (Buttons, Option<Kind>), settings: &Settings) -> View {
    let (pressed, selected) = lit;
    let mut class = "cap".to_owned();
    for (on, name) in [
        (cap.does.is_empty(), " joined"),
        (pressed.contains(cap.buttons), " down"),
        (selected.is_some_and(|kind| tools::picks(cap.buttons) == Some(kind)), " picked"),
    ] {
        class += if on { name } else { "" };
    }
    View::item("cap-item", cap.key)
        .with("", "class", class)
        .text("kbd", settings.key_of(cap))
        .text(".does", say(cap.does))
}

/// The answers to the player's requests.
pub fn answers(app: &App) -> View {
    let (game, now_ms) = (app.screen.game(), app.ctx.now_ms);
    let status = game.map(|game| &game.connection.status);
    let is_recent = |at: Option<f64>, long| at.is_some_and(|at| now_ms - at <= long);
    let denied = is_recent(status.and_then(|status| status.denied_ms), DENIED_MS);
    let over_http = is_recent(status.and_then(|status| status.over_http_ms), OVER_HTTP_MS);
    let fell = |(_, news): &(usize, News)| matches!(news, News::Fell(_));
    let is_floorless = game.is_some_and(lacks_floor) && app.visit.news.lines.iter().any(fell);
    let answer = match () {
        () if denied => say("Only the host can do that, and a host can't be removed."),
        () if over_http => say(strings::OVER_HTTP),
        () if is_floorless => say(
            "There is no floor where heroes appear, so they fall out of the world. Put a platform there.",
        ),
        () => "",
    };
    let clip = game.and_then(|game| Some((game, game.connection.status.clip.as_ref()?)));
    let clip = clip.filter(|(_, (at, _))| now_ms - at <= CLIP_MS);
    let view = View::panel("answers").text("#told", answer).show("#clip", clip.is_some());
    let Some((game, (_, kept))) = clip else { return view };
    let name = kept.as_ref().ok().filter(|name| !name.is_empty());
    let text = kept.as_ref().map_or_else(|refusal| *refusal, |name| strings::clip(name));
    view.text("#clip-text", say(text)).show("#clip-link", name.is_some()).with_or_without(
        "#clip-link",
        "href",
        name.map(|name| format!("{}/replay/{name}", game.connection.server())),
    )
}

/// Whether heroes of a scene that is being edited appear where nothing is below them.
fn lacks_floor(game: &GameScreen) -> bool {
    let scene = game.replica().filter(|_| game.edited.is_some()).map(|replica| &replica.room.scene);
    let Some((scene, hero)) = scene.and_then(|scene| Some((scene, scene.hero.as_ref()?))) else {
        return false;
    };
    hero.spawns.iter().any(|spawn| {
        scene.bodies.iter().all(|placed| {
            let away = placed.def.position - *spawn;
            let is_solid = matches!(placed.kind, Kind::Wall | Kind::Platform);
            !is_solid || away.y > 0.0 || away.x.abs() > placed.def.shape.half_extent().x
        })
    })
}

pub fn news(app: &App) -> View {
    let lines = app.visit.news.lines.iter().map(|(number, news)| line(*number, news));
    View::panel("news").list("#feed", lines)
}

fn line(number: usize, news: &News) -> View {
    let recolored;
    let (who, text, whom) = match news {
        News::Said(who, text, whom) => (who.as_ref(), say(text), whom.as_ref()),
        News::Joined(who) => (Some(who), say(" joined"), None),
        News::Left(who) => (Some(who), say(" left"), None),
        News::Removed(who) => (Some(who), say(" was removed"), None),
        News::Recolored(who, wished) => {
            let name = |color: u8| say(palette::NAMES[usize::from(color) % palette::NAMES.len()]);
            recolored = fill(
                " (you) is {color} here: {wished} was taken",
                &[("color", name(who.color)), ("wished", name(*wished))],
            );
            (Some(who), recolored.as_str(), None)
        }
        News::Hit(by, Some(whom)) if by == whom => (Some(by), say(" splashed themselves"), None),
        News::Hit(by, Some(whom)) => (Some(by), around(" splashed {player}").0, Some(whom)),
        News::Hit(by, None) => (Some(by), say(" hit a bystander"), None),
        News::OwnGoal(who) => (Some(who), say(" scored an own goal"), None),
        News::Renamed(who, now) => (Some(who), say(" is now "), Some(now)),
        News::Fell(who) => (Some(who), say(" fell out of the world"), None),
    };
    let mut item = View::item("news-item", number).text("span", text.to_owned());
    for (at, who) in [("bdi", who), ("bdi:last-child", whom)] {
        if let Some(who) = who {
            item = item.text(at, who.name.to_string()).style(at, "--color", color_of(who));
        }
    }
    item
}

/// Parts that need not change with every frame: the host's buttons and the network status.
pub fn status(app: &App) -> View {
    let game = app.screen.game();
    let closing_ms = game.and_then(|game| game.connection.status.closing_ms);
    let closing = closing_ms.map(|closing_ms| {
        let seconds = ((closing_ms - app.ctx.now_ms) / 1000.0).ceil().max(0.0);
        let sentence = match game.is_some_and(|game| game.connection.status.is_kept) {
            true => say("Server restarting in {count} s: the game goes on right after"),
            false => say("Server restarting in {count} s"),
        };
        fill(sentence, &[("count", &format!("{seconds:.0}"))])
    });
    // A simulated network must never be mistaken for the real one.
    let simulated = app.conditions.is_on() && game.is_some_and(|game| !game.is_in_page());
    let badge = simulated.then(|| {
        fill(
            "Simulated bad connection: {conditions}",
            &[("conditions", say(&app.conditions.words()))],
        )
    });
    let view = View::panel("status")
        .show("#close-room", game.is_some_and(|game| game.connection.status.host))
        .show("#edit-game", game.is_some_and(GameScreen::is_in_page))
        .text_or_hide("#banner", closing)
        .text_or_hide("#lag-badge", badge);
    match game {
        Some(game) => signal(view, game, app.ctx.now_ms),
        None => view,
    }
}

fn signal(view: View, game: &GameScreen, now_ms: f64) -> View {
    let bars = game.connection.bars(now_ms);
    let title = match bars {
        0 => say("No connection"),
        1 | 2 => say("Slow connection"),
        _ => say("Good connection"),
    };
    let ping = game.connection.meter.ping_ms.filter(|_| !game.is_in_page() && bars > 0);
    view.with("#signal", "data-bars", bars.to_string())
        .with("#signal", "title", title)
        .text("#ping", ping.map_or(String::new(), |ms| format!("{ms:.0} ms")))
}
