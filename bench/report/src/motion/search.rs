//! Runs random scenes in two engines with the same inputs and reports the slowest steps of the first relative to the
//! mean step of the second.
//!
//! Every engine plays twice, and the shorter of a step's two times counts: both runs do the same work, so any
//! difference is due to the machine.

use super::{Driver, STEPS, Setting};
use crate::csv::Csv;
use crate::engine::{Engine, State};
use crate::methods::Method;
use crate::shape::deepest_overlap;
use crate::study::thread_time_us;
use glam::DVec2;

/// Number of steps that an engine takes per turn.
const TURN: u32 = 10;
/// Interval between measurements of the overlaps, in steps.
const LOOK: u32 = 5;

/// Measurements from a run of one engine.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Time of each step, the shorter of its times in two runs.
    pub times_us: Vec<f64>,
    /// Number of pair solves in each step, if the engine counts them.
    pub visits: Vec<u64>,
    /// Deepest overlap in any measured step.
    pub deepest: f64,
    /// Mean of the deepest overlap over the measured steps.
    pub deepest_mean: f64,
    /// Largest number of bodies that were outside the container or lost at the same time.
    pub outside: usize,
    /// Sum of the energy gains in individual steps, as a share of the largest energy.
    pub gain: f64,
    /// Whether both runs ended in the same state.
    pub repeats: bool,
}

/// One of the two runs of an engine.
struct Player<'a> {
    engine: Box<dyn Engine>,
    driver: Driver<'a>,
    setting: &'a Setting,
    times_us: Vec<f64>,
    visits: Vec<u64>,
    overlaps: Vec<f64>,
    outside: usize,
    gained: f64,
    largest: f64,
}

/// Plays a setting with several methods in alternation; returns the runs in the order of the methods.
pub fn compare(setting: &Setting, methods: &[&Method]) -> Result<Vec<Run>, String> {
    let twice = methods.iter().flat_map(|method| [method, method]);
    let mut players: Vec<Player> =
        twice.map(|method| Player::new(setting, method)).collect::<Result<_, _>>()?;
    for _ in 0..STEPS / TURN {
        for (index, player) in players.iter_mut().enumerate() {
            (0..TURN).for_each(|_| player.step(index.is_multiple_of(2)));
        }
    }
    Ok(players.chunks_exact(2).map(|pair| run(&pair[0], &pair[1])).collect())
}

fn run(first: &Player, second: &Player) -> Run {
    let pairs = first.times_us.iter().zip(&second.times_us);
    let alike = |body: usize| {
        let (one, other) = (first.engine.state(body), second.engine.state(body));
        one == other || !one.position.is_finite()
    };
    Run {
        times_us: pairs.map(|(one, other)| one.min(*other)).collect(),
        visits: first.visits.clone(),
        deepest: first.overlaps.iter().copied().fold(0.0, f64::max),
        deepest_mean: first.overlaps.iter().sum::<f64>() / first.overlaps.len() as f64,
        outside: first.outside,
        gain: if first.setting.keeps_energy() { first.gained / first.largest } else { 0.0 },
        repeats: first.setting.scene.dynamic().all(alike),
    }
}

impl<'a> Player<'a> {
    fn new(setting: &'a Setting, method: &Method) -> Result<Player<'a>, String> {
        let knob = method.default.unwrap_or(method.settings[0]);
        Ok(Player {
            engine: (method.build)(&setting.scene, knob)?,
            driver: setting.driver(),
            setting,
            times_us: Vec::new(),
            visits: Vec::new(),
            overlaps: Vec::new(),
            outside: 0,
            gained: 0.0,
            largest: f64::MIN_POSITIVE,
        })
    }

    fn step(&mut self, watched: bool) {
        let gravity = self.driver.act(self.engine.as_mut());
        let before = if watched { self.energy(gravity).1 } else { 0.0 };
        let solves = self.engine.pair_solves().unwrap_or(0);
        let began = thread_time_us();
        self.engine.tick();
        self.times_us.push(thread_time_us() - began);
        self.visits.push(self.engine.pair_solves().unwrap_or(0) - solves);
        if watched {
            let (states, after) = self.energy(gravity);
            self.gained += (after - before).max(0.0);
            self.largest = self.largest.max(before.abs());
            self.outside = self.outside.max(self.setting.outside(&states));
            if (self.times_us.len() as u32).is_multiple_of(LOOK) {
                self.overlaps.push(deepest_overlap(&self.setting.scene.bodies, &states));
            }
        }
    }

    fn energy(&self, gravity: DVec2) -> (Vec<State>, f64) {
        let count = self.setting.scene.bodies.len();
        let states: Vec<State> = (0..count).map(|body| self.engine.state(body)).collect();
        let energy = self.setting.energy(&states, gravity);
        (states, energy)
    }
}

impl Run {
    /// Mean time of a step.
    pub fn mean_us(&self) -> f64 {
        self.times_us.iter().sum::<f64>() / self.times_us.len() as f64
    }

    /// Index and time of the slowest step.
    pub fn worst_us(&self) -> (usize, f64) {
        let steps = self.times_us.iter().copied().enumerate();
        steps.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN))
    }
}

