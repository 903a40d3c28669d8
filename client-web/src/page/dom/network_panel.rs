//! The network panel (F4): the connection in numbers and as a plot, whether the own hero
//! is predicted, and simulated networks to choose from. Plain DOM, touched only while it is open.

use crate::browser;
use crate::net::clock::TICK_MS;
use crate::net::meter::Traffic;
use crate::net::simulated_link::PRESETS;
use crate::page::app::App;
use crate::page::dom;
use crate::page::event::{Control, Event};
use crate::page::game::GameScreen;
use crate::page::plot::Plot;
use crate::page::queue::Events;
use wasm_bindgen::JsCast;
use web_sys::{HtmlElement, HtmlInputElement, KeyboardEvent, MouseEvent};

/// Moments in the plot, one each time that the texts are brought up to date.
const MOMENTS: usize = 60;
/// Width and height of the plot, in its own units.
const PLOT_SIZE: [f64; 2] = [240.0, 56.0];
/// The plot shows at least this many milliseconds.
const PLOT_MS_MIN: f64 = 50.0;

/// Figures with an element each: id and name.
const FIGURES: [(&str, &str); 8] = [
    ("net-trip", "round trip"),
    ("net-jitter", "jitter"),
    ("net-delay", "delay of other players"),
    ("net-rate", "snapshots"),
    ("net-lead", "own hero ahead"),
    ("net-error", "prediction error"),
    ("net-waiting", "inputs on their way"),
    ("net-frames", "frames"),
];

/// The panel as it was shown last.
pub struct NetworkPanel {
    shown: bool,
    trips: Plot,
    delays: Plot,
}

/// Fills the panel's fixed parts.
pub fn fill(app: &App) {
    let figures: HtmlElement = dom::by_id("net-figures");
    for (id, name) in FIGURES {
        dom::append(&figures, &dom::labelled("dt", "", name));
        let value = dom::labelled("dd", "", "\u{2013}");
        value.set_id(id);
        dom::append(&figures, &value);
    }
    let kinds: HtmlElement = dom::by_id("net-kinds");
    for traffic in Traffic::ALL {
        let row = dom::element("li", if traffic.comes_in() { "in" } else { "out" });
        dom::append(&row, &dom::labelled("span", "", name_of(traffic)));
        dom::append(&row, &dom::element("i", ""));
        dom::append(&row, &dom::labelled("b", "", ""));
        dom::append(&kinds, &row);
    }
    dom::by_id::<HtmlInputElement>("net-predict").set_checked(app.predicts());
    offer_presets(app);
}

/// Listens to the panel.
pub fn listen(events: Events) {
    let predict: HtmlInputElement = dom::by_id("net-predict");
    dom::listen(&predict, "change", move |_: web_sys::Event| {
        let on = dom::by_id::<HtmlInputElement>("net-predict").checked();
        events.push(Event::PredictionChosen(on));
    });
    let presets: HtmlElement = dom::by_id("net-presets");
    dom::listen(&presets, "change", move |event: web_sys::Event| {
        let chosen = event.target().and_then(|target| target.dyn_into::<HtmlInputElement>().ok());
        let index = chosen.and_then(|input| input.value().parse::<usize>().ok());
        if let Some(preset) = index.and_then(|index| PRESETS.get(index)) {
            events.push(Event::ConditionsChosen(preset.conditions));
        }
    });
    let panel: HtmlElement = dom::by_id("network");
    dom::listen(&panel, "click", give_keys_back);
    dom::listen_active(&panel, "keydown", move |event: KeyboardEvent| {
        if event.code() == "Escape" {
            event.prevent_default();
            event.stop_propagation();
            events.push(Event::Clicked(Control::Network));
        }
    });
}

/// One radio button a preset; the one that the address asked for is chosen.
fn offer_presets(app: &App) {
    let list: HtmlElement = dom::by_id("net-presets");
    for (index, preset) in PRESETS.iter().enumerate() {
        let label = dom::element("label", "");
        let input = dom::element("input", "");
        for (name, value) in [("type", "radio"), ("name", "lag"), ("value", &index.to_string())] {
            dom::set(&input, name, value);
        }
        if let Some(input) = input.dyn_ref::<HtmlInputElement>() {
            input.set_checked(preset.conditions == app.conditions);
        }
        dom::append(&label, &input);
        dom::append(&label, &dom::labelled("span", "", preset.name));
        dom::append(&list, &label);
    }
}

