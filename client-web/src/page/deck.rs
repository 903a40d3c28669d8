//! The controls under a film: timeline, transport, speeds, who is followed, and the mark that says
//! whether the hashes are equal. Plain DOM, touched only where something changed.

use super::watch::with_film;
use super::{app, dom, hud, modal, players};
use crate::film::{Chapter, Checks, Film, SPEEDS};
use crate::layers::Layer;
use crate::words;
use jostle_protocol::Appearance;
use jostle_protocol::replay::Ending;
use jostle_sim::{Seat, TICKS_PER_SECOND};
use std::fmt::Write;
use wasm_bindgen::JsCast;
use web_sys::{Element, Event, HtmlElement, HtmlInputElement, KeyboardEvent, PointerEvent};

/// The timeline's marks are brought up to date so often, milliseconds.
const MARKS_MS: f64 = 200.0;
/// Width of the timeline in the units of its marks.
const MARKS_WIDTH: f64 = 1000.0;
/// An arrow key moves so far, ticks.
const LEAP_TICKS: i64 = TICKS_PER_SECOND as i64;

/// What the controls showed last.
#[derive(Default)]
pub struct Deck {
    moment: Option<Moment>,
    cast: Vec<(Seat, Appearance)>,
    followed: Option<Seat>,
    marks_ms: f64,
    marked: (u32, usize, Option<u32>),
    /// Jumps after which the news was read.
    told: u32,
}

#[derive(Clone, Copy, PartialEq)]
struct Moment {
    tick: u32,
    goal: u32,
    last: u32,
    percent: u8,
    seeking: bool,
    playing: bool,
    at_end: bool,
    speed: f64,
    agrees: bool,
    differs_at: Option<u32>,
    all_equal: bool,
}

impl Deck {
    /// Puts a new film's name and length on the page.
    pub fn adopt(&mut self, film: &Film, name: Option<&str>, file: &str) {
        let (scene, start) = (film.scene(), film.replay().start());
        dom::set_text(&dom::by_id("room-title"), &scene.title);
        dom::document().set_title(&format!("{} \u{b7} replay \u{b7} Jostle", scene.title));
        let about = match (start.unix_s, file) {
            (0, "") => name.unwrap_or_default().to_owned(),
            (0, file) => file.to_owned(),
            (unix_s, _) => dom::date_and_time(unix_s as f64 * 1000.0),
        };
        dom::set_text(&dom::by_id("room-code"), &about);
        let hint: HtmlElement = dom::by_id("hint");
        let end = words::clock(f64::from(film.last_tick() - film.first_tick()), false);
        let cut = match film.ending() {
            Ending::Whole => String::new(),
            Ending::Cut(_) => format!("Its end is missing: it plays to {end}."),
        };
        dom::set_text(&hint, &cut);
        dom::show(&hint, !cut.is_empty());
        dom::show(&dom::by_id("copy"), name.is_some());
        let slider: HtmlInputElement = dom::by_id("seek");
        dom::set(&slider, "min", &film.first_tick().to_string());
        dom::set(&slider, "max", &film.last_tick().to_string());
        dom::set_text(&dom::by_id("length"), &end);
        for id in ["mark-checked", "mark-players", "mark-bursts", "mark-wrong"] {
            dom::set(&dom::by_id::<Element>(id), "d", "");
        }
        dom::by_id::<HtmlElement>("cast").set_text_content(None);
        fill_help(film);
    }

    /// Brings everything up to what the film shows.
    pub fn update(&mut self, film: &mut Film, now_ms: f64) {
        self.tell_news(film);
        let moment = Moment::of(film);
        let before = self.moment.replace(moment);
        if before != Some(moment) {
            show_moment(film, &moment, before.as_ref());
        }
        self.list_cast(film);
        if now_ms - self.marks_ms >= MARKS_MS {
            self.marks_ms = now_ms;
            self.draw_marks(film);
        }
    }

    /// News of what was not watched is none.
    fn tell_news(&mut self, film: &mut Film) {
        let jumped = std::mem::replace(&mut self.told, film.jumps()) != film.jumps();
        while let Some(news) = film.replica_mut().next_news() {
            if !jumped {
                hud::tell(&news);
            }
        }
    }