/// A scene with both engines' runs.
pub struct Finding {
    /// The scene's number in the sequence.
    pub number: u64,
    pub bodies: usize,
    /// Descriptions of the random choices that were made.
    pub traits: String,
    /// Jostle's run, followed by its peer's.
    pub runs: [Run; 2],
}

impl Finding {
    /// Time of the first engine's slowest step relative to the second engine's mean step time.
    pub fn worst_ratio(&self) -> f64 {
        self.runs[0].worst_us().1 / self.runs[1].mean_us()
    }

    /// The first engine's mean step time relative to the second's.
    pub fn mean_ratio(&self) -> f64 {
        self.runs[0].mean_us() / self.runs[1].mean_us()
    }
}

/// Plays one scene after another and reports each to `watch`.
pub fn search(
    seed: u64,
    numbers: std::ops::Range<u64>,
    methods: [&Method; 2],
    mut watch: impl FnMut(&Finding),
) -> Result<Vec<Finding>, String> {
    let mut findings = Vec::new();
    for number in numbers {
        let setting = Setting::new(seed, number);
        let runs = compare(&setting, &methods)?.try_into().map_err(|_| "two engines play")?;
        let traits = setting.traits.join("; ");
        let bodies = setting.scene.dynamic().count();
        let finding = Finding { number, bodies, traits, runs };
        watch(&finding);
        findings.push(finding);
    }
    Ok(findings)
}

/// Writes one line for each scene.
pub fn csv(findings: &[Finding]) -> String {
    let mut csv = Csv::new(&[
        "number",
        "bodies",
        "worst_ms",
        "worst_step",
        "mean_ms",
        "peer_mean_ms",
        "peer_worst_ms",
        "worst_over_peer_mean",
        "mean_over_peer_mean",
        "visits_most",
        "deepest",
        "peer_deepest",
        "deepest_mean",
        "peer_deepest_mean",
        "outside",
        "peer_outside",
        "energy_gain",
        "peer_energy_gain",
        "repeats",
        "traits",
    ]);
    for finding in findings {
        let [ours, peer] = &finding.runs;
        let (step, worst) = ours.worst_us();
        let ms = |us: f64| format!("{:.4}", us / 1000.0);
        let visits = ours.visits.iter().max().copied().unwrap_or(0);
        csv.row(&[
            finding.number.to_string(),
            finding.bodies.to_string(),
            ms(worst),
            step.to_string(),
            ms(ours.mean_us()),
            ms(peer.mean_us()),
            ms(peer.worst_us().1),
            format!("{:.3}", finding.worst_ratio()),
            format!("{:.3}", finding.mean_ratio()),
            visits.to_string(),
            format!("{:.4}", ours.deepest),
            format!("{:.4}", peer.deepest),
            format!("{:.5}", ours.deepest_mean),
            format!("{:.5}", peer.deepest_mean),
            ours.outside.to_string(),
            peer.outside.to_string(),
            format!("{:.2e}", ours.gain),
            format!("{:.2e}", peer.gain),
            ours.repeats.to_string(),
            finding.traits.clone(),
        ]);
    }
    csv.finish()
}

/// Lists the quantiles of the findings and the slowest scenes.
pub fn summary(findings: &[Finding]) -> String {
    if findings.is_empty() {
        return String::new();
    }
    let mut text =
        String::from("figure                               p50     p90     p99   worst\n");
    let mut line = |name: &str, of: &dyn Fn(&Finding) -> f64| {
        let mut values: Vec<f64> = findings.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        let [half, most, rare, worst] = [0.5, 0.9, 0.99, 1.0].map(at);
        text += &format!("{name:<32} {half:>7.3} {most:>7.3} {rare:>7.3} {worst:>7.3}\n");
    };
    line("worst step, ms", &|f| f.runs[0].worst_us().1 / 1000.0);
    line("mean step, ms", &|f| f.runs[0].mean_us() / 1000.0);
    line("the peer's mean step, ms", &|f| f.runs[1].mean_us() / 1000.0);
    line("the peer's worst step, ms", &|f| f.runs[1].worst_us().1 / 1000.0);
    line("worst step / peer's mean", &Finding::worst_ratio);
    line("mean step / peer's mean", &Finding::mean_ratio);
    line("mean deepest overlap / peer's", &|f| {
        f.runs[0].deepest_mean / f.runs[1].deepest_mean.max(crate::stability::SLOP)
    });
    line("energy gained, share", &|f| f.runs[0].gain);
    line("the peer's energy gained, share", &|f| f.runs[1].gain);
    let sum = |of: &dyn Fn(&Finding) -> usize| findings.iter().map(of).sum::<usize>();
    text += &format!(
        "outside: {}, the peer's {}; not repeated: {}\n",
        sum(&|f| f.runs[0].outside),
        sum(&|f| f.runs[1].outside),
        sum(&|f| usize::from(!f.runs[0].repeats))
    );
    let mut order: Vec<&Finding> = findings.iter().collect();
    order.sort_by(|a, b| b.worst_ratio().total_cmp(&a.worst_ratio()));
    for finding in order.iter().take(10) {
        let (step, us) = finding.runs[0].worst_us();
        text += &format!(
            "{:>5}: {:.2} of the peer's mean: {:.3} ms in step {step}: {}\n",
            finding.number,
            finding.worst_ratio(),
            us / 1000.0,
            finding.traits
        );
    }
    text
}
