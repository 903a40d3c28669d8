//! Rain of N bodies, half circles and half boxes (shared scene B1): Jostle's solver and its peers,
//! stepped in turns in one process, so that a busy machine slows all alike. Prints processor time a
//! step and what the result is worth; the ratio is the figure to quote.
//!
//! Usage: `cargo run --release --bin rain -- [N...]` (default 1000).

use jostle_peers::PEERS;
use jostle_report::engine::{Engine, State};
use jostle_report::methods::{METHODS, Method};
use jostle_report::scene::{Body, Mulberry, Scene, Shape};
use jostle_report::shape::deepest_overlap;
use jostle_report::study::thread_time_us;

/// Steps of a run; "settled" are those from [`SETTLED`] on.
const STEPS: usize = 600;
const SETTLED: usize = 300;

fn main() -> Result<(), String> {
    let counts: Vec<u32> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let counts = if counts.is_empty() { vec![1000] } else { counts };
    println!(
        "processor time a step, median, microseconds; rms speed and deepest overlap at the end"
    );
    counts.into_iter().try_for_each(compare)
}

struct Entry {
    method: Method,
    engine: Box<dyn Engine>,
    times_us: Vec<f64>,
}

fn compare(count: u32) -> Result<(), String> {
    let scene = rain(count);
    let mut entries = Vec::new();
    for &method in METHODS.iter().chain(&PEERS).filter(|method| method.in_stability) {
        let setting = method.default.unwrap_or(method.settings[0]);
        let engine = (method.build)(&scene, setting)?;
        entries.push(Entry { method, engine, times_us: Vec::new() });
    }
    for _ in 0..STEPS {
        for entry in &mut entries {
            let before = thread_time_us();
            entry.engine.tick();
            entry.times_us.push(thread_time_us() - before);
        }
    }
    for Entry { method, engine, times_us } in &entries {
        let (falling, settled) = (median(&times_us[..120]), median(&times_us[SETTLED..]));
        let states: Vec<State> = (0..scene.bodies.len()).map(|i| engine.state(i)).collect();
        let squares: f64 = scene.dynamic().map(|i| states[i].velocity.length_squared()).sum();
        println!(
            "N {count} {:30} falling {falling:8.1}, settled {settled:8.1}, rms {:.4}, deepest {:.4}",
            method.name,
            (squares / f64::from(count)).sqrt(),
            deepest_overlap(&scene.bodies, &states)
        );
    }
    Ok(())
}

/// `count` bodies in a container four times as many columns wide as rows high.
fn rain(count: u32) -> Scene {
    let columns = f64::from(4 * count).sqrt().ceil() as u32;
    let rows = count.div_ceil(columns);
    let mut scene = Scene::new(50.0);
    scene.contain(8.0 * f64::from(columns), 8.0 * f64::from(rows) + 40.0, 0.3, 0.0);
    let mut draws = Mulberry(0x5EED_0000 + count);
    for i in 0..count {
        let kind = draws.unit();
        let (a, b) = (1.0 + 2.5 * draws.unit(), 1.0 + 2.5 * draws.unit());
        let (jitter_x, jitter_y) = (draws.range(-0.45, 0.45), draws.range(-0.45, 0.45));
        let shape = if kind < 0.5 { Shape::Circle { radius: a } } else { Shape::rect(a, b) };
        let x = 8.0 * (f64::from(i % columns) + 0.5) + jitter_x;
        let y = 8.0 * (f64::from(i / columns) + 0.5) + jitter_y;
        scene.add(Body::new(shape, x, y));
    }
    scene
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
