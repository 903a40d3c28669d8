//! The controls over the canvas of a game: key caps, signal, figures, banner. Plain DOM, touched only
//! where something changed.

use crate::page::app::App;
use crate::page::dom;
use crate::page::dom::help;
use crate::page::dom::players::{PlayersView, name_element};
use crate::page::game::GameScreen;
use crate::page::news_log::NewsLog;
use crate::page::strings;
use crate::page::tools::{self, Cap};
use crate::world::replica::{News, Replica};
use jostle_game::{Buttons, Kind, Scene};
use jostle_protocol::Appearance;
use web_sys::HtmlElement;

/// Key caps are large for this long after joining, milliseconds.
const CAPS_LARGE_MS: f64 = 10_000.0;
/// The answer to a denied request is shown for this long, milliseconds.
const DENIED_MS: f64 = 5000.0;

/// The controls as they were shown last.
#[derive(Default)]
pub struct Hud {
    scene: Option<String>,
    caps: Vec<(Cap, HtmlElement)>,
    players: PlayersView,
    pressed: Buttons,
    selected: Option<Kind>,
    news_shown: usize,
    bottom_css: f32,
}

impl Hud {
    /// CSS pixels at the bottom of the canvas that the key caps cover.
    pub fn bottom_css(&self) -> f32 {
        self.bottom_css
    }

    /// Forgets the last screen.
    pub fn clear(&mut self) {
        *self = Hud::default();
        for id in ["caps", "feed", "players", "room-title", "room-code", "told"] {
            dom::by_id::<HtmlElement>(id).set_text_content(None);
        }
        for id in ["banner", "lag-badge", "hint", "help-hint", "close-room"] {
            dom::show(&dom::by_id(id), false);
        }
        dom::show(&dom::by_id("copy"), true);
        dom::document().set_title("Jostle");
    }

    /// Shows the newest news.
    pub fn show_news(&mut self, news: &NewsLog) {
        let list: HtmlElement = dom::by_id("feed");
        let new = news.added() - self.news_shown;
        let lines: Vec<&News> = news.lines().collect();
        self.news_shown = news.added();
        for news in &lines[lines.len().saturating_sub(new)..] {
            dom::append(&list, &line(news));
        }
        while list.child_element_count() > lines.len() as u32 {
            let Some(oldest) = list.first_element_child() else { return };
            oldest.remove();
        }
    }

    /// Shows everything that may change with every frame.
    pub fn show_frame(&mut self, app: &App, game: &GameScreen) {
        self.adopt_scene(game);
        self.light_caps(game, app.now_ms());
        let denied = game.status.denied_ms.is_some_and(|at| app.now_ms() - at <= DENIED_MS);
        dom::set_text(&dom::by_id("told"), if denied { strings::DENIED } else { "" });
    }

    fn adopt_scene(&mut self, game: &GameScreen) {
        let Some(replica) = game.replica() else { return };
        if self.scene.as_ref() == Some(&replica.scene.source) {
            return;
        }
        self.scene = Some(replica.scene.source.clone());
        dom::set_text(&dom::by_id("room-title"), &replica.scene.title);
        dom::document().set_title(&format!("{} \u{b7} Jostle", replica.scene.title));
        let code =
            if game.is_in_page() { "demo, offline".into() } else { format!("/{}", game.code) };
        dom::set_text(&dom::by_id("room-code"), &code);
        self.caps = make_caps(&replica.scene);
        help::fill_for_game(&replica.scene);
    }

    fn light_caps(&mut self, game: &GameScreen, now_ms: f64) {
        let joined_ms = game.status.joined_ms;
        let small = joined_ms.is_some_and(|joined| now_ms - joined > CAPS_LARGE_MS);
        let caps: HtmlElement = dom::by_id("caps");
        if caps.class_list().contains("small") != small {
            let _ = caps.class_list().toggle_with_force("small", small);
        }
        let pressed = game.controls.buttons();
        let selected = game.replica().and_then(Replica::selected_kind);
        if (pressed, selected) == (self.pressed, self.selected) {
            return;
        }
        (self.pressed, self.selected) = (pressed, selected);
        for (cap, element) in &self.caps {
            let _ = element.class_list().toggle_with_force("down", pressed.contains(cap.buttons));
            let picked = selected.is_some_and(|kind| tools::picks(cap.buttons) == Some(kind));
            let _ = element.class_list().toggle_with_force("picked", picked);
        }
    }

