//! The controls over the canvas of a game: key caps, signal, figures, banner. Plain DOM, touched only
//! where something changed.

use crate::input::bindings::{Bindings, Layout};
use crate::language::{around, fill, say};
use crate::net::clock::Clock;
use crate::page::app::App;
use crate::page::dom;
use crate::page::dom::help;
use crate::page::dom::list::{Item, List};
use crate::page::game::GameScreen;
use crate::page::news_log::NewsLog;
use crate::page::panels::players::color_of;
use crate::page::settings::Settings;
use crate::page::{strings, tools};
use crate::view::palette;
use crate::world::replica::{News, Replica};
use jostle_game::{Buttons, Kind, Scene, Tools};

/// Key caps are large for this long after joining, milliseconds.
const CAPS_LARGE_MS: f64 = 10_000.0;
/// The answer to a request for a clip is shown for this long, milliseconds.
const CLIP_MS: f64 = 8000.0;
/// The answer to a denied request is shown for this long, milliseconds.
const DENIED_MS: f64 = 5000.0;

/// The controls as they were shown last.
pub struct Hud {
    scene: Option<String>,
    /// Buttons that are down, and the kind of body that is picked.
    lit: (Buttons, Option<Kind>),
    /// The keys and their labels.
    keyed: (Bindings, Layout),
    caps: List,
    feed: List,
    /// Keys of the help, of a game or of a replay.
    pub help: List,
    /// CSS pixels of the canvas that the score board covers at the top, and the key caps at the bottom.
    pub covered_css: [f32; 2],
}

impl Hud {
    /// Nothing was shown yet.
    pub fn new() -> Hud {
        Hud {
            scene: None,
            lit: (Buttons::default(), None),
            keyed: Default::default(),
            caps: List::new("caps"),
            feed: List::new("feed"),
            help: List::new("help-keys"),
            covered_css: [0.0; 2],
        }
    }

    /// Forgets the last screen.
    pub fn clear(&mut self) {
        self.scene = None;
        self.covered_css = [0.0; 2];
        for list in [&mut self.caps, &mut self.feed] {
            list.show([]);
        }
        for id in ["room-title", "room-code", "told"] {
            dom::text(id, "");
        }
        for id in ["banner", "lag-badge", "clip", "hint", "help-hint", "close-room", "edit-game"] {
            dom::show(id, false);
        }
        dom::show("copy", true);
        dom::show("qr-code", true);
        dom::show("signal", true);
        dom::document().set_title("Jostle");
    }

    pub fn show_news(&mut self, news: &NewsLog) {
        self.feed.show(news.lines.iter().map(|(number, news)| line(*number, news)));
    }

    /// Shows everything that may change with every frame.
    pub fn show_frame(&mut self, app: &App, game: &GameScreen) {
        let now_ms = app.now_ms();
        if let Some(replica) = game.replica() {
            self.show_scene(app, game, replica);
        }
        let joined_ms = game.status.joined_ms;
        let small = joined_ms.is_some_and(|joined| now_ms - joined > CAPS_LARGE_MS);
        dom::set(
            &dom::html("caps"),
            "class",
            Some(["hud caps", "hud caps small"][usize::from(small)]),
        );
        let denied = game.status.denied_ms.is_some_and(|at| now_ms - at <= DENIED_MS);
        let clip = game.status.clip.as_ref().filter(|(at, _)| now_ms - at <= CLIP_MS);
        dom::show("clip", clip.is_some());
        if let Some((_, kept)) = clip {
            dom::text(
                "clip-text",
                say(kept.as_ref().map_or_else(|refusal| *refusal, |name| strings::clip(name))),
            );
            let name = kept.as_ref().ok().filter(|name| !name.is_empty());
            dom::show("clip-link", name.is_some());
            let link = name.map(|name| format!("{}/replay/{name}", game.server()));
            dom::set(&dom::html("clip-link"), "href", link.as_deref());
        }
        let answer = say("Only the host can do that, and a host can't be removed.");
        dom::text("told", if denied { answer } else { "" });
    }

    fn show_scene(&mut self, app: &App, game: &GameScreen, replica: &Replica) {
        let scene = &replica.scene;
        let lit = (game.controls.buttons(), replica.selected_kind());
        let settings = &app.settings;
        let keyed = self.keyed.0 == settings.keys && self.keyed.1 == settings.layout;
        if !keyed {
            self.keyed = (settings.keys.clone(), settings.layout.clone());
        }
        let known = self.scene.as_ref() == Some(&scene.source) && keyed;
        if !known || self.lit != lit {
            self.lit = lit;
            self.caps.show(caps(scene, lit, settings));
        }
        if known {
            return;
        }
        self.scene = Some(scene.source.clone());
        dom::show("turn", !scene.tools.contains(Tools::STEER));
        dom::text("room-title", say(&scene.title));
        dom::document().set_title(&format!("{} \u{b7} Jostle", say(&scene.title)));
        let code = format!("/{}", game.code);
        let about = match game.is_in_page() {
            true if game.is_alone() => say("played alone"),
            true => say("demo, offline"),
            false => &code,
        };
        let hint = match dom::is_touched() {
            true => say("watching: tap a name to follow it"),
            false => say("watching: a digit follows a player, H hides all but the game"),
        };
        let watched = format!("{about} \u{b7} {hint}");
        dom::text("room-code", if game.watches() { &watched } else { about });
        // There is no connection to show.
        dom::show("signal", !game.is_alone());
        help::fill_for_game(&mut self.help, scene, settings);
    }

