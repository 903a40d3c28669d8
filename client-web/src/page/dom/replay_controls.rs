//! The controls under a replay: timeline, transport, speeds, players to follow, and the mark that says
//! whether the hashes are equal. Plain DOM, touched only where something changed.

use crate::language::{fill, say};
use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::event::Event;
use crate::page::panels::hud::length;
use crate::page::panels::players::color_of;
use crate::page::queue::Events;
use crate::page::replay_screen::OpenReplay;
use crate::page::strings;
use crate::replay::chapters::Chapter;
use crate::replay::player::ReplayPlayer;
use jostle_protocol::PlayerState;
use std::fmt::Write;
use web_sys::{Element, HtmlInputElement, PointerEvent};

/// Time between two updates of the timeline's marks, milliseconds.
const MARKS_MS: f64 = 200.0;
/// Width of the timeline in the units of its marks.
const MARKS_WIDTH: f64 = 1000.0;

/// The controls as they were shown last.
pub struct ReplayControls {
    cast: List,
    marks_ms: f64,
    /// Ticks compared and chapters found when the marks were drawn, and the tick that differs.
    marked: Option<(u32, usize, Option<u32>)>,
}

impl ReplayControls {
    /// No replay was shown yet.
    pub fn new() -> ReplayControls {
        ReplayControls { cast: List::new("cast"), marks_ms: 0.0, marked: None }
    }

    /// Puts a new replay's name and length on the page.
    pub fn adopt(&mut self, replay: &OpenReplay) {
        (self.marks_ms, self.marked) = (0.0, None);
        let player = &replay.player;
        dom::set(&dom::html("seek"), "min", Some(&player.first_tick().to_string()));
        self.draw_marks(player);
    }

    pub fn show(&mut self, player: &ReplayPlayer, now_ms: f64) {
        show_timeline(player);
        let deck = dom::html("deck");
        let yes = |on| Some(if on { "yes" } else { "no" });
        dom::set(&deck, "data-seeking", yes(player.is_seeking()));
        dom::set(&deck, "data-playing", yes(player.playing));
        let does = if player.playing { say("Pause") } else { say("Play the replay") };
        let button = dom::html("play-pause");
        dom::set(&button, "aria-label", Some(does));
        dom::set(&button, "title", Some(&format!("{does} ({})", say("Space"))));
        dom::check("speeds", &player.speed.to_string());
        show_verdict(player);
        self.cast.show((0..).zip(player.players()).map(|(place, shown)| {
            let followed = player.followed == Some(shown.seat);
            chip(place, shown, followed)
        }));
        if now_ms - self.marks_ms >= MARKS_MS {
            self.marks_ms = now_ms;
            self.draw_marks(player);
        }
    }

    fn draw_marks(&mut self, player: &ReplayPlayer) {
        let (checks, chapters) = (&player.checks, &player.chapters.known);
        let marked = Some((checks.count(), chapters.len(), checks.differs_at));
        if self.marked == marked {
            return;
        }
        self.marked = marked;
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
        for (id, path) in [
            ("mark-checked", checked),
            ("mark-players", players),
            ("mark-bursts", bursts),
            ("mark-goals", goals),
            ("mark-wrong", wrong),
        ] {
            dom::set(&dom::by_id(id), "d", Some(&path));
        }
    }
}

fn show_timeline(player: &ReplayPlayer) {
    let (first, last, goal) = (player.first_tick(), player.last_tick(), player.goal());
    let slider: HtmlInputElement = dom::by_id("seek");
    dom::set(&slider, "max", Some(&last.to_string()));
    dom::text("length", &length(player));
    if slider.value() != goal.to_string() {
        slider.set_value(&goal.to_string());
    }
    let since = |tick: u32| f64::from(tick - first);
    let time = strings::clock(since(goal), true);
    dom::set(
        &slider,
        "aria-valuetext",
        Some(&fill("{time}, tick {tick}", &[("time", &time), ("tick", &goal.to_string())])),
    );
    dom::text("time", &time);
    let deck = dom::html("deck");
    let whole = since(last).max(1.0);
    for (name, share) in [
        ("--played", since(player.tick()) / whole),
        ("--goal", since(goal) / whole),
        ("--progress", player.progress()),
    ] {
        dom::style(&deck, name, &format!("{:.2}%", 100.0 * share));
    }
}