    fn list_cast(&mut self, film: &Film) {
        let players = film.players();
        let same = players.len() == self.cast.len()
            && players
                .iter()
                .zip(&self.cast)
                .all(|(player, (seat, look))| player.seat == *seat && player.appearance == *look);
        let list: HtmlElement = dom::by_id("cast");
        if !same {
            self.cast = players.iter().map(|p| (p.seat, p.appearance.clone())).collect();
            let focused =
                dom::document().active_element().and_then(|e| e.get_attribute("data-seat"));
            list.set_text_content(None);
            for (place, (seat, look)) in self.cast.iter().enumerate() {
                let button = chip(place, *seat, look);
                let item = dom::element("li", "");
                dom::append(&item, &button);
                dom::append(&list, &item);
                if focused == Some(seat.0.to_string()) {
                    let _ = button.focus();
                }
            }
        }
        if !same || self.followed != film.followed() {
            self.followed = film.followed();
            let chips = list.children();
            for (place, (seat, _)) in self.cast.iter().enumerate() {
                let item = chips.item(place as u32).and_then(|item| item.first_element_child());
                if let Some(button) = item {
                    let pressed = self.followed == Some(*seat);
                    dom::set(&button, "aria-pressed", &pressed.to_string());
                }
            }
        }
    }

    fn draw_marks(&mut self, film: &Film) {
        let (checks, chapters) = (film.checks(), film.chapters().known());
        let marked = (checks.count(), chapters.len(), checks.differs_at());
        if self.marked == marked {
            return;
        }
        self.marked = marked;
        let first = f64::from(film.first_tick());
        let scale = MARKS_WIDTH / (f64::from(film.last_tick()) - first).max(1.0);
        let at = |tick: u32| (f64::from(tick) - first) * scale;
        let (mut checked, mut players, mut bursts) = (String::new(), String::new(), String::new());
        for &[from, to] in checks.ranges() {
            let (from, to) = (at(from - 1), at(to));
            // Writing to a string cannot fail.
            let _ = write!(checked, "M{from:.1} 0V8H{to:.1}V0z");
        }
        for &(tick, chapter) in chapters {
            let marks = if chapter == Chapter::Burst { &mut bursts } else { &mut players };
            let _ = write!(marks, "M{:.1} 0V8", at(tick));
        }
        let wrong = checks.differs_at().map_or(String::new(), |t| format!("M{:.1} 0V8", at(t)));
        for (id, path) in [
            ("mark-checked", checked),
            ("mark-players", players),
            ("mark-bursts", bursts),
            ("mark-wrong", wrong),
        ] {
            dom::set(&dom::by_id::<Element>(id), "d", &path);
        }
    }
}

impl Moment {
    fn of(film: &Film) -> Moment {
        let checks = film.checks();
        Moment {
            tick: film.tick(),
            goal: film.goal(),
            last: film.last_tick(),
            percent: (film.progress() * 100.0) as u8,
            seeking: film.is_seeking(),
            playing: film.is_playing(),
            at_end: film.is_at_end(),
            speed: film.speed(),
            agrees: is_compared(checks, film.tick()),
            differs_at: checks.differs_at(),
            all_equal: checks.all_equal(),
        }
    }
}

fn is_compared(checks: &Checks, tick: u32) -> bool {
    checks.ranges().iter().any(|&[from, to]| (from..=to).contains(&tick))
}

fn show_moment(film: &Film, now: &Moment, before: Option<&Moment>) {
    let first = film.first_tick();
    let slider: HtmlInputElement = dom::by_id("seek");
    if before.is_none_or(|before| before.last != now.last) {
        dom::set(&slider, "max", &now.last.to_string());
        dom::set_text(&dom::by_id("length"), &words::clock(f64::from(now.last - first), false));
    }
    slider.set_value(&now.goal.to_string());
    let since = |tick: u32| f64::from(tick - first);
    let time = words::clock(since(now.goal), true);
    dom::set(&slider, "aria-valuetext", &format!("{time}, tick {}", now.goal));
    dom::set_text(&dom::by_id("time"), &time);
    let deck: HtmlElement = dom::by_id("deck");
    let whole = since(now.last).max(1.0);
    let percent = |share: f64| format!("{:.2}%", 100.0 * share);
    dom::style(&deck, "--played", &percent(since(now.tick) / whole));
    dom::style(&deck, "--goal", &percent(since(now.goal) / whole));
    dom::style(&deck, "--progress", &percent(f64::from(now.percent) / 100.0));
    if before.is_none_or(|b| (b.seeking, b.playing) != (now.seeking, now.playing)) {
        dom::set(&deck, "data-seeking", if now.seeking { "yes" } else { "no" });
        dom::set(&deck, "data-playing", if now.playing { "yes" } else { "no" });
        let button: HtmlElement = dom::by_id("play-pause");
        let does = if now.playing { "Pause" } else { "Play" };
        dom::set(&button, "aria-label", does);
        dom::set(&button, "title", &format!("{does} (Space)"));
    }
    if before.is_none_or(|before| before.speed != now.speed) {
        let selector = format!("#speeds input[value='{}']", now.speed);
        let radio = dom::document().query_selector(&selector).ok().flatten();
        if let Some(radio) = radio.and_then(|radio| radio.dyn_into::<HtmlInputElement>().ok()) {
            radio.set_checked(true);
        }
    }
    show_verdict(film, now);
}

