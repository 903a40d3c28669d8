//! Piles: large heaps, high stacks and heavy loads. All solvers take turns in one process, so that a busy machine slows
//! them all equally. The measurements include step times, for falling and for resting bodies, and the quality of the
//! result.

mod hard;
mod scenes;
mod scripts;

use crate::engine::{Engine, State};
use crate::methods::{Family, Method};
use crate::scene::Scene;
use crate::stability::{Sample, largest};
use crate::study::thread_time_us;
use glam::DVec2;
use scripts::{Driver, Script};

pub use scenes::all;

/// A scene and its requirements.
pub struct Pile {
    /// Id used on the command line.
    pub id: String,
    pub title: String,
    /// The scenes, one for each seed.
    pub scenes: Vec<Scene>,
    /// The external disturbance.
    pub script: Script,
    /// Duration of the run.
    pub ticks: usize,
    /// Whether quick runs omit this pile.
    pub full_only: bool,
    /// The figures, with the ranges accepted for Jostle.
    pub bounds: Vec<(Figure, Bound)>,
}

/// A figure to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// Mean time of the first 120 steps.
    Falling,
    /// Mean time of the slowest 60 consecutive steps.
    Slowest,
    /// Median time of a step in the second half of the run.
    Settled,
    /// Mean time of all steps.
    Mean,
    /// 99th percentile of the step time, relative to the mean.
    Spread,
    /// Time of the slowest step.
    Worst,
    /// Number of bodies outside the container after the last step.
    Escaped,
    /// Deepest overlap after any step.
    DeepestEver,
    /// Mean of the deepest overlap over all steps.
    MeanDeepest,
    /// Deepest overlap after the last step.
    DeepestAtEnd,
    /// Root mean square of the speeds after the last step.
    RmsAtEnd,
    /// The last time the rms speed was above [`CALM`].
    CalmAfter,
    /// The last time any body was faster than [`STILL`].
    SettledAfter,
    Rising,
    /// Height lost by the topmost body.
    HeightLost,
    /// Height of the centre of mass after the last step.
    MeanHeight,
    /// Root mean square of the speeds at [`LATER_S`], relative to its largest value until then.
    SpeedLeft,
    /// Number of bodies that are awake after the last step.
    Awake,
    /// Change in total momentum, as a share of the sum of all momenta at the start.
    Momentum,
    /// Change in energy, as a share of the initial energy.
    EnergyError,
}

/// A pile is calm while the rms speed of its bodies is below this value, in units/s.
const CALM: f64 = 0.05;
/// Time at which the remaining motion of a poured heap is measured, in seconds.
const LATER_S: f64 = 4.0;
/// A body is still while its speed is below this value, in units/s.
const STILL: f64 = 0.01;
/// Number of steps for [`Figure::Falling`] and for [`Figure::Slowest`].
const FALLING: usize = 120;
const STRETCH: usize = 60;
/// Number of steps that an engine takes per turn.
const TURN: usize = 10;