/// Shows the result of comparing the state hashes.
fn show_verdict(player: &ReplayPlayer) {
    let (checks, first, tick) = (&player.checks, player.first_tick(), player.tick());
    let compared = || checks.ranges.iter().any(|&[from, to]| (from..=to).contains(&tick));
    let (verdict, text) = match (checks.differs_at, player.hash()) {
        (Some(tick), _) => {
            let at = strings::clock(f64::from(tick - first), false);
            ("differs", &*fill("Doesn't match the recording after {time}", &[("time", &at)]))
        }
        (None, _) if checks.all_equal() && player.is_at_end() => ("whole", say("Fully verified")),
        (None, Some(_)) if compared() => ("equal", say("Verified")),
        // Nothing was compared at the start.
        (None, Some(_)) => ("none", say("Start")),
        (None, None) => ("none", say("Seeking\u{2026}")),
    };
    let check = dom::html("check");
    dom::set(&check, "data-verdict", Some(verdict));
    dom::text("check-text", text);
    // Details for comparisons: the tick, its hash, the first tick that differs.
    let hash = player.hash().map_or(String::new(), |hash| {
        fill(", state hash {hash}", &[("hash", &format!("{hash:016x}"))])
    });
    let differs = checks.differs_at.map_or(String::new(), |tick| {
        fill("; differs from tick {tick}", &[("tick", &tick.to_string())])
    });
    let [count, all] = [checks.count(), player.last_tick() - first].map(|count| count.to_string());
    let compared = fill("{count} of {all} ticks compared", &[("count", &count), ("all", &all)]);
    dom::set(&check, "title", Some(&format!("{}{hash}; {compared}{differs}", tick_in_words(tick))));
}

fn tick_in_words(tick: u32) -> String {
    fill("tick {tick}", &[("tick", &tick.to_string())])
}

/// The button that follows a player.
fn chip(place: usize, player: &PlayerState, followed: bool) -> Item {
    let PlayerState { seat, appearance, .. } = player;
    let label = fill("Follow {player}", &[("player", &*appearance.name)]);
    let key = if place < 9 { format!(" ({})", place + 1) } else { String::new() };
    Item::new("chip-item", seat.0)
        .with("button", "data-value", seat.0.to_string())
        .with("button", "title", label.clone() + &key)
        .with("button", "aria-label", label)
        .with("button", "aria-pressed", followed.to_string())
        .with("button", "--color", color_of(appearance))
        .text("bdi", &*appearance.name)
}

/// Listens to speeds and timeline.
pub fn listen(events: Events) {
    dom::listen(&dom::html("speeds"), "change", move |event: web_sys::Event| {
        if let Some(speed) = dom::value_of(&event) {
            events.push(Event::SpeedChosen(speed));
        }
    });
    let slider = dom::html("seek");
    dom::listen(&slider, "input", move |event: web_sys::Event| {
        if let Some(tick) = dom::value_of(&event) {
            events.push(Event::SeekChosen(tick));
            show_bubble(Some(tick));
        }
    });
    dom::listen(&slider, "pointermove", |event: PointerEvent| {
        let slider = dom::html("seek");
        let [first, last] = limits();
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
fn limits() -> [f64; 2] {
    let slider: Element = dom::by_id("seek");
    let limit = |name| slider.get_attribute(name).and_then(|value| value.parse().ok());
    ["min", "max"].map(|name| limit(name).unwrap_or(0.0))
}

/// Shows the time and tick that the pointer is at on the timeline.
fn show_bubble(tick: Option<u32>) {
    dom::show("bubble", tick.is_some());
    let Some(tick) = tick else { return };
    let [first, last] = limits();
    let since = f64::from(tick) - first;
    dom::text(
        "bubble",
        &format!("{} \u{b7} {}", strings::clock(since.max(0.0), true), tick_in_words(tick)),
    );
    let share = since / (last - first).max(1.0);
    dom::style(&dom::html("bubble"), "--at", &format!("{share:.4}"));
}