/// After a click keys belong to the game again; the focus of the keyboard stays in the panel. A clicked
/// label first hands the focus to its box.
fn give_keys_back(event: MouseEvent) {
    if event.detail() > 0 {
        browser::after(0, || {
            let _ = dom::by_id::<HtmlElement>("stage").focus();
        });
    }
}

fn name_of(traffic: Traffic) -> &'static str {
    match traffic {
        Traffic::Snapshot => "snapshots",
        Traffic::Keyframe => "keyframes",
        Traffic::Answer => "answers",
        Traffic::Input => "inputs",
        Traffic::Question => "questions",
    }
}

impl NetworkPanel {
    /// A closed panel.
    pub fn new() -> NetworkPanel {
        NetworkPanel { shown: false, trips: Plot::new(MOMENTS), delays: Plot::new(MOMENTS) }
    }

    /// Forgets the last game.
    pub fn clear(&mut self) {
        *self = NetworkPanel { shown: self.shown, ..NetworkPanel::new() };
    }

    /// Opens or closes the panel; its focus goes back to the canvas.
    pub fn show(&mut self, shown: bool) {
        if std::mem::replace(&mut self.shown, shown) == shown {
            return;
        }
        let panel: HtmlElement = dom::by_id("network");
        let within = dom::document().active_element().is_some_and(|e| panel.contains(Some(&e)));
        dom::show(&panel, shown);
        dom::set(&dom::by_id("signal"), "aria-pressed", &shown.to_string());
        if !shown && within {
            let _ = dom::by_id::<HtmlElement>("stage").focus();
        }
    }

    /// Brings the panel up to date.
    pub fn show_texts(&mut self, game: &GameScreen, now_ms: f64) {
        let Some(membership) = &game.membership else { return };
        let (clock, predictor) = (&membership.clock, membership.predictor.as_ref());
        let trip = game.meter.ping_ms();
        let delay_ms = clock.delay_ticks() * TICK_MS;
        self.trips.push(trip.unwrap_or(0.0));
        self.delays.push(delay_ms);
        if !self.shown {
            return;
        }
        let dash = || "\u{2013}".to_owned();
        let (snapshots, _) = game.meter.rate(Traffic::Snapshot, now_ms);
        let texts = [
            trip.map_or_else(dash, |ms| format!("{ms:.0} ms")),
            format!("{:.0} ms", clock.jitter_ticks() * TICK_MS),
            format!("{delay_ms:.0} ms"),
            format!("{snapshots} /s"),
            predictor.map_or_else(dash, |p| format!("{:.0} ms", p.lead_ticks() * TICK_MS)),
            predictor.map_or_else(dash, |p| format!("{:.2} units", p.error())),
            predictor.map_or_else(dash, |p| p.unacknowledged().to_string()),
            format!("{} /s", game.meter.frames_a_second(now_ms)),
        ];
        for ((id, _), text) in FIGURES.iter().zip(texts) {
            dom::set_text(&dom::by_id::<HtmlElement>(id), &text);
        }
        show_kinds(game, now_ms);
        self.draw();
    }

    /// Both lines in one scale.
    fn draw(&self) {
        let highest = self.trips.highest().max(self.delays.highest()).max(PLOT_MS_MIN);
        for (id, plot) in [("net-line-trip", &self.trips), ("net-line-delay", &self.delays)] {
            let line: web_sys::Element = dom::by_id(id);
            dom::set(&line, "d", &plot.path(PLOT_SIZE, highest));
        }
        dom::set_text(&dom::by_id::<HtmlElement>("net-scale"), &format!("{highest:.0} ms"));
    }
}

/// Bytes a second by kind, with bars on a scale of their own.
fn show_kinds(game: &GameScreen, now_ms: f64) {
    let rates = Traffic::ALL.map(|traffic| game.meter.rate(traffic, now_ms).1);
    let most = rates.iter().copied().max().unwrap_or(0).max(1);
    let rows = dom::by_id::<HtmlElement>("net-kinds").children();
    for (index, bytes) in (0..).zip(rates) {
        let Some(row) = rows.item(index) else { return };
        let share = format!("{:.1}%", 100.0 * bytes as f64 / most as f64);
        if let Some(bar) = row.children().item(1).and_then(|e| e.dyn_into::<HtmlElement>().ok()) {
            dom::style(&bar, "--share", &share);
        }
        if let Some(value) = row.children().item(2) {
            dom::set_text(&value, &format!("{:.2} kB/s", bytes as f64 / 1000.0));
        }
    }
}