impl Figure {
    /// The name of the figure, with its unit.
    pub fn name(self) -> &'static str {
        match self {
            Figure::Falling => "time a step, first 120 steps, µs",
            Figure::Slowest => "time a step, slowest 60 in a row, µs",
            Figure::Settled => "time a step, settled, µs",
            Figure::Mean => "time a step, mean, µs",
            Figure::Spread => "time a step, 99th percentile over mean",
            Figure::Worst => "time a step, worst, µs",
            Figure::Escaped => "outside at the end, bodies",
            Figure::DeepestEver => "deepest overlap ever, units",
            Figure::MeanDeepest => "deepest overlap of a step, mean, units",
            Figure::DeepestAtEnd => "deepest overlap at the end, units",
            Figure::RmsAtEnd => "rms speed at the end, units/s",
            Figure::CalmAfter => "rms speed below 0.05 after, s",
            Figure::SettledAfter => "nobody faster than 0.01 after, s",
            Figure::Rising => "fastest upward speed, units/s",
            Figure::HeightLost => "height lost, units",
            Figure::MeanHeight => "height of the centre of mass at the end, units",
            Figure::SpeedLeft => "rms speed after 4 s, share of the largest",
            Figure::Awake => "awake at the end, bodies",
            Figure::Momentum => "momentum error, share",
            Figure::EnergyError => "energy error at the end, share",
        }
    }

    /// Combines the figures from a pile's seeds, using the maximum for single events in a run and the mean otherwise.
    fn over_seeds(self, figures: &[f64]) -> f64 {
        match self {
            Figure::Worst | Figure::Escaped | Figure::DeepestEver | Figure::DeepestAtEnd => {
                largest(figures.iter().copied())
            }
            _ => mean(figures),
        }
    }

    fn of(self, run: &History, scene: &Scene) -> f64 {
        let last = run.samples.last().expect("the start is always there");
        let ever = |figure: fn(&Sample) -> f64| largest(run.samples[1..].iter().map(figure));
        let last_above = |bound: f64, figure: fn(&Sample) -> f64| {
            let above = |sample: &&Sample| figure(sample) > bound || figure(sample).is_nan();
            run.samples.iter().rev().find(above).map_or(0.0, |sample| sample.time_s)
        };
        let times = &run.times_us;
        match self {
            Figure::Falling => mean(&times[..FALLING]),
            Figure::Slowest => largest(times.windows(STRETCH).map(mean)),
            Figure::Settled => median(&times[times.len() / 2..]),
            Figure::Mean => mean(times),
            Figure::Spread => quantile(times, 0.99) / mean(times),
            Figure::Worst => largest(times.iter().copied()),
            Figure::Escaped => {
                let low = DVec2::ZERO;
                let high = DVec2::new(scripts::width(scene), scripts::height(scene));
                let is_out = |&i: &usize| {
                    let place = run.last[i].position;
                    !(place.cmpge(low).all() && place.cmple(high).all())
                };
                scene.dynamic().filter(is_out).count() as f64
            }
            Figure::DeepestEver => ever(|sample| sample.overlap),
            Figure::MeanDeepest => {
                let overlaps = run.samples[1..].iter().map(|sample| sample.overlap);
                overlaps.sum::<f64>() / (run.samples.len() - 1) as f64
            }
            Figure::DeepestAtEnd => last.overlap,
            Figure::RmsAtEnd => last.rms,
            Figure::CalmAfter => last_above(CALM, |sample| sample.rms),
            Figure::SettledAfter => last_above(STILL, |sample| sample.fastest),
            Figure::Rising => ever(|sample| sample.rising),
            Figure::HeightLost => height(scene, &run.first) - height(scene, &run.last),
            Figure::MeanHeight => {
                let of = |i: usize| scene.bodies[i].mass * run.last[i].position.y;
                let mass = scene.dynamic().map(|i| scene.bodies[i].mass).sum::<f64>();
                scene.dynamic().map(of).sum::<f64>() / mass
            }
            Figure::SpeedLeft => {
                let early = || run.samples.iter().filter(|sample| sample.time_s <= LATER_S);
                let last = early().next_back().map_or(f64::NAN, |sample| sample.rms);
                last / largest(early().map(|sample| sample.rms))
            }
            Figure::Awake => run.awake as f64,
            Figure::EnergyError => (last.energy / run.samples[0].energy - 1.0).abs(),
            Figure::Momentum => {
                let shares =
                    scene.dynamic().map(|i| scene.bodies[i].mass * run.first[i].velocity.length());
                (momentum(scene, &run.last) - momentum(scene, &run.first)).length()
                    / shares.sum::<f64>()
            }
        }
    }
}

/// Accepted range of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// No bound; the figure is only shown.
    None,
    Value(f64),
    /// At most this multiple of the first peer's figure.
    OfPeer(f64),
}

/// The figures of one solver, or the reason it could not run.
type Measured = Result<Vec<f64>, String>;

/// A pile with all solvers' figures.
pub struct Heap {
    pub pile: Pile,
    /// Each solver's figures, in the order of the methods.
    pub measured: Vec<Measured>,
    /// Index of the first peer among the solvers.
    pub peer: Option<usize>,
}

impl Heap {
    /// A solver's figure and, if it has a bound, whether it is accepted.
    pub fn figure(&self, solver: usize, index: usize) -> Option<(f64, Option<bool>)> {
        let value = self.measured[solver].as_ref().ok()?[index];
        let most = match self.pile.bounds[index].1 {
            Bound::None => None,
            Bound::Value(most) => Some(most),
            Bound::OfPeer(factor) => self.peer_figure(index).map(|peer| factor * peer),
        };
        Some((value, most.map(|most| value <= most)))
    }

    /// The figure of the first peer.
    fn peer_figure(&self, index: usize) -> Option<f64> {
        self.measured[self.peer?].as_ref().ok().map(|figures| figures[index])
    }
}

/// The recorded history of a run.
struct History {
    driver: Driver,
    samples: Vec<Sample>,
    times_us: Vec<f64>,
    first: Vec<State>,
    last: Vec<State>,
    awake: usize,
}

/// An engine with its run so far, or the reason it cannot run.
type Player = Result<(Box<dyn Engine>, History), String>;

/// Runs all solvers on a pile with each of its seeds.
pub fn measure(pile: Pile, methods: &[Method]) -> Heap {
    let methods: Vec<&Method> = methods.iter().filter(|method| method.in_stability).collect();
    let runs: Vec<Vec<Measured>> =
        (0..pile.scenes.len()).map(|seed| measure_seed(&pile, seed, &methods)).collect();
    let over_seeds = |solver: usize| {
        let of_solver: Vec<&Vec<f64>> = runs
            .iter()
            .map(|run| run[solver].as_ref())
            .collect::<Result<_, _>>()
            .map_err(String::clone)?;
        let figure = |(index, (figure, _)): (usize, &(Figure, Bound))| {
            let values: Vec<f64> = of_solver.iter().map(|figures| figures[index]).collect();
            figure.over_seeds(&values)
        };
        Ok(pile.bounds.iter().enumerate().map(figure).collect())
    };
    let measured = (0..methods.len()).map(over_seeds).collect();
    let peer = methods.iter().position(|method| method.family == Family::Peer);
    Heap { pile, measured, peer }
}

