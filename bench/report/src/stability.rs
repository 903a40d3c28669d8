//! The stability cases: stiff and extreme scenes, each with accepted and measured figures. Nothing is tuned to pass; a
//! failing case is reported as failing, with its figure.

mod extreme;
mod moving;
mod piles;
mod resting;
mod sleeping;
mod stiff;
mod watch;

use crate::engine::Engine;
use crate::methods::Method;
use crate::scene::Scene;
pub use watch::{Run, Sample, largest};

/// Overlap that engines allow, in units.
pub const SLOP: f64 = 0.005;

/// A case in the list.
#[derive(Clone, Copy)]
pub struct Case {
    /// The case's id, from S1 to S24.
    pub id: &'static str,
    pub title: &'static str,
    /// Runs the case with one solver.
    pub run: fn(&Subject) -> Outcome,
}

/// A solver that a case is run with.
#[derive(Clone, Copy)]
pub struct Subject {
    /// The method at its default setting.
    pub method: Method,
    /// Whether to omit the largest variants.
    pub quick: bool,
}

impl Subject {
    /// Creates an engine that contains the scene.
    pub fn build(&self, scene: &Scene) -> Result<Box<dyn Engine>, String> {
        (self.method.build)(scene, self.method.default.unwrap_or(self.method.settings[0]))
    }

    /// Runs a scene without interference and records it after every tick.
    pub fn watch(&self, scene: &Scene, seconds: f64) -> Result<Run, String> {
        Ok(Run::record(self.build(scene)?.as_mut(), scene, seconds, |_, _| {}))
    }
}

/// One figure compared with its bound.
#[derive(Clone, Debug)]
pub struct Check {
    /// The variant of the case; may be empty.
    pub variant: String,
    /// The measured quantity, with its unit.
    pub metric: &'static str,
    /// The largest accepted value.
    pub accepted: f64,
    /// The measured value; NaN counts as a failure.
    pub measured: f64,
}

impl Check {
    /// Whether the figure is accepted.
    pub fn passes(&self) -> bool {
        self.measured <= self.accepted
    }
}

/// The results of a case.
#[derive(Default)]
pub struct Outcome {
    /// All figures, in the same order for every solver.
    pub checks: Vec<Check>,
    /// A run to plot, with its name.
    pub series: Option<(String, Vec<Sample>)>,
    /// The reason the case could not be run, if any.
    pub not_applicable: Option<String>,
}

impl Outcome {
    pub fn check(&mut self, variant: &str, metric: &'static str, accepted: f64, measured: f64) {
        self.checks.push(Check { variant: variant.into(), metric, accepted, measured });
    }

    /// Keeps a run for the small plots if it is the first one.
    pub fn draw(&mut self, variant: &str, run: &Run) {
        if self.series.is_none() {
            self.series = Some((variant.into(), run.samples.clone()));
        }
    }

    /// Whether all figures pass; `None` if the case could not be run.
    pub fn verdict(&self) -> Option<bool> {
        self.not_applicable.is_none().then(|| self.checks.iter().all(Check::passes))
    }
}

/// Turns the error of an engine that cannot run a case into an outcome.
pub(crate) fn outcome(run: impl FnOnce(&mut Outcome) -> Result<(), String>) -> Outcome {
    let mut outcome = Outcome::default();
    if let Err(why) = run(&mut outcome) {
        outcome.not_applicable = Some(why);
    }
    outcome
}

/// Returns all cases in order.
pub fn all() -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    cases.extend(resting::CASES);
    cases.extend(sleeping::CASES);
    cases.extend(moving::CASES);
    cases.extend(piles::CASES);
    cases.extend(extreme::CASES);
    cases.extend(stiff::CASES);
    cases.sort_by_key(|case| case.id[1..].parse().unwrap_or(u32::MAX));
    cases
}

/// A case with one outcome per solver.
pub struct Verdicts {
    pub case: Case,
    /// One outcome per solver, in the order of the methods.
    pub outcomes: Vec<Outcome>,
}

/// Runs one case with all solvers.
pub fn judge(case: Case, methods: &[Method], quick: bool) -> Verdicts {
    let solvers = methods.iter().filter(|method| method.in_stability);
    let outcomes = solvers.map(|&method| (case.run)(&Subject { method, quick })).collect();
    Verdicts { case, outcomes }
}
