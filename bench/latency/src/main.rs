//! Measures the time from a key press to the frame that shows it. `cargo xtask latency` builds the
//! page and a release server first and then runs this program. It sends real key events to a real Chromium and finds,
//! for each press, the first frame in which the player's hero has moved.

use anyhow::{Context, Result, bail, ensure};
use jostle_tests::browser::Browser;
use jostle_tests::state::State;
use jostle_tests::tab::Screen;
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Largest apparent movement of a hero at rest, in world units: a quarter of the arena's quantum.
const MOVED: f64 = 0.25 / 64.0;
/// How long a key is held, in milliseconds.
const HELD_MS: u64 = 60;
/// Shortest time between two presses, in milliseconds; long enough for the hero to come to rest again.
const PAUSE_MS: u64 = 700;
/// Largest amount added to that time, in milliseconds, so that presses fall into every phase of a tick.
const PHASES_MS: u64 = 97;

/// A script for the page that records each press and the frames after it until one draws the hero in a different
/// position, and the time that the page's script takes for each frame.
const WATCH: &str = r#"(() => {
    const watch = window.watch = {armed: null, done: [], frames: [], costs: []};
    const next = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = callback => next(time => {
        const began = performance.now();
        callback(time);
        watch.costs.push(performance.now() - began);
    });
    let last = performance.now();
    const frame = () => {
        const now = performance.now();
        watch.frames.push(now - last);
        last = now;
        const press = watch.armed, place = window.jostle.own_place();
        if (press && place && press.at !== null) {
            press.seen += 1;
            const moved = Math.abs(place[0] - press.place[0]);
            if (moved > MOVED) {
                watch.done.push({ms: now - press.at, frames: press.seen});
                watch.armed = null;
            }
        } else if (press && place) {
            press.place = [place[0], place[1]];
        }
        next(frame);
    };
    next(frame);
    window.addEventListener('keydown', event => {
        if (watch.armed && watch.armed.at === null && watch.armed.place)
            watch.armed.at = event.timeStamp;
    }, true);
    return true;
})()"#;

/// A configuration to measure.
struct Case {
    name: &'static str,
    query: &'static str,
}

const CASES: [Case; 4] = [
    Case { name: "loopback, prediction", query: "" },
    Case { name: "loopback, none", query: "?predict=0" },
    Case { name: "150 +- 30 ms, prediction", query: "?lag=150,30" },
    Case { name: "150 +- 30 ms, none", query: "?lag=150,30&predict=0" },
];

#[derive(Clone, Copy, Debug, Deserialize)]
struct Press {
    /// Time from the key event to the end of the frame that shows it, in milliseconds.
    ms: f64,
    /// Number of frames up to and including that one.
    frames: u32,
}

/// The results of a case.
#[derive(Debug, Serialize)]
struct Figures {
    case: &'static str,
    presses: usize,
    p50_ms: f64,
    p99_ms: f64,
    max_ms: f64,
    /// Median number of frames from the press up to and including the one that shows it.
    p50_frames: f64,
    p99_frames: f64,
    /// Time from one frame to the next.
    frame_p50_ms: f64,
    frame_p99_ms: f64,
    /// Time that the page's script takes for a frame: the mean and the 99th percentile.
    script_mean_ms: f64,
    script_p99_ms: f64,
    /// The prediction error at the end as reported by the page, in world units.
    prediction_error: Option<f64>,
}

/// Arguments: the server's program, the number of presses per case, and optionally a file for JSON.
#[tokio::main]
async fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let program = arguments.next().context("the program of the server is missing")?;
    let presses: usize = arguments.next().context("the number of presses is missing")?.parse()?;
    let json = arguments.next();
    let server = Server::start(&program)?;
    let browser = Browser::launch().await?;
    let mut rows = Vec::new();
    for case in &CASES {
        let measured = measure(&browser, &server.link, case, presses).await;
        match measured {
            Ok(row) => {
                eprintln!(
                    "latency: {}: p50 {:.1} ms, p99 {:.1} ms",
                    row.case, row.p50_ms, row.p99_ms
                );
                rows.push(row);
            }
            Err(error) => {
                browser.close().await?;
                return Err(error);
            }
        }
    }
    browser.close().await?;
    print_table(&rows);
    if let Some(path) = json {
        std::fs::write(&path, serde_json::to_string_pretty(&rows)?)
            .with_context(|| format!("cannot write {path}"))?;
    }
    Ok(())
}

