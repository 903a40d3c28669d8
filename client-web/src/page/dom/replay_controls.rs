//! The controls under a replay: timeline, transport, speeds, players to follow, and the mark that says
//! whether the hashes are equal. Plain DOM, touched only where something changed.

use crate::page::dom;
use crate::page::dom::{help, players};
use crate::page::event::{Event, ReplayCommand};
use crate::page::queue::Events;
use crate::page::replay_screen::OpenReplay;
use crate::page::strings::{self, Verdict};
use crate::replay::chapters::Chapter;
use crate::replay::checks::Checks;
use crate::replay::player::ReplayPlayer;
use jostle_game::Seat;
use jostle_protocol::Appearance;
use jostle_protocol::replay::Ending;
use std::fmt::Write;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlElement, HtmlInputElement, PointerEvent};

/// Time between two updates of the timeline's marks, milliseconds.
const MARKS_MS: f64 = 200.0;
/// Width of the timeline in the units of its marks.
const MARKS_WIDTH: f64 = 1000.0;
/// The controls as they were shown last.
#[derive(Default)]
pub struct ReplayControls {
    moment: Option<Moment>,
    cast: Vec<(Seat, Appearance)>,
    followed: Option<Seat>,
    marks_ms: f64,
    marked: (u32, usize, Option<u32>),
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

impl ReplayControls {
    /// Puts a new replay's name and length on the page.
    pub fn adopt(&mut self, replay: &OpenReplay) {
        *self = ReplayControls::default();
        let OpenReplay { player, name, file, .. } = replay;
        let (scene, start) = (player.scene(), player.replay().start());
        dom::set_text(&dom::by_id("room-title"), &scene.title);
        dom::document().set_title(&format!("{} \u{b7} replay \u{b7} Jostle", scene.title));
        let about = match (start.unix_s, file.as_str()) {
            (0, "") => name.clone().unwrap_or_default(),
            (0, file) => file.to_owned(),
            (unix_s, _) => dom::date_and_time(unix_s as f64 * 1000.0),
        };
        dom::set_text(&dom::by_id("room-code"), &about);
        let hint: HtmlElement = dom::by_id("hint");
        let end = strings::clock(f64::from(player.last_tick() - player.first_tick()), false);
        let cut = match player.ending() {
            Ending::Whole => String::new(),
            Ending::Cut(_) => strings::incomplete(&end),
        };
        dom::set_text(&hint, &cut);
        dom::show(&hint, !cut.is_empty());
        dom::show(&dom::by_id("copy"), name.is_some());
        let slider: HtmlInputElement = dom::by_id("seek");
        dom::set(&slider, "min", &player.first_tick().to_string());
        dom::set(&slider, "max", &player.last_tick().to_string());
        dom::set_text(&dom::by_id("length"), &end);
        for id in ["mark-checked", "mark-players", "mark-bursts", "mark-wrong"] {
            dom::set(&dom::by_id::<Element>(id), "d", "");
        }
        dom::by_id::<HtmlElement>("cast").set_text_content(None);
        help::fill_for_replay(player);
    }

    /// Shows the state of a replay.
    pub fn show(&mut self, player: &ReplayPlayer, now_ms: f64) {
        let moment = Moment::of(player);
        let before = self.moment.replace(moment);
        if before != Some(moment) {
            show_moment(player, &moment, before.as_ref());
        }
        self.list_cast(player);
        if now_ms - self.marks_ms >= MARKS_MS {
            self.marks_ms = now_ms;
            self.draw_marks(player);
        }
    }

