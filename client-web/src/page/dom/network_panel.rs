//! The network panel (F4): the connection in numbers and as a plot, whether the own hero
//! is predicted, and simulated networks to choose from. Plain DOM, touched only while it is open.

use crate::language;
use crate::net::clock::TICK_MS;
use crate::net::meter::Traffic;
use crate::net::simulated_link::NetworkConditions;
use crate::page::app::App;
use crate::page::dom;
use crate::page::event::Event;
use crate::page::game::GameScreen;
use crate::page::plot::Plot;
use crate::page::queue::Events;
use web_sys::{Element, HtmlInputElement};

/// Moments in the plot, one each time that the texts are brought up to date.
const MOMENTS: usize = 60;
/// Width and height of the plot, in its own units.
const PLOT_SIZE: [f64; 2] = [240.0, 56.0];
/// The plot shows at least this many milliseconds.
const PLOT_MS_MIN: f64 = 50.0;

/// The panel as it was shown last.
pub struct NetworkPanel {
    shown: bool,
    trips: Plot,
    delays: Plot,
}

/// Fills in what was chosen before: whether the hero is predicted, and the network of the address.
pub fn fill(app: &App) {
    dom::by_id::<HtmlInputElement>("net-predict").set_checked(app.predicts());
    dom::check("net-presets", &app.conditions.code());
}

pub fn listen(events: Events) {
    dom::listen(&dom::html("net-predict"), "change", move |_: web_sys::Event| {
        let on = dom::by_id::<HtmlInputElement>("net-predict").checked();
        events.push(Event::PredictionChosen(on));
    });
    dom::listen(&dom::html("net-presets"), "change", move |event: web_sys::Event| {
        let chosen = dom::value_of::<String>(&event);
        if let Some(conditions) = chosen.and_then(|code| NetworkConditions::parse(&code)) {
            events.push(Event::ConditionsChosen(conditions));
        }
    });
}

impl NetworkPanel {
    pub fn new() -> NetworkPanel {
        NetworkPanel { shown: false, trips: Plot::new(MOMENTS), delays: Plot::new(MOMENTS) }
    }

    /// Forgets the last game.
    pub fn clear(&mut self) {
        *self = NetworkPanel { shown: self.shown, ..NetworkPanel::new() };
    }

    /// Opens or closes the panel; its focus goes back to the canvas. Whether that changed anything.
    pub fn show(&mut self, shown: bool) -> bool {
        if std::mem::replace(&mut self.shown, shown) == shown {
            return false;
        }
        let panel = dom::html("network");
        let within = dom::document().active_element().is_some_and(|e| panel.contains(Some(&e)));
        dom::show("network", shown);
        dom::set(&dom::html("signal"), "aria-pressed", Some(&shown.to_string()));
        if !shown && within {
            dom::focus_stage();
        }
        true
    }

    /// Brings the panel up to date.
    pub fn show_texts(&mut self, game: &GameScreen, now_ms: f64) {
        let Some(membership) = &game.membership else { return };
        let (clock, predictor) = (&membership.clock, membership.predictor.as_ref());
        let trip = game.meter.ping_ms;
        let delay_ms = clock.delay_ticks() * TICK_MS;
        self.trips.push(trip.unwrap_or(0.0));
        self.delays.push(delay_ms);
        if !self.shown {
            return;
        }
        let dash = || "\u{2013}".to_owned();
        let (snapshots, _) = game.meter.rate(Traffic::Snapshot, now_ms);
        for (id, text) in [
            ("net-trip", trip.map_or_else(dash, |ms| format!("{ms:.0} ms"))),
            ("net-jitter", format!("{:.0} ms", clock.lateness_ticks * TICK_MS)),
            ("net-delay", format!("{delay_ms:.0} ms")),
            ("net-rate", format!("{snapshots} /s")),
            (
                "net-lead",
                predictor.map_or_else(dash, |p| format!("{:.0} ms", p.lead_ticks() * TICK_MS)),
            ),
            (
                "net-error",
                predictor.map_or_else(dash, |p| {
                    language::fill("{count} units", &[("count", &format!("{:.2}", p.error))])
                }),
            ),
            ("net-waiting", predictor.map_or_else(dash, |p| p.unacknowledged().to_string())),
            ("net-frames", format!("{} /s", game.meter.frames_a_second(now_ms))),
        ] {
            dom::text(id, &text);
        }
        show_kinds(game, now_ms);
        self.draw();
    }

    /// Both lines in one scale.
    fn draw(&self) {
        let highest = self.trips.highest().max(self.delays.highest()).max(PLOT_MS_MIN);
        for (id, plot) in [("net-line-trip", &self.trips), ("net-line-delay", &self.delays)] {
            dom::set(&dom::by_id(id), "d", Some(&plot.path(PLOT_SIZE, highest)));
        }
        dom::text("net-scale", &format!("{highest:.0} ms"));
    }
}

/// Bytes a second by kind, with bars on a scale of their own.
fn show_kinds(game: &GameScreen, now_ms: f64) {
    let rates = Traffic::ALL.map(|traffic| game.meter.rate(traffic, now_ms).1);
    let most = rates.iter().copied().max().unwrap_or(0).max(1);
    for (kind, bytes) in (1..).zip(rates) {
        let part = |tag| dom::query::<Element>(&format!("#net-kinds li:nth-child({kind}) {tag}"));
        let (Some(bar), Some(value)) = (part("i"), part("b")) else { return };
        dom::style(&bar, "--share", &format!("{:.1}%", 100.0 * bytes as f64 / most as f64));
        dom::set_text(&value, &format!("{:.2} kB/s", bytes as f64 / 1000.0));
    }
}
