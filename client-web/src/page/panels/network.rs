//! Network panels: statistics (F3), and a panel (F4) that shows the connection in numbers and as a plot, switches
//! prediction of the player's hero on and off, and simulates bad networks.

use crate::language::fill;
use crate::net::clock::{Clock, TICK_MS};
use crate::net::meter::Traffic;
use crate::page::app::App;
use crate::page::game::GameScreen;
use crate::page::view::{Set, View, word};
use crate::world::replica::Replica;

/// Width and height of the plot in SVG units.
const PLOT_SIZE: [f64; 2] = [240.0, 56.0];
/// Minimum range of the plot, milliseconds.
const PLOT_MS_MIN: f64 = 50.0;
/// The bar and the number for each kind of traffic.
const KINDS: [[&str; 2]; Traffic::ALL.len()] = [
    ["#net-kinds > :nth-child(1) i", "#net-kinds > :nth-child(1) b"],
    ["#net-kinds > :nth-child(2) i", "#net-kinds > :nth-child(2) b"],
    ["#net-kinds > :nth-child(3) i", "#net-kinds > :nth-child(3) b"],
    ["#net-kinds > :nth-child(4) i", "#net-kinds > :nth-child(4) b"],
    ["#net-kinds > :nth-child(5) i", "#net-kinds > :nth-child(5) b"],
];

/// The panel, apart from its changing values.
pub fn view(app: &App) -> View {
    let view = View::panel("network")
        .show("#network", app.panels.network)
        .with("#signal", "aria-pressed", word(app.panels.network))
        .show("#figures", app.panels.figures);
    if !app.panels.network {
        return view;
    }
    view.set("#net-predict", Set::Checked(app.ctx.predicts))
        .set("#net-presets", Set::Choice(app.conditions.code().into()))
}

/// Bytes per second by kind, with bars relative to the largest.
fn kinds(mut view: View, game: &GameScreen, now_ms: f64) -> View {
    let rates = Traffic::ALL.map(|traffic| game.connection.meter.rate(traffic, now_ms).1);
    let most = rates.iter().copied().max().unwrap_or(0).max(1);
    for ([bar, value], bytes) in KINDS.into_iter().zip(rates) {
        let share = 100.0 * bytes as f64 / most as f64;
        view = view.style(bar, "--share", format!("{share:.1}%"));
        view = view.text(value, format!("{:.2} kB/s", bytes as f64 / 1000.0));
    }
    view
}

/// The panel's numbers and plot; both lines share one scale.
pub fn connection(app: &App) -> View {
    let mut view = View::panel("connection");
    let game = app.screen.game().filter(|_| app.panels.network);
    let Some((game, membership)) = game.and_then(|game| Some((game, game.membership.as_ref()?)))
    else {
        return view;
    };
    let (clock, predictor) = (&membership.clock, membership.predictor.as_ref());
    let dash = || "\u{2013}".to_owned();
    let ms = |ms: f64| format!("{ms:.0} ms");
    let error = |error: f32| fill("{count} units", &[("count", &format!("{error:.2}"))]);
    let (snapshots, _) = game.connection.meter.rate(Traffic::Snapshot, app.ctx.now_ms);
    let lead = predictor.map(|predictor| predictor.lead_ticks() * TICK_MS);
    let waiting = predictor.map(|predictor| predictor.unacknowledged().to_string());
    let [trips, delays] = &game.connection.plots;
    let highest = trips.highest().max(delays.highest()).max(PLOT_MS_MIN);
    for (at, text) in [
        ("#net-trip", game.connection.meter.ping_ms.map_or_else(dash, ms)),
        ("#net-jitter", ms(clock.lateness_ticks * TICK_MS)),
        ("#net-delay", ms(clock.delay_ticks() * TICK_MS)),
        ("#net-rate", format!("{snapshots} /s")),
        ("#net-lead", lead.map_or_else(dash, ms)),
        ("#net-error", predictor.map_or_else(dash, |predictor| error(predictor.error))),
        ("#net-waiting", waiting.unwrap_or_else(dash)),
        ("#net-frames", format!("{} /s", game.connection.meter.frames_a_second(app.ctx.now_ms))),
        ("#net-scale", ms(highest)),
    ] {
        view = view.text(at, text);
    }
    view = view.with("#net-line-trip", "d", trips.path(PLOT_SIZE, highest)).with(
        "#net-line-delay",
        "d",
        delays.path(PLOT_SIZE, highest),
    );
    kinds(view, game, app.ctx.now_ms)
}

pub fn figures(app: &App) -> View {
    let view = View::panel("figures");
    let Some(game) = app.screen.game().filter(|_| app.panels.figures) else { return view };
    let now_ms = app.ctx.now_ms;
    let clock = game.membership.as_ref().map(|membership| &membership.clock);
    let ticks = |figure: fn(&Clock) -> f64| {
        fill("{count} ticks", &[("count", &format!("{:.1}", clock.map_or(0.0, figure)))])
    };
    let count = |figure: fn(&Replica) -> usize| game.replica().map_or(0, figure).to_string();
    let tick = clock.and_then(|clock| clock.server_tick(now_ms)).unwrap_or(0.0);
    let meter = &game.connection.meter;
    let texts = [
        ("#figure-ping", meter.ping_ms.map_or("-".into(), |ms| format!("{ms:.0} ms"))),
        ("#figure-jitter", ticks(|clock| clock.lateness_ticks)),
        ("#figure-delay", ticks(Clock::delay_ticks)),
        ("#figure-tick", format!("{tick:.0}")),
        ("#figure-in", format!("{:.1} kB/s", meter.bytes_a_second(now_ms) as f64 / 1000.0)),
        ("#figure-frames", format!("{} /s", meter.frames_a_second(now_ms))),
        ("#figure-bodies", count(|replica| replica.bodies().len())),
        ("#figure-particles", count(|replica| replica.particles().len())),
        ("#figure-players", count(|replica| replica.room.players().len())),
    ];
    texts.into_iter().fold(view, |view, (at, text)| view.text(at, text))
}
