//! Measures work and precision on one problem, for every method at every setting, with errors from one run and times
//! from many interleaved ones. Computes the Pareto set, the slope against the step size and the floor of f32.

use crate::engine::{Engine, Trace};
use crate::methods::{Family, Field, Method};
use crate::number::short;
use crate::scene::Scene;
use rustix::time::{ClockId, clock_gettime};
use std::time::Instant;

/// A measure of the error.
#[derive(Clone, Copy)]
pub struct Norm {
    /// Name, as shown on an axis.
    pub name: &'static str,
    /// Unit of the error; empty for a pure number.
    pub unit: &'static str,
    /// Computes the error of a run, which is never negative.
    pub of: fn(&Scene, &Trace) -> f64,
}

/// A problem whose answer is known.
#[derive(Clone, Copy)]
pub struct Problem {
    /// Number in the list, with a letter if several scenes share the number.
    pub id: &'static str,
    pub title: &'static str,
    /// The scene in a sentence or two.
    pub about: &'static str,
    /// Where the correct answer comes from.
    pub reference: &'static str,
    /// Creates the scene; called once for every engine.
    pub scene: fn() -> Scene,
    /// Number of ticks in a run.
    pub ticks: u32,
    /// The norms; the first one is plotted.
    pub norms: &'static [Norm],
    /// Magnitude of the plotted quantity, which f32 cannot resolve to better than 2^-24 of this value.
    pub magnitude: f64,
}

impl Problem {
    /// Half a unit in the last place of f32 at the problem's magnitude.
    pub fn floor(&self) -> f64 {
        self.magnitude * 2f64.powi(-24)
    }
}

/// One setting of one method.
#[derive(Clone, Debug)]
pub struct Point {
    pub setting: f64,
    pub errors: Vec<f64>,
    /// Shortest processor time per tick over all runs, in microseconds.
    pub best_us: f64,
    /// Median processor time per tick over all runs, in microseconds.
    pub median_us: f64,
    /// Body steps and pair solves per tick; `None` if the engine does not count them.
    pub work: Option<f64>,
    /// Whether the point is in the Pareto set: no other engine's point is both faster and more precise.
    pub pareto: bool,
}

/// The points of one method at all settings that gave a result.
pub struct Curve {
    pub method: Method,
    /// The points, in the order of the settings.
    pub points: Vec<Point>,
    /// d log error / d log step over the points above the floor, if the knob divides the step.
    pub slope: Option<f64>,
}

/// An omitted point or method, and the reason.
pub struct Omission {
    /// The method, with a setting if only that setting is omitted.
    pub what: String,
    pub why: String,
}

/// A problem with all its measurements.
pub struct Study {
    pub problem: Problem,
    /// The curves, in the order of the table of methods.
    pub curves: Vec<Curve>,
    /// Methods that do not apply or that failed.
    pub omissions: Vec<Omission>,
    /// Number of timed runs of each point.
    pub rounds: u32,
}

/// How long to measure.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Number of seconds of timed runs per problem.
    pub budget_s: f64,
    /// Minimum and maximum number of runs per point.
    pub rounds: (u32, u32),
}

impl Effort {
    /// The effort for a quick run, which takes a few minutes in total, or for a thorough one.
    pub fn of(quick: bool) -> Effort {
        match quick {
            true => Effort { budget_s: 6.0, rounds: (3, 9) },
            false => Effort { budget_s: 60.0, rounds: (9, 25) },
        }
    }
}

/// Gravity above which a scene counts as typical of games, in units/s^2.
const STRONG: f64 = 25.0;