    /// Shows the texts that need not change with every frame.
    pub fn show_texts(&mut self, app: &App, game: &GameScreen) {
        show_signal(game, app.now_ms());
        if let Some(replica) = game.replica() {
            self.players.show(replica, game.status.host);
        }
        dom::show(&dom::by_id("close-room"), game.status.host);
        if app.panels.figures {
            show_figures(game, app.now_ms());
        }
        show_banner(game, app.now_ms());
        // A simulated network is never mistaken for the real one.
        let badge: HtmlElement = dom::by_id("lag-badge");
        if app.conditions.is_on() {
            dom::set_text(&badge, &strings::simulated(&app.conditions.words()));
        }
        dom::show(&badge, app.conditions.is_on() && !game.is_in_page());
        self.bottom_css = dom::by_id::<HtmlElement>("caps").offset_height() as f32;
    }
}

fn make_caps(scene: &Scene) -> Vec<(Cap, HtmlElement)> {
    let parent: HtmlElement = dom::by_id("caps");
    parent.set_text_content(None);
    let made = tools::caps(scene).into_iter().map(|cap| {
        let element = dom::element("span", if cap.does.is_empty() { "cap joined" } else { "cap" });
        dom::append(&element, &dom::labelled("kbd", "", cap.key));
        dom::append(&element, &dom::labelled("span", "does", cap.does));
        dom::append(&parent, &element);
        (cap, element)
    });
    made.collect()
}

/// A line of the feed.
fn line(news: &News) -> HtmlElement {
    let line = dom::element("li", "");
    let name = |who: &Appearance| dom::append(&line, &name_element(who));
    let say = |text: &str| dom::append(&line, &dom::labelled("span", "", text));
    match news {
        News::Joined(who) => {
            name(who);
            say(" joined");
        }
        News::Left(who) => {
            name(who);
            say(" left");
        }
        News::Hit(by, Some(whom)) if by == whom => {
            name(by);
            say(" splashed themselves");
        }
        News::Hit(by, Some(whom)) => {
            name(by);
            say(" splashed ");
            name(whom);
        }
        News::Hit(by, None) => {
            name(by);
            say(" hit a bystander");
        }
        News::Fell(who) => {
            name(who);
            say(" fell out of the world");
        }
    }
    line
}

fn show_signal(game: &GameScreen, now_ms: f64) {
    let bars = game.bars(now_ms);
    let signal: HtmlElement = dom::by_id("signal");
    dom::set(&signal, "data-bars", &bars.to_string());
    let title = match bars {
        0 => "No connection",
        1 | 2 => "Slow connection",
        _ => "Good connection",
    };
    dom::set(&signal, "title", title);
    let ping = game.meter.ping_ms().filter(|_| !game.is_in_page() && bars > 0);
    let ping = ping.map_or(String::new(), |ms| format!("{ms:.0} ms"));
    dom::set_text(&dom::by_id("ping"), &ping);
}

fn show_figures(game: &GameScreen, now_ms: f64) {
    let clock = game.membership.as_ref().map(|membership| &membership.clock);
    let clock = |figure: fn(&crate::net::clock::Clock) -> f64| clock.map_or(0.0, figure);
    let count = |figure: fn(&Replica) -> usize| game.replica().map_or(0, figure).to_string();
    let tick = game.membership.as_ref().and_then(|m| m.clock.server_tick(now_ms)).unwrap_or(0.0);
    let figures = [
        ("ping", game.meter.ping_ms().map_or("-".into(), |ms| format!("{ms:.0} ms"))),
        ("jitter", format!("{:.1} ticks", clock(|clock| clock.jitter_ticks()))),
        ("delay", format!("{:.1} ticks", clock(|clock| clock.delay_ticks()))),
        ("server tick", format!("{tick:.0}")),
        ("in", format!("{:.1} kB/s", game.meter.bytes_a_second(now_ms) as f64 / 1000.0)),
        ("frames", format!("{} /s", game.meter.frames_a_second(now_ms))),
        ("bodies", count(|replica| replica.bodies().len())),
        ("particles", count(|replica| replica.particles().len())),
        ("players", count(|replica| replica.players().len())),
    ];
    let list: HtmlElement = dom::by_id("figures");
    list.set_text_content(None);
    for (name, value) in figures {
        dom::append(&list, &dom::labelled("dt", "", name));
        dom::append(&list, &dom::labelled("dd", "", &value));
    }
}

fn show_banner(game: &GameScreen, now_ms: f64) {
    let banner: HtmlElement = dom::by_id("banner");
    let Some(closing) = game.status.closing_ms else { return dom::show(&banner, false) };
    let seconds = ((closing - now_ms) / 1000.0).ceil().max(0.0);
    dom::set_text(&banner, &strings::closing_in(seconds));
    dom::show(&banner, true);
}