    fn list_cast(&mut self, player: &ReplayPlayer) {
        let players = player.players();
        let same = players.len() == self.cast.len()
            && players.iter().zip(&self.cast).all(|(player, (seat, appearance))| {
                player.seat == *seat && player.appearance == *appearance
            });
        let list: HtmlElement = dom::by_id("cast");
        if !same {
            self.cast = players.iter().map(|p| (p.seat, p.appearance.clone())).collect();
            let focused =
                dom::document().active_element().and_then(|e| e.get_attribute("data-seat"));
            list.set_text_content(None);
            for (place, (seat, appearance)) in self.cast.iter().enumerate() {
                let button = chip(place, *seat, appearance);
                let item = dom::element("li", "");
                dom::append(&item, &button);
                dom::append(&list, &item);
                if focused == Some(seat.0.to_string()) {
                    let _ = button.focus();
                }
            }
        }
        if !same || self.followed != player.followed() {
            self.followed = player.followed();
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

    fn draw_marks(&mut self, player: &ReplayPlayer) {
        let (checks, chapters) = (player.checks(), player.chapters().known());
        let marked = (checks.count(), chapters.len(), checks.differs_at());
        if self.marked == marked {
            return;
        }
        self.marked = marked;
        let first = f64::from(player.first_tick());
        let scale = MARKS_WIDTH / (f64::from(player.last_tick()) - first).max(1.0);
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
    fn of(player: &ReplayPlayer) -> Moment {
        let checks = player.checks();
        Moment {
            tick: player.tick(),
            goal: player.goal(),
            last: player.last_tick(),
            percent: (player.progress() * 100.0) as u8,
            seeking: player.is_seeking(),
            playing: player.is_playing(),
            at_end: player.is_at_end(),
            speed: player.speed(),
            agrees: is_compared(checks, player.tick()),
            differs_at: checks.differs_at(),
            all_equal: checks.all_equal(),
        }
    }
}

fn is_compared(checks: &Checks, tick: u32) -> bool {
    checks.ranges().iter().any(|&[from, to]| (from..=to).contains(&tick))
}

fn show_moment(player: &ReplayPlayer, now: &Moment, before: Option<&Moment>) {
    let first = player.first_tick();
    let slider: HtmlInputElement = dom::by_id("seek");
    if before.is_none_or(|before| before.last != now.last) {
        dom::set(&slider, "max", &now.last.to_string());
        dom::set_text(&dom::by_id("length"), &strings::clock(f64::from(now.last - first), false));
    }
    slider.set_value(&now.goal.to_string());
    let since = |tick: u32| f64::from(tick - first);
    let time = strings::clock(since(now.goal), true);
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
    show_verdict(player, now);
}

fn show_verdict(player: &ReplayPlayer, now: &Moment) {
    let first = player.first_tick();
    let verdict = match (now.differs_at, player.hash()) {
        (Some(tick), _) => Verdict::Differs(tick - first),
        (None, _) if now.all_equal && now.at_end => Verdict::Whole,
        (None, Some(_)) if now.agrees => Verdict::Equal,
        (None, Some(_)) => Verdict::Start,
        (None, None) => Verdict::Seeking,
    };
    let (verdict, text) = verdict.texts();
    let check: HtmlElement = dom::by_id("check");
    dom::set(&check, "data-verdict", verdict);
    dom::set_text(&dom::by_id("check-text"), &text);
    // Details for comparisons: the tick, its hash, the first tick that differs.
    let hash = player.hash().map_or(String::new(), |hash| format!(", state hash {hash:016x}"));
    let differs =
        now.differs_at.map_or(String::new(), |tick| format!("; differs from tick {tick}"));
    let (count, last) = (player.checks().count(), now.last - first);
    let compared = format!("{count} of {last} ticks compared");
    dom::set(&check, "title", &format!("tick {}{hash}; {compared}{differs}", now.tick));
}

fn chip(place: usize, seat: Seat, appearance: &Appearance) -> HtmlElement {
    let button = dom::element("button", "chip");
    dom::set(&button, "type", "button");
    dom::set(&button, "data-seat", &seat.0.to_string());
    dom::set(&button, "aria-label", &format!("Follow {}", appearance.name));
    let key = if place < 9 { format!(" ({})", place + 1) } else { String::new() };
    dom::set(&button, "title", &format!("Follow {}{key}", appearance.name));
    dom::style(&button, "--color", &players::color_of(appearance));
    dom::append(&button, &dom::element("i", ""));
    dom::append(&button, &dom::labelled("bdi", "", &appearance.name));
    button
}

/// Listens to the controls.
pub fn listen(events: Events) {
    for (id, command) in [
        ("play-pause", ReplayCommand::Toggle),
        ("step-back", ReplayCommand::Step(-1)),
        ("step-on", ReplayCommand::Step(1)),
    ] {
        dom::listen(&dom::by_id::<HtmlElement>(id), "click", move |_: web_sys::Event| {
            events.push(Event::Replay(command));
        });
    }
    dom::listen(&dom::by_id::<HtmlElement>("cast"), "click", move |event: web_sys::Event| {
        let button = dom::target_within(&event, "button");
        let seat = button.and_then(|button| button.get_attribute("data-seat")?.parse().ok());
        if let Some(seat) = seat {
            events.push(Event::Replay(ReplayCommand::Follow(Seat(seat))));
        }
    });
    dom::listen(&dom::by_id::<HtmlElement>("speeds"), "change", move |event: web_sys::Event| {
        let radio = event.target().and_then(|target| target.dyn_into::<HtmlInputElement>().ok());
        if let Some(speed) = radio.and_then(|radio| radio.value().parse().ok()) {
            events.push(Event::Replay(ReplayCommand::Speed(speed)));
        }
    });
    listen_slider(events);
}

fn listen_slider(events: Events) {
    let slider: HtmlInputElement = dom::by_id("seek");
    dom::listen(&slider, "input", move |_: web_sys::Event| {
        let slider: HtmlInputElement = dom::by_id("seek");
        if let Ok(tick) = slider.value().parse() {
            events.push(Event::Replay(ReplayCommand::Seek(tick)));
            show_bubble(Some(tick));
        }
    });
    dom::listen(&slider, "pointermove", |event: PointerEvent| {
        let slider: HtmlInputElement = dom::by_id("seek");
        let [first, last] = limits(&slider);
        // The ends of the way of the thumb's middle.
        let (thumb, width) = (f64::from(slider.client_height()), f64::from(slider.client_width()));
        let share = (f64::from(event.offset_x()) - thumb / 2.0) / (width - thumb).max(1.0);
        show_bubble(Some((first + share.clamp(0.0, 1.0) * (last - first)).round() as u32));
    });
    for kind in ["pointerleave", "pointercancel", "blur"] {
        dom::listen(&slider, kind, |_: web_sys::Event| show_bubble(None));
    }
}

/// The first and last tick of the timeline.
fn limits(slider: &HtmlInputElement) -> [f64; 2] {
    let limit = |name| slider.get_attribute(name).and_then(|value| value.parse().ok());
    [limit("min").unwrap_or(0.0), limit("max").unwrap_or(0.0)]
}

/// Shows the time and tick that the pointer is at on the timeline.
fn show_bubble(tick: Option<u32>) {
    let bubble: HtmlElement = dom::by_id("bubble");
    dom::show(&bubble, tick.is_some());
    let Some(tick) = tick else { return };
    let [first, last] = limits(&dom::by_id("seek"));
    let since = f64::from(tick) - first;
    let text = format!("{} \u{b7} tick {tick}", strings::clock(since.max(0.0), true));
    dom::set_text(&bubble, &text);
    let share = since / (last - first).max(1.0);
    dom::style(&bubble, "--at", &format!("{share:.4}"));
}