/// Measures all methods on a problem.
pub fn measure(problem: Problem, methods: &[Method], effort: Effort) -> Study {
    let scene = (problem.scene)();
    let mut omissions = Vec::new();
    let mut entries = Vec::new();
    let began = Instant::now();
    for &method in methods {
        let applicable = match method.field {
            Field::All => true,
            Field::Contacts => scene.has_contacts(),
            Field::StrongGravity => scene.has_contacts() && scene.gravity.length() > STRONG,
            Field::FreeFlight => !scene.has_contacts(),
        };
        for &setting in method.settings.iter().filter(|_| applicable) {
            match (method.build)(&scene, setting) {
                Ok(engine) => entries.push(Entry::first(&problem, &scene, method, setting, engine)),
                Err(why) => {
                    omissions.push(Omission { what: method.name.into(), why });
                    break;
                }
            }
        }
    }
    let round_s = began.elapsed().as_secs_f64().max(1e-6);
    let (fewest, most) = effort.rounds;
    let rounds = ((effort.budget_s / round_s) as u32).clamp(fewest, most);
    for _ in 0..rounds {
        for entry in entries.iter_mut().filter(|entry| entry.failure.is_none()) {
            entry.times_us.push(entry.timed(&problem, &scene));
        }
    }
    let curves = collect(&problem, entries, &mut omissions);
    Study { problem, curves, omissions, rounds }
}

/// Errors larger than this multiple of a problem's magnitude do not count as results; they would leave no room for
/// other results in a plot.
const BLOWN_UP: f64 = 10.0;

/// A point under measurement.
struct Entry {
    method: Method,
    setting: f64,
    errors: Vec<f64>,
    work: Option<f64>,
    failure: Option<String>,
    times_us: Vec<f64>,
}

impl Entry {
    /// Runs once, without timing, to compute the errors.
    fn first(
        problem: &Problem,
        scene: &Scene,
        method: Method,
        setting: f64,
        mut engine: Box<dyn Engine>,
    ) -> Entry {
        let trace = Trace::record(engine.as_mut(), scene, problem.ticks);
        let errors: Vec<f64> = problem.norms.iter().map(|norm| (norm.of)(scene, &trace)).collect();
        let solves = engine.pair_solves();
        let work = solves.map(|solves| (solves + engine.body_steps()) as f64);
        let failure = if !trace.is_finite() || !errors[0].is_finite() {
            Some("the result is not finite".to_owned())
        } else if errors[0] > BLOWN_UP * problem.magnitude {
            Some(format!("it blows up: the error is {}", short(errors[0])))
        } else {
            None
        };
        Entry {
            method,
            setting,
            errors,
            work: work.map(|work| work / f64::from(problem.ticks)),
            failure,
            times_us: Vec::new(),
        }
    }

    /// Processor time per tick of one more run, in microseconds.
    fn timed(&self, problem: &Problem, scene: &Scene) -> f64 {
        let Ok(mut engine) = (self.method.build)(scene, self.setting) else { return f64::NAN };
        let before = thread_time_us();
        for _ in 0..problem.ticks {
            engine.tick();
        }
        (thread_time_us() - before) / f64::from(problem.ticks)
    }
}

/// Processor time of this thread, which excludes waiting for a busy core.
pub fn thread_time_us() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}

fn collect(problem: &Problem, entries: Vec<Entry>, omissions: &mut Vec<Omission>) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    for entry in entries {
        let Entry { method, setting, errors, work, failure, mut times_us } = entry;
        if let Some(why) = failure {
            let what = format!("{}, {} {setting}", method.name, method.knob);
            omissions.push(Omission { what, why });
            continue;
        }
        times_us.sort_by(f64::total_cmp);
        let point = Point {
            setting,
            errors,
            best_us: times_us[0],
            median_us: times_us[times_us.len() / 2],
            work,
            pareto: false,
        };
        match curves.last_mut().filter(|curve| curve.method.name == method.name) {
            Some(curve) if curve.method.knob == method.knob => curve.points.push(point),
            _ => curves.push(Curve { method, points: vec![point], slope: None }),
        }
    }
    mark_pareto(&mut curves);
    for curve in &mut curves {
        curve.slope = slope(curve, problem);
    }
    curves
}

