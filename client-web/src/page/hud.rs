//! The hud over the canvas: who is here, what happened, which keys do what, how good the
//! connection is. Plain DOM, touched only where something changed.

use super::dom;
use super::play::{Play, State};
use super::players::{Players, color_of, name_element};
use super::socket;
use crate::frame::View;
use crate::replica::{News, Replica};
use crate::words::{self, Cap};
use jostle_protocol::{Appearance, PlayerState};
use jostle_sim::{Buttons, Kind, Scene};
use web_sys::HtmlElement;

/// Key caps are large for so long after joining, milliseconds.
const CAPS_LARGE_MS: f64 = 10_000.0;
/// Text is brought up to date so often, milliseconds.
const TEXT_MS: f64 = 200.0;
/// A line about what was not done is shown for so long, milliseconds.
const TOLD_MS: f64 = 5000.0;
/// Lines in the feed.
const FEED_LINES_MAX: u32 = 6;

/// What the hud showed last.
#[derive(Default)]
pub struct Hud {
    scene: Option<String>,
    caps: Vec<(Cap, HtmlElement)>,
    players: Players,
    pressed: Buttons,
    selected: Option<Kind>,
    figures_shown: bool,
    bottom_css: f32,
    text_ms: f64,
    told_ms: Option<f64>,
}

impl Hud {
    /// Brings the hud up to a frame at `now_ms`. Whether texts are brought up to date with it.
    pub fn update(&mut self, play: &mut Play, now_ms: f64) -> bool {
        self.adopt_scene(play);
        self.light_caps(play, now_ms);
        self.tell_denied(play, now_ms);
        while let Some(news) = play.replica_mut().and_then(Replica::next_news) {
            tell(&news);
        }
        let due = now_ms - self.text_ms >= TEXT_MS;
        if due {
            self.text_ms = now_ms;
            self.update_text(play, now_ms);
        }
        due
    }

    /// Has the texts brought up to date with the next frame.
    pub fn refresh(&mut self) {
        self.text_ms = 0.0;
    }

    /// CSS pixels at the bottom of the canvas that the key caps cover.
    pub fn bottom_css(&self) -> f32 {
        self.bottom_css
    }

    /// Forgets what was shown: the game is over or starts anew.
    pub fn clear(&mut self) {
        *self = Hud { figures_shown: self.figures_shown, ..Hud::default() };
        for id in ["caps", "feed", "players", "room-title", "room-code", "told"] {
            dom::by_id::<HtmlElement>(id).set_text_content(None);
        }
        for id in ["banner", "lag-badge", "hint", "help-hint", "close-room"] {
            dom::show(&dom::by_id(id), false);
        }
        dom::show(&dom::by_id("copy"), true);
        dom::document().set_title("Jostle");
    }

    /// Shows or hides the figures.
    pub fn toggle_figures(&mut self) {
        self.figures_shown = !self.figures_shown;
        self.refresh();
        dom::show(&dom::by_id("figures"), self.figures_shown);
    }

    /// Says for a while that the room did not do what it was asked.
    fn tell_denied(&mut self, play: &mut Play, now_ms: f64) {
        let told: HtmlElement = dom::by_id("told");
        if play.take_denied() {
            self.told_ms = Some(now_ms);
            dom::set_text(&told, words::DENIED);
        } else if self.told_ms.take_if(|told_ms| now_ms - *told_ms > TOLD_MS).is_some() {
            dom::set_text(&told, "");
        }
    }

    fn adopt_scene(&mut self, play: &Play) {
        let Some(replica) = play.replica() else { return };
        if self.scene.as_ref() == Some(&replica.scene.source) {
            return;
        }
        self.scene = Some(replica.scene.source.clone());
        dom::set_text(&dom::by_id("room-title"), &replica.scene.title);
        dom::document().set_title(&format!("{} \u{b7} Jostle", replica.scene.title));
        let code = if play.is_demo() { "demo, offline".into() } else { format!("/{}", play.code) };
        dom::set_text(&dom::by_id("room-code"), &code);
        self.caps = make_caps(&replica.scene);
        show_hint(&replica.scene);
        fill_game_help(&replica.scene);
    }

    fn light_caps(&mut self, play: &Play, now_ms: f64) {
        let small = play.joined_ms.is_some_and(|joined| now_ms - joined > CAPS_LARGE_MS);
        let caps: HtmlElement = dom::by_id("caps");
        if caps.class_list().contains("small") != small {
            let _ = caps.class_list().toggle_with_force("small", small);
        }
        let pressed = play.controls.buttons();
        let selected = play.replica().and_then(Replica::selected_kind);
        if (pressed, selected) == (self.pressed, self.selected) {
            return;
        }
        (self.pressed, self.selected) = (pressed, selected);
        for (cap, element) in &self.caps {
            let _ = element.class_list().toggle_with_force("down", pressed.contains(cap.buttons));
            let picked = selected.is_some_and(|kind| words::picks(cap.buttons) == Some(kind));
            let _ = element.class_list().toggle_with_force("picked", picked);
        }
    }