    /// Shows the texts that need not change with every frame.
    pub fn show_texts(&mut self, app: &App, game: &GameScreen) {
        show_signal(game, app.now_ms());
        dom::show("close-room", game.status.host);
        dom::show("edit-game", game.is_in_page());
        if app.panels.figures {
            show_figures(game, app.now_ms());
        }
        let closing = game.status.closing_ms.map(|closing_ms| {
            let seconds = ((closing_ms - app.now_ms()) / 1000.0).ceil().max(0.0);
            let sentence = match game.status.is_kept {
                true => say("Server restarting in {count} s: the game goes on right after"),
                false => say("Server restarting in {count} s"),
            };
            fill(sentence, &[("count", &format!("{seconds:.0}"))])
        });
        dom::text_or_hide("banner", closing.as_deref());
        // A simulated network is never mistaken for the real one.
        let simulated = app.conditions.is_on() && !game.is_in_page();
        let badge = fill(
            "Simulated bad connection: {conditions}",
            &[("conditions", &app.conditions.words())],
        );
        dom::text_or_hide("lag-badge", simulated.then_some(&badge));
        self.covered_css = ["board", "caps"].map(|id| dom::html(id).offset_height() as f32);
    }
}

/// The key caps of a scene; those whose buttons are down or whose body is picked are lit.
fn caps(
    scene: &Scene,
    (pressed, selected): (Buttons, Option<Kind>),
    settings: &Settings,
) -> impl Iterator<Item = Item> {
    tools::caps(scene).into_iter().map(move |cap| {
        let picked = selected.is_some_and(|kind| tools::picks(cap.buttons) == Some(kind));
        let classes = [
            (true, "cap"),
            (cap.does.is_empty(), "joined"),
            (pressed.contains(cap.buttons), "down"),
            (picked, "picked"),
        ];
        let classes: Vec<&str> = classes.into_iter().filter(|c| c.0).map(|c| c.1).collect();
        Item::new("cap-item", cap.key)
            .with("", "class", classes.join(" "))
            .text("kbd", settings.key_of(&cap))
            .text(".does", say(cap.does))
    })
}

fn line(number: usize, news: &News) -> Item {
    let recolored;
    let (who, text, whom) = match news {
        News::Said(who, text, whom) => (who.as_ref(), say(text), whom.as_ref()),
        News::Joined(who) => (Some(who), say(" joined"), None),
        News::Left(who) => (Some(who), say(" left"), None),
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
        News::Fell(who) => (Some(who), say(" fell out of the world"), None),
    };
    Item::new("news-item", number)
        .text("bdi", who.map_or("", |who| &who.name))
        .with("bdi", "--color", who.map(color_of))
        .text("span", text)
        .text("bdi:last-child", whom.map_or("", |whom| &whom.name))
        .with("bdi:last-child", "--color", whom.map(color_of))
}

fn show_signal(game: &GameScreen, now_ms: f64) {
    let bars = game.bars(now_ms);
    let signal = dom::html("signal");
    dom::set(&signal, "data-bars", Some(&bars.to_string()));
    let title = match bars {
        0 => say("No connection"),
        1 | 2 => say("Slow connection"),
        _ => say("Good connection"),
    };
    dom::set(&signal, "title", Some(title));
    let ping = game.meter.ping_ms.filter(|_| !game.is_in_page() && bars > 0);
    dom::text("ping", &ping.map_or(String::new(), |ms| format!("{ms:.0} ms")));
}

fn show_figures(game: &GameScreen, now_ms: f64) {
    let clock = game.membership.as_ref().map(|membership| &membership.clock);
    let ticks = |figure: fn(&Clock) -> f64| {
        fill("{count} ticks", &[("count", &format!("{:.1}", clock.map_or(0.0, figure)))])
    };
    let count = |figure: fn(&Replica) -> usize| game.replica().map_or(0, figure).to_string();
    let tick = clock.and_then(|clock| clock.server_tick(now_ms)).unwrap_or(0.0);
    let meter = &game.meter;
    for (id, text) in [
        ("figure-ping", meter.ping_ms.map_or("-".into(), |ms| format!("{ms:.0} ms"))),
        ("figure-jitter", ticks(|clock| clock.lateness_ticks)),
        ("figure-delay", ticks(Clock::delay_ticks)),
        ("figure-tick", format!("{tick:.0}")),
        ("figure-in", format!("{:.1} kB/s", meter.bytes_a_second(now_ms) as f64 / 1000.0)),
        ("figure-frames", format!("{} /s", meter.frames_a_second(now_ms))),
        ("figure-bodies", count(|replica| replica.bodies().len())),
        ("figure-particles", count(|replica| replica.particles().len())),
        ("figure-players", count(|replica| replica.players().len())),
    ] {
        dom::text(id, &text);
    }
}