fn show_verdict(film: &Film, now: &Moment) {
    let (verdict, text) = match (now.differs_at, film.hash()) {
        (Some(tick), _) => ("differs", format!("hash differs from tick {tick} on")),
        (None, _) if now.all_equal && now.at_end => {
            ("whole", format!("all {} ticks equal", now.last - film.first_tick()))
        }
        (None, Some(hash)) if now.agrees => {
            ("equal", format!("tick {} \u{b7} hash {:04x}\u{2026} equal", now.tick, hash >> 48))
        }
        (None, Some(_)) => ("none", format!("tick {} \u{b7} the start", now.tick)),
        (None, None) => ("none", format!("going to tick {}", now.goal)),
    };
    let check: HtmlElement = dom::by_id("check");
    dom::set(&check, "data-verdict", verdict);
    dom::set_text(&dom::by_id("check-text"), &text);
    let hash = film.hash().map_or(String::new(), |hash| format!("state hash {hash:016x}; "));
    let (count, last) = (film.checks().count(), now.last - film.first_tick());
    dom::set(&check, "title", &format!("{hash}{count} of {last} ticks played again and compared"));
}

fn chip(place: usize, seat: Seat, look: &Appearance) -> HtmlElement {
    let button = dom::element("button", "chip");
    dom::set(&button, "type", "button");
    dom::set(&button, "data-seat", &seat.0.to_string());
    dom::set(&button, "aria-label", &format!("Follow {}", look.name));
    let key = if place < 9 { format!(" ({})", place + 1) } else { String::new() };
    dom::set(&button, "title", &format!("Follow {}{key}", look.name));
    dom::style(&button, "--color", &players::color_of(look));
    dom::append(&button, &dom::element("i", ""));
    dom::append(&button, &dom::labelled("bdi", "", &look.name));
    button
}

fn fill_help(film: &Film) {
    hud::fill_help(
        "Watching a replay",
        &film.scene().about,
        "Back to the replay",
        words::REPLAY_KEYS,
    );
}

/// Listens to the controls.
pub fn listen() {
    let on_click = |id: &str, work: fn(&mut Film)| {
        dom::listen(&dom::by_id::<HtmlElement>(id), "click", move |_: Event| with_film(work));
    };
    on_click("play-pause", toggle);
    on_click("step-back", |film| step(film, -1));
    on_click("step-on", |film| step(film, 1));
    // As a video does.
    on_click("stage", toggle);
    dom::listen(&dom::by_id::<HtmlElement>("cast"), "click", |event: Event| {
        let button = dom::target_within(&event, "button");
        let seat = button.and_then(|button| button.get_attribute("data-seat")?.parse().ok());
        if let Some(seat) = seat {
            with_film(|film| follow(film, Seat(seat)));
        }
    });
    dom::listen(&dom::by_id::<HtmlElement>("speeds"), "change", |event: Event| {
        let radio = event.target().and_then(|target| target.dyn_into::<HtmlInputElement>().ok());
        if let Some(speed) = radio.and_then(|radio| radio.value().parse().ok()) {
            with_film(|film| film.set_speed(speed));
        }
    });
    listen_slider();
}