/// Marks the points that no other engine's point beats, ignoring the reference methods.
fn mark_pareto(curves: &mut [Curve]) {
    let engines = curves.iter().filter(|curve| curve.method.family != Family::Yardstick);
    let all: Vec<(f64, f64)> =
        engines.flat_map(|curve| &curve.points).map(|p| (p.best_us, p.errors[0])).collect();
    for curve in curves.iter_mut().filter(|curve| curve.method.family != Family::Yardstick) {
        for point in &mut curve.points {
            let own = (point.best_us, point.errors[0]);
            point.pareto = !all.iter().any(|other| beats(*other, own));
        }
    }
}

/// Times and errors that differ by less than this share count as equal, because times are not known more precisely.
const ALIKE: f64 = 0.05;

/// Whether `one` is clearly better in time or error and no worse in the other respect.
fn beats(one: (f64, f64), other: (f64, f64)) -> bool {
    let no_worse = |a: f64, b: f64| a <= b * (1.0 + ALIKE);
    let better = |a: f64, b: f64| a < b * (1.0 - ALIKE);
    let (faster, finer) = (better(one.0, other.0), better(one.1, other.1));
    no_worse(one.0, other.0) && no_worse(one.1, other.1) && (faster || finer)
}

/// Errors within this multiple of the floor reveal more about rounding than about the method.
const FLOORS: f64 = 4.0;

fn slope(curve: &Curve, problem: &Problem) -> Option<f64> {
    if !curve.method.divides_step {
        return None;
    }
    // Beyond the most precise point, rounding errors increase with the number of steps.
    let errors = || curve.points.iter().map(|point| point.errors[0]).enumerate();
    let best = errors().min_by(|a, b| a.1.total_cmp(&b.1))?.0;
    let falling = &curve.points[..=best];
    let above = falling.iter().filter(|point| point.errors[0] > FLOORS * problem.floor());
    let logs: Vec<(f64, f64)> =
        above.map(|point| (-point.setting.log10(), point.errors[0].log10())).collect();
    (logs.len() >= 3).then(|| least_squares(&logs))
}

/// Slope of the least-squares line through points.
pub fn least_squares(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
    let (mid_x, mid_y) = (x / count, y / count);
    let across: f64 = points.iter().map(|p| (p.0 - mid_x) * (p.1 - mid_y)).sum();
    let along: f64 = points.iter().map(|p| (p.0 - mid_x) * (p.0 - mid_x)).sum();
    across / along
}

impl Study {
    /// A method's default point, as used by a scene that specifies only its solver.
    pub fn default_of(&self, method: &str) -> Option<(&Curve, &Point)> {
        let ours = self.curves.iter().find(|curve| curve.method.name == method)?;
        let point = ours.points.iter().find(|p| Some(p.setting) == ours.method.default)?;
        Some((ours, point))
    }

    /// The most precise point of a family, or the faster one in case of a tie.
    pub fn best(&self, family: Family) -> Option<(&Curve, &Point)> {
        let curves = self.curves.iter().filter(|curve| curve.method.family == family);
        let points = curves.flat_map(|curve| curve.points.iter().map(move |point| (curve, point)));
        points.min_by(|(_, a), (_, b)| {
            a.errors[0].total_cmp(&b.errors[0]).then(a.best_us.total_cmp(&b.best_us))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{beats, least_squares};

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let points: Vec<(f64, f64)> =
            (1..6).map(f64::from).map(|x| (x.log10(), 2.0 * x.log10() + 3.0)).collect();
        assert!((least_squares(&points) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_point_is_beaten_by_a_clear_margin_only() {
        assert!(beats((1.0, 1.0), (2.0, 1.0)));
        assert!(beats((1.0, 0.0), (1.0, 1e-9)));
        assert!(!beats((0.99, 1.0), (1.0, 1.0)));
        assert!(!beats((1.0, 2.0), (2.0, 1.0)));
    }
}