    fn update_text(&mut self, play: &Play, now_ms: f64) {
        let bars = match play.state() {
            State::Playing | State::Frozen if !play.is_demo() => {
                play.meter.bars(play.silence_ms(now_ms))
            }
            State::Playing | State::Frozen => 4,
            _ => 0,
        };
        dom::set(&dom::by_id("signal"), "data-bars", &bars.to_string());
        let ping = play.meter.ping_ms().filter(|_| !play.is_demo() && bars > 0);
        let title = match bars {
            0 => "No connection",
            1 | 2 => "Slow connection",
            _ => "Good connection",
        };
        dom::set(&dom::by_id("signal"), "title", title);
        let ping = ping.map_or(String::new(), |ms| format!("{ms:.0} ms"));
        dom::set_text(&dom::by_id("ping"), &ping);
        if let Some(replica) = play.replica() {
            self.players.update(replica, play.is_host());
        }
        dom::show(&dom::by_id("close-room"), play.is_host());
        if self.figures_shown {
            show_figures(play, now_ms);
        }
        show_banner(play, now_ms);
        show_lag(play);
        self.bottom_css = dom::by_id::<HtmlElement>("caps").offset_height() as f32;
    }
}

fn make_caps(scene: &Scene) -> Vec<(Cap, HtmlElement)> {
    let parent: HtmlElement = dom::by_id("caps");
    parent.set_text_content(None);
    let made = words::caps(scene).into_iter().map(|cap| {
        let element = dom::element("span", if cap.does.is_empty() { "cap joined" } else { "cap" });
        dom::append(&element, &dom::labelled("kbd", "", cap.key));
        dom::append(&element, &dom::labelled("span", "does", cap.does));
        dom::append(&parent, &element);
        (cap, element)
    });
    made.collect()
}

/// One line on the stage and in the help.
fn show_hint(scene: &Scene) {
    let hint = words::hint(scene, is_touched());
    for id in ["hint", "help-hint"] {
        let line: HtmlElement = dom::by_id(id);
        dom::set_text(&line, hint.unwrap_or_default());
        dom::show(&line, hint.is_some());
    }
}

/// Whether the page is played with thumbs.
fn is_touched() -> bool {
    dom::root().dataset().get("touch").is_some()
}

fn fill_game_help(scene: &Scene) {
    let touch = [
        ("Left thumb", "move, where the scene has heroes"),
        ("Touch", "use the chosen tool there"),
    ];
    let general =
        [("?", "this help"), ("F2", "bounds of all bodies"), ("F3", "figures"), ("F4", "network")];
    let keys = words::caps(scene).into_iter().map(|cap| (cap.key, cap.does)).chain(general);
    let keys = touch.into_iter().filter(|_| is_touched()).chain(keys);
    fill_help("How to play", &scene.about, "Back to the game", keys);
}

/// Fills the help with keys and what they do; a key that does nothing of its own joins the next.
pub fn fill_help(
    title: &str,
    about: &str,
    back: &str,
    keys: impl IntoIterator<Item = (&'static str, &'static str)>,
) {
    dom::set_text(&dom::by_id("help-title"), title);
    dom::set_text(&dom::by_id("help-about"), about);
    dom::set_text(&dom::by_id("help-close"), back);
    let list: HtmlElement = dom::by_id("help-keys");
    list.set_text_content(None);
    let mut joined = String::new();
    for (key, does) in keys {
        joined = if joined.is_empty() { key.to_owned() } else { format!("{joined} {key}") };
        if !does.is_empty() {
            dom::append(&list, &dom::labelled("dt", "", &joined));
            dom::append(&list, &dom::labelled("dd", "", does));
            joined.clear();
        }
    }
}

/// Puts a line into the feed.
pub fn tell(news: &News) {
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
        News::Hit(by, Some(whom)) => {
            name(by);
            say(" splashed ");
            name(whom);
        }
        News::Hit(by, None) => {
            name(by);
            say(" hit a hero");
        }
        News::Fell(who) => {
            name(who);
            say(" fell out of the world");
        }
    }
    let feed: HtmlElement = dom::by_id("feed");
    dom::append(&feed, &line);
    while feed.child_element_count() > FEED_LINES_MAX {
        if let Some(oldest) = feed.first_element_child() {
            oldest.remove();
        }
    }
}