fn listen_slider() {
    let slider: HtmlInputElement = dom::by_id("seek");
    dom::listen(&slider, "input", |_: Event| {
        let slider: HtmlInputElement = dom::by_id("seek");
        if let Ok(tick) = slider.value().parse() {
            with_film(|film| film.aim(tick));
            show_bubble(Some(tick));
        }
    });
    dom::listen(&slider, "pointermove", |event: PointerEvent| {
        let slider: HtmlInputElement = dom::by_id("seek");
        let limit = |name| slider.get_attribute(name).and_then(|v| v.parse::<f64>().ok());
        let (Some(first), Some(last)) = (limit("min"), limit("max")) else { return };
        // The ends of the way of the thumb's middle.
        let (thumb, width) = (f64::from(slider.client_height()), f64::from(slider.client_width()));
        let share = (f64::from(event.offset_x()) - thumb / 2.0) / (width - thumb).max(1.0);
        show_bubble(Some((first + share.clamp(0.0, 1.0) * (last - first)).round() as u32));
    });
    for kind in ["pointerleave", "pointercancel", "blur"] {
        dom::listen(&slider, kind, |_: Event| show_bubble(None));
    }
}

/// The time and tick that the pointer is at on the timeline.
fn show_bubble(tick: Option<u32>) {
    let bubble: HtmlElement = dom::by_id("bubble");
    dom::show(&bubble, tick.is_some());
    let Some(tick) = tick else { return };
    with_film(|film| {
        let since = |tick: u32| f64::from(tick.saturating_sub(film.first_tick()));
        let text = format!("{} \u{b7} tick {tick}", words::clock(since(tick), true));
        dom::set_text(&bubble, &text);
        let share = since(tick) / since(film.last_tick()).max(1.0);
        dom::style(&bubble, "--at", &format!("{share:.4}"));
    });
}

fn toggle(film: &mut Film) {
    if film.is_playing() { film.pause() } else { film.play() }
}

/// Stands still so many ticks from here.
fn step(film: &mut Film, ticks: i64) {
    film.pause();
    leap(film, ticks);
}

fn leap(film: &mut Film, ticks: i64) {
    let goal = i64::from(film.goal()) + ticks;
    let (first, last) = (i64::from(film.first_tick()), i64::from(film.last_tick()));
    film.aim(goal.clamp(first, last) as u32);
}

fn hurry(film: &mut Film, faster: bool) {
    let now = SPEEDS.iter().position(|&speed| speed == film.speed()).unwrap_or(2);
    let next = if faster { now + 1 } else { now.saturating_sub(1) };
    film.set_speed(SPEEDS[next.min(SPEEDS.len() - 1)]);
}

/// Follows a player; again for the whole world.
fn follow(film: &mut Film, seat: Seat) {
    let other = film.followed() != Some(seat);
    film.follow(other.then_some(seat));
}

/// A key while a film is on.
pub fn key_down(event: &KeyboardEvent) {
    let held = event.ctrl_key() || event.meta_key() || event.alt_key();
    if held || modal::top() != Layer::Page || is_theirs(event) {
        return;
    }
    let key = event.key();
    let work: Box<dyn FnOnce(&mut Film)> = match key.as_str() {
        " " if event.repeat() => Box::new(|_| {}),
        " " => Box::new(toggle),
        "," => Box::new(|film| step(film, -1)),
        "." => Box::new(|film| step(film, 1)),
        "ArrowLeft" => Box::new(|film| leap(film, -LEAP_TICKS)),
        "ArrowRight" => Box::new(|film| leap(film, LEAP_TICKS)),
        "ArrowUp" => Box::new(|film| hurry(film, true)),
        "ArrowDown" => Box::new(|film| hurry(film, false)),
        "Home" => Box::new(|film| film.aim(film.first_tick())),
        "End" => Box::new(|film| film.aim(film.last_tick())),
        "0" => Box::new(|film| film.follow(None)),
        digit => match digit.parse::<usize>() {
            Ok(place) => Box::new(move |film| {
                let seat = film.players().get(place.wrapping_sub(1)).map(|player| player.seat);
                if let Some(seat) = seat {
                    follow(film, seat);
                }
            }),
            Err(_) => return,
        },
    };
    event.prevent_default();
    with_film(work);
}

/// Whether a key has a meaning for the control that has the focus.
fn is_theirs(event: &KeyboardEvent) -> bool {
    let key = event.key();
    let Some(target) = event.target().and_then(|t| t.dyn_into::<Element>().ok()) else {
        return false;
    };
    if target.closest("button, a").ok().flatten().is_some() {
        return matches!(key.as_str(), " " | "Enter");
    }
    let moves = key.starts_with("Arrow") || key.starts_with("Page");
    target.tag_name() == "INPUT" && (moves || matches!(key.as_str(), "Home" | "End"))
}

/// Shows or hides the bounds.
pub fn toggle_bounds() {
    app::with(|app| app.watch_mut().map(|watch| watch.film.toggle_bounds()));
}