/// Runs all solvers with one seed. For figures about the slowest step, the shorter time of each step in two runs
/// counts, since momentary load on the machine affects different steps.
fn measure_seed(pile: &Pile, seed: usize, methods: &[&Method]) -> Vec<Measured> {
    let scene = &pile.scenes[seed];
    let mut players = play(pile, seed, methods);
    if pile.bounds.iter().any(|&(figure, _)| figure == Figure::Worst) {
        let again = play(pile, seed, methods);
        for ((_, run), (_, other)) in players.iter_mut().flatten().zip(again.iter().flatten()) {
            for (time, other) in run.times_us.iter_mut().zip(&other.times_us) {
                *time = time.min(*other);
            }
        }
    }
    let figures = |run: &History| pile.bounds.iter().map(|(f, _)| f.of(run, scene)).collect();
    players.into_iter().map(|player| player.map(|(_, run)| figures(&run))).collect()
}

/// Runs all solvers in alternation.
fn play(pile: &Pile, seed: usize, methods: &[&Method]) -> Vec<Player> {
    let scene = &pile.scenes[seed];
    let mut players: Vec<Player> =
        methods.iter().map(|method| player(method, scene, pile.script, seed)).collect();
    for _ in 0..pile.ticks / TURN {
        for (engine, history) in players.iter_mut().flatten() {
            (0..TURN).for_each(|_| history.step(engine.as_mut(), scene));
        }
    }
    players
}

fn player(method: &Method, scene: &Scene, script: Script, seed: usize) -> Player {
    let engine = (method.build)(scene, method.default.unwrap_or(method.settings[0]))?;
    let (sample, first) = Sample::read(engine.as_ref(), scene, 0.0);
    let last = first.clone();
    let driver = Driver::new(script, seed as u32);
    let (samples, times_us) = (vec![sample], Vec::new());
    Ok((engine, History { driver, samples, times_us, first, last, awake: 0 }))
}

impl History {
    fn step(&mut self, engine: &mut dyn Engine, scene: &Scene) {
        self.driver.act(engine, scene);
        let before = thread_time_us();
        engine.tick();
        self.times_us.push(thread_time_us() - before);
        let time_s = self.times_us.len() as f64 * scene.tick_s;
        let (sample, last) = Sample::read(engine, scene, time_s);
        self.samples.push(sample);
        self.last = last;
        self.awake = scene.dynamic().filter(|&body| !engine.is_asleep(body)).count();
    }
}

fn height(scene: &Scene, states: &[State]) -> f64 {
    scene.dynamic().map(|i| states[i].position.y).fold(f64::NEG_INFINITY, f64::max)
}

fn momentum(scene: &Scene, states: &[State]) -> DVec2 {
    scene.dynamic().map(|i| states[i].velocity * scene.bodies[i].mass).sum()
}

fn mean(times: &[f64]) -> f64 {
    times.iter().sum::<f64>() / times.len() as f64
}

fn median(times: &[f64]) -> f64 {
    quantile(times, 0.5)
}

fn quantile(times: &[f64], share: f64) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(sorted.len() as f64 * share) as usize]
}

#[cfg(test)]
mod tests {
    use super::{Driver, Figure, History, Script, measure, scenes};
    use crate::engine::State;
    use crate::methods::METHODS;
    use crate::stability::Sample;

    fn history(rms: &[f64]) -> History {
        let sample = |(tick, &rms): (usize, &f64)| Sample {
            time_s: tick as f64,
            overlap: 0.0,
            energy: 0.0,
            rms,
            fastest: rms,
            rising: 0.0,
        };
        let samples = rms.iter().enumerate().map(sample).collect();
        let times_us = (0..200).map(|tick| if tick < 60 { 3.0 } else { 1.0 }).collect();
        let (first, last) = (vec![State::default()], vec![State::default()]);
        History { driver: Driver::new(Script::Still, 0), samples, times_us, first, last, awake: 0 }
    }

    #[test]
    fn figures_are_those_of_the_run() {
        let scene = crate::scene::Scene::new(0.0);
        let run = history(&[9.0, 0.04, 0.06, 0.02, 0.001]);
        let of = |figure: Figure| figure.of(&run, &scene);
        assert_eq!(of(Figure::CalmAfter), 2.0);
        assert_eq!(of(Figure::SettledAfter), 3.0);
        assert_eq!(of(Figure::RmsAtEnd), 0.001);
        assert_eq!(
            (of(Figure::Falling), of(Figure::Slowest), of(Figure::Settled)),
            (2.0, 3.0, 1.0)
        );
    }

    #[test]
    fn the_conjugate_solver_keeps_a_stack_and_momentum() {
        for id in ["stack-20", "thrown-50"] {
            let pile = scenes::all().into_iter().find(|pile| pile.id == id).expect("in the list");
            let heap = measure(pile, &METHODS[4..5]);
            for index in 0..heap.pile.bounds.len() {
                let (value, accepted) = heap.figure(0, index).expect("it can play");
                let figure = heap.pile.bounds[index].0;
                assert_ne!(accepted, Some(false), "{id}: {figure:?} is {value}");
            }
        }
    }
}