fn show_figures(play: &Play, now_ms: f64) {
    let clock = play.clock();
    let bodies = play.replica().map_or(0, |r| r.bodies().len());
    let particles = play.replica().map_or(0, |r| r.particles().len());
    let players = play.replica().map_or(0, |r| r.players().len());
    let tick = clock.server_tick(now_ms).unwrap_or(0.0);
    let figures = [
        ("ping", play.meter.ping_ms().map_or("-".into(), |ms| format!("{ms:.0} ms"))),
        ("jitter", format!("{:.1} ticks", clock.jitter_ticks())),
        ("delay", format!("{:.1} ticks", clock.delay_ticks())),
        ("server tick", format!("{tick:.0}")),
        ("in", format!("{:.1} kB/s", play.meter.bytes_a_second(now_ms) as f64 / 1000.0)),
        ("frames", format!("{} /s", play.meter.frames_a_second(now_ms))),
        ("bodies", bodies.to_string()),
        ("particles", particles.to_string()),
        ("players", players.to_string()),
    ];
    let list: HtmlElement = dom::by_id("figures");
    list.set_text_content(None);
    for (name, value) in figures {
        dom::append(&list, &dom::labelled("dt", "", name));
        dom::append(&list, &dom::labelled("dd", "", &value));
    }
}

fn show_banner(play: &Play, now_ms: f64) {
    let banner: HtmlElement = dom::by_id("banner");
    let Some(closing) = play.closing_ms else { return dom::show(&banner, false) };
    let seconds = ((closing - now_ms) / 1000.0).ceil().max(0.0);
    dom::set_text(&banner, &format!("The server closes in {seconds:.0} s"));
    dom::show(&banner, true);
}

/// A simulated network is never mistaken for the real one.
fn show_lag(play: &Play) {
    let (badge, lag) = (dom::by_id::<HtmlElement>("lag-badge"), socket::lag());
    if lag.is_on() {
        dom::set_text(&badge, &format!("Simulated network: {}", lag.words()));
    }
    dom::show(&badge, lag.is_on() && !play.is_demo());
}

/// Name tags over heroes.
#[derive(Default)]
pub struct Tags {
    tags: Vec<Tag>,
}

struct Tag {
    element: HtmlElement,
    appearance: Option<Appearance>,
    own: bool,
    size: [f32; 2],
}

impl Tags {
    /// Puts a tag over every hero in view. Where two would overlap, the own one or
    /// the first in seat order stays.
    pub fn update(&mut self, replica: &Replica, view: &View, css_per_pixel: f32) {
        let mut placed: Vec<[f32; 4]> = Vec::new();
        let mut used = 0;
        // The own tag wins its place.
        let own = |player: &&PlayerState| player.seat == replica.seat;
        let players = replica.players();
        let others = players.iter().filter(|player| !own(player));
        for player in players.iter().filter(own).chain(others) {
            let hero = player.hero.and_then(|id| replica.bodies().iter().find(|b| b.id == id));
            let Some(hero) = hero else { continue };
            let tag = self.take(used, &player.appearance, own(&player));
            used += 1;
            let above = hero.center + jostle_sim::Vec2::new(0.0, hero.shape.half_extent().y);
            let at = view.to_pixel(above) * css_per_pixel;
            let [width, height] = tag.size;
            let left = (at.x - width * 0.5).round();
            let top = (at.y - height - 6.0).round();
            let rect = [left, top, left + width, top + height];
            let free = !placed.iter().any(|other| overlap(&rect, other));
            let seen = free && in_view(&rect, view, css_per_pixel);
            if seen {
                placed.push(rect);
                let transform = format!("translate({left}px, {top}px)");
                dom::style(&tag.element, "transform", &transform);
            }
            dom::style(&tag.element, "opacity", if seen { "1" } else { "0" });
        }
        for tag in &mut self.tags[used..] {
            dom::style(&tag.element, "opacity", "0");
        }
    }

    /// Removes all tags.
    pub fn clear(&mut self) {
        for tag in self.tags.drain(..) {
            tag.element.remove();
        }
    }

    fn take(&mut self, place: usize, appearance: &Appearance, own: bool) -> &mut Tag {
        if place == self.tags.len() {
            let element = dom::element("div", "tag");
            dom::set(&element, "dir", "auto");
            dom::append(&dom::by_id::<HtmlElement>("tags"), &element);
            self.tags.push(Tag { element, appearance: None, own: false, size: [0.0; 2] });
        }
        let tag = &mut self.tags[place];
        if tag.appearance.as_ref() != Some(appearance) || tag.own != own {
            let _ = tag.element.class_list().toggle_with_force("own", own);
            tag.own = own;
            dom::set_text(&tag.element, &appearance.name);
            dom::style(&tag.element, "--color", &color_of(appearance));
            let size = [tag.element.offset_width(), tag.element.offset_height()];
            tag.size = size.map(|pixels| pixels as f32);
            tag.appearance = Some(appearance.clone());
        }
        tag
    }
}

fn overlap(a: &[f32; 4], b: &[f32; 4]) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

fn in_view(rect: &[f32; 4], view: &View, css_per_pixel: f32) -> bool {
    let width = view.pixels[0] as f32 * css_per_pixel;
    let height = view.pixels[1] as f32 * css_per_pixel;
    rect[0] < width && rect[2] > 0.0 && rect[1] > -4.0 && rect[3] < height
}
