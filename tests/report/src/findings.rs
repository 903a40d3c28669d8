//! What the numbers of a problem say, in sentences: where the default sits, what more work buys, who
//! is better.

use crate::methods::Family;
use crate::number::short;
use crate::stability::{Outcome, Verdicts};
use crate::study::{Curve, Point, Study};

/// A claim against a peer needs this share of its error at equal time ...
pub const ERROR_SHARE: f64 = 0.1;
/// ... and this share of its time at equal error.
pub const TIME_SHARE: f64 = 1.0 / 3.0;

/// Jostle beside one peer on one problem.
pub struct Comparison {
    /// Whose curve.
    pub peer: &'static str,
    /// Our error over the peer's at the peer's time; the worst of its settings. Infinite if
    /// nothing of ours is as fast.
    pub error_share: f64,
    /// Our time over the peer's at the peer's error; likewise.
    pub time_share: f64,
}

impl Comparison {
    /// Whether Jostle is better by both margins.
    pub fn is_won(&self) -> bool {
        self.error_share <= ERROR_SHARE && self.time_share <= TIME_SHARE
    }

    /// In a word: better by both margins, ahead but short of them, or a loss.
    pub fn verdict(&self) -> &'static str {
        match (self.is_won(), self.error_share < 1.0 && self.time_share < 1.0) {
            (true, _) => "better",
            (false, true) => "ahead",
            (false, false) => "LOSS",
        }
    }
}

/// One comparison a peer that has a curve.
pub fn comparisons(study: &Study) -> Vec<Comparison> {
    let of = |family| move |curve: &&Curve| curve.method.family == family;
    let ours: Vec<&Point> =
        study.curves.iter().filter(of(Family::Jostle)).flat_map(|curve| &curve.points).collect();
    // Below the floor all errors are alike.
    let error = |point: &Point| point.errors[0].max(study.problem.floor());
    let compare = |curve: &Curve| {
        let (mut error_share, mut time_share) = (0f64, 0f64);
        for point in &curve.points {
            let fast = ours.iter().filter(|p| p.best_us <= point.best_us).map(|p| error(p));
            let good = ours.iter().filter(|p| error(p) <= error(point)).map(|p| p.best_us);
            error_share = error_share.max(fast.fold(f64::INFINITY, f64::min) / error(point));
            time_share = time_share.max(good.fold(f64::INFINITY, f64::min) / point.best_us);
        }
        Comparison { peer: curve.method.name, error_share, time_share }
    };
    study.curves.iter().filter(of(Family::Peer)).map(compare).collect()
}

/// Problems on which Jostle is better than every peer that took part, those with peers at all, and
/// a sentence on each loss.
pub fn tally(studies: &[Study]) -> (usize, usize, Vec<String>) {
    let (mut won, mut compared, mut losses) = (0, 0, Vec::new());
    for study in studies {
        let comparisons = comparisons(study);
        let lost = comparisons.iter().filter(|comparison| !comparison.is_won());
        compared += usize::from(!comparisons.is_empty());
        won += usize::from(!comparisons.is_empty() && lost.clone().count() == 0);
        losses.extend(
            lost.map(|c| format!("{} {}. {}", study.problem.id, study.problem.title, on_peer(c))),
        );
    }
    (won, compared, losses)
}

/// What the drawn runs of a case show, a sentence a solver.
pub fn seen_over_time(verdicts: &Verdicts, solvers: &[&str]) -> Vec<String> {
    let of = |(solver, outcome): (&&str, &Outcome)| {
        let (_, samples) = outcome.series.as_ref()?;
        let (start, last) = (samples.first()?, samples.last()?);
        let deepest = samples[1..].iter().max_by(|a, b| a.overlap.total_cmp(&b.overlap))?;
        let gain = samples.iter().map(|sample| sample.energy - start.energy).fold(0.0, f64::max);
        let share = gain / start.energy.abs().max(f64::MIN_POSITIVE);
        // Where everything starts at rest and without height, a share of it says nothing.
        let gained = match start.energy == 0.0 {
            true => String::new(),
            false => format!("largest energy gain {} of the start; ", short(share)),
        };
        Some(format!(
            "{solver}: deepest overlap {} at {} s; {gained}rms speed {} at the end.",
            short(deepest.overlap),
            short(deepest.time_s),
            short(last.rms)
        ))
    };
    solvers.iter().zip(&verdicts.outcomes).filter_map(of).collect()
}