async fn measure(
    browser: &Browser,
    link: &str,
    case: &'static Case,
    presses: usize,
) -> Result<Figures> {
    let visitor = browser.visitor().await?;
    let tab = browser.open(&visitor, Screen::SMALL).await?;
    tab.go(&format!("{link}arena{}", case.query)).await?;
    tab.until("a hero of one's own", State::plays).await?;
    tab.ticks(180).await?;
    tab.eval::<bool>(&WATCH.replace("MOVED", &MOVED.to_string())).await?;
    let mut random: u32 = 1;
    for press in 0..presses {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let phase = u64::from(random >> 16) % PHASES_MS;
        tokio::time::sleep(Duration::from_millis(PAUSE_MS + phase)).await;
        tab.eval::<bool>("(watch.armed = {at: null, place: null, seen: 0}, true)").await?;
        tab.until_true("watch.armed.place").await?;
        // Alternate directions, so that the hero always has room.
        let key = if press % 2 == 0 { "d" } else { "a" };
        tab.key_down(key).await?;
        tokio::time::sleep(Duration::from_millis(HELD_MS)).await;
        tab.key_up(key).await?;
        tab.until_true("!watch.armed").await?;
    }
    let done: Vec<Press> = tab.eval("watch.done").await?;
    let frames: Vec<f64> = tab.eval("watch.frames").await?;
    let costs: Vec<f64> = tab.eval("watch.costs").await?;
    ensure!(done.len() == presses, "{} of {presses} presses were seen", done.len());
    let error: Option<f64> =
        tab.eval("JSON.parse(window.jostle.state()).prediction?.error ?? null").await?;
    browser.forget(visitor).await?;
    let times = sorted(done.iter().map(|press| press.ms));
    let counts = sorted(done.iter().map(|press| f64::from(press.frames)));
    let frames = sorted(frames.into_iter().skip(1));
    let costs = sorted(costs.into_iter());
    Ok(Figures {
        case: case.name,
        presses,
        p50_ms: at(&times, 0.5),
        p99_ms: at(&times, 0.99),
        max_ms: at(&times, 1.0),
        p50_frames: at(&counts, 0.5),
        p99_frames: at(&counts, 0.99),
        frame_p50_ms: at(&frames, 0.5),
        frame_p99_ms: at(&frames, 0.99),
        script_mean_ms: costs.iter().sum::<f64>() / costs.len().max(1) as f64,
        script_p99_ms: at(&costs, 0.99),
        prediction_error: error,
    })
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Returns a quantile: the value that this share of all values does not exceed.
fn at(sorted: &[f64], share: f64) -> f64 {
    let index = (share * sorted.len() as f64).ceil() as usize;
    sorted[index.clamp(1, sorted.len()) - 1]
}

fn print_table(rows: &[Figures]) {
    println!(
        "| | p50 ms | p99 ms | most ms | p50 frames | p99 frames | frame p50 ms | frame p99 ms | \
         script mean ms | script p99 ms | error |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for row in rows {
        let error = row.prediction_error.map_or("-".to_owned(), |error| format!("{error:.3}"));
        println!(
            "| {} | {:.1} | {:.1} | {:.1} | {} | {} | {:.1} | {:.1} | {:.2} | {:.1} | {error} |",
            row.case,
            row.p50_ms,
            row.p99_ms,
            row.max_ms,
            row.p50_frames,
            row.p99_frames,
            row.frame_p50_ms,
            row.frame_p99_ms,
            row.script_mean_ms,
            row.script_p99_ms,
        );
    }
}

/// A running `jostle serve`, which is stopped when this program exits.
struct Server {
    child: Child,
    /// The server's URL, with a trailing slash.
    link: String,
}

impl Server {
    fn start(program: &str) -> Result<Server> {
        let mut child = Command::new(program)
            .args(["serve", "--listen", "127.0.0.1:0", "--log", "warn"])
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {program}"))?;
        let output = child.stdout.take().context("no output")?;
        let line = BufReader::new(output).lines().next().context("no line")??;
        let Some(link) = line.trim().rsplit(' ').next().filter(|link| link.starts_with("http"))
        else {
            bail!("no address in {line:?}");
        };
        Ok(Server { child, link: format!("{}/", link.trim_end_matches('/')) })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
