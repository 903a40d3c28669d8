//! What the numbers of a problem say, in sentences: where the default sits, what more work buys, who
//! is better.

use crate::methods::Family;
use crate::number::short;
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
    let verdict =
        if comparison.is_won() { "better by both margins" } else { "LOSS or no clear win" };
    format!(
        "Against {}: at equal time {}, at equal error {} (worst of its settings): {verdict}.",
        comparison.peer,
        share(comparison.error_share, "error"),
        share(comparison.time_share, "time"),
    )
}