/// Sentences on a problem.
pub fn seen(study: &Study) -> Vec<String> {
    let mut sentences = Vec::new();
    sentences.extend(on_default(study));
    sentences.extend(on_best(study));
    sentences.extend(on_slopes(study));
    sentences.extend(on_stalled(study));
    for comparison in comparisons(study) {
        sentences.push(on_peer(&comparison));
    }
    sentences
}

fn named(study: &Study, curve: &Curve, point: &Point) -> String {
    let unit = study.problem.norms[0].unit;
    let (method, space) = (&curve.method, if unit.is_empty() { "" } else { " " });
    format!(
        "{}, {} {}: {}{space}{unit} at {} µs a tick",
        method.name,
        method.knob,
        point.setting,
        short(point.errors[0]),
        short(point.best_us)
    )
}

fn on_default(study: &Study) -> Option<String> {
    let Some((curve, point)) = study.default_point() else {
        return Some("Nothing of Jostle's plays this problem: see the omissions.".into());
    };
    let place = if point.pareto { "on the Pareto set" } else { "not on the Pareto set" };
    Some(format!("The default of every scene ({}) is {place}.", named(study, curve, point)))
}

fn on_best(study: &Study) -> Option<String> {
    let (curve, point) = study.best(Family::Jostle)?;
    let (_, default) = study.default_point()?;
    if point.errors[0] >= default.errors[0] {
        return Some("No other setting of Jostle's is more precise.".into());
    }
    let floor =
        if point.errors[0] <= study.problem.floor() { ", below the floor of f32" } else { "" };
    let ratio = point.best_us / default.best_us;
    let named = named(study, curve, point);
    Some(format!("Most precise of Jostle's ({named}, {} times the time){floor}.", short(ratio)))
}

fn on_slopes(study: &Study) -> Option<String> {
    let slope = |curve: &Curve| Some(format!("{} {:.2}", curve.method.name, curve.slope?));
    let slopes: Vec<String> = study.curves.iter().filter_map(slope).collect();
    (!slopes.is_empty()).then(|| format!("Order in the step: {}.", slopes.join("; ")))
}

/// Jostle's curves on which more work buys nothing.
fn on_stalled(study: &Study) -> Option<String> {
    let stalls = |curve: &&Curve| {
        let (Some(first), Some(last)) = (curve.points.first(), curve.points.last()) else {
            return false;
        };
        curve.method.family == Family::Jostle
            && curve.points.len() > 1
            && last.errors[0] > 0.5 * first.errors[0].max(study.problem.floor() * 4.0)
    };
    let names: Vec<String> = study
        .curves
        .iter()
        .filter(stalls)
        .map(|curve| format!("{} ({})", curve.method.name, curve.method.knob))
        .collect();
    (!names.is_empty())
        .then(|| format!("Turning the knob up does not halve the error: {}.", names.join("; ")))
}

fn on_peer(comparison: &Comparison) -> String {
    let share = |share: f64, of: &str| match share.is_finite() {
        true => format!("{} of its {of}", short(share)),
        false => format!("nothing that matches its {of}"),
    };
    let verdict = comparison.verdict();
    format!(
        "Against {}: at equal time {}, at equal error {} (worst of its settings): {verdict}.",
        comparison.peer,
        share(comparison.error_share, "error"),
        share(comparison.time_share, "time"),
    )
}
